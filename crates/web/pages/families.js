// The fitness of each child over the fitness of its parents. The server repeats the generations to
// find the parents, so the page requests them only when the user opens this part.

import { EDGE, scatterPlane, shape } from "swarm/charts.js";
import { canvas, decimals, element, onKeys } from "swarm/dom.js";
import { palette } from "swarm/drawing.js";
import { exports } from "swarm/export.js";
import { askJson } from "swarm/page.js";
import { clamp } from "swarm/scales.js";

/** Maximum number of shown children; for longer runs, the page requests only every n-th generation. */
const CHILDREN_MAX = 100_000;
/** Maximum distance between a pointer and the point that it selects, pixels. */
const NEAR = 14;
/** The origin of a child: a name, its meaning, and its colour in the style. */
const KINDS = [
  { name: "crossover", title: "from two parents, then mutated", color: "line" },
  { name: "copy", title: "from one parent, then mutated", color: "good" },
  { name: "elite", title: "its parent, unchanged: only trials differ", color: "relay" },
];

/** A child from a row of the server. `x`: the mean fitness of its parents. */
function child([generation, individual, population, operator, fitness, ...of]) {
  const parents = of.length > 2 ? [[of[0], of[1]], [of[2], of[3]]] : [[of[0], of[1]]];
  const x = parents.reduce((sum, [, its]) => sum + its, 0) / parents.length;
  return { generation, individual, population, operator, fitness, parents, x };
}

/** A part of the page that is closed at first. `update(n_generations, every)`: the number of
 *  generations, and the stride of the shown ones; `zoom(range)` shows the children of some
 *  generations, null: of all. */
