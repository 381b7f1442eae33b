// Any individual, simulated when the page opens; and a changed simulation beside it.

import { element } from "swarm/dom.js";
import { controllerButton } from "swarm/controller.js";
import { unpack } from "swarm/episode.js";
import { laboratory } from "swarm/laboratory.js";
import { localSimulation } from "swarm/local-simulation.js";
import { ask, askJson, bar, complain, main, resolve } from "swarm/page.js";
import { readAddress } from "swarm/player.js";

const address = decodeURIComponent(location.pathname.slice("/replay/".length));
const [id, at] = address.split("@");
const where = `${encodeURIComponent(id)}${at ? `@${at}` : ""}`;
bar(`Replay ${address}`, "");

const exportButton = controllerButton(where);
const neighbours = element("p", { className: "row" }, element("a", { href: `/experiment/${id}` }, `experiment ${id}`), exportButton);
const loading = element("p", { className: "loading muted", role: "status" });
main.replaceChildren(neighbours, loading);

/** Links to the previous and the next individual, if they exist. */
function drawNeighbours({ population_size: n_individuals, generations_done: n_generations }) {
  if (!at?.includes("/") || at.endsWith("mean")) return;
  const [generation, individual] = at.split("/").map(Number);
  const link = (g, i, text) => (g >= 0 && g < n_generations && i >= 0 && i < n_individuals ? [element("a", { href: `/replay/${id}@${g}/${i}` }, text)] : []);
  exportButton.before(
    ...link(generation, individual - 1, "‹ individual"), ...link(generation, individual + 1, "individual ›"),
    ...link(generation - 1, individual, "‹ generation"), ...link(generation + 1, individual, "generation ›"),
    element("a", { href: `/replay/${id}` }, "champion"));
}

/** Changes in the query of the address. */
const place = {
  read: () => new URLSearchParams(location.search),
  write: (words) => history.replaceState(null, "", `${location.pathname}${words.size ? `?${words}` : ""}${location.hash}`),
};

let local = null;

/** The simulator of this browser, for changed episodes, so that no simulation waits for a server;
 *  null if it is absent. The server simulates the unchanged episode: it is there sooner. */
async function localFor(words) {
  if ([...words.keys()].every((name) => name === "judged")) return null;
  local ??= askJson(`/api/individual/${where}`).then(({ played, genotype }) => localSimulation(played, new Uint8Array(Float64Array.from(genotype).buffer)));
  // The next change asks again after a failure.
  local.catch(() => (local = null));
  return local;
}

async function start() {
  // After a click on an individual, the user wants to see it move; an address with a step
  // shows that step.
  const plays = location.hash === "" && !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const timer = setTimeout(() => (loading.textContent = "simulating its trials …"), 300);
  const answers = Promise.all([askJson(`/api/experiments/${id}`), askJson(`/api/trials/${where}`)]);
  const [experiment, trials] = await answers.finally(() => clearTimeout(timer));
  drawNeighbours(experiment.experiment);
  const played = trials.is_judgement ? { trial_set: "judgement" } : { trial_set: "generation", generation: trials.generation, trial: 0 };
  const simulate = async (words) => (await localFor(words))?.simulate(words) ?? unpack(await (await ask(`/api/replay/${where}?${words}`)).arrayBuffer());
  const fails = (error) => (error ? complain(error, "replay") : resolve("replay"));
  const shown = laboratory({ config: experiment.config, played, trials, simulate, place, fails });
  loading.replaceWith(...shown.nodes);
  addEventListener("hashchange", () => shown.first()?.goTo(readAddress()));
  await shown.start();
  if (plays) shown.first()?.clock.toggle();
}

start().catch((error) => complain(error, "replay"));
