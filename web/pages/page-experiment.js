// One experiment: its curve, its individuals, its champion, what it does, and its file.

import { decimals, element } from "swarm/dom.js";
import { chart } from "swarm/charts.js";
import { whatItDoes } from "swarm/doing.js";
import { dynamicsPanel } from "swarm/dynamics.js";
import { heatMap } from "swarm/heat-map.js";
import { askJson, bar, complain, listen, main, order, remaining, span, stateMark } from "swarm/page.js";

/** Time between two looks at what does not come with every generation, ms. */
const LOOK_EVERY = 2000;

const id = location.pathname.split("/").pop();
bar(`Experiment ${id}`, "");

const generations = [];
let experiment = null;
let champion = null;

const title = element("h1", {});
const state = element("span", {});
const facts = element("p", { className: "muted" });
const actions = element("div", { className: "row actions" });
const fitness = chart("fitness by generation");
const spread = chart("standard deviation of fitness by generation");
const map = heatMap(id);
const championBox = element("section", { className: "panel" });
const dynamics = dynamicsPanel(id);
const doing = element("section", { className: "panel" });
const eventList = element("ol", { className: "events" });
const file = element("pre", { className: "file" });
main.replaceChildren(
  element("header", { className: "row" }, title, state, element("span", { className: "space" }), actions), facts,
  element("section", { className: "panel" }, element("h2", {}, "Fitness"), fitness),
  map,
  element("div", { className: "columns" }, championBox, doing,
    element("section", { className: "panel" }, element("h2", {}, "Diversity"),
      element("p", { className: "muted small" }, "standard deviation of fitness among the individuals"), spread),
    element("section", { className: "panel" }, element("h2", {}, "Events"), eventList)),
  dynamics,
  element("details", { className: "panel" }, element("summary", {}, "Experiment file"), file));

function draw() {
  if (!experiment) return;
  const it = experiment;
  title.textContent = `${it.id} ${it.name}`;
  state.replaceChildren(stateMark(it));
  const left = remaining(it, generations);
  facts.textContent = [
    `${it.generations_done} of ${it.generations} generations of ${it.population_size} by ${it.algorithm}`,
    `${it.genotype_len} genes`, `seed ${it.seed}`, it.group && `group ${it.group} ${it.variant}`, it.forked_from && `fork of ${it.forked_from}`,
    left !== null && `${span(left)} left`, it.reason,
  ].filter(Boolean).join(" · ");
  const points = (column) => generations.map((row) => [row[0], row[column]]);
  const marks = champion?.judged
    ? [{ name: "champion, 95 %", value: champion.judged[0], low: champion.judged[1], high: champion.judged[2], color: "var(--good)" }]
    : [];
  fitness.show({
    xLabel: "generation", yLabel: "fitness", marks,
    bands: [{ color: "var(--line)", points: generations.map((row) => [row[0], row[3], row[1]]) }],
    lines: [{ name: "best", color: "var(--relay)", points: points(1) }, { name: "mean", color: "var(--line)", points: points(2) }],
  });
  fitness.dataset.generations = generations.length;
  spread.show({ xLabel: "generation", yLabel: "standard deviation", lines: [{ name: "standard deviation", color: "var(--line)", points: points(4) }] });
  map.update(it.generations_done);
  dynamics.update(it.generations_done);
}

function drawActions(hasCoordinator) {
  const isUnfinished = ["running", "paused"].includes(experiment.state);
  const act = async (what, body, question) => {
    if (question && !confirm(question)) return;
    try {
      const changed = await (await order(`/api/experiments/${id}/${what}`, body)).json();
      if (what === "fork") location.assign(`/experiment/${changed.id}`);
      else await load();
    } catch (error) {
      complain(error);
    }
  };
  const name = `experiment ${id} (${experiment.name})`;
  const button = (text, onclick) => element("button", { onclick, id: `do-${text}` }, text);
  const buttons = [];
  if (hasCoordinator && isUnfinished) {
    buttons.push(experiment.state === "paused"
      ? button("resume", () => act("resume", {}))
      : button("pause", () => act("pause", {}, `Pause ${name}? Its work is taken back from the workers.`)));
    buttons.push(button("priority", () => {
      const answer = prompt(`Weight of ${name} in the sharing of the fleet, 1 to 1000:`, experiment.priority);
      if (answer !== null) act("priority", { priority: Number(answer) });
    }));
    buttons.push(button("cancel", () => act("cancel", {}, `End ${name} for good? Its history and champion stay.`)));
  }
  if (hasCoordinator && experiment.generations_done > 0) {
    buttons.push(button("fork", () => {
      const last = experiment.generations_done - 1;
      const answer = prompt(`Start a new experiment that goes on from ${name} with another seed. After which generation, 0 to ${last}?`, last);
      if (answer !== null) act("fork", { generation: Number(answer), seed: Math.floor(Math.random() * 2 ** 32) });
    }));
  }
  actions.replaceChildren(...buttons);
}

function drawChampion() {
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
    parts.push(element("p", { className: "row" }, play(id, "champion"), play(`${id}@0/0`, "first generation"), play(`${id}@${done - 1}/0`, "last generation")));
  } else {
    parts.push(element("p", { className: "muted" }, "none before the first generation is complete"));
  }
  parts.push(element("p", { className: "muted small digest" }, `digest ${experiment.digest}`), element("p", { className: "muted small" }, experiment.simulation));
  championBox.replaceChildren(...parts);
}

async function drawDoing(hasCoordinator) {
  doing.hidden = !hasCoordinator || experiment.state !== "running";
  if (!doing.hidden) doing.replaceChildren(element("h2", {}, "Now"), ...whatItDoes(await askJson(`/api/experiments/${id}/explain`)));
}

async function drawEvents() {
  const { events } = await askJson(`/api/experiments/${id}/events`);
  eventList.replaceChildren(...events.slice(-30).reverse().map((event) =>
    element("li", {}, element("time", { className: "muted" }, new Date(event.at_ms).toLocaleString()), ` ${event.text}`)));
  if (events.length === 0) eventList.append(element("li", { className: "muted" }, "none but generations"));
}

let hasCoordinator = false;

/** What does not come with every generation. */
async function load() {
  const answer = await askJson(`/api/experiments/${id}`);
  ({ experiment, champion } = answer);
  file.textContent = JSON.stringify(answer.config, null, 2);
  draw();
  drawChampion();
  drawActions(hasCoordinator);
  await Promise.all([drawEvents(), drawDoing(hasCoordinator)]);
}

let next = null;

/** Looks again and again, as long as something happens. */
async function follow() {
  clearTimeout(next);
  try {
    await load();
    document.getElementById("problem")?.remove();
  } catch (error) {
    complain(error);
  }
  clearTimeout(next);
  if (["running", "unfinished", "paused"].includes(experiment?.state)) next = setTimeout(follow, document.hidden ? 5 * LOOK_EVERY : LOOK_EVERY);
}

try {
  hasCoordinator = (await askJson("/api/session")).has_coordinator;
  await follow();
  listen(`/api/experiments/${id}/live?from=0`, (news) => {
    // After a new connection the server may say again what is known.
    for (const row of news.generations) if (row[0] === generations.length + (generations[0]?.[0] ?? row[0])) generations.push(row);
    const before = experiment;
    experiment = news.experiment;
    draw();
    if (before.state !== experiment.state) follow();
  });
} catch (error) {
  complain(error);
}
