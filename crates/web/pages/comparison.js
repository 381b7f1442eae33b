// The statistics of a comparison of groups, and the keys in which the files of runs
// differ.

import { decimals, element } from "swarm/dom.js";
import { exports } from "swarm/export.js";
import { askJson, counted } from "swarm/page.js";
import { sweptValues } from "swarm/swept-values.js";

/** Maximum number of compared files. */
const FILES_MAX = 60;

const span = ({ ci95 }) => (ci95 ? `${decimals(ci95[0], 3)}–${decimals(ci95[1], 3)}` : "–");
const table = (head, rows) => element("div", { className: "scroll", tabIndex: 0, role: "group", "aria-label": head.join(", ") }, element("table", { className: "list" },
  element("thead", {}, element("tr", {}, ...head.map((name) => element("th", { scope: "col" }, name)))),
  element("tbody", {}, ...rows.map((cells) => element("tr", {}, ...cells.map((cell, i) => element("td", { "data-label": head[i] }, cell)))))));

/** Sections with the statistics of `swarmctl compare`. `groups`: name and runs of each. */
export async function statistics(groups) {
  const { quantities } = await askJson(`/api/compare?samples=${groups.map(({ runs }) => runs.map((it) => it.id).join(",")).join(";")}`);
  return quantities.filter(({ samples }) => samples.some(Boolean)).map(({ title, samples, pairs }) => {
    const rows = samples.flatMap((it, i) => (it ? [[groups[i].name, String(it.n), element("b", {}, decimals(it.median.value, 3)), span(it.median), decimals(it.iqm.value, 3), span(it.iqm)]] : []));
    const better = pairs.map(({ first, second, probability, p }) => [groups[first].name, groups[second].name, element("b", {}, decimals(probability.value, 3)), span(probability), p === null ? "–" : p < 0.001 ? "< 0.001" : decimals(p, 3)]);
    return element("section", { className: "panel statistics" }, element("h2", {}, title),
      table(["group", "runs", "median", "95 %", "IQM", "95 %"], rows),
      ...(better.length ? [element("p", { className: "muted small" }, "probability that a run of the first is better than one of the second; p of the two-sided Mann-Whitney test, not corrected for the number of pairs"),
        table(["better", "than", "probability", "95 %", "p"], better)] : []));
  });
}

/** A value of each key of a file, by its path. */
function flat(value, path = "", found = new Map()) {
  if (value !== null && typeof value === "object" && !Array.isArray(value)) {
    for (const [key, inner] of Object.entries(value)) flat(inner, path ? `${path}.${key}` : key, found);
  } else {
    found.set(path, JSON.stringify(value));
  }
  return found;
}

const files = new Map();

async function fileOf(id) {
  if (!files.has(id)) files.set(id, flat((await askJson(`/api/experiments/${id}`)).config));
  return files.get(id);
}

/** Runs as rows, with a column for each key in which their files differ; and figures of these keys.
 *  */
export async function differences(runs) {
  const shown = runs.slice(0, FILES_MAX);
  const configs = await Promise.all(shown.map((it) => fileOf(it.id)));
  const keys = [...new Set(configs.flatMap((it) => [...it.keys()]))].filter((key) => key !== "seed" && new Set(configs.map((it) => it.get(key))).size > 1);
  // The last parts of a path suffice, unless two keys share them.
  const short = (key) => key.split(".").slice(-2).join(".");
  const title = (key) => (keys.filter((it) => short(it) === short(key)).length > 1 ? key : short(key));
  const head = ["run", "seed", "champion", ...keys.map(title)];
  const texts = shown.map((it, i) => [`${it.id} ${it.name}`, String(it.seed), it.champion === null ? "–" : decimals(it.champion, 3), ...keys.map((key) => configs[i].get(key) ?? "–")]);
  const rows = texts.map(([name, ...rest], i) => [element("a", { href: `/experiment/${shown[i].id}` }, name), ...rest]);
  const save = exports({ table: () => [["id", "seed", "champion", ...keys], ...shown.map((it, i) => [it.id, it.seed, it.champion, ...texts[i].slice(3)])], name: () => "runs" });
  const swept = keys.map((key, k) => ({ key, title: head[k + 3], values: configs.map((it) => it.get(key) ?? "–") })).filter(({ key }) => key !== "name");
  const figures = sweptValues(shown, swept, runs.length);
  return element("div", {}, figures, element("section", { className: "panel differences" },
    element("div", { className: "row" }, element("h2", {}, "Where their files differ"), element("span", { className: "muted small" }, keys.length ? `${counted(keys.length, "key")} beside the seed` : "only in the seed"), save),
    table(head, rows)));
}
