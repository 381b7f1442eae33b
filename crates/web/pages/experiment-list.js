// All experiments, kept up to date: the whole list once, and then the changes.

import { AGAIN_AFTER, askJson, complain, listen, resolve } from "swarm/page.js";

/** Follows the list. `onChange(experiments, changed)`: all experiments by id, and the ids of new,
 *  changed and deleted ones. */
export async function followExperiments(onChange) {
  const experiments = new Map();
  const take = (news) => {
    const changed = new Set(news.gone);
    if (news.whole) {
      for (const id of experiments.keys()) changed.add(id);
      experiments.clear();
    }
    for (const id of news.gone) experiments.delete(id);
    for (const it of news.experiments) {
      experiments.set(it.id, it);
      changed.add(it.id);
    }
    onChange(experiments, changed);
  };
  const begin = async () => {
    try {
      const whole = await askJson("/api/experiments");
      resolve("list");
      take(whole);
      listen(`/api/live?since=${whole.mark}`, take);
    } catch (error) {
      complain(error, "list");
      if (error.status !== 401) setTimeout(begin, AGAIN_AFTER);
    }
  };
  await begin();
}

/** All experiments in their present state, oldest first. */
export async function allExperiments() {
  return (await askJson("/api/experiments")).experiments;
}
