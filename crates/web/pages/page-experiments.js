// All experiments.

import { element } from "swarm/dom.js";
import { followExperiments } from "swarm/experiment-list.js";
import { exports } from "swarm/export.js";
import { COLUMNS } from "swarm/list-columns.js";
import { listTable } from "swarm/list-table.js";
import { ListView, groupings } from "swarm/list-view.js";
import { askJson, bar, complain, main, order, resolve } from "swarm/page.js";

bar("Experiments", "/");
let experiments = new Map();
const chosen = new Set();
const view = new ListView(COLUMNS, () => draw());
const table = listTable(view, chosen, () => drawActions());

const search = element("input", { type: "search", value: view.parts.q, placeholder: "Words, state=running, KEY=VALUE, -not", title: "words in name, group, algorithm, state and labels; state=failed, seed=3 or a label KEY=VALUE match exactly; - before a word excludes", "aria-label": "search", oninput: () => view.set({ q: search.value }) });
const grouping = element("select", { id: "by", onchange: () => view.set({ by: grouping.value, open: "" }) });
// Narrow screens have no headings to press.
const orders = [{ name: "id", title: "Experiment", isGreatFirst: true }, ...COLUMNS.filter((column) => column.value)].flatMap(({ name, title, isGreatFirst }) => {
  const rising = [name, `${title} ▲`], falling = [`-${name}`, `${title} ▼`];
  return isGreatFirst ? [falling, rising] : [rising, falling];
});
const sorting = element("select", { id: "sort", onchange: () => view.set({ sort: sorting.value }) }, ...orders.map(([value, text]) => element("option", { value }, text)));
const archived = element("input", { type: "checkbox", id: "archived", checked: view.parts.archived !== "", onchange: () => view.set({ archived: archived.checked ? "1" : "" }) });
const archivedText = element("span");
const boxes = COLUMNS.map((column) => {
  const box = element("input", { type: "checkbox", checked: view.shown.includes(column), onchange: () => view.showColumn(column.name, box.checked) });
  box.dataset.column = column.name;
  return element("label", {}, box, column.title);
});
const columns = element("details", { className: "menu" }, element("summary", {}, "Columns"), element("div", {}, ...boxes));
const states = element("div", { className: "row states" });
const count = element("span", { className: "muted", id: "count" });
const actions = element("div", { className: "row actions" });

main.replaceChildren(
  element("header", { className: "row" }, element("h1", {}, "Experiments"), states, element("span", { className: "space" }), search,
    element("label", { className: "narrow" }, "sorted by ", sorting), element("label", {}, "by ", grouping), columns, element("label", {}, archived, archivedText)),
  element("div", { className: "row bar" }, count, exports({ table: () => table.rowsToSave(), name: () => "experiments" }), element("span", { className: "space" }), actions),
  element("div", { className: "panel scroll" }, table.node));

/** Texts and choices around the table; unchanged ones are left alone. */
function drawAround() {
  const all = [...experiments.values()];
  const n_archived = all.filter((it) => it.archived).length;
  sorting.value = view.parts.sort;
  archivedText.textContent = `archived (${n_archived})`;
  count.textContent = table.count() === all.length ? `${all.length} experiment${all.length === 1 ? '' : 's'}` : `${table.count()} of ${all.length}`;
  const names = ["", ...Object.keys(groupings(all))];
  if (grouping.dataset.names !== names.join()) {
    grouping.dataset.names = names.join();
    grouping.replaceChildren(...names.map((name) => element("option", { value: name, selected: name === view.parts.by }, name || "nothing")));
  }
  const counts = [...Map.groupBy(all.filter((it) => !it.archived || archived.checked), (it) => it.state)].map(([state, its]) => [state, its.length]);
  const says = JSON.stringify([counts, view.parts.q]);
  if (states.dataset.says === says) return;
  states.dataset.says = says;
  const held = states.contains(document.activeElement) ? document.activeElement.dataset.state : null;
  states.replaceChildren(...counts.map(([state, n]) => {
    const word = `state=${state}`;
    const words = view.parts.q.split(/\s+/).filter(Boolean);
    const isOn = words.includes(word);
    const button = element("button", { type: "button", className: `state ${state}`, "aria-pressed": String(isOn), onclick: () => {
      search.value = (isOn ? words.filter((it) => it !== word) : [...words.filter((it) => !it.startsWith("state=")), word]).join(" ");
      view.set({ q: search.value });
    } }, `${n} ${state}`);
    button.dataset.state = state;
    return button;
  }));
  if (held) [...states.children].find((it) => it.dataset.state === held)?.focus();
}

function draw() {
  table.redraw();
  drawAround();
}

let hasCoordinator = false;

/** Actions on the ticked experiments. */
function drawActions() {
  const its = [...chosen].map((id) => experiments.get(id)).filter(Boolean);
  const button = (id, text, onclick) => element("button", { type: "button", id, onclick }, text);
  const each = async (action, body) => {
    try {
      for (const it of its) await order(`/api/experiments/${it.id}/${action}`, body);
      resolve("order");
    } catch (error) {
      complain(error, "order");
    }
  };
  const label = () => {
    const answer = prompt("Labels for the ticked experiments, such as `paper draft=2`; `-paper` removes one:");
    if (!answer?.trim()) return;
    const words = answer.trim().split(/\s+/);
    const set = Object.fromEntries(words.filter((it) => !it.startsWith("-")).map((it) => [it.split("=")[0], it.split("=").slice(1).join("=")]));
    each("label", { set, remove: words.filter((it) => it.startsWith("-")).map((it) => it.slice(1)) });
  };
  const areArchived = its.length > 0 && its.every((it) => it.archived);
  actions.replaceChildren(...(its.length === 0 ? [element("span", { className: "muted" }, "tick some to compare, label or archive them")] : [
    element("span", { className: "muted" }, `${its.length} ticked`),
    button("compare", "Compare", () => location.assign(`/compare?runs=${[...chosen].join(",")}`)),
    ...(hasCoordinator ? [button("label", "Label …", label), button("archive", areArchived ? "Take out of the archive" : "Archive", () => each(areArchived ? "restore" : "archive", {}))] : []),
  ]));
}

drawActions();
askJson("/api/session").then((session) => {
  hasCoordinator = session.has_coordinator;
  drawActions();
}).catch((error) => complain(error, "session"));
followExperiments((now, changed) => {
  experiments = now;
  table.update(now, changed);
  drawAround();
});
