// Any individual, simulated when the page is opened; and again with something different,
// side by side.

import { element } from "swarm/dom.js";
import { unpack } from "swarm/episode.js";
import { ask, bar, complain, main, resolve } from "swarm/page.js";
import { NOWHERE, Player, heading, readAddress } from "swarm/player.js";

const address = decodeURIComponent(location.pathname.slice("/replay/".length));
const [id, at] = address.split("@");
bar(`Replay ${address}`, "");

/** What may be different, as the form shows it. */
const FIELDS = [
  ["trial", "trial", { type: "number", min: 0, max: 999 }],
  ["generation", "worlds of generation", { type: "number", min: 0 }],
  ["seed", "seed", { type: "number", min: 0 }],
  ["robots", "robots", { type: "number", min: 1, max: 10000 }],
  ["steps", "steps", { type: "number", min: 1, max: 100000 }],
];
const INHIBIT = ["wireless_receiver:msg", "wireless_receiver:signal", "wireless_receiver:receiving_direction", "wireless_receiver:sending_direction", "wireless_receiver:state", "light_sensor", "distance_sensor", "ground_sensor"];
const PERTURB = ["leader_failure", "topology_switch"];

const words = new URLSearchParams(location.search);
const inputs = Object.fromEntries(FIELDS.map(([name, , attributes]) => [name, element("input", { ...attributes, id: `what-if-${name}`, value: words.get(name) ?? "", className: "number" })]));
const choice = (name, options) => {
  inputs[name] = element("select", { id: `what-if-${name}` }, ...["", ...options].map((option) => element("option", { value: option, selected: option === (words.get(name) ?? "") }, option || "nothing")));
  return inputs[name];
};
const form = element("form", { className: "panel what-if" }, element("b", {}, "What if"),
  ...FIELDS.map(([name, text]) => element("label", {}, text, inputs[name])),
  element("label", {}, "nobody gets", choice("inhibit", INHIBIT)), element("label", {}, "trouble", choice("perturb", PERTURB)),
  element("button", { type: "submit", id: "again" }, "Simulate"),
  element("button", { type: "button", id: "beside", title: "the one above, and the changed one next to it", onclick: () => go(true) }, "Side by side"));
const stage = element("div", { className: "replays" });
const neighbours = element("p", { className: "row" }, element("a", { href: `/experiment/${id}` }, `experiment ${id}`));
main.replaceChildren(neighbours, stage, form);

if (at?.includes("/") && !at.endsWith("mean")) {
  const [generation, individual] = at.split("/").map(Number);
  const link = (g, i, text) => element("a", { href: `/replay/${id}@${g}/${i}` }, text);
  if (individual > 0) neighbours.append(link(generation, individual - 1, "‹ individual"));
  neighbours.append(link(generation, individual + 1, "individual ›"));
  if (generation > 0) neighbours.append(link(generation - 1, individual, "‹ generation"));
  neighbours.append(link(generation + 1, individual, "generation ›"));
  neighbours.append(element("a", { href: `/replay/${id}` }, "champion"));
}

/** What the form says, without what is left to the experiment. */
function query() {
  const filled = Object.entries(inputs).map(([name, input]) => [name, input.value.trim()]).filter(([, value]) => value !== "");
  return new URLSearchParams(filled);
}

async function simulated(words) {
  const response = await ask(`/api/replay/${encodeURIComponent(id)}${at ? `@${at}` : ""}?${words}`);
  return unpack(await response.arrayBuffer());
}

/** Those that are shown, with one clock. */
let players = [];
/** Counts what was asked for: only the latest answer is shown. */
let asked = 0;

/** Shows the episode of the address: changed, or as it was with the changed one beside it. */
async function show(words, isBeside) {
  const mine = ++asked;
  stage.setAttribute("aria-busy", "true");
  try {
    const wanted = isBeside ? [new URLSearchParams(), words] : [words];
    const episodes = await Promise.all(wanted.map(simulated));
    if (mine !== asked) return;
    const old = players[0];
    old?.clock.pause();
    const first = new Player(episodes[0]);
    const others = episodes.slice(1).map((episode) => new Player(episode, { place: NOWHERE, clock: first.clock, suffix: "-beside" }));
    players = [first, ...others];
    stage.replaceChildren(...players.map((player) => element("div", {}, heading(player.episode, player.suffix), player.node)));
    stage.classList.toggle("two", isBeside);
    // Who fills in the form goes on with that.
    if (!form.contains(document.activeElement)) first.node.focus({ preventScroll: true });
    resolve("replay");
  } catch (error) {
    if (mine === asked) complain(error, "replay");
  }
  if (mine === asked) stage.removeAttribute("aria-busy");
}

/** Shows what the form says, and keeps it in the address. */
function go(isBeside) {
  if (!form.reportValidity()) return undefined;
  const words = query();
  const shown = new URLSearchParams([...words, ...(isBeside ? [["beside", 1]] : [])]);
  history.replaceState(null, "", `${location.pathname}?${shown}${location.hash}`);
  return show(words, isBeside);
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  go(false);
});
addEventListener("hashchange", () => players[0]?.goTo(readAddress()));
// Somebody clicked an individual to see it move; an address with a step is to be looked at.
const plays = location.hash === "" && !matchMedia("(prefers-reduced-motion: reduce)").matches;
await show(query(), words.has("beside"));
if (plays) players[0]?.clock.toggle();
