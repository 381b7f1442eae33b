// The present activity of an experiment, or the reason why it waits.

import { element } from "swarm/dom.js";
import { counted, span } from "swarm/page.js";

/** Paragraphs with the server's answer. */
export function whatItDoes(it) {
  const parts = [];
  for (const trouble of it.troubles) parts.push(element("p", { className: "bad" }, trouble));
  if (it.workers_available === 0) {
    parts.push(element("p", { className: "bad" }, it.workers_of_others ? `No worker takes it: ${counted(it.workers_of_others, "worker")} only for other experiments.` : it.workers ? "No connected worker gets work." : "No worker is connected: start one with `worker`."));
  }
  if (it.round) {
    const { name, episodes, episodes_left: left, items_queued: queued, running_ms: running, held } = it.round;
    parts.push(element("p", {}, `${name}: ${episodes - left} of ${episodes} episodes in ${span(running)}`),
      element("progress", { max: episodes, value: episodes - left }),
      element("p", { className: "muted" }, `${counted(queued, "item")} without a worker, the others at ${counted(held.length, "worker")}`));
    const rows = held.sort((a, b) => b[2] - a[2]).slice(0, 6).map(([worker, items, ms]) =>
      element("tr", {}, element("td", {}, worker), element("td", {}, counted(items, "item")), element("td", {}, `for ${span(ms)}`)));
    if (rows.length) parts.push(element("table", {}, ...rows));
  }
  for (const [worker, why] of it.withheld.slice(0, 5)) parts.push(element("p", { className: "bad small" }, `${worker}: ${why}`));
  if (it.rivals.length) parts.push(element("p", { className: "muted" }, `shares the fleet with ${it.rivals.map((rival) => `experiment ${rival}`).join(", ")}`));
  return parts;
}
