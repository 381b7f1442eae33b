// All experiments.

import { decimals, element } from "swarm/dom.js";
import { sparkline } from "swarm/charts.js";
import { askJson, bar, complain, listen, main, remaining, span, stateMark } from "swarm/page.js";

bar("Experiments", "/");
const search = element("input", { type: "search", placeholder: "Search by name, group, algorithm, state", "aria-label": "search", oninput: () => draw() });
const rows = element("tbody");
const table = element("table", { className: "list" },
  element("thead", {}, element("tr", {}, ...["", "Experiment", "State", "Progress", "Best", "Mean", "Recent best", "Champion", "Share"].map((name) => element("th", {}, name)))), rows);
const compare = element("button", { disabled: true, onclick: () => location.assign(`/compare?runs=${[...chosen].join(",")}`) }, "Compare");
main.replaceChildren(
  element("header", { className: "row" }, element("h1", {}, "Experiments"), element("span", { className: "space" }), search, compare),
  element("div", { className: "panel scroll" }, table));

const chosen = new Set();
let experiments = [];

async function load() {
  try {
    experiments = (await askJson("/api/experiments")).experiments;
    draw();
  } catch (error) {
    complain(error);
  }
}

function draw() {
  const words = search.value.toLowerCase().split(/\s+/);
  const matches = (it) => words.every((word) => `${it.id} ${it.name} ${it.group} ${it.variant} ${it.algorithm} ${it.state} seed=${it.seed}`.toLowerCase().includes(word));
  const weights = experiments.filter((it) => it.state === "running").reduce((sum, it) => sum + it.priority, 0);
  const found = experiments.filter(matches).reverse();
  rows.replaceChildren(...found.map((it) => row(it, weights)));
  if (found.length === 0) {
    const text = experiments.length ? "No experiment matches." : "There is no experiment yet: swarmctl submit FILE starts one.";
    rows.append(element("tr", {}, element("td", { colSpan: 9, className: "muted" }, text)));
  }
}

function row(it, weights) {
  const left = remaining(it, it.recent);
  const done = it.generations ? it.generations_done / it.generations : 0;
  const box = element("input", { type: "checkbox", checked: chosen.has(it.id), "aria-label": `compare ${it.name}`, onchange: () => {
    if (box.checked) chosen.add(it.id);
    else chosen.delete(it.id);
    compare.disabled = chosen.size === 0;
  } });
  const progress = element("progress", { max: 1, value: done });
  const place = [it.group, it.variant, `seed ${it.seed}`, it.algorithm, it.forked_from && `fork of ${it.forked_from}`].filter(Boolean).join(" · ");
  const cell = (label, ...content) => element("td", { "data-label": label }, ...content);
  return element("tr", { "data-id": it.id },
    cell("", box),
    cell("", element("a", { href: `/experiment/${it.id}` }, `${it.id} ${it.name}`), element("div", { className: "muted small" }, place)),
    cell("State", stateMark(it)),
    cell("Progress", progress, element("div", { className: "small muted" }, `${it.generations_done} of ${it.generations}${left === null ? "" : `, ${span(left)} left`}`)),
    cell("Best", decimals(it.best ?? NaN, 3)), cell("Mean", decimals(it.mean ?? NaN, 3)),
    cell("", sparkline(it.recent.map((generation) => generation[1]))),
    cell("Champion", it.champion !== null
      ? element("a", { href: `/replay/${it.id}`, title: "its worth, on trials that selected nothing; click to play" }, decimals(it.champion, 3))
      : it.generations_done ? element("a", { href: `/replay/${it.id}` }, "play") : "–"),
    cell("Share", it.state === "running" ? `${Math.round((100 * it.priority) / weights)} %` : "–"));
}

await load();
listen("/api/live", load);
