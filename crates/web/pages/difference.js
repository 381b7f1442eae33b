// What changes and interventions did to an episode, in words and measures.

import { decimals, element } from "swarm/dom.js";
import { nameOf } from "swarm/interventions.js";
import { shortest } from "swarm/episode.js";

/** Distance from which a robot counts as elsewhere, cm. */
const ELSEWHERE = 5;
const ACTIONS = ["x", "y", "heading", "led", "relays"];

/** The first step in which a robot does something else, and the robot; null if none does. */
function firstOther(before, after, without) {
  let first = null;
  for (let robot = 0; robot < before.n_robots; robot++) {
    if (without.has(robot)) continue;
    for (const name of ACTIONS) {
      const [old, other] = [before.row(name, robot), after.row(name, robot)];
      const step = old.findIndex((value, i) => value !== other[i]);
      if (step >= 0 && (first === null || step < first.step)) first = { step, robot };
    }
  }
  return first;
}

/** A number beside the one before, such as "0.71 instead of 0.83". */
function instead(name, before, after) {
  if (decimals(before, 3) === decimals(after, 3)) return null;
  return element("span", { className: "measure" }, `${name} `, element("b", {}, decimals(after, 3)), element("span", { className: "muted" }, ` instead of ${decimals(before, 3)}`));
}

const capital = (text) => text[0].toUpperCase() + text.slice(1);

/** A panel. `before` and `after`: episodes; `interventions`: their list. */
export function difference(before, after, interventions) {
  const sentences = [];
  const isSameSwarm = before.n_robots === after.n_robots && before.steps === after.steps && before.trial === after.trial && before.generation === after.generation && before.seed === after.seed;
  if (isSameSwarm) {
    const touched = new Set(interventions.filter((it) => it.kind === "robot").map((it) => it.number));
    const first = firstOther(before, after, touched);
    const others = touched.size > 0 && touched.size < before.n_robots ? "other robots" : "robots";
    if (first === null) sentences.push(`All ${others} act exactly as before.`);
    else {
      const last = before.steps - 1;
      const away = Array.from({ length: before.n_robots }, (_, robot) => {
        const [a, b] = [before.pose(robot, last), after.pose(robot, last)];
        return Math.hypot(shortest(a.x - b.x, before.periodX), shortest(a.y - b.y, before.periodY));
      });
      const n = away.filter((it) => it > ELSEWHERE).length;
      sentences.push(`The first ${others} that does something else is robot ${first.robot}, in step ${first.step}.`,
        n === 0 ? "At the end, all robots are where they were before." : `At the end, ${n} of ${before.n_robots} robots are elsewhere, by ${decimals(away.reduce((sum, it) => sum + it, 0) / before.n_robots, 0)} cm in the mean.`);
    }
  }
  const measures = Object.keys(before.measures).map((name) => instead(name.replaceAll("_", " "), before.measures[name], after.measures[name] ?? NaN));
  const numbers = [instead("fitness of this trial", before.fitness, after.fitness), ...measures].filter((it) => it !== null);
  if (numbers.length === 0) sentences.push("Fitness and measures are the same.");
  return element("section", { className: "panel difference", id: "difference", role: "status" }, element("h2", {}, "What changed"),
    ...(interventions.length ? [element("p", {}, `${capital(interventions.map(nameOf).join("; "))}.`)] : []),
    element("p", {}, sentences.join(" ")), element("p", { className: "row" }, ...numbers));
}
