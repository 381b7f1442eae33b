// Plays an episode: the world, its controls, the robot that is followed, the timeline.

import { decimals, element } from "swarm/dom.js";
import { robotPanel } from "swarm/robot-panel.js";
import { timeline } from "swarm/timeline.js";
import { World } from "swarm/world.js";

/** Steps per second. */
const SPEEDS = [2, 5, 10, 20, 40, 80, 160, 320];

const HELP = [
  ["Space", "play, pause"], ["← →", "one step; with Shift, ten"], ["Home End", "first, last step"],
  ["↑ ↓", "faster, slower"], ["[ ]", "follow another robot"], ["Esc", "follow nobody"],
  ["T", "trails"], ["R", "who hears whom"], ["A", "reach of all radios"], ["N", "numbers"],
  ["W", "whole world, or the swarm"],
];

export class Player {
  /** `place`: where step and robot are remembered, such as the page's address. */
  constructor(episode, place = addressPlace()) {
    this.episode = episode;
    this.place = place;
    const { step = 0, robot = null } = place.read();
    this.view = {
      steps: episode.steps, step: clamp(step, episode.steps), share: 0,
      robot: robot !== null && robot < episode.n_robots ? robot : null,
      trails: true, radio: episode.has_radio, reach: false, numbers: true,
    };
    this.speed = SPEEDS.indexOf(20);
    this.isPlaying = false;
    this.seesWorld = false;
    /** Players that show the same step. */
    this.followers = [];
    this.build();
    this.redraw();
  }

  build() {
    const { episode, view } = this;
    const seek = (step) => this.seek(step);
    const choose = (robot) => this.choose(robot);
    this.world = new World(episode, view, choose);
    this.panel = robotPanel(episode, view, seek, choose);
    this.timeline = timeline(episode, view, seek);
    const button = (text, title, onclick, id = "") => element("button", { title, onclick, id, "aria-label": title }, text);
    this.playButton = button("▶", "play (Space)", () => this.toggle(), "play");
    this.slider = element("input", {
      type: "range", min: 0, max: episode.steps - 1, step: 1, id: "step-slider", "aria-label": "step",
      oninput: () => this.seek(Number(this.slider.value)),
    });
    this.stepText = element("output", { id: "step" });
    this.speedText = element("output", { id: "speed", title: "steps per second" });
    const toggle = (name, text, title) => {
      const box = element("input", { type: "checkbox", checked: view[name], id: `show-${name}`, onchange: () => this.show(name, box.checked) });
      this.boxes = { ...this.boxes, [name]: box };
      return element("label", { title }, box, text);
    };
    const controls = element("div", { className: "controls" },
      button("|◀", "first step (Home)", () => this.seek(0)),
      button("◀", "one step back (←)", () => this.step(-1), "back"),
      this.playButton,
      button("▶︎|", "one step on (→)", () => this.step(1), "forward"),
      this.slider, this.stepText,
      element("span", { className: "speed" },
        button("−", "slower (↓)", () => this.changeSpeed(-1)), this.speedText,
        button("+", "faster (↑)", () => this.changeSpeed(1))));
    const options = element("div", { className: "options" },
      toggle("trails", "trails", "where robots were in the last 60 steps (T)"),
      episode.has_radio ? toggle("radio", "who hears whom", "frames of the last steps; a colour per symbol (R)") : null,
      episode.has_radio ? toggle("reach", "reach", "how far each robot is heard (A)") : null,
      toggle("numbers", "numbers", "of robots and symbols (N)"),
      button("world", "whole world, or the swarm (W)", () => this.toggleWorld(), "camera"),
      element("span", { className: "space" }),
      this.legend(), this.help());
    this.node = element("div", { className: "player", tabIndex: 0 },
      element("div", { className: "stage" }, this.world.node, controls, options), this.panel.node, this.timeline.node);
    this.node.addEventListener("keydown", (event) => this.key(event));
    this.changeSpeed(0);
  }

  /** What the marks in the world mean. */
  legend() {
    const { episode } = this;
    const item = (className, text) => element("span", { className: "key" }, element("i", { className }), text);
    const has = (name) => episode.columns[name].values.some((value) => value > 0);
    return element("span", { className: "legend" },
      has("led") ? item("led-on", "LED on") : null,
      has("relays") ? item("relays", "relays") : null,
      has("carries") ? item("carries", "carries") : null,
      has("failed") ? item("failed", "failed") : null,
      episode.has_targets ? item("target", "should shine") : null);
  }

