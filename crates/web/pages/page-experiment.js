// One experiment: its curve, its individuals, its champion, its activity, and its file.

import { decimals, element } from "swarm/dom.js";
import { chart } from "swarm/charts.js";
import { controllerButton } from "swarm/controller.js";
import { whatItDoes } from "swarm/doing.js";
import { dynamicsPanel } from "swarm/dynamics.js";
import { familiesPanel } from "swarm/families.js";
import { heatMap } from "swarm/heat-map.js";
import { frontPanel } from "swarm/front.js";
import { COLUMN } from "swarm/generation-row.js";
import { repertoirePanel } from "swarm/repertoire.js";
import { askJson, bar, complain, endPage, listen, main, oneByOne, order, remaining, resolve, span, stateMark } from "swarm/page.js";

/** Time between two requests for data that do not come with every generation, ms. */
const LOOK_EVERY = 2000;

const id = location.pathname.split("/").pop();
bar(`Experiment ${id}`, "");

const generations = [];
let experiment = null;
/** Populations of the experiment, each with its own descent; and whether its individuals have
 *  parents. */
let n_populations = 1;
let hasParents = false;
let champion = null;

const title = element("h1", {});
const state = element("span", {});
const facts = element("p", { className: "muted" });
const actions = element("div", { className: "row actions" });
/** All figures over generations show the same range. */
const onZoom = (range) => [fitness, spread, map, families].forEach((it) => it.zoom(range));
const fitness = chart("fitness by generation", { onZoom });
const spread = chart("standard deviation of fitness by generation", { onZoom });
const map = heatMap(id, onZoom);
const championBox = element("section", { className: "panel" });
const dynamics = dynamicsPanel(id);
const families = familiesPanel(id);
/** The elites of a repertoire or of a front, if the algorithm evolves one. */
let elites = null;
const doing = element("section", { className: "panel" });
const eventList = element("ol", { className: "events", tabIndex: 0, "aria-label": "events, the latest first" });
const file = element("pre", { className: "file", tabIndex: 0, "aria-label": "experiment file" });
/** The reason why the page is empty, or does not advance. */
const standing = element("section", { className: "panel standing", hidden: true });
const diversity = element("section", { className: "panel" }, element("h2", {}, "Diversity"),
  element("p", { className: "muted small" }, "standard deviation of fitness among the individuals"), spread);
/** The parts that need a complete generation. */
const results = [element("section", { className: "panel" }, element("h2", {}, "Fitness"), fitness), map, championBox, diversity, dynamics];
for (const part of results) part.hidden = true;
main.replaceChildren(
  element("header", { className: "row" }, title, state, element("span", { className: "space" }), actions), facts, standing,
  results[0], map,
  element("div", { className: "columns" }, championBox, doing, diversity,
    element("section", { className: "panel" }, element("h2", {}, "Events"), eventList)),
  dynamics, families,
  element("details", { className: "panel" }, element("summary", {}, "Experiment file"), file));

/** The next step for a stopped experiment, and its stored data. */
const NEXT = {
  running: () => "The first generation is being computed: the curve and the map of individuals begin when it is complete.",
  unfinished: () => "No generation is complete, and these files do not show whether a program computes the experiment: `swarmctl run FILE` continues it.",
  paused: () => "It is paused: resume continues it, without a loss of results.",
  cancelled: (it) => `It was cancelled${it.generations_done ? ": its generations and its champion stay" : " before a generation was complete"}. To compute it after all, submit its file below again.`,
  failed: (it) => `${it.generations_done ? "Its generations stay." : "No generation was complete."} The events show the cause; \`swarmctl explain ${id}\` tells more. When the cause is gone, \`swarmctl resume ${id}\` continues it.`,
};

/** Shows the progress of the experiment, unless the curve does. */
function drawStanding() {
  const it = experiment;
  const isEmpty = it.generations_done === 0;
  for (const part of results) part.hidden = isEmpty;
  families.hidden = isEmpty || !hasParents;
  if (elites) elites.hidden = isEmpty;
  const says = NEXT[it.state];
  standing.hidden = !says || (!isEmpty && ["running", "unfinished"].includes(it.state));
  if (standing.hidden) return;
  const title = { running: "Before the first generation", unfinished: "Before the first generation" }[it.state] ?? `${it.state[0].toUpperCase()}${it.state.slice(1)}`;
  standing.replaceChildren(element("h2", {}, title),
    it.reason ? element("p", { className: it.state === "failed" ? "bad" : "" }, it.reason) : null, element("p", {}, says(it)));
}

