// The dependence of champions' worth on the swept values in the files of runs.

import { shape, text } from "swarm/charts.js";
import { decimals, element, onKeys, onTheme } from "swarm/dom.js";
import { exports } from "swarm/export.js";
import { clamp, extremes, rampColor, ticks } from "swarm/scales.js";

/** Minimum number of runs for a statement about a key. */
const RUNS_MIN = 6;
/** Up to this number, the values of a key get evenly spaced positions, because values of a grid are
 *  uneven. */
const PLACES_MAX = 8;
/** Maximum distance between runs with the same value, pixels. */
const APART = 16;
/** Pixels of a letter of the axes. */
const LETTER = 7;
/** The part of the colours that is visible on a light and on a dark ground. */
const SEEN = { light: [0, 0.85], dark: [0.35, 1] };

const isDark = matchMedia("(prefers-color-scheme: dark)");

/** Colour of a share from 0 to 1, on the ground of this theme. */
function colorOf(share) {
  const [from, to] = SEEN[isDark.matches ? "dark" : "light"];
  return `rgb(${rampColor(from + share * (to - from)).join(" ")})`;
}

/** Share of the variance of `worths` between groups with the same value, and the expected share of
 *  values without an effect; null if each run has its own value, or all have the same worth. */
function etaSquared(values, worths) {
  const mean = (all) => all.reduce((sum, it) => sum + it, 0) / all.length;
  const groups = [...Map.groupBy(worths, (_, i) => values[i]).values()];
  const middle = mean(worths);
  const total = worths.reduce((sum, it) => sum + (it - middle) ** 2, 0);
  if (groups.length === worths.length || !(total > 0)) return null;
  const between = groups.reduce((sum, its) => sum + its.length * (mean(its) - middle) ** 2, 0);
  return { share: between / total, byChance: (groups.length - 1) / (worths.length - 1) };
}

/** Parallel coordinates and importance of keys, null with too few runs or keys. `runs`: those with
 *  files; `keys`: key, title, and a value for each run, as text; `n_chosen`: number of requested
 *  runs. */
export function sweptValues(runs, keys, n_chosen) {
  const judged = runs.map((_, i) => i).filter((i) => runs[i].champion !== null).sort((a, b) => runs[a].champion - runs[b].champion);
  const its = judged.map((i) => runs[i]);
  const swept = keys.map((it) => ({ ...it, values: judged.map((i) => it.values[i]) })).filter(({ values }) => new Set(values).size > 1);
  if (its.length < RUNS_MIN || swept.length === 0) return null;
  const left_out = n_chosen > its.length ? `; ${n_chosen - its.length} of ${n_chosen} runs are left out, without a judged champion or beyond the first ${runs.length}` : "";
  return element("section", { className: "panel swept" }, element("h2", {}, "Swept values and the champion\u2019s worth"),
    element("p", { className: "muted small" }, `${its.length} runs${left_out}`), parallel(its, swept), element("h3", {}, "Importance of each key"), importance(its, swept));
}

/** The positions of a key's values, as shares of an axis, and the labels of the axis. */
function placesOf(values) {
  const distinct = [...new Set(values)];
  const isNumber = distinct.every((it) => it !== "" && Number.isFinite(Number(it)));
  if (isNumber) distinct.sort((a, b) => a - b);
  if (isNumber && distinct.length > PLACES_MAX) {
    const [low, high] = extremes(distinct.map(Number));
    const at = (value) => (Number(value) - low) / (high - low);
    return { at, labels: ticks(low, high, 5).map((it) => [at(it), String(Number(it.toPrecision(6)))]) };
  }
  const at = (value) => (distinct.indexOf(value) + 0.5) / distinct.length;
  const step = Math.ceil(distinct.length / 20);
  return { at, labels: distinct.filter((_, i) => i % step === 0).map((it) => [at(it), it]) };
}

