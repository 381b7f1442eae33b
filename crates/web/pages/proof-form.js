// Chooses a bundle, proves it, and shows the proof.

import { element } from "swarm/dom.js";
import { THREADS, prove } from "swarm/proof.js";
import { loadSimulator } from "swarm/simulator.js";

const SAMPLES = [["5", "5 generations"], ["20", "20 generations"], ["all", "all generations"]];
const WITHOUT = "The program that serves this page was compiled without the simulator for browsers, which releases have. `swarmctl verify FILE` proves the same claims.";

/** The form. `known`: the file of this page, with name and bytes, if it has one. */
export function proofForm(known = null) {
  const simulator = loadSimulator();
  let running = null;
  const sample = element("select", { id: "sample" }, ...SAMPLES.map(([value, text]) => element("option", { value }, text)));
  const input = element("input", { type: "file", id: "file", accept: ".zip", onchange: () => input.files[0] && choose(input.files[0]) });
  const start = known && element("button", { type: "button", id: "start", className: "play", onclick: () => begin(known.name, known.bytes) }, `verify ${known.name}`);
  const cancel = element("button", { type: "button", id: "cancel", hidden: true, onclick: () => running.abort() }, "cancel");
  const bar = element("progress", { id: "progress", hidden: true });
  // Screen readers announce the end, not each generation.
  const status = element("p", { id: "status", className: "muted" });
  const result = element("div", { id: "proof", role: "status" });

  simulator.then((module) => {
    if (module) return;
    input.disabled = sample.disabled = true;
    result.replaceChildren(element("p", { className: "flaw", id: "without" }, WITHOUT));
    // `begin` shows a failure.
  }, () => {});

  const choose = (file) => begin(file.name, file.arrayBuffer().then((it) => new Uint8Array(it)));

  /** `content`: the bytes of the bundle, or their promise. */
  async function begin(name, content) {
    running?.abort();
    const mine = (running = new AbortController());
    result.replaceChildren();
    Object.assign(status, { textContent: `reading ${name} …` });
    cancel.hidden = bar.hidden = false;
    bar.removeAttribute("value");
    const started = performance.now();
    try {
      const [module, bytes] = await Promise.all([simulator, content]);
      if (!module) throw new Error(WITHOUT);
      mine.signal.throwIfAborted();
      const generations = sample.value === "all" ? null : Number(sample.value);
      const proof = await prove(module, { file: name, bytes, generations, signal: mine.signal, onProgress });
      const seconds = (performance.now() - started) / 1000;
      status.textContent = `${THREADS} ${THREADS === 1 ? "thread" : "threads"} of this browser took ${seconds.toFixed(1)} s. Nothing left this computer.`;
      show(proof);
    } catch (error) {
      if (mine !== running) return;
      status.textContent = mine.signal.aborted ? `cancelled; nothing is proven about ${name}` : "";
      if (!mine.signal.aborted) result.replaceChildren(element("p", { className: "flaw" }, element("b", {}, "not proven"), ` ${name}: ${error.message}`));
    } finally {
      if (mine === running) {
        cancel.hidden = bar.hidden = true;
        running = null;
      }
    }
  }

  function onProgress({ done, generations, what }) {
    Object.assign(bar, { max: generations, value: done });
    status.textContent = `generation ${done} of ${generations}${what ? `; ${what}` : ""}`;
  }

  function show(proof) {
    const [file, ...lines] = proof.split("\n");
    const rows = lines.map((line) => {
      const [, kind, text] = line.match(/^(\w+)\s+(.*)$/);
      return element("li", { className: kind }, element("b", {}, kind), element("span", {}, text));
    });
    const copied = element("span", { className: "muted", role: "status" });
    const copy = element("button", { type: "button", id: "copy", onclick: async () => {
      await navigator.clipboard.writeText(proof);
      copied.textContent = "copied";
    } }, "copy as text");
    result.replaceChildren(element("p", { className: "digest" }, file), element("ul", { className: "proof" }, ...rows), element("p", { className: "row" }, copy, copied));
  }

  const drop = element("section", { className: "panel drop" },
    element("p", { className: "row" }, start, element("label", {}, known ? "or another bundle " : "bundle ", input), element("label", {}, "simulate again ", sample), cancel),
    element("p", { className: "muted" }, known ? "This file contains the bundle and the simulator." : "Or drop a bundle here: the file that `swarmctl export` wrote."), bar, status);
  drop.addEventListener("dragover", (event) => event.preventDefault());
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) choose(event.dataTransfer.files[0]);
  });
  return element("div", {},
    element("h1", {}, "Verify a bundle"),
    element("p", { className: "muted" }, "This page repeats the evolution, link by link, and simulates the champion's judgement and some generations again, which the last link of the chain selects. Every bit must be the same. It computes in this browser, and uploads nothing."),
    drop, result);
}
