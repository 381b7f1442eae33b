// The fitness of every individual of every generation; a click on a cell plays it.

import { canvas, decimals, element } from "swarm/dom.js";
import { ask, complain, resolve } from "swarm/page.js";

/** Pixels of a cell: least and most along the generations, least among the individuals. */
const CELL_MIN = 14;
const CELL_MAX = 80;
const ROW_MIN = 3;
/** Generations that are asked for at once. */
const PAGE = 500;

/** Colours from bad to good: seen by all eyes, and in grey. */
const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** Red, green and blue of a share from 0 to 1. */
function colorOf(share) {
  const at = Math.max(0, Math.min(1, share)) * (STOPS.length - 1);
  const low = Math.min(Math.floor(at), STOPS.length - 2);
  return STOPS[low].map((from, i) => Math.round(from + (STOPS[low + 1][i] - from) * (at - low)));
}

/** The map of an experiment; `update(n_generations)` shows more of it. */
export function heatMap(id) {
  /** Per generation the fitness of its individuals, sorted as they are numbered. */
  const generations = new Map();
  const asked = new Set();
  /** Pictures of pages of generations, a pixel for each individual, so that scrolling draws few
   *  of them instead of every cell. */
  const pictures = new Map();
  let n_generations = 0;
  let first = 0;
  let n_individuals = 0;
  let range = [Infinity, -Infinity];
  let isSorted = false;
  let atEnd = true;

  const title = element("span", { className: "readout" });
  const sort = element("input", { type: "checkbox", id: "sort-individuals", onchange: () => { isSorted = sort.checked; pictures.clear(); picture.redraw(); } });
  const spacer = element("div", { className: "spacer" });
  const picture = canvas((context, width, height) => draw(context, width, height), "fitness of every individual");
  const scroller = element("div", { className: "scroller", tabIndex: 0, "aria-label": "generations, left to right" }, spacer, picture);
  const node = element("section", { className: "panel heat-map" },
    element("header", {}, element("h2", {}, "Every individual"), element("span", { className: "muted" }, "click one to play it"),
      element("span", { className: "space" }), title,
      element("label", {}, sort, "best on top")),
    scroller);

  const rowHeight = () => Math.max(ROW_MIN, Math.min(CELL_MIN, 320 / Math.max(1, n_individuals)));

  /** Few generations fill the width, many scroll. */
  const cellWidth = () => Math.max(CELL_MIN, Math.min(CELL_MAX, Math.floor(scroller.clientWidth / Math.max(1, n_generations))));

  /** Individuals of a generation in the order of the rows. */
  const order = (values) => {
    const indices = [...values.keys()].filter((i) => !Number.isNaN(values[i]));
    return isSorted ? indices.sort((a, b) => values[b] - values[a]) : indices;
  };

  /** The picture of the generations from `page * PAGE` on. */
  const pictureOf = (page) => {
    if (pictures.has(page)) return pictures.get(page);
    const drawn = element("canvas", { width: PAGE, height: n_individuals });
    const context = drawn.getContext("2d");
    const image = context.createImageData(PAGE, n_individuals);
    const [low, high] = range;
    for (let column = 0; column < PAGE; column++) {
      const values = generations.get(page * PAGE + column);
      if (!values) continue;
      order(values).forEach((individual, place) => {
        image.data.set([...colorOf((values[individual] - low) / (high - low || 1)), 255], 4 * (place * PAGE + column));
      });
    }
    context.putImageData(image, 0, 0);
    pictures.set(page, drawn);
    return drawn;
  };

  const draw = (context, width, height) => {
    context.clearRect(0, 0, width, height);
    if (n_generations === 0) return;
    const left = scroller.scrollLeft;
    const cell = cellWidth();
    const from = Math.max(first, Math.floor(left / cell));
    const to = Math.min(n_generations, Math.ceil((left + width) / cell));
    const row = rowHeight();
    for (let generation = from; generation < to; generation++) if (!generations.has(generation)) load(generation);
    if (n_individuals === 0) return;
    context.imageSmoothingEnabled = false;
    for (let page = Math.floor(from / PAGE); page * PAGE < to; page++) {
      const begin = Math.max(from, page * PAGE);
      const n = Math.min(to, (page + 1) * PAGE) - begin;
      context.drawImage(pictureOf(page), begin - page * PAGE, 0, n, n_individuals, begin * cell - left, 0, n * cell, n_individuals * row);
    }
    // Lines between the cells.
    for (let generation = from; generation < to; generation++) context.clearRect((generation + 1) * cell - left - 1, 0, 1, height);
    for (let place = 1; row > 4 && place <= n_individuals; place++) context.clearRect(0, place * row - 1, width, 1);
  };

  /** Asks for the generations around one, unless that is under way. */
  const load = async (generation) => {
    const from = Math.floor(generation / PAGE) * PAGE;
    const key = `${from}/${Math.min(from + PAGE, n_generations)}`;
    if (asked.has(key)) return;
    asked.add(key);
    try {
      const response = await ask(`/api/experiments/${id}/fitness?from=${from}`);
      const buffer = await response.arrayBuffer();
      const [start, n, individuals] = new Uint32Array(buffer, 0, 3);
      const values = new Float32Array(buffer, 12);
      for (let i = 0; i < n; i++) {
        const row = values.subarray(i * individuals, (i + 1) * individuals);
        generations.set(start + i, row);
        for (const value of row) if (!Number.isNaN(value)) range = [Math.min(range[0], value), Math.max(range[1], value)];
      }
      if (from === 0 || start > from) first = Math.max(first, start);
      n_individuals = Math.max(n_individuals, individuals);
      pictures.clear();
      resolve("map");
      resize();
    } catch (error) {
      asked.delete(key);
      complain(error, "map");
    }
  };

  const resize = () => {
    spacer.style.width = `${n_generations * cellWidth()}px`;
    scroller.style.height = `${Math.max(40, n_individuals * rowHeight()) + 18}px`;
    picture.style.height = `${Math.max(40, n_individuals * rowHeight())}px`;
    if (atEnd) scroller.scrollLeft = scroller.scrollWidth;
    picture.redraw();
  };

  /** The individual under the pointer. */
  const cell = (event) => {
    const box = picture.getBoundingClientRect();
    const generation = Math.floor((event.clientX - box.left + scroller.scrollLeft) / cellWidth());
    const values = generations.get(generation);
    const place = Math.floor((event.clientY - box.top) / rowHeight());
    if (!values || place < 0 || place >= values.length) return null;
    const individual = order(values)[place];
    return { generation, individual, fitness: values[individual] };
  };
  scroller.addEventListener("scroll", () => {
    atEnd = scroller.scrollLeft + scroller.clientWidth > scroller.scrollWidth - 3 * cellWidth();
    requestAnimationFrame(() => picture.redraw());
  });
  picture.addEventListener("pointermove", (event) => {
    const found = cell(event);
    title.textContent = found ? `generation ${found.generation}, individual ${found.individual}: ${decimals(found.fitness, 4)}` : "";
  });
  picture.addEventListener("click", (event) => {
    const found = cell(event);
    if (found) location.assign(`/replay/${id}@${found.generation}/${found.individual}`);
  });
  node.update = (n) => {
    if (n === n_generations) return;
    n_generations = n;
    if (!generations.has(n - 1)) load(n - 1);
    resize();
  };
  return node;
}
