// Curves of several runs, single or as the median of a group.

import { element } from "swarm/dom.js";
import { chart } from "swarm/charts.js";
import { differences, statistics } from "swarm/comparison.js";
import { allExperiments } from "swarm/experiment-list.js";
import { COLUMN } from "swarm/generation-row.js";
import { askJson, bar, complain, main, resolve } from "swarm/page.js";
import { quantile, seriesStyle } from "swarm/scales.js";

/** The x axes: the name of each, and its value after each generation. */
const AXES = {
  generation: { label: "generation", values: (rows) => rows.map((row) => row[COLUMN.generation]) },
  episodes: { label: "episodes", values: (rows) => sums(rows, COLUMN.episodes) },
  time: { label: "wall time, s", values: (rows) => sums(rows, COLUMN.ms).map((ms) => ms / 1000) },
};

function sums(rows, column) {
  let sum = 0;
  return rows.map((row) => (sum += row[column]));
}

bar("Compare", "/compare");
const words = new URLSearchParams(location.search);
const chosen = new Set((words.get("runs") ?? "").split(",").filter(Boolean).map(Number));
const histories = new Map();
let experiments = [];

const select = (name, options, value) => element("select", { id: name, "aria-label": name, onchange: show }, ...options.map((option) => element("option", { value: option, selected: option === value }, option)));
const axis = select("along", Object.keys(AXES), words.get("along") ?? "generation");
const column = select("value", ["best", "mean"], words.get("value") ?? "mean");
const grouping = select("as", ["runs", "groups"], words.get("as") ?? "runs");
const list = element("div", { className: "choices" });
const picture = chart("fitness of several runs");
const found = element("div", { className: "columns wide" });
const files = element("div");
main.replaceChildren(element("h1", {}, "Compare"),
  element("div", { className: "row" }, element("label", {}, "fitness: ", column), element("label", {}, "along: ", axis), element("label", {}, "as: ", grouping)),
  element("section", { className: "panel tall" }, picture), found, files,
  element("section", { className: "panel" }, element("h2", {}, "Runs"), list));

async function history(id) {
  if (histories.has(id)) return histories.get(id);
  const rows = [];
  for (let from = 0; from !== null;) {
    const page = await askJson(`/api/experiments/${id}/generations?from=${from}`);
    rows.push(...page.generations);
    from = page.next;
  }
  histories.set(id, rows);
  return rows;
}

/** The group of a run. */
const kind = (it) => [it.group || it.name, it.variant].filter(Boolean).join(" ");

/** Counts the selections: only the answers about the latest one are shown. */
let asked = 0;
/** The groups that the tables explain; empty while they wait for others. */
let explained = "";

/** Statistics of the groups, and differences between the files of runs. */
async function explain(groups, runs) {
  const mine = asked;
  const wanted = JSON.stringify(groups.map((it) => [it.name, it.runs.map((run) => run.id)]));
  if (wanted === explained) return;
  explained = "";
  if (found.childElementCount === 0) found.replaceChildren(element("p", { className: "loading muted", role: "status" }, "comparing …"));
  const answers = await Promise.all([groups.length ? statistics(groups) : [], runs.length ? differences(runs) : ""]);
  if (mine !== asked) return;
  explained = wanted;
  found.replaceChildren(...answers[0]);
  files.replaceChildren(answers[1]);
}

async function show() {
  const mine = ++asked;
  const words = new URLSearchParams({ runs: [...chosen].join(","), along: axis.value, value: column.value, as: grouping.value });
  window.history.replaceState(null, "", `?${words}`);
  try {
    const runs = experiments.filter((it) => chosen.has(it.id));
    const { label, values } = AXES[axis.value];
    const curves = await Promise.all(runs.map(async (it) => {
      const rows = await history(it.id);
      const along = values(rows);
      return { it, points: rows.map((row, i) => [along[i], row[COLUMN[column.value]]]) };
    }));
    if (mine !== asked) return;
    const content = { xLabel: label, yLabel: `${column.value} fitness`, lines: [], bands: [] };
    const groups = [...Map.groupBy(runs, kind)].map(([name, its]) => ({ name, runs: its }));
    if (grouping.value === "runs") {
      content.lines = curves.map(({ it, points }, i) => ({ name: `${it.id} ${kind(it)} seed ${it.seed}`, ...seriesStyle(i, curves.length), points }));
    } else {
      groups.forEach(({ name }, i) => {
        const members = curves.filter(({ it }) => kind(it) === name).map(({ points }) => points).filter((points) => points.length);
        const n = Math.min(...members.map((points) => points.length));
        const sorted = (k) => members.map((points) => points[k][1]).sort((a, b) => a - b);
        // For episodes and time, the ends of a generation differ between runs: use their
        // median.
        const at = (k) => quantile(members.map((points) => points[k][0]).sort((a, b) => a - b), 0.5);
        const steps = Array.from({ length: Number.isFinite(n) ? n : 0 }, (_, k) => k);
        const style = seriesStyle(i, groups.length);
        content.bands.push({ name, color: style.color, points: steps.map((k) => [at(k), quantile(sorted(k), 0.25), quantile(sorted(k), 0.75)]) });
        content.lines.push({ name: `${name}, ${members.length} runs, median and quartiles`, ...style, points: steps.map((k) => [at(k), quantile(sorted(k), 0.5)]) });
      });
    }
    picture.show(content);
    await explain(groups, runs);
    if (mine === asked) resolve("compare");
  } catch (error) {
    if (mine !== asked) return;
    // The tables are about other runs, and the next selection asks again.
    explained = "";
    found.replaceChildren();
    files.replaceChildren();
    complain(error, "compare");
  }
}

try {
  experiments = await allExperiments();
  if (chosen.size === 0) for (const it of experiments.slice(-5)) chosen.add(it.id);
  // The compared runs come first, however many others there are.
  const ordered = experiments.toReversed().sort((a, b) => chosen.has(b.id) - chosen.has(a.id));
  list.replaceChildren(...ordered.map((it) => {
    const box = element("input", { type: "checkbox", checked: chosen.has(it.id), onchange: () => {
      if (box.checked) chosen.add(it.id);
      else chosen.delete(it.id);
      show();
    } });
    return element("label", {}, box, `${it.id} ${kind(it)} seed ${it.seed} (${it.algorithm}, ${it.generations_done} generations)`);
  }));
  await show();
} catch (error) {
  complain(error);
}
