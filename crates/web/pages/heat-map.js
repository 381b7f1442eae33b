// The fitness of every individual of every generation in one picture. It zooms with the curve
// above; a click on a cell plays the individual.

import { canvas, decimals, element, onKeys } from "swarm/dom.js";
import { EDGE, fitnessScale, mapFigure, markCell, shape, text } from "swarm/charts.js";
import { exports } from "swarm/export.js";
import { FitnessPages } from "swarm/fitness-pages.js";
import { complain, resolve } from "swarm/page.js";
import { clamp, rampColor, ticks } from "swarm/scales.js";

/** Minimum size of a cell with lines between cells, pixels. */
const LINES_FROM = 7;

/** The map of an experiment; `update(n_generations)` shows more of it. `onZoom(range)`: called with
 *  the visible generations, null for all; `zoom(range)` shows some. */
export function heatMap(id, onZoom = () => {}) {
  const pages = new FitnessPages(id);
  /** Pictures of pages with a pixel for each individual, to draw a few images instead of many cells. */
  const pictures = new Map();
  let n_generations = 0;
  let range = null;
  let isSorted = false;
  /** The cell of the readout: a generation, and a place among its individuals. */
  let cursor = null;
  let held = null;

  const readout = element("span", { className: "readout muted", role: "status" });
  const sort = element("input", { type: "checkbox", id: "sort-individuals", onchange: () => {
    isSorted = sort.checked;
    pictures.clear();
    draw();
  } });
  const picture = canvas((context, width, height) => paint(context, width, height), "");
  const axes = shape("svg", { "aria-hidden": "true" });
  const stage = element("div", { className: "cells", tabIndex: 0, role: "group", "aria-roledescription": "heat map", "aria-label": "fitness of every individual of every generation; arrow keys go through them, Enter plays one, + and - zoom" }, axes, picture);
  const scale = element("span", { className: "scale muted small" });
  const files = exports({ svg: () => mapFigure(stage, axes, picture), table: () => table(), name: () => `individuals-${id}` });
  const node = element("section", { className: "panel heat-map" },
    element("header", {}, element("h2", {}, "Every individual"), element("span", { className: "muted" }, "click one to play it, drag to zoom"),
      element("span", { className: "space" }), scale, element("label", {}, sort, "best on top")),
    stage, element("p", { className: "row small" }, readout, files));

  /** The visible generations as positions: the beginning of the first one, the end of the last one. */
  const window = () => (range ? [Math.max(0, Math.round(range[0]) - 0.5), Math.min(n_generations - 1, Math.round(range[1])) + 0.5] : [-0.5, n_generations - 0.5]);

  /** Individuals of a generation in the order of the rows. */
  const order = (values) => {
    const indices = [...values.keys()].filter((i) => !Number.isNaN(values[i]));
    return isSorted ? indices.sort((a, b) => values[b] - values[a]) : indices;
  };

  /** The picture of a page, with a column of pixels for each requested generation. */
  const pictureOf = (page) => {
    const key = `${page.from}/${page.every}`;
    const known = pictures.get(key);
    if (known?.count === page.count && known.low === pages.low && known.high === pages.high) return known.drawn;
    const n_columns = Math.ceil((page.to - page.from) / page.every);
    const drawn = element("canvas", { width: n_columns, height: Math.max(1, pages.n_individuals) });
    const context = drawn.getContext("2d");
    const image = context.createImageData(n_columns, drawn.height);
    const { low, high } = pages;
    for (let column = 0; column < n_columns; column++) {
      const values = pages.at(page.from + column * page.every);
      if (!values) continue;
      order(values).forEach((individual, place) => {
        image.data.set([...rampColor((values[individual] - low) / (high - low || 1)), 255], 4 * (place * n_columns + column));
      });
    }
    context.putImageData(image, 0, 0);
    pictures.set(key, { drawn, count: page.count, low, high });
    return drawn;
  };

  const paint = (context, width, height) => {
    context.clearRect(0, 0, width, height);
    const n_rows = pages.n_individuals;
    const [from, to] = window();
    const cell = width / (to - from);
    const needed = pages.needed(from + 0.5, to + 0.5, width, n_generations);
    load(needed);
    if (n_rows > 0) {
      const row = height / n_rows;
      context.imageSmoothingEnabled = cell * needed[0].every < 1 || row < 1;
      for (const page of needed) {
        const image = pictureOf(page);
        context.drawImage(image, (page.from - 0.5 - from) * cell, 0, image.width * page.every * cell, height);
      }
      if (cell > LINES_FROM) for (let generation = Math.ceil(from); generation < to; generation++) context.clearRect(Math.round((generation + 0.5 - from) * cell) - 1, 0, 1, height);
      if (row > LINES_FROM) for (let place = 1; place < n_rows; place++) context.clearRect(0, Math.round(place * row) - 1, width, 1);
      if (cursor) markCell(context, (cursor.generation - 0.5 - from) * cell, cursor.place * row, cell, row);
    }
    if (held?.to !== undefined) {
      const [left, right] = [held.at, held.to].sort((a, b) => a - b);
      context.fillStyle = "rgb(128 128 128 / 40%)";
      context.fillRect(left, 0, right - left, height);
    }
  };

  const drawAxes = () => {
    const [width, height] = [stage.clientWidth, stage.clientHeight];
    if (!width || n_generations === 0) return;
    axes.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const [from, to] = window();
    const bottom = height - EDGE.bottom;
    const x = (generation) => EDGE.left + ((generation - from) / (to - from)) * (width - EDGE.left - EDGE.right);
    const y = (place) => EDGE.top + ((place + 0.5) / Math.max(1, pages.n_individuals)) * (bottom - EDGE.top);
    const middle = (EDGE.top + bottom) / 2;
    const whole = (low, high, n) => ticks(low, high, n).filter(Number.isInteger);
    axes.replaceChildren(
      ...whole(Math.max(0, from + 0.5), to - 0.5, Math.min(8, width / 90)).map((it) => text(x(it), bottom + 16, String(it), { "text-anchor": "middle" })),
      ...whole(0, pages.n_individuals - 1, 5).map((it) => text(EDGE.left - 6, y(it) + 4, String(it), { "text-anchor": "end" })),
      text((EDGE.left + width - EDGE.right) / 2, height - 6, "generation", { "text-anchor": "middle" }),
      text(14, middle, isSorted ? "rank" : "individual", { "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` }));
  };

  const draw = () => {
    const n = pages.n_individuals;
    stage.style.height = `${Math.max(120, Math.min(360, 14 * n, Math.max(220, 3 * n))) + EDGE.top + EDGE.bottom}px`;
    drawAxes();
    if (Number.isFinite(pages.low)) scale.replaceChildren(...fitnessScale(pages.low, pages.high));
    drawReadout();
    picture.redraw();
  };

  /** Requests visible unknown generations, unless a request is under way. */
  const load = async (needed) => {
    try {
      if (await pages.load(needed, n_generations)) draw();
      resolve("map");
    } catch (error) {
      complain(error, "map");
    }
  };

  const found = () => {
    const values = cursor && pages.at(cursor.generation);
    const individual = values && order(values)[cursor.place];
    return individual === undefined || individual === null ? null : { ...cursor, individual, fitness: values[individual] };
  };

  const drawReadout = () => {
    const it = found();
    readout.textContent = it ? `generation ${it.generation}, individual ${it.individual}: ${decimals(it.fitness, 4)}` : "";
  };

  const zoomTo = (to, isOurs = true) => {
    if (String(to) === String(range)) return;
    range = to;
    cursor = null;
    draw();
    if (isOurs) onZoom(range);
  };

  const play = () => {
    const it = found();
    if (it) location.assign(`/replay/${id}@${it.generation}/${it.individual}`);
  };

  /** The cell at a place of the picture. */
  const at = (event) => {
    const box = picture.getBoundingClientRect();
    const [from, to] = window();
    const generation = Math.round(from + ((event.clientX - box.left) / box.width) * (to - from));
    return { x: event.clientX - box.left, width: box.width, generation: pages.nearest(clamp(generation, n_generations)), place: Math.floor(((event.clientY - box.top) / box.height) * pages.n_individuals) };
  };
  picture.addEventListener("pointerdown", (event) => {
    held = { at: at(event).x };
    picture.setPointerCapture(event.pointerId);
  });
  picture.addEventListener("pointermove", (event) => {
    const { x, generation, place } = at(event);
    cursor = { generation, place };
    if (held && Math.abs(x - held.at) > 5) held.to = x;
    drawReadout();
    picture.redraw();
  });
  picture.addEventListener("pointerup", (event) => {
    const drag = held;
    held = null;
    if (!drag) return;
    const { width } = at(event);
    if (drag.to === undefined) return;
    const [from, to] = window();
    const ends = [drag.at, drag.to].sort((a, b) => a - b).map((x) => from + (x / width) * (to - from));
    zoomTo([Math.max(0, Math.round(ends[0])), Math.min(n_generations - 1, Math.round(ends[1]))]);
    picture.dataset.dragged = "1";
  });
  picture.addEventListener("click", (event) => {
    if (picture.dataset.dragged) return void delete picture.dataset.dragged;
    const { generation, place } = at(event);
    cursor = { generation, place };
    play();
  });
  picture.addEventListener("dblclick", () => zoomTo(null));
  picture.addEventListener("pointerleave", () => {
    cursor = null;
    drawReadout();
    picture.redraw();
  });
  onKeys(stage, (by) => {
    if (n_generations === 0) return null;
    const [from, to] = [Math.ceil(window()[0]), Math.floor(window()[1])];
    const now = cursor ?? { generation: from, place: -1 };
    const go = (generation, place) => {
      cursor = { generation: pages.nearest(Math.max(from, Math.min(to, generation))), place: clamp(place, pages.n_individuals) };
      draw();
    };
    const scaled = (factor) => {
      const half = ((to - from) * factor) / 2;
      const middle = cursor?.generation ?? (from + to) / 2;
      const next = [Math.max(0, Math.round(middle - half)), Math.min(n_generations - 1, Math.round(middle + half))];
      zoomTo(next[0] === 0 && next[1] === n_generations - 1 ? null : next);
    };
    return {
      ArrowRight: () => go(now.generation + by, Math.max(0, now.place)), ArrowLeft: () => go(now.generation - by, Math.max(0, now.place)),
      ArrowDown: () => go(now.generation, now.place + by), ArrowUp: () => go(now.generation, now.place - by),
      Home: () => go(from, Math.max(0, now.place)), End: () => go(to, Math.max(0, now.place)), Enter: play, "+": () => scaled(0.5), "=": () => scaled(0.5), "-": () => scaled(2), Escape: () => zoomTo(null),
    };
  });
  new ResizeObserver(draw).observe(stage);

  /** The visible values as a table. */
  const table = () => {
    const [from, to] = window();
    const rows = [["generation", "individual", "fitness"]];
    for (let generation = Math.ceil(from); generation < to; generation++) {
      pages.at(generation)?.forEach((value, individual) => Number.isNaN(value) || rows.push([generation, individual, value]));
    }
    return rows;
  };

  node.update = (n) => {
    if (n === n_generations) return;
    n_generations = n;
    draw();
  };
  node.zoom = (to) => zoomTo(to, false);
  return node;
}