function draw() {
  if (!experiment) return;
  const it = experiment;
  title.textContent = `${it.id} ${it.name}`;
  state.replaceChildren(stateMark(it));
  const left = remaining(it, generations);
  facts.textContent = [
    `${it.generations_done} of ${it.generations} generations of ${it.population_size} by ${it.algorithm}`,
    `${it.genotype_len} genes`, `seed ${it.seed}`, it.group && `group ${it.group} ${it.variant}`, it.forked_from && `fork of ${it.forked_from}`,
    left !== null && `${span(left)} left`,
  ].filter(Boolean).join(" · ");
  drawStanding();
  const points = (column) => generations.map((row) => [row[COLUMN.generation], row[column]]);
  const marks = champion?.judged
    ? [{ name: "champion, 95 %", value: champion.judged[0], low: champion.judged[1], high: champion.judged[2], color: "var(--good)" }]
    : [];
  fitness.show({
    xLabel: "generation", yLabel: "fitness", marks,
    bands: [{ color: "var(--line)", points: generations.map((row) => [row[COLUMN.generation], row[COLUMN.min], row[COLUMN.best]]) }],
    lines: [{ name: "best", color: "var(--relay)", points: points(COLUMN.best) }, { name: "mean", color: "var(--line)", points: points(COLUMN.mean) }],
  });
  fitness.dataset.generations = generations.length;
  spread.show({ xLabel: "generation", yLabel: "standard deviation", lines: [{ name: "standard deviation", color: "var(--line)", points: points(COLUMN.deviation) }] });
  map.update(it.generations_done);
  dynamics.update(it.generations_done);
  elites?.update(it.generations_done, it.state === "completed");
  families.update(it.generations_done, it.generations * it.population_size * n_populations);
}

let offered = "";

/** Replaces the buttons only when they change, so that focus and clicks survive. */
function drawActions() {
  const due = [hasCoordinator, experiment.state, experiment.generations_done > 0].join();
  if (due === offered) return;
  offered = due;
  const isUnfinished = ["running", "paused"].includes(experiment.state);
  const act = async (what, body, question) => {
    if (question && !confirm(question)) return;
    try {
      const changed = await (await order(`/api/experiments/${id}/${what}`, body)).json();
      resolve("order");
      if (what === "fork") location.assign(`/experiment/${changed.id}`);
      else await look();
    } catch (error) {
      complain(error, "order");
    }
  };
  const name = `experiment ${id} (${experiment.name})`;
  const held = document.activeElement?.closest(".actions") ? document.activeElement.id : "";
  const button = (text, onclick) => element("button", { onclick, id: `do-${text}` }, text);
  const buttons = [];
  if (hasCoordinator && isUnfinished) {
    buttons.push(experiment.state === "paused"
      ? button("resume", () => act("resume", {}))
      : button("pause", () => act("pause", {}, `Pause ${name}? The coordinator takes its work back from the workers.`)));
    buttons.push(button("priority", () => {
      const answer = prompt(`Share of ${name} in the fleet, relative to other experiments, 1 to 1000:`, experiment.priority);
      if (answer !== null) act("priority", { priority: Number(answer) });
    }));
    buttons.push(button("cancel", () => act("cancel", {}, `End ${name} for good? Its history and champion stay.`)));
  }
  if (hasCoordinator && experiment.generations_done > 0) {
    buttons.push(button("fork", () => {
      const last = experiment.generations_done - 1;
      const answer = prompt(`Start a new experiment that continues ${name} with another seed. After which generation, 0 to ${last}?`, last);
      if (answer !== null) act("fork", { generation: Number(answer), seed: Math.floor(Math.random() * 2 ** 32) });
    }));
  }
  actions.replaceChildren(...buttons);
  if (held) (document.getElementById(held) ?? buttons[0])?.focus();
}

let drawnChampion = "";

