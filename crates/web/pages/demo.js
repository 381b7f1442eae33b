// The fleet in a page: the coordinator's engine with workers that the visitor treats badly, beside
// the same run on a fleet that nobody disturbs.

import { element } from "swarm/dom.js";
import { digests } from "swarm/demo-digests.js";
import { Items } from "swarm/demo-items.js";
import { stage } from "swarm/demo-stage.js";
import { Words } from "swarm/demo-words.js";
import { Thread, loadSimulator } from "swarm/simulator.js";

const WITHOUT = "The program that made this page was compiled without the simulator for browsers, which releases have.";
/** What a click on a worker does: the state of its machine, the word on the tool, and what it is. */
const TOOLS = [
  ["killed", "Kill", "the process ends"],
  ["hung", "Hang", "the process stops, and says nothing"],
  ["slow", "Slow down", "everything takes four times as long"],
  ["lying", "Make lie", "results are wrong in the ninth decimal"],
  ["healthy", "Mend", "as on the first day"],
];
const SPEEDS = [0.5, 1, 2, 4, 8, 16];
const AUDITS = [["1", "every result"], ["0.1", "one in ten results"], ["0", "no result"]];
/** The module is this far ahead of the picture, ms of the visitor. */
const AHEAD = 160;
/** Time of the fleet between two random faults, ms. */
const CHAOS_EVERY = 1200;

/** The page's content. */
export function demo() {
  const node = element("div", { className: "demo" });
  node.append(element("h1", {}, "Break this fleet"),
    element("p", { className: "lead" }, "Twenty workers evolve a robot swarm. Choose a fault and click workers: the coordinator must notice, and the result must stay the same, bit for bit."));
  loadSimulator().then((module) => {
    if (!module) return node.append(element("p", { className: "flaw", id: "without" }, WITHOUT));
    let thread = null;
    const place = element("div");
    node.append(place);
    const begin = async (audits) => {
      thread?.end();
      const mine = (thread = new Thread(module));
      // What is still shown has ended: a click on it would be lost.
      const focused = document.activeElement?.id;
      place.inert = true;
      try {
        const { header } = await mine.call({ call: "begin-fleets", audits: Number(audits) });
        if (mine !== thread) return;
        place.replaceChildren(...show(mine, header, audits, begin));
        place.inert = false;
        if (focused) document.getElementById(focused)?.focus();
      } catch (error) {
        if (mine !== thread) return;
        place.replaceChildren(element("p", { className: "flaw" }, error.message));
        place.inert = false;
      }
    };
    begin(AUDITS[0][0]);
  }).catch((error) => node.append(element("p", { className: "flaw" }, error.message)));
  return node;
}