/** A line for each run through its values, from the least to the greatest worth. */
function parallel(runs, swept) {
  const worths = runs.map((it) => it.champion);
  const [low, high] = extremes(worths);
  const shareOf = (worth) => (worth - low) / (high - low || 1);
  const titles = [...swept.map((it) => it.title.split(/(?<=\.)/)), ["champion\u2019s", "worth"]];
  const labelOf = (label) => (label.length > 14 ? `${label.slice(0, 13)}…` : label);
  const svg = shape("svg", { role: "group", tabindex: "0", "aria-roledescription": "parallel coordinates", "aria-label": "champion's worth by swept values; arrow keys go through runs, Enter opens one" });
  const ramp = element("i", { className: "ramp" });
  const readout = element("span", { className: "readout muted", role: "status" });
  const table = () => [["id", "seed", ...swept.map((it) => it.key), "champion"], ...runs.map((it, i) => [it.id, it.seed, ...swept.map(({ values }) => values[i]), it.champion])];
  const node = element("figure", { className: "chart parallel" }, element("div", { className: "scroll" }, svg),
    element("figcaption", {}, element("span", {}, `worth ${decimals(low, 3)} `, ramp, ` ${decimals(high, 3)}`), readout, exports({ svg: () => svg, table, name: () => "swept-values" })));
  /** The run of the readout; null: none. */
  let cursor = null;
  let lines = [];

  const axes = swept.map(({ values }) => {
    const { at, labels } = placesOf(values);
    const members = Map.groupBy(runs.keys(), (i) => values[i]);
    const nudge = values.map((value, i) => {
      const its = members.get(value);
      return its.length < 2 ? 0 : its.indexOf(i) / (its.length - 1) - 0.5;
    });
    return { labels: labels.map(([share, label]) => [share, labelOf(label)]), share: (i) => at(values[i]), nudge };
  });
  axes.push({ labels: ticks(low, high, 5).map((it) => [shareOf(it), String(Number(it.toPrecision(6)))]), share: (i) => shareOf(worths[i]), nudge: worths.map(() => 0) });

  const draw = () => {
    const pitch = Math.max(90, ...titles.flat().map((it) => it.length * LETTER + 12));
    const [edge, n_rows] = [pitch / 2, Math.max(...titles.map((it) => it.length))];
    const width = Math.max(node.clientWidth, pitch * axes.length);
    const height = 320;
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.style.width = `${width}px`;
    svg.style.height = `${height}px`;
    const [top, bottom] = [16 * n_rows + 14, height - 12];
    const x = (axis) => edge + (axis / (axes.length - 1)) * (width - 2 * edge);
    const y = (share) => bottom - share * (bottom - top);
    lines = runs.map((it, i) => {
      const points = axes.map(({ share, nudge }, axis) => `${x(axis).toFixed(1)} ${(y(share(i)) - APART * nudge[i]).toFixed(1)}`);
      return shape("path", { class: "line", d: `M${points.join("L")}`, stroke: colorOf(shareOf(worths[i])), "data-name": it.id });
    });
    const scales = axes.flatMap(({ labels }, axis) => [
      shape("line", { x1: x(axis), x2: x(axis), y1: top, y2: bottom, class: "rule" }),
      ...titles[axis].map((part, row) => text(x(axis), 12 + 16 * row, part, { "text-anchor": "middle" })),
      ...labels.map(([share, label]) => text(x(axis) + 7, y(share) + 4, label, { class: "axis value" }))]);
    svg.replaceChildren(...lines, ...scales);
    const stops = [0, 0.25, 0.5, 0.75, 1].map(colorOf).join(", ");
    ramp.style.background = `linear-gradient(to right, ${stops})`;
    mark();
  };

  const mark = () => {
    lines.forEach((line, i) => line.setAttribute("class", cursor === null ? "line" : cursor === i ? "line marked" : "line faint"));
    const it = runs[cursor];
    readout.textContent = it ? `${it.id} ${it.name}, seed ${it.seed}: worth ${decimals(it.champion, 4)}; ${swept.map(({ title, values }) => `${title} ${values[cursor]}`).join(", ")}` : "";
  };
  const goTo = (i) => {
    cursor = i === null ? null : clamp(i, runs.length);
    mark();
  };
  svg.addEventListener("pointermove", ({ target }) => {
    const i = lines.indexOf(target);
    if (i >= 0) goTo(i);
  });
  svg.addEventListener("pointerleave", () => goTo(null));
  onKeys(svg, () => {
    const up = () => goTo(cursor === null ? 0 : cursor + 1);
    const down = () => goTo(cursor === null ? runs.length - 1 : cursor - 1);
    return { ArrowRight: up, ArrowUp: up, ArrowLeft: down, ArrowDown: down, Home: () => goTo(0), End: () => goTo(runs.length - 1), Escape: () => goTo(null),
      Enter: () => cursor !== null && location.assign(`/experiment/${runs[cursor].id}`) };
  });
  new ResizeObserver(draw).observe(node);
  onTheme(draw);
  return node;
}

/** A bar for each key, the most important one first. */
function importance(runs, swept) {
  const found = swept.map(({ key, title, values }) => ({ key, title, n_values: new Set(values).size, eta: etaSquared(values, runs.map((it) => it.champion)) }))
    .sort((a, b) => (b.eta?.share ?? -1) - (a.eta?.share ?? -1));
  const svg = shape("svg", { role: "img", "aria-label": `importance of keys: ${found.map((it) => `${it.title} ${it.eta ? decimals(it.eta.share, 2) : "unknown"}`).join(", ")}` });
  const table = () => [["key", "values", "runs", "eta squared", "eta squared by chance"], ...found.map((it) => [it.key, it.n_values, runs.length, it.eta?.share, it.eta?.byChance])];
  const node = element("figure", { className: "chart importance" }, svg, element("figcaption", {},
    element("span", { className: "muted" }, "one-way \u03b7\u00b2 of each key by itself: variance of worth between its values, as a share of all; the dashed line is the expected share of values without an effect"),
    exports({ svg: () => svg, table, name: () => "importance" })));
  const draw = () => {
    const width = Math.max(260, node.clientWidth);
    const bottom = 34 * found.length + 4;
    svg.setAttribute("viewBox", `0 0 ${width} ${bottom + 40}`);
    svg.style.height = `${bottom + 40}px`;
    const x = (share) => 12 + share * (width - 24);
    const rows = found.flatMap(({ title, eta }, i) => {
      const y = 34 * i;
      const says = eta ? decimals(eta.share, 2) : "unknown: each run has its own value, or all have the same worth";
      const bar = eta ? [shape("rect", { x: x(0), y: y + 18, width: Math.max(1, x(eta.share) - x(0)), height: 12, class: "share" }),
        shape("line", { x1: x(eta.byChance), x2: x(eta.byChance), y1: y + 15, y2: y + 33, class: "chance" })] : [];
      return [text(x(0), y + 13, `${title}: ${says}`, { class: "axis name" }), ...bar];
    });
    svg.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].flatMap((it) => [
      shape("line", { x1: x(it), x2: x(it), y1: 2, y2: bottom, class: "grid" }), text(x(it), bottom + 16, String(it), { "text-anchor": "middle" })]),
    ...rows, text(width / 2, bottom + 34, "share of the variance of worth explained (one-way \u03b7\u00b2)", { "text-anchor": "middle" }));
  };
  new ResizeObserver(draw).observe(node);
  return node;
}
