// The picture of a fleet: the coordinator with the trials of the present batch, workers around it,
// and items on their way.

import { path, shape } from "swarm/charts.js";
import { Travel } from "swarm/demo-travel.js";
import { canvas, color, decimals, element, onTheme } from "swarm/dom.js";

/** The states of a trial, by their digit; the names of custom properties of the style. */
const CELLS = ["--grid", "--accent", "--relay", "--relay", "--good"];
const WORDS = { healthy: "", killed: "killed", hung: "hung", slow: "slow", lying: "lies" };

/** A worker's state for people, as the visitor and as the coordinator see it. */
function stateOf({ health, is_connected, quarantined, waits, n_items }) {
  const known = quarantined ? "quarantined" : health === "hung" && !is_connected ? "given up" : "";
  const own = WORDS[health];
  if (own) return known ? `${own}, ${known}` : own;
  if (known) return known;
  if (waits) return "waits";
  return n_items ? "computes" : "idle";
}

/** The best fitness of each generation, of both fleets; `show(report)` draws it, and returns the values
 *  of the disturbed one. */
function fitnessCurves(generations) {
  const lines = ["undisturbed", "disturbed"].map((run) => shape("path", { class: run }));
  const node = shape("svg", { class: "curves", viewBox: "0 0 600 100", preserveAspectRatio: "none", "aria-hidden": "true" }, ...lines);
  let n_drawn = "";
  function show(report) {
    const runs = [report.undisturbed, report.disturbed].map(({ links }) => links.filter((link) => !link.is_last).map((link) => link.best));
    if (String(runs.map((run) => run.length)) !== n_drawn) {
      n_drawn = String(runs.map((run) => run.length));
      const top = Math.max(1, ...runs.flat());
      lines.forEach((line, i) => line.setAttribute("d", path(runs[i].map((value, g) => [(600 * (g + 0.5)) / generations, 96 - (90 * value) / top]))));
    }
    return runs[1];
  }
  return { node, show };
}

/** The picture; `onWorker(i)`: a click on a worker. */
export function stage(names, generations, onWorker) {
  let tool = "";
  let report = null;
  let colors = {};
  const nodes = names.map((name, i) => {
    const state = element("span", { className: "state-of" });
    const button = element("button", { type: "button", className: "worker", onclick: () => onWorker(i) }, element("b", {}, name.replace("worker-", "")), element("i", { className: "machine", "aria-hidden": "true" }), state);
    return { name, button, state, said: "" };
  });
  const round = element("p", { id: "round" });
  const counts = element("p", { className: "muted small" });
  const cells = canvas((context, width, height) => drawCells(context, width, height));
  const referee = element("p", { id: "referee", className: "referee" });
  const curves = fitnessCurves(generations);
  const best = element("span", { className: "muted small" });
  const coordinator = element("div", { className: "coordinator" }, element("div", { className: "row" }, element("h2", {}, "Coordinator"), element("span", { className: "space" }), best), round, element("div", { className: "cells-of" }, cells), counts, curves.node, referee);
  const travel = new Travel();
  const overlay = canvas((context, width, height) => travel.resize(context, width, height, node, coordinator, nodes.map(({ button }) => button)));
  overlay.className = "travel";
  const node = element("div", { className: "stage floor", role: "group", "aria-label": "the fleet" }, coordinator, ...nodes.map(({ button }) => button), overlay);
  const readColors = () => {
    colors = Object.fromEntries([...new Set(CELLS), "--muted", "--border", "--panel", "--bad", "--led-4", "--ink", "--target"].map((name) => [name, color(name)]));
    travel.colors = colors;
  };
  readColors();
  onTheme(readColors);

  function drawCells(context, width, height) {
    context.clearRect(0, 0, width, height);
    if (!report || report.cells.length === 0) return;
    const n = report.cells.length;
    const n_trials = n / report.n_individuals;
    // Individuals side by side; a single one in as many rows as fit.
    const n_columns = report.n_individuals > 8 ? report.n_individuals : Math.ceil(Math.sqrt((n * width) / height));
    const n_rows = Math.ceil(n / n_columns);
    const [w, h] = [width / n_columns, Math.min(height / n_rows, (2.5 * width) / n_columns)];
    const gap = Math.min(2, w / 5);
    for (let i = 0; i < n; i++) {
      const isTall = report.n_individuals > 8;
      const [column, row] = isTall ? [Math.floor(i / n_trials), i % n_trials] : [i % n_columns, Math.floor(i / n_columns)];
      const state = Number(report.cells[i]);
      context.globalAlpha = state === 1 ? 0.55 : 1;
      context.fillStyle = colors[CELLS[state]];
      context.fillRect(column * w + gap / 2, row * h + gap / 2, w - gap, h - gap);
      if (state === 3) {
        context.fillStyle = colors["--panel"];
        context.fillRect(column * w + w / 2 - gap, row * h + gap, 2 * gap, h - 2 * gap);
      }
    }
    context.globalAlpha = 1;
  }

  function show(next) {
    report = next;
    const { disturbed, cells: digits } = next;
    const isOver = disturbed.over_at !== null;
    round.textContent = isOver ? "The run is over." : `computes ${disturbed.round}${/^generation/.test(disturbed.round) ? `; the last is ${generations - 1}` : ""}`;
    const count = (digit) => digits.split(digit).length - 1;
    counts.textContent = isOver ? "" : `trials: ${count("0")} wait, ${count("1")} are computed, ${count("4")} of ${digits.length} are known; audits: ${next.n_audits_waiting} wait, ${next.n_audits} are computed`;
    referee.textContent = next.questions.length ? `Referee: ${next.questions[0]}${next.questions.length > 1 ? `; ${next.questions.length - 1} more` : ""}` : "Referee: no question";
    referee.classList.toggle("asked", next.questions.length > 0);
    const values = curves.show(next);
    best.textContent = values.length ? `best fitness ${decimals(Math.max(...values), 3)}` : "";
    next.workers.forEach((worker, i) => {
      const { button, state, name, said } = nodes[i];
      const text = stateOf(worker);
      button.className = `worker ${worker.health}${worker.quarantined ? " quarantined" : ""}${worker.is_connected ? "" : " gone"}`;
      const label = `${name}, ${text}: ${tool}`;
      if (label === said) return;
      nodes[i].said = label;
      state.textContent = text;
      button.setAttribute("aria-label", label);
      button.title = worker.quarantined ?? worker.waits ?? "";
    });
    cells.redraw();
  }

  return {
    node,
    show,
    setTool(word) {
      tool = word;
      if (report) show(report);
    },
    draw(items, now, isStill) {
      if (report) travel.draw(items, now, isStill, report.workers);
    },
  };
}
