// Plays an episode: the world, its controls, the followed robot, the timeline.

import { Clock } from "swarm/clock.js";
import { decimals, element } from "swarm/dom.js";
import { recordButton } from "swarm/recording.js";
import { robotPanel } from "swarm/robot-panel.js";
import { clamp } from "swarm/scales.js";
import { timeline } from "swarm/timeline.js";
import { worthOf } from "swarm/trials.js";
import { World } from "swarm/world.js";

const HELP = [
  ["Space", "play, pause"], ["← →", "one step; with Shift, ten"], ["Home End", "first, last step"],
  ["↑ ↓", "faster, slower"], ["[ ]", "follow another robot"], ["Esc", "follow nobody"],
  ["T", "trails"], ["R", "who hears whom"], ["A", "reach of all radios"], ["N", "numbers"],
  ["W", "whole world, or the swarm"],
];

/** The player that receives keys: the last one that the user touched. */
let active = null;
document.addEventListener("keydown", (event) => {
  if (active?.node.isConnected) active.key(event);
});

export class Player {
  /** `place`: the store of step and robot, such as the page's address. `clock`: the clock of the
   *  player beside this one. `suffix`: distinguishes its ids from those of the other player.
   *  `chosen(robot)`: hears of the followed robot. */
  constructor(episode, { place = addressPlace(), clock = null, suffix = "", chosen = () => {} } = {}) {
    this.episode = episode;
    this.chosen = chosen;
    this.place = place;
    this.suffix = suffix;
    const { step = 0, robot = null } = place.read();
    this.clock = clock ?? new Clock(step);
    this.view = {
      steps: episode.steps, step: 0, share: 0, robot: this.known(robot),
      trails: true, radio: episode.has_radio, reach: false, numbers: true,
    };
    this.seesWorld = false;
    this.build();
    this.clock.join(this, episode.steps);
    this.tick();
    if (!active?.node.isConnected) active = this;
  }

  /** A robot's number, if the robot exists. */
  known(robot) {
    return robot !== null && robot !== undefined && robot < this.episode.n_robots ? robot : null;
  }

  build() {
    const { episode, view, clock, suffix } = this;
    const seek = (step) => clock.seek(step);
    const choose = (robot) => this.choose(robot);
    const id = (name) => (name ? name + suffix : "");
    this.world = new World(episode, view, choose);
    // Two players have parts of different names.
    const label = (name) => (suffix ? `${name}, changed` : name);
    this.panel = robotPanel(episode, view, seek, choose, id, label("the followed robot"));
    this.timeline = timeline(episode, view, seek, label("over all steps"));
    const button = (text, title, onclick, name = "") => element("button", { type: "button", title, onclick, id: id(name), className: name, "aria-label": title }, text);
    this.playButton = button("▶", "play (Space)", () => clock.toggle(), "play");
    this.slider = element("input", {
      type: "range", min: 0, max: episode.steps - 1, step: 1, id: id("step-slider"), "aria-label": "step",
      oninput: () => clock.seek(Number(this.slider.value)),
    });
    // Not an <output>: a screen reader would read out twenty numbers a second.
    this.stepText = element("span", { id: id("step"), className: "step" });
    this.speedText = element("span", { id: id("speed"), className: "pace", title: "steps per second" });
    const toggle = (name, text, title) => {
      const box = element("input", { type: "checkbox", checked: view[name], id: id(`show-${name}`), onchange: () => this.show(name, box.checked) });
      this.boxes = { ...this.boxes, [name]: box };
      return element("label", { title }, box, text);
    };
    const controls = element("div", { className: "controls" },
      button("|◀", "first step (Home)", () => clock.seek(0)),
      button("◀", "one step back (←)", () => this.step(-1), "back"),
      this.playButton,
      button("▶︎|", "one step on (→)", () => this.step(1), "forward"),
      this.slider, this.stepText,
      element("span", { className: "speed" },
        button("−", "slower (↓)", () => clock.changeSpeed(-1)), this.speedText,
        button("+", "faster (↑)", () => clock.changeSpeed(1))));
    this.recordButton = recordButton(this.world.node, clock, { id: id("record"), className: "record" });
    const options = element("div", { className: "options" },
      toggle("trails", "trails", "trails of the last 60 steps (T)"),
      episode.has_radio ? toggle("radio", "who hears whom", "frames of the last steps; a colour per symbol (R)") : null,
      episode.has_radio ? toggle("reach", "reach", "radio reach of each robot (A)") : null,
      toggle("numbers", "numbers", "of robots and symbols (N)"),
      button("world", "whole world, or the swarm (W)", () => this.toggleWorld(), "camera"),
      this.recordButton,
      element("span", { className: "space" }),
      this.legend(), this.help());
    this.node = element("div", { className: "player", tabIndex: 0, role: "group", "aria-label": label(episode.name) },
      element("div", { className: "stage" }, this.world.node, controls, options), this.panel.node, this.timeline.node);
    for (const kind of ["pointerdown", "focusin"]) this.node.addEventListener(kind, () => (active = this));
  }

