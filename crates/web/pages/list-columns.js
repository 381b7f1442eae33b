// The columns of the list of experiments.

import { decimals, element } from "swarm/dom.js";
import { sparkline } from "swarm/charts.js";
import { span, stateMark } from "swarm/page.js";

/** Remaining time of a run at its latest pace, ms; null if it does not run. */
const left = (it) => (it.state === "running" && it.generation_ms !== null ? it.generation_ms * (it.generations - it.generations_done) : null);
const number = (value) => decimals(value ?? NaN, 3);

/** The labels of an experiment, each as a mark. */
const labelMarks = (it) => Object.entries(it.labels).map(([key, value]) => element("span", { className: "tag" }, value ? `${key}=${value}` : key));

/** The worth of a champion comes first: it is measured on trials that selected nothing. The value
 *  before a judgement is optimistic, and marked so. */
function worth(it) {
  if (it.champion !== null) return [element("a", { className: "worth", href: `/replay/${it.id}`, title: "its worth, on trials that selected nothing; click to play" }, number(it.champion))];
  if (it.selection !== null) return [element("a", { className: "muted", href: `/replay/${it.id}`, title: "on the trials that selected it, which is optimistic; click to play" }, `≈ ${number(it.selection)}`)];
  return [it.generations_done ? element("a", { href: `/replay/${it.id}` }, "play") : "–"];
}

function progress(it) {
  const done = it.generations ? it.generations_done / it.generations : 0;
  const ms = left(it);
  return [element("progress", { max: 1, value: done, "aria-label": "generations done" }),
    element("div", { className: "small muted" }, `${it.generations_done} of ${it.generations}${ms === null ? "" : `, ${span(ms)} left`}`)];
}

/** Each has a name, a title, a width, the cell of an experiment, and a value that sorts (null:
 *  none). `says`: the data of the cell; `saved`: the value in a saved table; each is given only
 *  if it differs from the value that sorts. */
export const COLUMNS = [
  { name: "champion", title: "Champion", width: "5.5rem", isUsual: true, isGreatFirst: true, value: (it) => it.champion ?? it.selection, says: (it) => [it.champion, it.selection, it.generations_done > 0], cell: worth },
  { name: "state", title: "State", width: "7.5rem", isUsual: true, value: (it) => it.state, says: (it) => [it.state, it.reason], cell: (it) => [stateMark(it)] },
  { name: "progress", title: "Progress", width: "11rem", isUsual: true, isGreatFirst: true, value: (it) => it.generations_done / (it.generations || 1), says: (it) => [it.generations_done, it.generations, left(it)], cell: progress },
  { name: "left", title: "Time left", width: "5.5rem", value: left, cell: (it) => [left(it) === null ? "–" : span(left(it))] },
  { name: "recent", title: "Recent best", width: "8.5rem", isUsual: true, value: null, says: (it) => it.recent, saved: (it) => it.recent.join(" "), cell: (it) => [sparkline(it.recent)] },
  { name: "best", title: "Best of last", width: "6.5rem", isGreatFirst: true, value: (it) => it.best, cell: (it) => [number(it.best)] },
  { name: "mean", title: "Mean of last", width: "6.5rem", isUsual: true, isGreatFirst: true, value: (it) => it.mean, cell: (it) => [number(it.mean)] },
  { name: "selection", title: "Selection", width: "6rem", isGreatFirst: true, value: (it) => it.selection, cell: (it) => [number(it.selection)] },
  { name: "labels", title: "Labels", width: "minmax(6rem, 1fr)", isUsual: true, value: (it) => Object.keys(it.labels).sort().join(" ") || null, says: (it) => it.labels, saved: (it) => Object.entries(it.labels).map((pair) => pair.join("=")).join(" "), cell: labelMarks },
  { name: "group", title: "Group", width: "minmax(6rem, 1fr)", value: (it) => it.group || null, cell: (it) => [it.group || "–"] },
  { name: "variant", title: "Variant", width: "minmax(6rem, 1fr)", value: (it) => it.variant || null, cell: (it) => [it.variant || "–"] },
  { name: "algorithm", title: "Algorithm", width: "6rem", value: (it) => it.algorithm, cell: (it) => [it.algorithm] },
  { name: "seed", title: "Seed", width: "5rem", value: (it) => String(it.seed), cell: (it) => [String(it.seed)] },
  { name: "population", title: "Population", width: "6.5rem", isGreatFirst: true, value: (it) => it.population_size, cell: (it) => [String(it.population_size)] },
  { name: "genes", title: "Genes", width: "4.5rem", isGreatFirst: true, value: (it) => it.genotype_len, cell: (it) => [String(it.genotype_len)] },
  { name: "share", title: "Share", width: "4.5rem", isGreatFirst: true, value: (it) => (it.state === "running" ? it.priority : null), says: (it, weights) => (it.state === "running" ? Math.round((100 * it.priority) / weights) : null), cell: (it, weights) => [it.state === "running" ? `${Math.round((100 * it.priority) / weights)} %` : "–"] },
  { name: "submitted", title: "Submitted", width: "11rem", isGreatFirst: true, value: (it) => it.submitted_at_ms, saved: (it) => new Date(it.submitted_at_ms).toISOString(), cell: (it) => [new Date(it.submitted_at_ms).toLocaleString()] },
];
