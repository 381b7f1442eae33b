// The trials of an individual as a strip, from the worst to the best; each can be selected.

import { decimals, element } from "swarm/dom.js";
import { shape } from "swarm/charts.js";
import { exports } from "swarm/export.js";
import { clamp } from "swarm/scales.js";

/** Height of the strip, and room around its bars, pixels. */
const [HEIGHT, EDGE] = [64, 3];

/** `trials`: the server's answer. `shown`: the played trial, null for none. `pick(trial)`: plays
 *  another one; without it the strip is read-only. */
export function trialStrip(trials, shown, pick = null) {
  const { fitness, mean, interval, median, worst, best } = trials;
  const order = [...fitness.keys()].sort((a, b) => fitness[a] - fitness[b]);
  const low = Math.min(0, ...[fitness[worst], mean]);
  const high = Math.max(fitness[best], interval?.[1] ?? mean, low + 1e-9);
  const n = order.length;
  const wide = 1000;
  const y = (value) => HEIGHT - EDGE - ((value - low) / (high - low)) * (HEIGHT - 2 * EDGE);
  const svg = shape("svg", { viewBox: `0 0 ${wide} ${HEIGHT}`, preserveAspectRatio: "none", class: "strip" });
  if (interval) svg.append(shape("rect", { x: 0, width: wide, y: y(interval[1]), height: Math.max(1, y(interval[0]) - y(interval[1])), class: "interval" }));
  svg.append(shape("line", { x1: 0, x2: wide, y1: y(mean), y2: y(mean), class: "mean" }));
  let at = Math.max(0, order.indexOf(shown));
  const cell = wide / n;
  order.forEach((trial, place) => {
    const height = Math.max(2, y(low) - y(fitness[trial]));
    svg.append(shape("rect", { x: place * cell + 0.1 * cell, width: 0.8 * cell, y: y(low) - height, height, class: trial === shown ? "bar shown" : "bar" }));
  });
  const readout = element("span", { className: "muted small", role: "status" });
  const says = (place) => `trial ${order[place]}: ${decimals(fitness[order[place]], 4)}, ${place + 1} of ${n} from the worst`;
  const mark = (place) => {
    readout.textContent = says(place);
    svg.querySelectorAll(".bar").forEach((bar, i) => bar.classList.toggle("near", i === place));
  };
  const placeOf = (event) => {
    const box = svg.getBoundingClientRect();
    return clamp(Math.floor(((event.clientX - box.left) / box.width) * n), n);
  };
  svg.addEventListener("pointermove", (event) => mark(placeOf(event)));
  if (pick) {
    svg.setAttribute("tabindex", "0");
    svg.setAttribute("role", "slider");
    for (const [name, value] of Object.entries({ label: "trial to play, from the worst to the best", valuemin: 1, valuemax: n, valuenow: at + 1, valuetext: says(at) })) svg.setAttribute(`aria-${name}`, value);
    svg.addEventListener("click", (event) => pick(order[placeOf(event)]));
    svg.addEventListener("keydown", (event) => {
      const to = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: n - 1 }[event.key];
      if (event.key === "Enter") pick(order[at]);
      else if (to === undefined) return;
      else at = clamp(to, n);
      // The player uses the same keys for steps.
      event.preventDefault();
      event.stopPropagation();
      svg.setAttribute("aria-valuenow", at + 1);
      svg.setAttribute("aria-valuetext", says(at));
      mark(at);
    });
  }
  const files = exports({ svg: () => svg, table: () => [["trial", "fitness"], ...order.map((trial) => [trial, fitness[trial]])], name: () => "trials" });
  const button = (name, trial) => element("button", { type: "button", id: `trial-${name}`, "aria-pressed": String(trial === shown), onclick: () => pick(trial) }, `${name} ${decimals(fitness[trial], 3)}`);
  return element("section", { className: "panel trials" },
    element("div", { className: "row" }, element("h2", {}, trials.is_judgement ? "Trials of the judgement" : "Trials of its generation"), readout, files, element("span", { className: "space" }),
      ...(pick ? [button("worst", worst), button("median", median), button("best", best)] : [])),
    svg,
    element("p", { className: "row muted small" }, element("span", {}, "worst"), element("span", { className: "space" }),
      element("span", {}, `line: mean${interval ? ", band: its 95 % interval" : ""}`), element("span", { className: "space" }), element("span", {}, "best")));
}

/** "this trial 0.81, judged 0.69 (0.66 to 0.72)": the shown trial beside the judged fitness. */
export function worthOf(trials) {
  if (!trials || trials.fitness.length < 2) return [];
  const { mean, interval, is_judgement: isJudgement, fitness } = trials;
  return [isJudgement ? ", judged " : ", mean ", element("b", {}, decimals(mean, 4)),
    interval ? ` (${decimals(interval[0], 4)} to ${decimals(interval[1], 4)}, ${fitness.length} trials)` : ` of ${fitness.length} trials`];
}