/** Shows the champion when it changes, so that focus and clicks survive. */
function drawChampion() {
  const due = JSON.stringify([champion, experiment.generations_done, experiment.digest, experiment.simulation]);
  if (due === drawnChampion) return;
  drawnChampion = due;
  const play = (address, text) => element("a", { className: "play", href: `/replay/${address}` }, `▶ ${text}`);
  const done = experiment.generations_done;
  const parts = [element("h2", {}, "Champion")];
  if (champion) {
    const who = champion.individual === null ? "mean of the distribution" : `individual ${champion.individual}`;
    const [mean, low, high, trials] = champion.judged ?? [];
    parts.push(element("p", {}, champion.judged
      ? element("b", {}, `${decimals(mean, 4)}, 95 % ${decimals(low, 4)} to ${decimals(high, 4)}`)
      : "not judged yet", champion.judged ? ` on ${trials} new trials` : ""));
    if (champion.selection !== null) parts.push(element("p", { className: "muted" }, `${decimals(champion.selection, 4)} on the trials that selected it, which is optimistic`));
    parts.push(element("p", { className: "muted" }, `${who} of generation ${champion.generation}`));
    parts.push(element("p", { className: "row" }, play(id, "champion"), play(`${id}@0/0`, "first generation"), play(`${id}@${done - 1}/0`, "last generation"), controllerButton(id)));
  } else {
    parts.push(element("p", { className: "muted" }, "none before the first generation is complete"));
  }
  parts.push(element("p", { className: "muted small digest" }, `digest ${experiment.digest}`), element("p", { className: "muted small" }, experiment.simulation));
  championBox.replaceChildren(...parts);
}

async function drawDoing() {
  doing.hidden = !hasCoordinator || experiment.state !== "running";
  if (!doing.hidden) doing.replaceChildren(element("h2", {}, "Now"), ...whatItDoes(await askJson(`/api/experiments/${id}/explain`)));
}

let eventsUpTo = null;

async function drawEvents() {
  // News may come before the answer, which then lacks their events.
  const upTo = experiment.last_sequence;
  if (upTo === eventsUpTo) return;
  const { events } = await askJson(`/api/experiments/${id}/events`);
  eventsUpTo = upTo;
  eventList.replaceChildren(...events.slice(-30).reverse().map((event) =>
    element("li", {}, element("time", { className: "muted" }, new Date(event.at_ms).toLocaleString()), ` ${event.text}`)));
  if (events.length === 0) eventList.append(element("li", { className: "muted" }, "only generations"));
}

let hasCoordinator = false;

/** Data that do not come with every generation. */
async function load() {
  const answer = await askJson(`/api/experiments/${id}`);
  ({ experiment, champion } = answer);
  n_populations = Object.keys(answer.config.algorithm?.populations ?? {}).length || 1;
  hasParents = answer.has_parents;
  if (!elites && (answer.has_repertoire || answer.has_front)) {
    elites = answer.has_front ? frontPanel(id) : repertoirePanel(id);
    results[0].after(elites);
  }
  const text = JSON.stringify(answer.config, null, 2);
  if (file.textContent !== text) file.textContent = text;
  draw();
  drawChampion();
  drawActions();
  await Promise.all([drawEvents(), drawDoing()]);
}

/** The experiment does not exist, or no longer exists. */
function end(refusal) {
  isOver = true;
  clearTimeout(next);
  stopListening();
  if (refusal.status !== 401) endPage(`There is no experiment ${id}`, `${refusal.message}. It may have been deleted, or belong to another coordinator.`, ["/", "All experiments"]);
}

let next = null;
let isOver = false;
let stopListening = () => {};

/** Requests the data now, and repeatedly as long as they can change. */
const look = oneByOne(async () => {
  clearTimeout(next);
  try {
    await load();
    resolve("look");
  } catch (error) {
    if ([400, 401, 404].includes(error.status)) return end(error);
    complain(error, "look");
  }
  const isFollowed = !experiment || ["running", "unfinished", "paused"].includes(experiment.state);
  if (isFollowed && !isOver) next = setTimeout(look, document.hidden ? 5 * LOOK_EVERY : LOOK_EVERY);
  return undefined;
});

async function start() {
  hasCoordinator = (await askJson("/api/session")).has_coordinator;
  await look();
  if (isOver) return;
  stopListening = listen(`/api/experiments/${id}/live?from=0`, (news) => {
    // After a new connection the server may repeat known generations.
    for (const row of news.generations) if (row[COLUMN.generation] === generations.length + (generations[0]?.[COLUMN.generation] ?? row[COLUMN.generation])) generations.push(row);
    const before = experiment;
    experiment = news.experiment;
    draw();
    drawActions();
    if (before?.state !== experiment.state || (before.generations_done === 0) !== (experiment.generations_done === 0)) look();
  }, end);
}

start().catch((error) => complain(error, "start"));
