// The workers and their work.

import { decimals, element } from "swarm/dom.js";
import { whatItDoes } from "swarm/doing.js";
import { followExperiments } from "swarm/experiment-list.js";
import { fleetTimeline } from "swarm/fleet-timeline.js";
import { askJson, bar, complain, counted, main, resolve, span } from "swarm/page.js";

/** Time between two requests, ms. */
const LOOK_EVERY = 2000;
/** Maximum number of explained experiments. */
const EXPLAINED_MAX = 6;

bar("Fleet", "/fleet");
const summary = element("p", { className: "muted" });
const rows = element("tbody");
const heading = ["Worker", "Slots", "Items", "Results/s", "Idle", "Last heard", "Connected", "Version", ""];
const timeline = fleetTimeline();
const work = element("div", { className: "columns" });
main.replaceChildren(element("h1", {}, "Fleet"), summary, timeline, work,
  element("div", { className: "panel scroll" }, element("table", { className: "list" },
    element("thead", {}, element("tr", {}, ...heading.map((name) => element("th", {}, name)))), rows)));

function row(it) {
  const ago = (ms) => span(Math.max(0, Date.now() - ms));
  const cell = (label, ...content) => element("td", { "data-label": label }, ...content);
  const idle = element("meter", { min: 0, max: 1, value: it.idle_share, title: `${Math.round(100 * it.idle_share)} %` });
  return element("tr", { "data-id": it.id },
    cell("", element("b", {}, it.name)), cell("Slots", String(it.slots)), cell("Items", String(it.items)),
    cell("Results/s", decimals(it.results_per_second, 1)), cell("Idle", idle, ` ${Math.round(100 * it.idle_share)} %`),
    cell("Last heard", `${ago(it.last_heard_at_ms)} ago`), cell("Connected", ago(it.connected_at_ms)),
    cell("Version", it.version), cell("", element("span", { className: "bad" }, it.trouble)));
}

/** The running experiments, and the panels of some of them, by id. */
let running = [];
const panels = new Map();
const more = element("p", { className: "muted" });

/** The activity of each unfinished experiment, and the reason why it waits. */
async function explain() {
  const its = running.slice(0, EXPLAINED_MAX);
  for (const id of panels.keys()) if (!its.some((it) => it.id === id)) panels.delete(id);
  await Promise.all(its.map(async (it) => {
    const answer = await askJson(`/api/experiments/${it.id}/explain`);
    const text = element("div");
    const panel = panels.get(it.id) ?? { text, node: element("section", { className: "panel" }, element("h2", {}, element("a", { href: `/experiment/${it.id}` }, `${it.id} ${it.name}`)), text) };
    panels.set(it.id, panel);
    panel.text.replaceChildren(...whatItDoes(answer));
  }));
  more.textContent = running.length > its.length ? `${running.length - its.length} more experiments run` : "";
  const wanted = [...[...panels.values()].map((panel) => panel.node), more];
  if (wanted.some((node, place) => work.children[place] !== node)) work.replaceChildren(...wanted);
}

async function look() {
  try {
    const { workers } = await askJson("/api/workers");
    const slots = workers.reduce((sum, it) => sum + it.slots, 0);
    const rate = workers.reduce((sum, it) => sum + it.results_per_second, 0);
    summary.textContent = workers.length
      ? `${counted(workers.length, "worker")} with ${counted(slots, "slot")}, ${decimals(rate, 1)} results per second`
      : "No worker is connected: start one with `worker`.";
    rows.replaceChildren(...workers.slice(0, 1000).map(row));
    timeline.show(await askJson("/api/timeline"), workers);
    await explain();
    resolve("look");
  } catch (error) {
    complain(error, "look");
  }
  // The next request starts when this one has ended, so a slow server gets fewer requests.
  setTimeout(look, document.hidden ? 5 * LOOK_EVERY : LOOK_EVERY);
}

await followExperiments((experiments) => (running = [...experiments.values()].filter((it) => it.state === "running")));
await look();
