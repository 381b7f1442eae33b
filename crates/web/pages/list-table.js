// The list of experiments as a table. Only changed cells are replaced, and rows do not move
// while the user points at them, so focus, clicks and scrolling survive.

import { decimals, element } from "swarm/dom.js";
import { counted } from "swarm/page.js";
import { groupings } from "swarm/list-view.js";
import { quantile } from "swarm/scales.js";

/** Rows are grids, so that a browser skips invisible ones; roles describe them to screen readers.
 *  */
const td = (properties, ...content) => element("td", { role: "cell", ...properties }, ...content);

/** `onChoose`: called when the ticked rows change. */
export function listTable(view, chosen, onChoose) {
  const rows = element("tbody", { role: "rowgroup" });
  const head = element("tr", { role: "row" });
  const node = element("table", { className: "list runs", role: "table" }, element("thead", { role: "rowgroup" }, head), rows);
  const none = element("tr", { className: "whole", role: "row" }, td({ className: "muted" }));
  /** The rows of experiments by id, and those of groups by name. */
  let known = new Map();
  let groups = new Map();
  let experiments = new Map();
  let shown = [];
  let weights = 0;
  /** The shown rows, in order. */
  let found = [];

  const all = element("input", { type: "checkbox", "aria-label": "choose all shown experiments", onchange: () => {
    for (const it of found) choose(it.id, all.checked);
    onChoose();
  } });

  const choose = (id, isChosen) => {
    if (isChosen) chosen.add(id);
    else chosen.delete(id);
    const box = known.get(id)?.box;
    if (box) box.checked = isChosen;
  };

  let headSays = "";

  const drawHead = () => {
    const { name, sign } = view.order;
    const says = [name, sign, ...shown.map((it) => it.name)].join();
    if (says === headSays) return;
    headSays = says;
    const held = head.contains(document.activeElement) ? document.activeElement.dataset.column : null;
    node.style.setProperty("--columns", ["1.6rem", "minmax(12rem, 3fr)", ...shown.map((it) => it.width)].join(" "));
    const columns = [{ name: "id", title: "Experiment", isGreatFirst: true, value: true }, ...shown];
    head.replaceChildren(element("th", { role: "columnheader" }, all), ...columns.map((column) => {
      const isSorted = column.name === name;
      const mark = isSorted ? (sign > 0 ? " ▲" : " ▼") : "";
      const content = column.value ? element("button", { className: "sort", type: "button", "data-column": column.name, onclick: () => view.sortBy(column) }, `${column.title}${mark}`) : column.title;
      return element("th", { role: "columnheader", "aria-sort": isSorted ? (sign > 0 ? "ascending" : "descending") : "none" }, content);
    }));
    if (held) head.querySelector(`[data-column="${held}"]`)?.focus();
  };

  const row = (it) => {
    const box = element("input", { type: "checkbox", checked: chosen.has(it.id), "aria-label": `choose ${it.id} ${it.name}`, onchange: () => {
      choose(it.id, box.checked);
      onChoose();
    } });
    const made = { box, says: new Map(), cells: new Map(shown.map((column) => [column.name, td({ "data-label": column.title, className: column.name })])) };
    made.title = td({ className: "title" });
    made.node = element("tr", { "data-id": it.id, role: "row" }, td({ className: "choose" }, box), made.title, ...made.cells.values());
    return made;
  };

  /** Fills the changed cells of a row. */
  const fill = (made, it) => {
    const renew = (name, cell, says, content) => {
      const text = JSON.stringify(says);
      if (made.says.get(name) === text) return;
      made.says.set(name, text);
      cell.replaceChildren(...content());
    };
    const place = [it.group, it.variant, `seed ${it.seed}`, it.algorithm, it.forked_from && `fork of ${it.forked_from}`, it.archived && "archived"].filter(Boolean).join(" · ");
    renew("", made.title, [it.name, place], () => [element("a", { href: `/experiment/${it.id}` }, `${it.id} ${it.name}`), element("div", { className: "muted small" }, place)]);
    for (const column of shown) {
      renew(column.name, made.cells.get(column.name), (column.says ?? column.value)(it, weights), () => column.cell(it, weights));
    }
  };

  const rowOf = (it) => {
    const made = known.get(it.id) ?? row(it);
    if (!known.has(it.id)) fill(made, it);
    known.set(it.id, made);
    return made.node;
  };

  const groupRow = (name, members) => {
    const made = groups.get(name) ?? { node: element("tr", { className: "group whole", role: "row" }), says: "" };
    groups.set(name, made);
    const states = [...Map.groupBy(members, (it) => it.state)].map(([state, its]) => `${its.length} ${state}`).join(", ");
    const worth = members.map((it) => it.champion).filter((it) => it !== null).sort((a, b) => a - b);
    const middle = worth.length ? quantile(worth, 0.5) : null;
    const isOpen = view.isOpen(name);
    const ids = members.map((it) => it.id);
    const says = JSON.stringify([states, worth, isOpen, ids]);
    if (made.says === says) return made.node;
    made.says = says;
    const isHeld = made.node.contains(document.activeElement);
    const button = element("button", { type: "button", "aria-expanded": String(isOpen), onclick: () => view.toggle(name) }, `${isOpen ? "▾" : "▸"} ${name || "none"}`);
    made.node.replaceChildren(td({}, element("div", { className: "row" }, button,
      middle === null ? null : element("span", {}, element("b", {}, decimals(middle, 3)), element("span", { className: "muted" }, ` median worth of ${counted(worth.length, "champion")}, ${decimals(worth[0], 3)} to ${decimals(worth.at(-1), 3)}`)),
      element("span", { className: "muted" }, `${counted(members.length, "run")}: ${states}`),
      element("span", { className: "space" }), element("a", { href: `/compare?runs=${ids.join(",")}&as=groups` }, "compare"))));
    if (isHeld) made.node.querySelector("button").focus();
    return made.node;
  };

  /** Whether the user points at a row, or has the focus in one: then it stays in place. */
  const isHeld = () => rows.matches(":hover") || rows.contains(document.activeElement);

  /** Keeps the order of shown rows, and puts new ones between them. */
  const inPlace = (sorted) => {
    const places = new Map([...rows.children].map((it, place) => [Number(it.dataset.id), place]));
    const old = sorted.filter((it) => places.has(it.id)).sort((a, b) => places.get(a.id) - places.get(b.id));
    const fresh = sorted.filter((it) => !places.has(it.id));
    for (const it of fresh) {
      const at = old.findIndex((other) => view.compare(it, other) < 0);
      old.splice(at < 0 ? old.length : at, 0, it);
    }
    return old;
  };

  let byBefore = null;

  /** `isOrdered`: the user has chosen another order, which applies at once. */
  const draw = (isOrdered) => {
    const columns = view.shown;
    if (columns.length !== shown.length || columns.some((column, i) => column !== shown[i])) {
      shown = columns;
      known = new Map();
      rows.replaceChildren();
    }
    drawHead();
    found = [...experiments.values()].filter(view.filter()).sort(view.compare);
    if (!isOrdered && isHeld()) found = inPlace(found);
    const wanted = [];
    const by = groupings(experiments.values())[view.parts.by];
    if (view.parts.by !== byBefore) groups = new Map();
    byBefore = view.parts.by;
    if (by) {
      for (const [name, members] of Map.groupBy(found, by)) {
        wanted.push(groupRow(name, members));
        if (view.isOpen(name)) wanted.push(...members.map(rowOf));
      }
    } else {
      wanted.push(...found.map(rowOf));
    }
    if (found.length === 0) {
      none.firstChild.textContent = experiments.size ? "No experiment matches." : "There is no experiment yet: swarmctl submit FILE starts one.";
      wanted.push(none);
    }
    place(rows, wanted);
    all.checked = found.length > 0 && found.every((it) => chosen.has(it.id));
  };

  /** Takes the present experiments; `changed`: the ids of changed ones. */
  const update = (now, changed) => {
    experiments = now;
    const before = weights;
    weights = [...now.values()].reduce((sum, it) => sum + (it.state === "running" ? it.priority : 0), 0);
    for (const [id, made] of known) {
      const it = now.get(id);
      if (!it) {
        known.delete(id);
        chosen.delete(id);
      } else if (changed.has(id) || (weights !== before && it.state === "running")) fill(made, it);
    }
    draw(false);
  };
  // Rows with a new place move there when the user leaves them.
  rows.addEventListener("pointerleave", () => draw(false));

  /** The listed runs in order, as a table: the identity of each run, and the shown columns. */
  const rowsToSave = () => {
    const names = ["id", "name", "group", "variant", "seed"];
    const columns = shown.filter((it) => !names.includes(it.name));
    return [[...names, ...columns.map((it) => it.name)], ...found.map((it) => [...names.map((name) => it[name]), ...columns.map((column) => (column.saved ?? column.value)(it))])];
  };

  return { node, update, redraw: () => draw(true), count: () => found.length, rowsToSave };
}

/** Gives an element exactly these children in this order, with as few moves as possible. */
function place(parent, wanted) {
  const kept = new Set(wanted);
  for (const child of [...parent.children]) if (!kept.has(child)) child.remove();
  let at = parent.firstChild;
  for (const node of wanted) {
    if (node === at) at = at.nextSibling;
    // A moved element keeps its focus if the browser supports that.
    else if (node.isConnected && parent.moveBefore) parent.moveBefore(node, at);
    else parent.insertBefore(node, at);
  }
}
