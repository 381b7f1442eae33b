// The latest work of the fleet: a row for each worker, a lane for each of its slots.

import { shape, text } from "swarm/charts.js";
import { decimals, element, onKeys } from "swarm/dom.js";
import { exports } from "swarm/export.js";
import { span } from "swarm/page.js";
import { clamp } from "swarm/scales.js";

/** Maximum number of drawn rows of workers. */
const WORKERS_MAX = 64;
/** Maximum number of drawn lanes of a worker. */
const LANES_MAX = 16;
/** The longest shown time, ms. */
const LONGEST = 300_000;
/** Pixels. */
const [AXIS, GAP, LETTER] = [22, 6, 7];

/** The text of each outcome; the style has its colour. */
const FATES = {
  computed: "computed",
  unanswered: "no answer yet",
  "taken-back": "not needed any more",
  failed: "failed",
  lost: "lost with its worker",
};

/** Puts the assignments of a worker into lanes. Results state their time of computing. Other
 *  assignments have only the time of sending: each takes the free time before its end. An assignment
 *  without free time had not begun. */
function inLanes(assignments, n_lanes) {
  const lanes = Array.from({ length: n_lanes }, () => []);
  const placed = [];
  const put = (it, lane, start) => {
    lanes[lane].push([start, it.end]);
    placed.push({ ...it, lane, start });
  };
  const isTimed = (it) => it.fate === "computed";
  const timed = assignments.filter(isTimed).sort((a, b) => a.start - b.start);
  const latest = lanes.map(() => -Infinity);
  for (const it of timed) {
    const free = latest.findIndex((end) => end <= it.start);
    const lane = free >= 0 ? free : latest.indexOf(Math.min(...latest));
    put(it, lane, Math.max(it.start, latest[lane]));
    latest[lane] = Math.max(it.end, latest[lane]);
  }
  for (const it of assignments.filter((it) => !isTimed(it)).sort((a, b) => a.start - b.start)) {
    const starts = lanes.map((taken) => taken.reduce((from, [start, end]) => (start < it.end ? Math.max(from, end) : from), it.start));
    const start = Math.min(...starts);
    const isSeen = start < it.end || it.fate === "lost" || it.fate === "failed";
    if (isSeen) put(it, starts.indexOf(start), Math.min(start, it.end));
  }
  return placed;
}