  /** The legend of the marks in the world. */
  legend() {
    const { episode } = this;
    const item = (className, text) => element("span", { className: "key" }, element("i", { className }), text);
    const has = (name) => episode.columns[name].values.some((value) => value > 0);
    return element("span", { className: "legend" },
      has("led") ? item("led-on", "LED on") : null,
      has("relays") ? item("relays", "relays") : null,
      has("carries") ? item("carries", "carries") : null,
      has("failed") ? item("failed", "failed") : null,
      episode.has_targets ? item("target", "should shine") : null,
      ...this.places("areas", "sees_areas"), ...this.places("lights", "sees_lights"));
  }

  /** The areas and lights. If some robots have a sensor for them, and others have none, also the names of those that have. */
  places(name, sees) {
    const { robots } = this.episode;
    const seeing = robots.filter((it) => it[sees]).map((it) => it.name);
    const who = [0, robots.length].includes(seeing.length) ? "" : `, seen by ${seeing.join(", ")}`;
    const kinds = Map.groupBy(this.episode[name], (it) => `${it.name} ${it.color}`);
    return [...kinds.values()].map((its) => {
      const mark = element("i", { className: name });
      mark.style.setProperty("--place", its[0].color);
      return element("span", { className: "key place" }, mark, `${its[0].name}${its.length > 1 ? ` (${its.length})` : ""}${who}`);
    });
  }