  help() {
    const rows = HELP.map(([keys, what]) => element("tr", {}, element("td", {}, element("kbd", {}, keys)), element("td", {}, what)));
    return element("details", { className: "help" }, element("summary", { title: "keys" }, "keys"), element("table", {}, ...rows));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.target.tagName === "INPUT" && event.target.type !== "range" && event.target.type !== "checkbox") return;
    const { n_robots, steps } = this.episode;
    const next = (by) => this.choose(((this.view.robot ?? (by > 0 ? -1 : n_robots)) + by + n_robots) % n_robots);
    const flip = (name) => this.boxes[name] && this.show(name, !this.view[name]);
    const actions = {
      " ": () => this.toggle(), ArrowLeft: () => this.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => this.step(event.shiftKey ? 10 : 1), Home: () => this.seek(0), End: () => this.seek(steps - 1),
      ArrowUp: () => this.changeSpeed(1), ArrowDown: () => this.changeSpeed(-1), "[": () => next(-1), "]": () => next(1),
      Escape: () => this.choose(null), t: () => flip("trails"), r: () => flip("radio"), a: () => flip("reach"),
      n: () => flip("numbers"), w: () => this.toggleWorld(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (event.key === " " && event.target.tagName === "BUTTON")) return;
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
    this.remember();
    this.redraw();
  }

  toggleWorld() {
    this.seesWorld = !this.seesWorld;
    if (this.seesWorld) this.world.camera.showWorld();
    else this.world.camera.showSwarm();
    this.redraw();
  }

  changeSpeed(by) {
    this.speed = clamp(this.speed + by, SPEEDS.length);
    this.speedText.textContent = `${SPEEDS[this.speed]}/s`;
  }

  step(by) {
    this.pause();
    this.seek(this.view.step + by);
  }

  seek(step) {
    this.view.step = clamp(step, this.episode.steps);
    this.view.share = 0;
    for (const follower of this.followers) follower.seek(this.view.step);
    if (!this.isPlaying) this.remember();
    this.redraw();
  }

  toggle() {
    if (this.isPlaying) return this.pause();
    if (this.view.step === this.episode.steps - 1) this.seek(0);
    this.isPlaying = true;
    this.playButton.textContent = "❚❚";
    let before = performance.now();
    const frame = (now) => {
      if (!this.isPlaying) return;
      this.advance(((now - before) / 1000) * SPEEDS[this.speed]);
      before = now;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /** Goes on by so many steps, which need not be whole. */
  advance(by) {
    const { steps } = this.episode;
    const at = Math.min(this.view.step + this.view.share + by, steps - 1);
    this.view.step = Math.floor(at);
    this.view.share = at - this.view.step;
    for (const follower of this.followers) follower.follow(this.view);
    if (at >= steps - 1) this.pause();
    else this.redraw();
  }

  /** Shows the moment of another player. */
  follow({ step, share }) {
    this.view.step = clamp(step, this.episode.steps);
    this.view.share = this.view.step === step ? share : 0;
    this.redraw();
  }

  pause() {
    this.isPlaying = false;
    this.playButton.textContent = "▶";
    this.view.share = 0;
    this.remember();
    this.redraw();
  }

  remember() {
    this.place.write({ step: this.view.step, robot: this.view.robot });
  }

  redraw() {
    this.slider.value = this.view.step;
    this.stepText.textContent = `step ${this.view.step} of ${this.episode.steps}`;
    this.world.node.redraw();
    this.panel.redraw();
    this.timeline.redraw();
  }
}

/** What an episode is, above it. */
export function heading(episode) {
  const worlds = episode.generation === null ? "worlds of evaluations" : `worlds of generation ${episode.generation}`;
  const measures = Object.entries(episode.measures).map(([name, mean]) => `${name.replaceAll("_", " ")} ${decimals(mean, 3)}`);
  return element("header", { className: "episode" },
    element("h1", {}, episode.name),
    element("p", { className: "muted" },
      `${episode.experiment}, ${episode.n_robots} robots, seed ${episode.seed}, ${worlds}, trial ${episode.trial}`),
    element("p", { id: "result" }, element("b", {}, `fitness ${decimals(episode.fitness, 4)}`), ` (${episode.fitness_function})`,
      element("span", { className: "muted" }, measures.length ? ` · ${measures.join(" · ")}` : "")));
}

/** Remembers step and robot after the # of the address. */
function addressPlace() {
  return {
    read() {
      const words = new URLSearchParams(location.hash.slice(1));
      const number = (name) => (/^\d+$/.test(words.get(name) ?? "") ? Number(words.get(name)) : undefined);
      return { step: number("step"), robot: number("robot") };
    },
    write({ step, robot }) {
      const words = new URLSearchParams({ step });
      if (robot !== null) words.set("robot", robot);
      history.replaceState(null, "", `#${words}`);
    },
  };
}

function clamp(value, n) {
  return Math.max(0, Math.min(n - 1, value));
}
