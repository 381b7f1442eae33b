// Any individual, simulated when the page opens; and a changed simulation beside it.

import { element } from "swarm/dom.js";
import { controllerButton } from "swarm/controller.js";
import { unpack } from "swarm/episode.js";
import { ask, askJson, bar, complain, main, resolve } from "swarm/page.js";
import { NOWHERE, Player, heading, readAddress } from "swarm/player.js";
import { trialStrip } from "swarm/trials.js";
import { changesOf, whatIf } from "swarm/what-if.js";

const address = decodeURIComponent(location.pathname.slice("/replay/".length));
const [id, at] = address.split("@");
const where = `${encodeURIComponent(id)}${at ? `@${at}` : ""}`;
bar(`Replay ${address}`, "");

const exportButton = controllerButton(where);
const neighbours = element("p", { className: "row" }, element("a", { href: `/experiment/${id}` }, `experiment ${id}`), exportButton);
const loading = element("p", { className: "loading muted", role: "status" });
const stage = element("div", { className: "replays" });
const strip = element("div");
const formPlace = element("div");
main.replaceChildren(neighbours, loading, stage, strip, formPlace);

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

/** Shows the reason of a wait that takes longer than a moment. */
async function waitingFor(text, work) {
  const timer = setTimeout(() => (loading.textContent = text), 300);
  try {
    return await work;
  } finally {
    clearTimeout(timer);
    loading.textContent = "";
  }
}

async function simulated(words) {
  const response = await ask(`/api/replay/${where}?${words}`);
  return unpack(await response.arrayBuffer());
}

/** The shown players, with one clock. */
let players = [];
/** Counts requests: only the latest answer is shown. */
let asked = 0;
let config = null;
let trials = null;
let form = null;
/** The played trial of the judgement; null: the default one. */
let judged = new URLSearchParams(location.search).get("judged");

/** The query that chooses a world: of the judgement, unless a generation is named. */
function withWorld(words) {
  if (judged === null || words.has("generation") || words.has("trial")) return words;
  return new URLSearchParams([["judged", judged], ...words]);
}

/** Shows the episode of the address: the changed one, or the original with the changed one beside it. */
async function show(words, isBeside) {
  const mine = ++asked;
  stage.setAttribute("aria-busy", "true");
  try {
    const wanted = isBeside ? [withWorld(new URLSearchParams()), words] : [words];
    const episodes = await waitingFor("simulating …", Promise.all(wanted.map(simulated)));
    if (mine !== asked) return;
    const old = players[0];
    old?.clock.pause();
    const first = new Player(episodes[0]);
    const others = episodes.slice(1).map((episode) => new Player(episode, { place: NOWHERE, clock: first.clock, suffix: "-beside" }));
    players = [first, ...others];
    const changes = wanted.map((words) => changesOf(words, config));
    stage.replaceChildren(...players.map((player, i) => element("div", {}, heading(player.episode, { suffix: player.suffix, trials, changes: changes[i] }), player.node)));
    stage.classList.toggle("two", isBeside);
    drawStrip(episodes[0]);
    // The user may still be filling in the form: leave it alone.
    if (!form?.node.contains(document.activeElement)) first.node.focus({ preventScroll: true });
    resolve("replay");
  } catch (error) {
    if (mine === asked) complain(error, "replay");
  }
  if (mine === asked) stage.removeAttribute("aria-busy");
}

/** The trials to pick from, if there are several. */
function drawStrip(episode) {
  if (!trials || trials.fitness.length < 2) return;
  const isOneOfThem = episode.trial_set === (trials.is_judgement ? "judgement" : "generation") && episode.generation === trials.generation;
  strip.replaceChildren(trialStrip(trials, isOneOfThem ? episode.trial : null, (trial) => {
    const words = form.query();
    for (const name of ["generation", "trial"]) words.delete(name);
    if (trials.is_judgement) judged = String(trial);
    else words.set("trial", trial);
    remember(words, false);
    show(withWorld(words), false);
  }));
}

/** Stores the shown episode in the address. */
function remember(words, isBeside) {
  const shown = new URLSearchParams([...withWorld(words), ...(isBeside ? [["beside", 1]] : [])]);
  history.replaceState(null, "", `${location.pathname}${shown.size ? `?${shown}` : ""}${location.hash}`);
}

/** Shows the episode of the form. */
function go(isBeside) {
  if (!form.node.reportValidity()) return undefined;
  const words = form.query();
  remember(words, isBeside);
  return show(withWorld(words), isBeside);
}

async function start() {
  // After a click on an individual, the user wants to see it move; an address with a step
  // shows that step.
  const plays = location.hash === "" && !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const words = new URLSearchParams(location.search);
  const isBeside = words.has("beside");
  for (const name of ["beside", "judged"]) words.delete(name);
  const answers = Promise.all([askJson(`/api/experiments/${id}`), askJson(`/api/trials/${where}`)]);
  const [experiment, known] = await waitingFor("simulating its trials …", answers);
  config = experiment.config;
  drawNeighbours(experiment.experiment);
  trials = known;
  const played = trials.is_judgement ? { trial_set: "judgement" } : { trial_set: "generation", generation: trials.generation, trial: 0 };
  form = whatIf({ config, words, played, go });
  formPlace.replaceChildren(form.node);
  await show(withWorld(words), isBeside);
  if (plays) players[0]?.clock.toggle();
}

addEventListener("hashchange", () => players[0]?.goTo(readAddress()));
start().catch((error) => complain(error, "replay"));