/** The timeline; `show(answer, workers)` draws the server's answer. */
export function fleetTimeline() {
  let rows = [];
  let now = 0;
  let window = [0, 1];
  let answer = null;
  let slots = new Map();
  /** The readout: a row, and an assignment in it if any; null: none. */
  let cursor = null;

  const choice = element("select", { "aria-label": "how far back", onchange: () => arrange() },
    ...[["", "all known time"], ["1000", "1 s"], ["10000", "10 s"], ["60000", "1 min"]].map(([value, text]) => element("option", { value }, text)));
  const readout = element("p", { className: "muted small readout", role: "status" });
  const more = element("p", { className: "muted small" });
  const picture = shape("svg", { role: "group", tabindex: "0", "aria-roledescription": "timeline", "aria-label": "latest work of the workers; left and right go through the work of a worker, up and down through workers, Escape continues" });
  const files = exports({ svg: () => picture, table: () => table(), name: () => "timeline" });
  const broken = element("ul", { className: "events broken" });
  const keys = Object.entries(FATES).filter(([fate]) => fate !== "failed").map(([fate, text]) =>
    element("span", { className: "key" }, element("i", { className: fate }), fate === "lost" ? "failed, or lost" : text));
  const node = element("section", { className: "panel fleet-timeline" },
    element("header", { className: "row" }, element("h2", {}, "Latest work"), element("span", { className: "space" }), choice),
    picture, element("div", { className: "row small muted" }, ...keys, files), readout, more, broken);

  const arrange = () => {
    if (!answer) return;
    const all = answer.assignments.map(([worker, batch, individual, first, end, given, ended, busy, fate]) => ({
      worker, batch: answer.batches[batch][0], number: batch, individual, trials: [first, end], fate,
      end: -ended / 1000, start: -(fate === "computed" ? ended + busy : given) / 1000, given: -given / 1000,
    }));
    const earliest = Math.max(-LONGEST, Math.min(-100, ...all.filter((it) => it.fate === "computed" || it.fate === "unanswered").map((it) => it.start)));
    window = [choice.value ? Math.max(-Number(choice.value), -LONGEST) : earliest, 0];
    const byWorker = Map.groupBy(all.filter((it) => it.end >= window[0]), (it) => it.worker);
    rows = [...byWorker].map(([worker, its]) => {
      const [id, name] = answer.workers[worker];
      const n_lanes = Math.min(LANES_MAX, slots.get(id) ?? 1);
      return { name, id, isGone: !slots.has(id), n_lanes, its: inLanes(its, n_lanes).filter((it) => it.end >= window[0]).sort((a, b) => a.start - b.start || a.lane - b.lane) };
    }).sort((a, b) => a.id - b.id);
    const n_more = Math.max(0, rows.length - WORKERS_MAX);
    rows = rows.slice(0, WORKERS_MAX);
    more.textContent = n_more ? `${n_more} more workers do not fit` : "";
    cursor = null;
    broken.replaceChildren(...brokenLines(all));
    node.dataset.assignments = all.length;
    draw();
  };

  /** Assignments without a result, those of a worker and a batch in one line. */
  const brokenLines = (all) => {
    const lines = Map.groupBy(all.filter((it) => it.fate === "lost" || it.fate === "failed"), (it) => `${it.worker} ${it.number} ${it.fate} ${Math.round(it.end / 100)}`);
    return [...lines.values()].sort((a, b) => b[0].end - a[0].end).slice(0, 20).map((its) => {
      const { worker, fate, end, batch } = its[0];
      const individuals = its.map((it) => it.individual).sort((a, b) => a - b);
      return element("li", {}, element("time", { className: "muted" }, new Date(now + end).toLocaleTimeString()),
        ` ${answer.workers[worker][1]}: `, element("span", { className: "bad" }, FATES[fate]),
        `, ${batch}, ${individuals.length === 1 ? "individual" : "individuals"} ${individuals.slice(0, 12).join(", ")}${individuals.length > 12 ? ", …" : ""}`);
    });
  };

  // With few workers, each gets more room.
  const height = (row) => Math.max(rows.length > 8 ? 14 : 22, row.n_lanes * (row.n_lanes > 4 ? 5 : 9));
  const left = (width) => (width < 600 ? 70 : 130);
  const x = (at, width) => left(width) + ((at - window[0]) / (window[1] - window[0])) * (width - left(width) - 4);

  const draw = () => {
    const width = Math.max(260, picture.clientWidth);
    const total = AXIS + Math.max(AXIS, rows.reduce((sum, row) => sum + height(row) + GAP, 0));
    picture.setAttribute("viewBox", `0 0 ${width} ${total}`);
    picture.style.height = `${total}px`;
    picture.replaceChildren(...timeAxis(width, total), shape("g", {}, ...bars(width)), shape("g", { class: "cursor" }));
    if (rows.length === 0) picture.append(text(width / 2, AXIS, "no work lately", { "text-anchor": "middle" }));
    drawCursor();
  };

  const timeAxis = (width, total) => {
    const length = window[1] - window[0];
    const power = 10 ** Math.floor(Math.log10(length / 4));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((it) => it >= length / (width > 700 ? 8 : 4)) ?? 10 * power;
    const ago = (at) => (step < 10 ? span(-at) : `${Number((-at / 1000).toFixed(3))} s`);
    const nodes = [text(width - 2, total - 6, "now", { "text-anchor": "end" })];
    for (let at = 0; at >= window[0]; at -= step) {
      nodes.push(shape("line", { x1: x(at, width), x2: x(at, width), y1: 0, y2: total - AXIS, class: "grid" }));
      if (at < 0) nodes.push(text(x(at, width), total - 6, `−${ago(at)}`, { "text-anchor": "middle" }));
    }
    return nodes;
  };

  const bars = (width) => {
    const begin = left(width);
    const room = Math.floor((begin - 8) / LETTER);
    const nodes = [];
    let top = 0;
    for (const row of rows) {
      const tall = height(row);
      row.top = top;
      const name = row.name.length > room ? `${row.name.slice(0, room - 1)}…` : row.name;
      nodes.push(text(0, top + tall / 2 + 4, name, { class: row.isGone ? "axis" : "axis name" }),
        shape("line", { x1: begin, x2: width, y1: top + tall + GAP / 2, y2: top + tall + GAP / 2, class: "grid" }));
      for (const it of row.its) {
        const box = boxOf(row, it, width);
        // Neighbouring generations differ in colour.
        nodes.push(shape("rect", { ...box, class: it.number % 2 ? `${it.fate} odd` : it.fate }));
        if (it.fate === "lost" || it.fate === "failed") nodes.push(text(box.x + box.width, box.y + box.height / 2 + 4, "✕", { class: "axis lost", "text-anchor": "end" }));
      }
      top += tall + GAP;
    }
    return nodes;
  };

  /** The rectangle of an assignment. */
  const boxOf = (row, it, width) => {
    const lane = height(row) / row.n_lanes;
    const [from, to] = [Math.max(left(width), x(it.start, width)), x(it.end, width)];
    return { x: from, y: row.top + it.lane * lane, width: Math.max(1, to - from - (to - from > 4 ? 1 : 0)), height: lane - 1 };
  };

  /** Frames the assignment of the cursor, and reads it out. */
  const drawCursor = () => {
    const group = picture.querySelector(".cursor");
    const { row, it } = cursor ?? {};
    readout.textContent = !row ? "\u00a0" : !it ? row.name
      : `${row.name}: ${it.batch}, individual ${it.individual}, trials ${it.trials[0]} to ${it.trials[1] - 1}; ${FATES[it.fate]}, ${decimals(it.end - it.start, 1)} ms`;
    if (!it) return group?.replaceChildren();
    const box = boxOf(row, it, Math.max(260, picture.clientWidth));
    return group.replaceChildren(shape("rect", { ...box, x: box.x - 1, y: box.y - 1, width: box.width + 2, height: box.height + 2 }));
  };

  /** The drawn assignments, as a table. */
  const table = () => [["worker", "lane", "batch", "individual", "first trial", "end of trials", "start, ms", "end, ms", "fate"],
    ...rows.flatMap((row) => row.its.map((it) => [row.name, it.lane, it.batch, it.individual, ...it.trials, it.start, it.end, it.fate]))];

  const goTo = (to) => {
    cursor = to;
    drawCursor();
  };
  picture.addEventListener("pointermove", (event) => {
    const box = picture.getBoundingClientRect();
    const begin = left(box.width);
    const at = window[0] + ((event.clientX - box.left - begin) / (box.width - begin - 4)) * (window[1] - window[0]);
    const inside = (row) => event.clientY - box.top - row.top;
    const row = rows.find((it) => inside(it) >= 0 && inside(it) < height(it));
    if (!row) return;
    const lane = Math.floor(inside(row) / (height(row) / row.n_lanes));
    goTo({ row, it: row.its.find((it) => it.lane === lane && at >= it.start && at <= it.end) });
  });
  picture.addEventListener("pointerleave", () => goTo(null));
  picture.addEventListener("blur", () => goTo(null));
  onKeys(picture, (by) => {
    if (rows.length === 0) return null;
    const row = cursor?.row ?? rows[0];
    const place = cursor?.it ? row.its.indexOf(cursor.it) : -1;
    const go = (to) => goTo({ row, it: row.its[clamp(to, row.its.length)] });
    // Keeps the time, at another worker.
    const goToRow = (to) => {
      const other = rows[clamp(to, rows.length)];
      const at = cursor?.it?.start ?? window[1];
      const nearest = (a, b) => (Math.abs(b.start - at) < Math.abs(a.start - at) ? b : a);
      goTo({ row: other, it: other.its.length ? other.its.reduce(nearest) : undefined });
    };
    return { ArrowRight: () => go(place + by), ArrowLeft: () => go((place < 0 ? row.its.length : place) - by), Home: () => go(0), End: () => go(row.its.length - 1),
      ArrowDown: () => goToRow(cursor ? rows.indexOf(row) + 1 : 0), ArrowUp: () => goToRow(rows.indexOf(row) - 1), Escape: () => goTo(null) };
  });
  new ResizeObserver(draw).observe(node);
  node.show = (latest, workers) => {
    // While the user points at an assignment, or goes through assignments with keys, the picture
    // stays.
    if (picture.matches(":hover") || cursor) return;
    answer = latest;
    now = Date.now();
    slots = new Map(workers.map((it) => [it.id, it.slots]));
    arrange();
  };
  return node;
}
