// The form of changes for a new simulation of a swarm. It offers the properties of its robots
// with their present values, and marks changes.

import { element } from "swarm/dom.js";

/** Numbers that can be changed: their names for people, and ranges. */
const NUMBERS = [
  ["robots", "robots", { min: 1, max: 10000 }],
  ["steps", "steps", { min: 1, max: 100000 }],
  ["seed", "seed", { min: 0 }],
  ["generation", "worlds of generation", { min: 0 }],
  ["trial", "trial of that generation", { min: 0, max: 999 }],
];
const PERTURBATIONS = [["leader_failure", "the leader fails", (robot) => "led_actuator" in robot.actuators], ["topology_switch", "robots get new places", () => true]];

/** The present values, from an experiment file. `played`: generation and trial of the episode. */
function today(config, played) {
  const robot = config.world.objects[config.algorithm.evolvable_object] ?? { perturbations: {}, actuators: {} };
  const isGeneration = played.trial_set === "generation";
  return {
    robot,
    values: { robots: robot.num_instances, steps: config.algorithm.evaluation_steps, seed: config.seed, generation: isGeneration ? played.generation : null, trial: isGeneration ? played.trial : null },
  };
}

/** The form. `config`: the experiment's file; `words`: the query of the address; `played`: the
 *  unchanged episode; `go(isBeside)`: simulates again. */
export function whatIf({ config, words, played, go }) {
  const { robot, values } = today(config, played);
  const inputs = {};
  const marks = {};
  const field = (name, text, input, note = null) => {
    inputs[name] = input;
    marks[name] = element("label", {}, text, input, note);
    return marks[name];
  };
  const numbers = NUMBERS.map(([name, text, range]) => {
    const known = values[name];
    const note = known === null ? null : element("span", { className: "muted was" }, `instead of ${known}`);
    return field(name, text, element("input", { type: "number", className: "number", id: `what-if-${name}`, ...range, value: words.get(name) ?? known ?? "", placeholder: known ?? "judged" }), note);
  });
  const choice = (name, text, options) => {
    const select = element("select", { id: `what-if-${name}` }, ...[["", "nothing"], ...options].map(([value, label]) => element("option", { value, selected: value === (words.get(name) ?? "") }, label)));
    return options.length ? field(name, text, select) : null;
  };
  const stimuli = Object.entries(config.topology?.stimuli ?? {});
  const readings = [...Map.groupBy(stimuli, ([, it]) => it.sensor)].map(([sensor, its]) => [sensor, its.map(([name]) => name).join(", ")]);
  const troubles = PERTURBATIONS.filter(([name, , has]) => has(robot) && !robot.perturbations[name]).map(([name, text]) => [name, text]);
  const reset = element("button", { type: "button", id: "reset", title: "reset to the original", onclick: () => {
    for (const [name, input] of Object.entries(inputs)) input.value = values[name] ?? "";
    drawMarks();
    go(false);
  } }, "Reset");
  const node = element("form", { className: "panel what-if" }, element("b", {}, "What if"),
    ...numbers, choice("inhibit", "nobody gets", readings), choice("perturb", "trouble", troubles),
    element("button", { type: "submit", id: "again" }, "Simulate"),
    element("button", { type: "button", id: "beside", title: "the one above, and the changed one next to it", onclick: () => go(true) }, "Side by side"), reset);
  const isChanged = (name) => inputs[name].value.trim() !== String(values[name] ?? "");
  const drawMarks = () => {
    for (const name of Object.keys(inputs)) marks[name].classList.toggle("changed", isChanged(name));
    reset.hidden = !Object.keys(inputs).some(isChanged);
  };
  node.addEventListener("input", drawMarks);
  node.addEventListener("submit", (event) => {
    event.preventDefault();
    go(false);
  });
  drawMarks();

  return {
    node,
    /** The changes, as the query of an address. */
    query: () => new URLSearchParams(Object.keys(inputs).filter(isChanged).map((name) => [name, inputs[name].value.trim()]).filter(([, value]) => value !== "")),
  };
}

/** The changes in the query of an address, for people: "9 robots, no robot gets message". */
export function changesOf(words, config) {
  const texts = {
    robots: (it) => `${it} robots`, steps: (it) => `${it} steps`, seed: (it) => `seed ${it}`, generation: (it) => `worlds of generation ${it}`,
    inhibit: (it) => `no robot gets ${Object.entries(config.topology?.stimuli ?? {}).filter(([, its]) => its.sensor === it).map(([name]) => name).join(", ") || it}`,
    perturb: (it) => PERTURBATIONS.find(([name]) => name === it)?.[1] ?? it,
  };
  return [...words].filter(([name]) => texts[name]).map(([name, value]) => texts[name](value));
}
