// All experiments.

import { decimals, element } from "swarm/dom.js";
import { sparkline } from "swarm/charts.js";
import { askJson, bar, complain, listen, main, oneByOne, remaining, resolve, span, stateMark } from "swarm/page.js";

/** Least time between two questions, ms. */
const LOAD_EVERY = 1000;

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
/** The rows that exist, by id: what is shown of an experiment, and its cells. */
const known = new Map();
const none = element("tr", {}, element("td", { colSpan: 9, className: "muted" }));

/** One question at a time: a slow server gets fewer of them. */
const load = oneByOne(async () => {
  try {
    experiments = (await askJson("/api/experiments")).experiments;
    draw();
    resolve("list");
  } catch (error) {
    complain(error, "list");
  }
  await new Promise((wake) => setTimeout(wake, LOAD_EVERY));
});

/** Only cells that say something else are replaced, so focus, clicks and scrolling are not lost. */
function draw() {
  const words = search.value.toLowerCase().split(/\s+/);
  const matches = (it) => words.every((word) => `${it.id} ${it.name} ${it.group} ${it.variant} ${it.algorithm} ${it.state} seed=${it.seed}`.toLowerCase().includes(word));
  const weights = experiments.filter((it) => it.state === "running").reduce((sum, it) => sum + it.priority, 0);
  const found = experiments.filter(matches).reverse();
  const ids = new Set(experiments.map((it) => it.id));
  for (const [id, { node }] of known) {
    if (ids.has(id)) continue;
    node.remove();
    known.delete(id);
  }
  const wanted = found.map((it) => updated(it, weights));
  if (found.length === 0) {
    none.firstChild.textContent = experiments.length ? "No experiment matches." : "There is no experiment yet: swarmctl submit FILE starts one.";
    wanted.push(none);
  }
  for (const node of [...rows.children]) if (!wanted.includes(node)) node.remove();
  wanted.forEach((node, place) => {
    if (rows.children[place] !== node) rows.insertBefore(node, rows.children[place] ?? null);
  });
}

/** The row of an experiment, with what is new of it. */
function updated(it, weights) {
  const share = it.state === "running" ? weights : 0;
  const says = JSON.stringify([it, share]);
  const old = known.get(it.id);
  if (old?.says === says) return old.node;
  const fresh = row(it, weights);
  if (!old) {
    known.set(it.id, { node: fresh, says });
    return fresh;
  }
  old.says = says;
  [...fresh.children].forEach((cell, place) => {
    const shown = old.node.children[place];
    if (place > 0 && shown.innerHTML !== cell.innerHTML) shown.replaceChildren(...cell.childNodes);
  });
  return old.node;
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

load();
listen("/api/live", load);