export function familiesPanel(id) {
  const children = [];
  let populations = [];
  let next = 0;
  let n_generations = 0;
  let every = 1;
  let isAsking = false;
  let range = null;
  /** The highlighted kind; null: none. */
  let marked = null;
  /** The visible children and their positions, to find the one to read out. */
  let shown = [];
  let scale = null;
  let cursor = null;

  const note = element("span", { className: "muted small" });
  const readout = element("span", { className: "readout muted", role: "status" });
  const legend = element("div", { className: "keys small" });
  const picture = canvas((context, width, height) => paint(context, width, height), "");
  const frame = shape("svg", { "aria-hidden": "true" });
  /** A ring around the point of the readout: moving it repaints no points. */
  const ring = element("i", { className: "ring", hidden: true });
  const stage = element("div", { className: "cells", tabIndex: 0, role: "group", "aria-roledescription": "scatter plot", "aria-label": "fitness of each child against the mean of its parents; arrow keys go through children and generations, Enter plays one" }, frame, picture, ring);
  const files = exports({ svg: () => whole(), table: () => table(), name: () => `families-${id}` });
  const node = element("details", { className: "panel families", hidden: true, ontoggle: () => ask() },
    element("summary", {}, "Parents and children"),
    element("p", { className: "muted small" }, "Children above the dashed line are fitter than the mean of their parents. An elite is its own parent: its distance from the line is the difference between trials. A zoom of the curve chooses generations; a click plays a child."),
    legend, stage, element("p", { className: "row small" }, note, readout, files));

  const isSeen = ({ generation }) => !range || (generation >= Math.round(range[0]) && generation <= Math.round(range[1]));

  const draw = () => {
    shown = children.filter(isSeen);
    cursor = null;
    files.hidden = shown.length === 0;
    node.dataset.children = shown.length;
    note.textContent = [`${shown.length.toLocaleString("en")} children`, every > 1 && `of one generation in ${every}`, next < n_generations && `at generation ${next} of ${n_generations}`].filter(Boolean).join(", ");
    drawLegend();
    drawFrame();
    drawReadout();
    picture.redraw();
  };

  const drawLegend = () => {
    const held = legend.contains(document.activeElement) ? document.activeElement.dataset.name : null;
    const keys = KINDS.map(({ name, title, color }) => {
      const its = shown.filter((it) => it.operator === name);
      if (its.length === 0) return null;
      const fitter = its.filter((it) => it.fitness > it.x).length;
      const dot = element("i", {});
      dot.style.background = `var(--${color})`;
      const key = element("button", { type: "button", className: "key", title: `${title}; click to highlight them`, "aria-pressed": String(marked === name), onclick: () => {
        marked = marked === name ? null : name;
        draw();
      } }, dot, `${name}: ${its.length.toLocaleString("en")}, ${Math.round((100 * fitter) / its.length)} % fitter than their parents`);
      key.dataset.name = name;
      return key;
    });
    legend.replaceChildren(...keys.filter(Boolean));
    if (held) [...legend.children].find((it) => it.dataset.name === held)?.focus();
  };

  const drawFrame = () => {
    scale = scatterPlane(stage, frame, shown.map((it) => it.x), shown.map((it) => it.fitness), 0.03, "mean fitness of the parents", "fitness of the child");
    if (!scale) return;
    const { x0, x1, x, y0, y1, y } = scale;
    const [from, to] = [Math.max(x0, y0), Math.min(x1, y1)];
    if (from < to) frame.append(shape("line", { x1: x(from), y1: y(from), x2: x(to), y2: y(to), class: "diagonal" }));
  };

  /** The opacity of the points of a kind: overlapping points form a cloud. */
  const opacity = (name) => (marked !== null && marked !== name ? 0.06 : Math.max(0.25, Math.min(0.85, 30 / Math.sqrt(shown.length))));
  const radius = () => (shown.length > 5000 ? 1.5 : 2.5);

  const paint = (context, width, height) => {
    context.clearRect(0, 0, width, height);
    if (!scale) return;
    const colors = palette();
    const side = 2 * radius();
    for (const { name, color } of KINDS) {
      context.globalAlpha = opacity(name);
      context.fillStyle = colors[color];
      for (const it of shown) if (it.operator === name) context.fillRect(scale.x(it.x) - EDGE.left - side / 2, scale.y(it.fitness) - EDGE.top - side / 2, side, side);
    }
  };

  const drawReadout = () => {
    ring.hidden = cursor === null;
    if (cursor === null) return void (readout.textContent = "");
    ring.style.transform = `translate(${scale.x(shown[cursor].x)}px, ${scale.y(shown[cursor].fitness)}px)`;
    const { generation, individual, population, operator, fitness, parents } = shown[cursor];
    const from = parents.map(([parent, its]) => `${parent} (${decimals(its, 3)})`).join(" and ");
    readout.textContent = `generation ${generation}, individual ${individual}${populations.length > 1 ? `, ${populations[population]}` : ""}: ${decimals(fitness, 3)}, ${operator} from ${from}`;
  };

  const look = (at) => {
    cursor = at;
    drawReadout();
  };

  const play = () => cursor !== null && location.assign(`/replay/${id}@${shown[cursor].generation}/${shown[cursor].individual}`);

  /** The point next to a pointer; null if none is near. */
  const nearest = (event) => {
    if (!scale) return null;
    const box = picture.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left + EDGE.left, event.clientY - box.top + EDGE.top];
    let found = null;
    let least = NEAR ** 2;
    for (let i = 0; i < shown.length; i++) {
      const away = (scale.x(shown[i].x) - px) ** 2 + (scale.y(shown[i].fitness) - py) ** 2;
      if (away >= least) continue;
      found = i;
      least = away;
    }
    return found;
  };
  picture.addEventListener("pointermove", (event) => look(nearest(event)));
  picture.addEventListener("pointerleave", () => look(null));
  picture.addEventListener("click", (event) => {
    look(nearest(event));
    play();
  });
  onKeys(stage, (by) => {
    if (shown.length === 0) return null;
    const at = (to) => look(clamp(to, shown.length));
    /** The same individual in the previous or next generation, if shown. */
    const beside = (sign) => {
      const it = shown[cursor ?? 0];
      const isOf = (other) => sign * (other.generation - it.generation) > 0 && other.individual === it.individual && other.population === it.population;
      const found = sign > 0 ? shown.findIndex(isOf) : shown.findLastIndex(isOf);
      at(found < 0 ? cursor ?? 0 : found);
    };
    return {
      ArrowRight: () => beside(1), ArrowLeft: () => beside(-1), ArrowDown: () => at((cursor ?? -1) + by), ArrowUp: () => at((cursor ?? 1) - by),
      Home: () => at(0), End: () => at(shown.length - 1), Enter: play, Escape: () => look(null),
    };
  });
  new ResizeObserver(draw).observe(stage);

  /** Axes and points as one figure: one path per kind, with points as round ends of lines without
   *  length. */
  const whole = () => {
    const points = KINDS.map(({ name, color }) => shape("path", {
      d: shown.filter((it) => it.operator === name).map((it) => `M${scale.x(it.x).toFixed(1)} ${scale.y(it.fitness).toFixed(1)}h0`).join(""),
      fill: "none", stroke: palette()[color], opacity: opacity(name), "stroke-width": 2 * radius(), "stroke-linecap": "round", "data-name": name,
    }));
    frame.append(...points);
    queueMicrotask(() => points.forEach((it) => it.remove()));
    return frame;
  };

  const table = () => [
    ["generation", "individual", "population", "operator", "fitness", "parent", "fitness of parent", "other parent", "fitness of other parent"],
    ...shown.map((it) => [it.generation, it.individual, populations[it.population], it.operator, it.fitness, ...it.parents.flat()])];

  const ask = async () => {
    if (!node.open || node.hidden || isAsking) return;
    isAsking = true;
    try {
      while (next < n_generations && node.open) {
        const page = await askJson(`/api/experiments/${id}/families?from=${next}&every=${every}`);
        ({ populations } = page);
        // Random individuals have no parents, and failed individuals have no fitness.
        children.push(...page.children.filter((row) => row.length > 5 && row[4] !== null).map(child));
        if (page.next <= next) break;
        next = page.next;
        draw();
      }
    } catch (error) {
      note.textContent = error.message;
    }
    isAsking = false;
  };

  node.update = (n, n_children) => {
    n_generations = n;
    if (next === 0) every = Math.max(1, Math.ceil(n_children / CHILDREN_MAX));
    ask();
  };
  node.zoom = (to) => {
    range = to;
    draw();
  };
  return node;
}
