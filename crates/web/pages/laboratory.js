// An individual's episode; a changed one beside it; and the forms that change it.

import { difference } from "swarm/difference.js";
import { element } from "swarm/dom.js";
import { interventionForm, nameOf, readInterventions, writeInterventions } from "swarm/interventions.js";
import { NOWHERE, Player, heading } from "swarm/player.js";
import { trialStrip } from "swarm/trials.js";
import { changesOf, whatIf } from "swarm/what-if.js";

/** Time after which a wait is explained, ms. */
const MOMENT = 300;

/** The parts of a page. `config`: the experiment's file; `played`: trial set, generation and trial of
 *  the unchanged episode; `trials`: those of the individual, if known; `simulate(words)`: the episode
 *  with these changes; `place`: the store of the changes; `fails(error)`: shows an error, or hides
 *  it with null; `known`: the unchanged episode, if the page has it. */
export function laboratory({ config, played, trials, simulate, place, fails, known = null }) {
  const loading = element("p", { className: "loading muted", role: "status" });
  const stage = element("div", { className: "replays" });
  const [changed, intervening, strip] = [element("div"), element("div"), element("div")];
  /** The shown players, with one clock. */
  let players = [];
  /** Counts requests: only the latest answer is shown. */
  let asked = 0;
  let interventions = [];
  /** What the form of interventions keeps from one to the next. */
  const handState = { thing: 0, isMoving: false };
  /** Whether the next episode plays at once, because the one before it did. */
  let goesOn = false;
  /** The played trial of the judgement; null: the default one. */
  let judged = null;
  /** The unchanged episode of a world, by its query. */
  const unchanged = new Map(known ? [["", known]] : []);
  const form = whatIf({ config, words: place.read(), played, go: (isBeside) => go(isBeside || interventions.length > 0) });

  /** The query that chooses a world: of the judgement, unless a generation is named. */
  function withWorld(words) {
    if (judged === null || words.has("generation") || words.has("trial")) return words;
    return new URLSearchParams([["judged", judged], ...words]);
  }

  /** The changes of both forms. */
  function words() {
    const found = form.query();
    if (interventions.length) found.set("interventions", writeInterventions(interventions));
    return found;
  }

  async function episodeOf(query) {
    const key = String(query);
    if (unchanged.has(key)) return unchanged.get(key);
    const episode = await simulate(query);
    if ([...query.keys()].every((name) => name === "judged")) unchanged.set(key, episode);
    return episode;
  }

  /** The episodes, one after the other, because a thread computes them. Once a later request has
   *  come, the rest is left out: it would end the simulation of the later one. */
  async function episodes(wanted, mine) {
    const found = [];
    for (const query of wanted) if (mine === asked) found.push(await episodeOf(query));
    return found;
  }

  /** Explains a wait that takes longer than a moment. */
  async function waitingFor(work) {
    const start = performance.now();
    const say = () => (loading.textContent = `simulating … ${Math.round((performance.now() - start) / 1000)} s`);
    const timers = [setTimeout(say, MOMENT), setInterval(say, 1000)];
    try {
      return await work;
    } finally {
      clearTimeout(timers[0]);
      clearInterval(timers[1]);
      loading.textContent = "";
    }
  }

  /** Shows the changed episode, or the original with the changed one beside it, unless a later request
   *  has come. Returns the error, if it shows one. */
  async function show(query, isBeside) {
    const mine = ++asked;
    stage.setAttribute("aria-busy", "true");
    try {
      const wanted = isBeside ? [withWorld(new URLSearchParams()), query] : [query];
      const found = await waitingFor(episodes(wanted, mine));
      if (mine !== asked) return null;
      draw(found, wanted, isBeside);
      fails(null);
      return null;
    } catch (error) {
      if (mine !== asked) return null;
      fails(error);
      return error;
    } finally {
      if (mine === asked) stage.removeAttribute("aria-busy");
    }
  }

  function draw(found, wanted, isBeside) {
    players[0]?.clock.pause();
    let hand = null;
    const chosen = (robot) => hand?.choose(robot);
    const first = new Player(found[0], { chosen });
    const others = found.slice(1).map((episode) => new Player(episode, { place: NOWHERE, clock: first.clock, suffix: "-beside", chosen }));
    players = [first, ...others];
    const changes = wanted.map((query) => [...changesOf(query, config), ...readInterventions(query).map(nameOf)]);
    stage.replaceChildren(...players.map((player, i) => element("div", {}, heading(player.episode, { suffix: player.suffix, trials, changes: changes[i] }), player.node)));
    stage.classList.toggle("two", isBeside);
    changed.replaceChildren(...(isBeside ? [difference(found[0], found[1], interventions)] : []));
    const worlds = players.map((player) => player.world);
    hand = interventionForm({ list: interventions, episode: found.at(-1), clock: first.clock, worlds, state: handState, change: intervene });
    hand.choose(first.view.robot);
    first.clock.join(hand, first.episode.steps);
    hand.tick();
    intervening.replaceChildren(hand.node);
    drawStrip(found[0]);
    // The user may still be filling in the form: leave it alone.
    if (!form.node.contains(document.activeElement)) first.node.focus({ preventScroll: true });
    if (goesOn) first.clock.toggle();
    goesOn = false;
  }

  /** The trials to pick from, if there are several. */
  function drawStrip(episode) {
    if (!trials || trials.fitness.length < 2) return;
    const isOneOfThem = episode.trial_set === (trials.is_judgement ? "judgement" : "generation") && episode.generation === trials.generation;
    strip.replaceChildren(trialStrip(trials, isOneOfThem ? episode.trial : null, (trial) => {
      const query = words();
      for (const name of ["generation", "trial"]) query.delete(name);
      if (trials.is_judgement) judged = String(trial);
      else query.set("trial", trial);
      const isBeside = interventions.length > 0;
      remember(query, isBeside);
      show(withWorld(query), isBeside);
    }));
  }

  function remember(query, isBeside) {
    place.write(new URLSearchParams([...withWorld(query), ...(isBeside ? [["beside", 1]] : [])]));
  }

  /** Shows the episode of the forms. */
  function go(isBeside) {
    if (!form.node.reportValidity()) return undefined;
    const query = words();
    remember(query, isBeside);
    return show(withWorld(query), isBeside);
  }

  /** Simulates with other interventions: the swarm goes on from the same step. Those that are not
   *  possible are forgotten. */
  async function intervene(list) {
    const before = interventions;
    interventions = list;
    goesOn = players[0].clock.isPlaying;
    if (!(await go(list.length > 0)) || interventions !== list) return;
    interventions = before;
    remember(words(), before.length > 0);
  }

  return {
    nodes: [loading, intervening, changed, stage, strip, form.node],
    /** The player with the clock. */
    first: () => players[0],
    /** Shows the episode of the address; the unchanged one if its changes are wrong. */
    async start() {
      const query = place.read();
      const isBeside = query.has("beside");
      judged = query.get("judged");
      interventions = readInterventions(query);
      for (const name of ["beside", "judged"]) query.delete(name);
      const error = await show(withWorld(query), isBeside);
      if (!error || players.length) return;
      interventions = [];
      await show(new URLSearchParams(), false);
      fails(error);
    },
  };
}
