// Changes in the middle of an episode: their form, their text in an address, and their names.

import { decimals, element } from "swarm/dom.js";

/** What can happen to a robot: the name in an address, the button, its explanation, and what the
 *  robot then is. */
const ROBOTS = {
  remove: ["Remove", "no robot hears, senses or meets it; the task still counts it where it was", "is gone"],
  freeze: ["Freeze", "it stands still, whatever its controller decides", "stands still"],
  mute: ["Mute", "its radio sends nothing", "is mute"],
  deafen: ["Deafen", "its radio receives nothing", "is deaf"],
};
/** The same for lights and areas. */
const PLACES = {
  remove: ["Remove", "no sensor sees it", "is out"],
  freeze: ["Freeze", "it stays where it is", "stays where it is"],
};
const actsOf = (kind) => (kind === "robot" ? ROBOTS : PLACES);

/** The interventions in the query of an address, in their order. */
export function readInterventions(words) {
  const text = words.get("interventions") ?? "";
  return text === "" ? [] : text.split(",").map((one) => {
    const [step, kind, number, act, x, y] = one.split(":");
    return { step: Number(step), kind, number: Number(number), act, x: Number(x), y: Number(y) };
  });
}

/** Their text in an address. */
export function writeInterventions(list) {
  return list.map(({ step, kind, number, act, x, y }) => [step, kind, number, act, ...(act === "place" ? [x, y] : [])].join(":")).join(",");
}

/** "robot 3 is mute from step 42 on". */
export function nameOf({ step, kind, number, act, x, y }) {
  if (act === "place") return `${kind} ${number} is put at (${decimals(x, 0)}, ${decimals(y, 0)}) in step ${step}`;
  return `${kind} ${number} ${actsOf(kind)[act]?.[2] ?? act} from step ${step} on`;
}

/** What can happen to a thing of an episode. */
function actsOn(episode, kind, number) {
  if (kind !== "robot") return { light: ["remove", "freeze"], area: ["remove"], movable: [] }[kind];
  const { emits_within: emits, hears_within: hears } = episode.kinds[number];
  return ["remove", "freeze", ...(emits === null ? [] : ["mute"]), ...(hears === null ? [] : ["deafen"])];
}

/** All things of an episode: kind, number and name. */
function thingsOf(episode) {
  const numbered = (kind, n, name) => Array.from({ length: n }, (_, i) => ({ kind, number: i, name: name(i) }));
  const disc = (kind, discs) => numbered(kind, discs.length, (i) => `${kind} ${i} (${discs[i].name})`);
  return [
    ...numbered("robot", episode.n_robots, (i) => (episode.robots.length > 1 ? `robot ${i} (${episode.kinds[i].name})` : `robot ${i}`)),
    ...disc("light", episode.lights), ...disc("area", episode.areas),
    ...numbered("movable", episode.room?.movables.length ?? 0, (i) => `movable ${i}`),
  ];
}

/** The form. `list`: the interventions so far; `episode`: the changed one; `clock`: that of the
 *  players; `worlds`: theirs, in which things can be dragged; `state`: the chosen thing, and whether
 *  things can be dragged, for the next form; `change(list)`: simulates with other interventions. */
export function interventionForm({ list, episode, clock, worlds, state, change }) {
  const things = thingsOf(episode);
  const choose = (thing) => {
    state.thing = thing;
    drawButtons();
  };
  const select = element("select", { id: "thing", "aria-label": "robot or thing to change", onchange: () => choose(Number(select.value)) },
    ...things.map(({ name }, i) => element("option", { value: i }, name)));
  const now = element("b", { id: "intervene-step" });
  const buttons = element("span", { className: "row", id: "acts" });
  const chosen = () => things[state.thing] ?? things[0];
  const add = (act, place = {}, { kind, number } = chosen()) =>
    change([...list, { step: clock.step, kind, number, act, ...place }].sort((a, b) => a.step - b.step));

  const coordinate = (axis, size) => element("input", { type: "number", className: "number", id: `put-${axis}`, min: 0, max: size, step: "any", required: true, "aria-label": `${axis}, cm` });
  const [x, y] = [coordinate("x", episode.width), coordinate("y", episode.height)];
  const put = element("form", { className: "row", id: "put", hidden: true, onsubmit: (event) => {
    event.preventDefault();
    add("place", { x: Number(x.value), y: Number(y.value) });
  } }, element("span", { className: "muted" }, "drag it in the world, or put it at"), x, y, "cm", element("button", { type: "submit" }, "Put"));
  const move = element("button", { type: "button", id: "move", "aria-pressed": "false", title: "drag robots and things in the world", onclick: () => openHand(!state.isMoving) }, "Move");

  const node = element("section", { className: "panel intervene", "aria-label": "interventions" },
    element("div", { className: "row" }, element("h2", {}, "Intervene"), element("span", {}, "in step ", now), select, buttons, move), put,
    element("ul", { id: "interventions" }, ...list.map((it, i) => element("li", {}, element("span", {}, nameOf(it)),
      element("button", { type: "button", title: "undo this", "aria-label": `undo: ${nameOf(it)}`, onclick: () => change(list.filter((_, k) => k !== i)) }, "×")))));

  function drawButtons() {
    const { kind, number } = chosen();
    select.value = things.indexOf(chosen());
    [x.value, y.value] = episode.placeOf(kind, number, Math.min(clock.step, episode.steps - 1)).map((value) => value.toFixed(1));
    buttons.replaceChildren(...actsOn(episode, kind, number).map((act) => {
      const isDone = list.some((it) => it.kind === kind && it.number === number && it.act === act && it.step <= clock.step);
      const [text, title] = actsOf(kind)[act];
      return element("button", { type: "button", id: `act-${act}`, title, disabled: isDone, onclick: () => add(act) }, text);
    }));
  }

  /** Opens or closes the hand that carries things in the worlds. */
  function openHand(isOpen) {
    state.isMoving = isOpen;
    put.hidden = !isOpen;
    move.setAttribute("aria-pressed", String(isOpen));
    for (const world of worlds) world.carry(isOpen ? (thing, place) => add("place", place, thing) : null);
  }

  /** The step for which the buttons are drawn. */
  let drawn = null;
  openHand(state.isMoving);
  return {
    node,
    /** Follows the clock. */
    tick() {
      now.textContent = clock.step;
      // While the swarm moves, the buttons stay, so that they can be pressed.
      if (clock.isPlaying || drawn === clock.step) return;
      drawn = clock.step;
      drawButtons();
    },
    /** Chooses the robot that a player follows. */
    choose(robot) {
      if (robot !== null) choose(robot);
    },
  };
}
