// The repertoire of an experiment: the fittest elite of every cell of behaviours. A click on a cell
// plays its elite.

import { canvas, decimals, element, onKeys } from "swarm/dom.js";
import { EDGE, fitnessScale, mapFigure, markCell, shape, text } from "swarm/charts.js";
import { exports } from "swarm/export.js";
import { askDuringRun } from "swarm/page.js";
import { clamp, extremes, rampColor, ticks } from "swarm/scales.js";

/** Minimum size of a cell with lines between cells, pixels. */
const LINES_FROM = 7;

/** A part of the page, with the `update` of `askDuringRun`. */
export function repertoirePanel(id) {
  let found = null;
  /** Elites by their cells on the first two axes. */
  let elites = new Map();
  let range = [0, 1];
  /** The cell of the readout. */
  let cursor = null;

  const readout = element("span", { className: "readout muted", role: "status" });
  const scale = element("span", { className: "scale muted small" });
  const note = element("p", { className: "muted small" });
  const picture = canvas((context, width, height) => paint(context, width, height), "");
  const axes = shape("svg", { "aria-hidden": "true" });
  const stage = element("div", { className: "cells", tabIndex: 0, role: "group", "aria-roledescription": "heat map", "aria-label": "fitness of the elite of every cell of behaviours; arrow keys go through the cells, Enter plays an elite" }, axes, picture);
  const files = exports({ svg: () => mapFigure(stage, axes, picture), table: () => table(), name: () => `repertoire-${id}` });
  const node = element("details", { className: "panel repertoire", hidden: true, open: true },
    element("summary", {}, "Repertoire"),
    element("header", {}, element("span", { className: "muted" }, "click a cell to play its elite"), element("span", { className: "space" }), scale),
    note, stage, element("p", { className: "row small" }, readout, files));

  /** Numbers of cells along the first two axes; a single descriptor has one row. */
  const size = () => [found.axes[0].cells, found.axes[1]?.cells ?? 1];
  const key = (i, j) => `${i},${j}`;
  const at = (cell) => cell && elites.get(key(...cell));

  const paint = (context, width, height) => {
    context.clearRect(0, 0, width, height);
    if (!found) return;
    const [n_columns, n_rows] = size();
    const [wide, high] = [width / n_columns, height / n_rows];
    const gap = Math.min(wide, high) > LINES_FROM ? 1 : 0;
    for (const { cell: [i, j], fitness } of elites.values()) {
      context.fillStyle = `rgb(${rampColor((fitness - range[0]) / (range[1] - range[0] || 1)).join(" ")})`;
      context.fillRect(i * wide, height - (j + 1) * high, Math.max(wide - gap, 1), Math.max(high - gap, 1));
    }
    if (cursor) markCell(context, cursor[0] * wide, height - (cursor[1] + 1) * high, wide, high);
  };

  const drawAxes = () => {
    const [width, height] = [stage.clientWidth, stage.clientHeight];
    if (!width || !found) return;
    axes.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const bottom = height - EDGE.bottom;
    const [along, up] = found.axes;
    const share = ({ low, high }, value) => (value - low) / (high - low);
    const name = ({ measure, of }) => `${measure} (${of})`;
    const middle = (EDGE.top + bottom) / 2;
    const label = (value) => String(Number(value.toPrecision(6)));
    const nodes = ticks(along.low, along.high, Math.min(8, width / 90)).map((value) =>
      text(EDGE.left + share(along, value) * (width - EDGE.left - EDGE.right), bottom + 16, label(value), { "text-anchor": "middle" }));
    nodes.push(text((EDGE.left + width - EDGE.right) / 2, height - 6, name(along), { "text-anchor": "middle" }));
    if (up) {
      nodes.push(...ticks(up.low, up.high, 5).map((value) =>
        text(EDGE.left - 6, bottom - share(up, value) * (bottom - EDGE.top) + 4, label(value), { "text-anchor": "end" })));
      nodes.push(text(14, middle, name(up), { "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` }));
    }
    axes.replaceChildren(...nodes);
  };

  const draw = () => {
    if (!found) return;
    if (elites.size) scale.replaceChildren(...fitnessScale(...range));
    const { corrected, generation, n_elites } = found;
    note.textContent = corrected
      ? `judged on new trials: QD score ${decimals(corrected.qd_score, 3)}, coverage ${decimals(100 * corrected.coverage, 0)} %, ${decimals(100 * corrected.stay, 0)} % of ${n_elites} elites stay in their cell`
      : `after generation ${generation}: ${n_elites} elites, whose fitness is optimistic until the end of the run judges them`;
    node.dataset.cells = elites.size;
    drawAxes();
    drawReadout();
    picture.redraw();
  };

  const drawReadout = () => {
    if (!found || !cursor) return void (readout.textContent = "");
    const it = at(cursor);
    const place = `cell ${cursor.slice(0, found.axes.length).join(", ")}`;
    const described = it && found.axes.map(({ measure }, i) => `${measure} ${decimals(it.descriptors[i], 3)}`).join(", ");
    readout.textContent = it ? `${place}: ${decimals(it.fitness, 4)}, ${described}, individual ${it.individual} of generation ${it.generation}` : `${place}: no elite`;
  };

  const play = () => {
    const it = at(cursor);
    if (it) location.assign(`/replay/${it.experiment}@${it.generation}/${it.individual}`);
  };

  const take = (answer) => {
    found = answer;
    elites = new Map();
    for (const [cell, fitness, descriptors, generation, individual, experiment] of found.shown) {
      const place = [cell[0], cell[1] ?? 0];
      const before = elites.get(key(...place));
      // With more than two descriptors, several elites share a cell of the picture.
      if (!before || before.fitness < fitness) elites.set(key(...place), { cell: place, fitness, descriptors, generation, individual, experiment });
    }
    range = extremes([...elites.values()].map((it) => it.fitness));
    draw();
  };

  /** The cell at a place of the picture. */
  const under = (event) => {
    const box = picture.getBoundingClientRect();
    const [n_columns, n_rows] = size();
    const within = (value, n) => clamp(Math.floor(value * n), n);
    return [within((event.clientX - box.left) / box.width, n_columns), within((box.bottom - event.clientY) / box.height, n_rows)];
  };
  const point = (cell) => {
    cursor = cell;
    drawReadout();
    picture.redraw();
  };
  picture.addEventListener("pointermove", (event) => found && point(under(event)));
  picture.addEventListener("pointerleave", () => point(null));
  picture.addEventListener("click", (event) => {
    if (!found) return;
    point(under(event));
    play();
  });
  onKeys(stage, (by) => {
    if (!found) return null;
    const [n_columns, n_rows] = size();
    const [i, j] = cursor ?? [0, 0];
    const go = (column, row) => point([clamp(column, n_columns), clamp(row, n_rows)]);
    return {
      ArrowRight: () => go(cursor ? i + by : 0, j), ArrowLeft: () => go(i - by, j), ArrowUp: () => go(i, j + by), ArrowDown: () => go(i, j - by),
      Home: () => go(0, j), End: () => go(n_columns - 1, j), PageUp: () => go(i, n_rows - 1), PageDown: () => go(i, 0), Enter: play,
    };
  });
  new ResizeObserver(draw).observe(stage);

  /** The shown elites. */
  const table = () => [
    ["address", "fitness", ...found.axes.map(({ measure, of }) => `${measure}_${of}`)],
    ...found.shown.map(([, fitness, descriptors, generation, individual, experiment]) => [`${experiment}@${generation}/${individual}`, fitness, ...descriptors]),
  ];

  askDuringRun(node, `/api/experiments/${id}/repertoire`, { take, note, isDone: () => !found || found.corrected });
  return node;
}