  help() {
    const rows = HELP.map(([keys, what]) => element("tr", {}, element("td", {}, element("kbd", {}, keys)), element("td", {}, what)));
    return element("details", { className: "help" }, element("summary", { title: "keys" }, "keys"), element("table", {}, ...rows));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented || isTyped(event)) return;
    const { n_robots } = this.episode;
    const { clock } = this;
    const next = (by) => this.choose(((this.view.robot ?? (by > 0 ? -1 : n_robots)) + by + n_robots) % n_robots);
    const flip = (name) => this.boxes[name] && this.show(name, !this.view[name]);
    const actions = {
      " ": () => clock.toggle(), ArrowLeft: () => this.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => this.step(event.shiftKey ? 10 : 1), Home: () => clock.seek(0), End: () => clock.seek(clock.steps - 1),
      ArrowUp: () => clock.changeSpeed(1), ArrowDown: () => clock.changeSpeed(-1), "[": () => next(-1), "]": () => next(1),
      Escape: () => this.choose(null), t: () => flip("trails"), r: () => flip("radio"), a: () => flip("reach"),
      n: () => flip("numbers"), w: () => this.toggleWorld(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  show(name, isShown) {
    this.view[name] = isShown;
    this.boxes[name].checked = isShown;
    this.redraw();
  }

  choose(robot) {
    this.view.robot = robot;
    this.chosen(robot);
    this.remember();
    this.redraw();
  }

  toggleWorld() {
    this.seesWorld = !this.seesWorld;
    if (this.seesWorld) this.world.camera.showWorld();
    else this.world.camera.showSwarm();
    this.redraw();
  }

  step(by) {
    this.clock.pause();
    this.clock.seek(this.clock.step + by);
  }

  /** Shows the moment of the clock, or the last one if the episode is over by then. */
  tick() {
    const { clock, view, playButton } = this;
    view.step = clamp(clock.step, this.episode.steps);
    view.share = view.step === clock.step && view.step < this.episode.steps - 1 ? clock.share : 0;
    const [sign, title] = clock.isPlaying ? ["❚❚", "pause (Space)"] : ["▶", "play (Space)"];
    if (playButton.title !== title) {
      Object.assign(playButton, { textContent: sign, title });
      playButton.setAttribute("aria-label", title);
    }
    // Setting a text again lays it out again, which takes longer than drawing a frame.
    const speed = `${clock.speed}/s`;
    if (this.speedText.textContent !== speed) this.speedText.textContent = speed;
    this.recordButton?.update();
    if (!clock.isPlaying) this.remember();
    this.redraw();
  }

  /** Follows the address after the user has changed it. */
  goTo({ step, robot }) {
    this.view.robot = this.known(robot);
    if (step !== undefined) this.clock.seek(step);
    else this.redraw();
  }

  remember() {
    this.place.write({ step: this.view.step, robot: this.view.robot });
  }

  redraw() {
    const { steps } = this.episode;
    const { step, robot } = this.view;
    this.world.node.redraw();
    // Between two steps only the world moves.
    if (this.drawn?.step === step && this.drawn.robot === robot) return;
    this.drawn = { step, robot };
    this.slider.value = step;
    this.stepText.textContent = `step ${step} of ${steps - 1}`;
    this.panel.redraw();
    this.timeline.redraw();
  }
}

/** Whether a key belongs to the focused element: a text field, or a button that Space presses. */
function isTyped({ target, key }) {
  const field = target.closest?.("input, select, textarea, [contenteditable]");
  if (field && !["range", "checkbox"].includes(field.type)) return true;
  return key === " " && target.closest?.("button, summary, a, input[type=checkbox]") !== null;
}

/** The worlds of an episode, for people. */
function worlds({ trial_set: set, generation, trial }) {
  const names = { judgement: `trial ${trial} of its judgement`, "held-out": `held-out trial ${trial} after generation ${generation}`, evaluation: `trial ${trial} of evaluations` };
  return names[set] ?? `trial ${trial} of generation ${generation}`;
}

/** The heading of an episode. `suffix`: that of its player; `trials`: the trials that define the
 *  individual's fitness; `changes`: the differences from its evolution. */
export function heading(episode, { suffix = "", trials = null, changes = [] } = {}) {
  const measures = Object.entries(episode.measures).map(([name, mean]) => `${name.replaceAll("_", " ")} ${decimals(mean, 3)}`);
  return element("header", { className: "episode" },
    element("h1", {}, episode.name, ...changes.map((text) => element("span", { className: "change" }, text))),
    element("p", { className: "muted" }, `${episode.experiment}, ${episode.n_robots} robots, seed ${episode.seed}, ${worlds(episode)}`),
    element("p", { id: `result${suffix}` }, element("b", {}, `this trial ${decimals(episode.fitness, 4)}`), ...worthOf(trials),
      element("span", { className: "muted" }, ` · ${episode.fitness_function}${measures.length ? ` · ${measures.join(" · ")}` : ""}`)));
}

/** Step and robot after the # of an address. */
export function readAddress() {
  const words = new URLSearchParams(location.hash.slice(1));
  const number = (name) => (/^\d+$/.test(words.get(name) ?? "") ? Number(words.get(name)) : undefined);
  return { step: number("step"), robot: number("robot") };
}

/** Remembers step and robot after the # of the address, and leaves other words there alone. */
function addressPlace() {
  let written = location.hash;
  return {
    read: readAddress,
    write({ step, robot }) {
      const words = new URLSearchParams(location.hash.slice(1));
      words.set("step", step);
      words.delete("robot");
      if (robot !== null) words.set("robot", robot);
      // Browsers limit the number of changes of an address per second.
      if (`#${words}` === written) return;
      written = `#${words}`;
      history.replaceState(history.state, "", written);
    },
  };
}

/** A player without a place in the address. */
export const NOWHERE = { read: () => ({}), write: () => {} };
