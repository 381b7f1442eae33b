// The front of an experiment: compromises between fitness and an aim, as points. A click on a point
// plays its elite.

import { EDGE, mapFigure, scatterPlane, shape } from "swarm/charts.js";
import { canvas, decimals, element, onKeys } from "swarm/dom.js";
import { palette } from "swarm/drawing.js";
import { exports } from "swarm/export.js";
import { askDuringRun } from "swarm/page.js";
import { clamp } from "swarm/scales.js";

/** Maximum distance between a pointer and the point that it selects, pixels. */
const NEAR = 24;
/** Radius of a point, pixels. */
const RADIUS = 4;

/** A part of the page, with the `update` of `askDuringRun`. */
export function frontPanel(id) {
  let found = null;
  /** The elites on the front, by ascending first aim. */
  let elites = [];
  let scale = null;
  /** The place of the readout in `elites`. */
  let cursor = null;

  const readout = element("span", { className: "readout muted", role: "status" });
  const note = element("p", { className: "muted small" });
  const picture = canvas((context, width, height) => paint(context, width, height), "");
  const frame = shape("svg", { "aria-hidden": "true" });
  /** A ring around the point of the readout: moving it repaints no points. */
  const ring = element("i", { className: "ring", hidden: true });
  const stage = element("div", { className: "cells", tabIndex: 0, role: "group", "aria-roledescription": "scatter plot", "aria-label": "fitness of the elites on the front over the first aim; arrow keys go along the front, Enter plays an elite" }, frame, picture, ring);
  const files = exports({ svg: () => mapFigure(stage, frame, picture), table: () => table(), name: () => `front-${id}` });
  const node = element("details", { className: "panel front", hidden: true, open: true },
    element("summary", {}, "Front"),
    element("p", { className: "muted small" }, "No point is better than another one in fitness and all aims; a click on a point plays its elite."),
    note, stage, element("p", { className: "row small" }, readout, files));

  const paint = (context, width, height) => {
    context.clearRect(0, 0, width, height);
    if (!scale) return;
    context.fillStyle = palette().line;
    for (const it of elites) {
      context.beginPath();
      context.arc(scale.x(it.aims[0]) - EDGE.left, scale.y(it.fitness) - EDGE.top, RADIUS, 0, 2 * Math.PI);
      context.fill();
    }
  };

  const draw = () => {
    if (!found) return;
    const { aims: [aim], figures, generation, n_elites } = found;
    const volume = figures && `hypervolume ${decimals(figures.hypervolume, 4)} up to (${figures.reference.map((value) => decimals(value, 3)).join(", ")})`;
    if (!figures) note.textContent = `after generation ${generation}: no elite has finite values`;
    else if (figures.stay === null) note.textContent = `after generation ${generation}: ${volume}, ${n_elites} elites, whose values are optimistic until the end of the run judges them`;
    else note.textContent = `judged on new trials: ${volume}, ${decimals(100 * figures.stay, 0)} % of ${n_elites} elites stay on the front`;
    node.dataset.points = elites.length;
    files.hidden = elites.length === 0;
    scale = scatterPlane(stage, frame, elites.map((it) => it.aims[0]), elites.map((it) => it.fitness), 0.04, `${aim.measure} (${aim.of}), ${aim.direction}`, "fitness");
    drawReadout();
    picture.redraw();
  };

  const drawReadout = () => {
    ring.hidden = cursor === null || !scale;
    if (ring.hidden) return void (readout.textContent = "");
    const { fitness, aims, generation, individual } = elites[cursor];
    ring.style.transform = `translate(${scale.x(aims[0])}px, ${scale.y(fitness)}px)`;
    const values = found.aims.map(({ measure }, i) => `${measure} ${decimals(aims[i], 3)}`).join(", ");
    readout.textContent = `fitness ${decimals(fitness, 4)}, ${values}, individual ${individual} of generation ${generation}`;
  };

  const point = (at) => {
    cursor = at;
    drawReadout();
  };
  const play = () => {
    const it = elites[cursor];
    if (it) location.assign(`/replay/${it.experiment}@${it.generation}/${it.individual}`);
  };

  const take = (answer) => {
    found = answer;
    elites = found.shown.map(([fitness, aims, generation, individual, experiment]) => ({ fitness, aims, generation, individual, experiment }));
    elites.sort((a, b) => a.aims[0] - b.aims[0] || a.fitness - b.fitness);
    cursor = null;
    draw();
  };

  /** The place of the elite next to a pointer; null: none is near. */
  const under = (event) => {
    if (!scale) return null;
    const box = stage.getBoundingClientRect();
    const distance = (it) => Math.hypot(scale.x(it.aims[0]) - event.clientX + box.left, scale.y(it.fitness) - event.clientY + box.top);
    const nearest = elites.reduce((best, it, i) => (distance(it) < distance(elites[best]) ? i : best), 0);
    return distance(elites[nearest]) <= NEAR ? nearest : null;
  };
  picture.addEventListener("pointermove", (event) => point(under(event)));
  picture.addEventListener("pointerleave", () => point(null));
  picture.addEventListener("click", (event) => {
    point(under(event));
    play();
  });
  onKeys(stage, (by) => {
    if (elites.length === 0) return null;
    const go = (to) => point(clamp(to, elites.length));
    const along = (step) => go(cursor === null ? 0 : cursor + step);
    return {
      ArrowRight: () => along(by), ArrowLeft: () => along(-by), ArrowUp: () => along(by), ArrowDown: () => along(-by),
      Home: () => go(0), End: () => go(elites.length - 1), Enter: play,
    };
  });
  new ResizeObserver(draw).observe(stage);

  /** The elites on the front. */
  const table = () => [
    ["address", "fitness", ...found.aims.map(({ measure, of }) => `${measure}_${of}`)],
    ...elites.map(({ fitness, aims, generation, individual, experiment }) => [`${experiment}@${generation}/${individual}`, fitness, ...aims]),
  ];

  askDuringRun(node, `/api/experiments/${id}/front`, { take, note, isDone: () => found?.figures?.stay !== null });
  return node;
}