/** The fleet of a thread that has begun. `begin(audits)` begins another one. */
function show(thread, begun, audits, begin) {
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const { workers: names, generations } = begun;
  let report = begun.report;
  let tool = TOOLS[0][0];
  let speed = 2;
  let isPlaying = true;
  let isBusy = false;
  let shown = 0;
  let chaosAt = Infinity;
  let before = performance.now();
  const items = new Items();
  const words = new Words(names, generations);
  const two = digests(generations);
  const floor = stage(names, generations, (worker) => treat(worker, tool));

  const play = element("button", { type: "button", id: "play", className: "play", onclick: () => setPlaying(!isPlaying) });
  const setPlaying = (on) => {
    isPlaying = on;
    play.textContent = on ? "❚❚ pause" : "▶ go on";
  };
  const pace = element("output", { id: "pace", className: "pace" });
  const slider = element("input", { type: "range", id: "speed", min: 0, max: SPEEDS.length - 1, step: 1, value: SPEEDS.indexOf(speed), "aria-label": "speed", oninput: () => setSpeed(SPEEDS[slider.value]) });
  const setSpeed = (times) => {
    speed = times;
    pace.textContent = `${times}×`;
    slider.setAttribute("aria-valuetext", `${times} times as fast`);
  };
  const radio = ([health, word, what], i) => element("label", { title: what, className: `tool ${health}` },
    element("input", { type: "radio", name: "tool", value: health, checked: health === tool, onchange: () => choose(health) }),
    element("span", {}, word), element("kbd", { "aria-hidden": "true" }, String(i + 1)));
  const tools = element("fieldset", { className: "tools" }, element("legend", {}, "A click on a worker:"), ...TOOLS.map(radio));
  const choose = (health) => {
    tool = health;
    tools.querySelector(`[value=${health}]`).checked = true;
    floor.setTool(TOOLS.find(([name]) => name === health)[1]);
  };
  const chaos = element("button", { type: "button", id: "chaos", "aria-pressed": "false", title: "a random fault again and again", onclick: () => {
    const on = chaos.getAttribute("aria-pressed") !== "true";
    chaos.setAttribute("aria-pressed", String(on));
    chaosAt = on ? report.now : Infinity;
  } }, "Chaos");
  const mend = element("button", { type: "button", id: "mend", onclick: () => names.forEach((_, i) => report.workers[i].health !== "healthy" && treat(i, "healthy")) }, "Mend all");
  const again = element("button", { type: "button", id: "again", onclick: () => begin(choice.value) }, "Start over");
  const choice = element("select", { id: "audits", onchange: () => begin(choice.value) }, ...AUDITS.map(([value, text]) => element("option", { value, selected: value === audits }, text)));
  const status = element("p", { id: "status", className: "muted", role: "status" });
  const log = element("ol", { id: "log", className: "events", tabindex: "0", "aria-label": "what happens" });

  const calls = [];
  async function request(header) {
    try {
      take((await thread.call(header)).header);
    } catch (error) {
      isPlaying = false;
      status.replaceChildren(element("span", { className: "bad" }, error.message));
    }
  }

  function treat(worker, health) {
    const was = report.workers[worker];
    if (was.health === health && !was.quarantined) return;
    const text = words.treated(worker, health, was);
    status.textContent = text;
    write(report.now, text, health === "healthy" ? "good" : "mine");
    if (health === "killed") items.lose(worker);
    calls.push({ call: "treat", worker, health });
  }

  function take(next) {
    report = next;
    items.expect(next.events);
    floor.show(next);
    two.show(next);
    for (const [at, text, kind] of words.of(next)) write(at, text, kind);
    node.dataset.generations = next.disturbed.links.length;
    node.dataset.over = next.disturbed.over_at !== null;
  }

  function write(at, text, kind) {
    log.prepend(element("li", { className: kind }, element("time", { className: "muted" }, `${(at / 1000).toFixed(1)} s`), " ", text));
    while (log.children.length > 200) log.lastChild.remove();
  }

  /** Keeps the module a little ahead of the picture. */
  async function compute() {
    if (isBusy) return;
    isBusy = true;
    while (calls.length) await request(calls.shift());
    const missing = shown + AHEAD * speed - report.now;
    const isOver = report.disturbed.over_at !== null && report.undisturbed.over_at !== null;
    if (isPlaying && missing > 0 && !isOver) {
      if (report.now >= chaosAt) {
        chaosAt = report.now + CHAOS_EVERY;
        const worker = Math.floor(Math.random() * names.length);
        const fault = Math.floor(Math.random() * 4);
        treat(worker, report.workers[worker].health === "healthy" ? TOOLS[fault][0] : "healthy");
      }
      await request({ call: "advance", ms: Math.min(missing, 250 * speed) });
    }
    isBusy = false;
  }

  function frame(now) {
    if (!node.isConnected) return;
    requestAnimationFrame(frame);
    const passed = Math.min(100, now - before);
    before = now;
    if (isPlaying) shown = Math.min(report.now, shown + passed * speed);
    items.advance(shown);
    floor.draw(items, shown, still.matches);
    compute();
  }

  const node = element("div", { className: "demo-parts" },
    element("div", { className: "row demo-bar" }, play, element("label", { className: "speed" }, "speed", slider, pace), tools,
      element("div", { className: "row" }, chaos, mend)),
    two.node, floor.node, status,
    element("div", { className: "columns" },
      element("section", { className: "panel" }, element("h2", {}, "What happens"), log),
      element("section", { className: "panel" }, element("h2", {}, "What you see"), ...explained(), element("p", { className: "row" }, element("label", {}, "A second worker audits ", choice), again))));
  node.addEventListener("keydown", (event) => {
    const found = TOOLS[Number(event.key) - 1];
    if (found && !event.ctrlKey && !event.metaKey && !event.altKey) choose(found[0]);
  });
  setPlaying(true);
  setSpeed(speed);
  choose(tool);
  take(report);
  queueMicrotask(() => requestAnimationFrame(frame));
  return [node];
}

function explained() {
  const key = (className, text) => element("span", { className: "key" }, element("i", { className }), text);
  return [
    element("p", { className: "row small" }, key("work", "an item: a network and its trials"), key("copy", "a copy, since the first worker may be slow"), key("audit", "an audit of a known result"), key("result", "a result"), key("lie", "a lie, as only you know")),
    element("ul", { className: "rules" },
      element("li", {}, element("b", {}, "Kill. "), "The items of a killed worker go to others."),
      element("li", {}, element("b", {}, "Hang. "), "Others get copies of late items, and after 10 s of silence the worker is given up."),
      element("li", {}, element("b", {}, "Slow down. "), "The worker that would finish an item first gets it, so slow workers get less. Near the end of a generation, items are split."),
      element("li", {}, element("b", {}, "Make lie. "), "A second worker audits each result. If a bit differs, the referee computes the trial itself. The liar is in quarantine, and its results no longer count. Without audits, nobody notices a lie, and the digest changes: try it.")),
    element("p", {}, "The engine is the coordinator's own, with the same evolution and the same simulator, compiled for browsers. Only time and network are simulated: trials take longer than in truth, so that you can watch. The fitness is real, so the run ends with the digest of ", element("code", {}, "swarmctl run --example quickstart"), "."),
  ];
}
