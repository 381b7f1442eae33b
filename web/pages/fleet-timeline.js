// Who computed what lately: a row for each worker, a lane for each of its slots.

import { canvas, color, decimals, element } from "swarm/dom.js";
import { span } from "swarm/page.js";

/** Rows of workers that are drawn at most. */
const WORKERS_MAX = 64;
/** Lanes of a worker that are drawn at most. */
const LANES_MAX = 16;
/** No look goes back further, ms. */
const LONGEST = 300_000;
/** Pixels. */
const [AXIS, GAP] = [22, 6];

/** What is said of each fate, and its colour. */
const FATES = {
  computed: ["computed", "--line"],
  unanswered: ["no answer yet", "--relay"],
  "taken-back": ["not needed any more", "--muted"],
  failed: ["failed", "--bad"],
  lost: ["lost with its worker", "--bad"],
};

/** Puts the assignments of a worker into lanes. Results say when they were computed; of the
 *  others only when they were given is known, so each takes what is left free before its end,
 *  and those for which nothing is left had not begun. */
export function inLanes(assignments, n_lanes) {
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

/** The timeline; `show(answer, workers)` draws what the server says. */
export function fleetTimeline() {
  let rows = [];
  let now = 0;
  let window = [0, 1];
  let answer = null;
  let slots = new Map();

  const choice = element("select", { "aria-label": "how far back", onchange: () => arrange() },
    ...[["", "all that is known"], ["1000", "1 s"], ["10000", "10 s"], ["60000", "1 min"]].map(([value, text]) => element("option", { value }, text)));
  const readout = element("p", { className: "muted small" });
  const picture = canvas((context, width, height) => draw(context, width, height), "who computed what");
  const broken = element("ul", { className: "events broken" });
  const keys = Object.entries(FATES).filter(([fate]) => fate !== "failed").map(([fate, [text]]) =>
    element("span", { className: "key" }, element("i", { className: fate }), fate === "lost" ? "failed, or lost" : text));
  const node = element("section", { className: "panel fleet-timeline" },
    element("header", { className: "row" }, element("h2", {}, "Who computed what"), element("span", { className: "space" }), choice),
    picture, element("p", { className: "row small muted" }, ...keys), readout, broken);

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
      return { name, id, isGone: !slots.has(id), n_lanes, its: inLanes(its, n_lanes) };
    }).sort((a, b) => a.id - b.id);
    const n_more = Math.max(0, rows.length - WORKERS_MAX);
    rows = rows.slice(0, WORKERS_MAX);
    readout.textContent = n_more ? `${n_more} more workers have no room` : "\u00a0";
    broken.replaceChildren(...brokenLines(all));
    node.dataset.assignments = all.length;
    picture.style.height = `${AXIS + rows.reduce((sum, row) => sum + height(row) + GAP, 0)}px`;
    picture.redraw();
  };

  /** Assignments without a result, those of a worker and a batch in one line. */
  const brokenLines = (all) => {
    const lines = Map.groupBy(all.filter((it) => it.fate === "lost" || it.fate === "failed"), (it) => `${it.worker} ${it.number} ${it.fate} ${Math.round(it.end / 100)}`);
    return [...lines.values()].sort((a, b) => b[0].end - a[0].end).slice(0, 20).map((its) => {
      const { worker, fate, end, batch } = its[0];
      const individuals = its.map((it) => it.individual).sort((a, b) => a - b);
      return element("li", {}, element("time", { className: "muted" }, new Date(now + end).toLocaleTimeString()),
        ` ${answer.workers[worker][1]}: `, element("span", { className: "bad" }, FATES[fate][0]),
        `, ${batch}, ${individuals.length === 1 ? "individual" : "individuals"} ${individuals.slice(0, 12).join(", ")}${individuals.length > 12 ? ", …" : ""}`);
    });
  };

  // Few workers have more room each.
  const height = (row) => Math.max(rows.length > 8 ? 14 : 22, row.n_lanes * (row.n_lanes > 4 ? 5 : 9));
  const left = (width) => (width < 600 ? 70 : 130);
  const x = (at, width) => left(width) + ((at - window[0]) / (window[1] - window[0])) * (width - left(width) - 4);

  const draw = (context, width, total) => {
    const begin = left(width);
    context.clearRect(0, 0, width, total);
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "middle";
    const [ink, muted, grid] = ["--ink", "--muted", "--grid"].map(color);
    const length = window[1] - window[0];
    const ago = (at) => (step < 10 ? span(-at) : `${Number((-at / 1000).toFixed(3))} s`);
    const power = 10 ** Math.floor(Math.log10(length / 4));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((it) => it >= length / (width > 700 ? 8 : 4)) ?? 10 * power;
    for (let at = 0; at >= window[0]; at -= step) {
      context.fillStyle = grid;
      context.fillRect(Math.round(x(at, width)), 0, 1, total - AXIS);
      context.fillStyle = muted;
      context.textAlign = at === 0 ? "right" : "center";
      context.fillText(at === 0 ? "now" : `−${ago(at)}`, at === 0 ? width - 2 : x(at, width), total - AXIS / 2);
    }
    let top = 0;
    for (const row of rows) {
      const tall = height(row);
      const lane = tall / row.n_lanes;
      context.textAlign = "left";
      context.fillStyle = row.isGone ? muted : ink;
      context.fillText(row.name, 0, top + tall / 2, begin - 8);
      context.fillStyle = grid;
      context.fillRect(begin, top + tall + GAP / 2, width - begin, 1);
      for (const it of row.its) {
        if (it.end < window[0]) continue;
        const [from, to] = [Math.max(begin, x(it.start, width)), x(it.end, width)];
        const y = top + it.lane * lane;
        context.fillStyle = color(FATES[it.fate][1]);
        // One generation is told from the next.
        context.globalAlpha = it.fate === "computed" && it.number % 2 ? 0.55 : it.fate === "taken-back" ? 0.45 : 1;
        const wide = Math.max(1, to - from - (to - from > 4 ? 1 : 0));
        context.fillRect(from, y, wide, lane - 1);
        context.globalAlpha = 1;
        if (it.fate === "lost" || it.fate === "failed") context.fillText("✕", to - 5, y + lane / 2);
      }
      top += tall + GAP;
    }
    if (rows.length === 0) {
      context.fillStyle = muted;
      context.textAlign = "center";
      context.fillText("nothing was computed lately", width / 2, total / 2);
    }
  };

  picture.addEventListener("pointermove", (event) => {
    const box = picture.getBoundingClientRect();
    const begin = left(box.width);
    const at = window[0] + ((event.clientX - box.left - begin) / (box.width - begin - 4)) * (window[1] - window[0]);
    let top = 0;
    for (const row of rows) {
      const inside = event.clientY - box.top - top;
      if (inside >= 0 && inside < height(row)) {
        const lane = Math.floor(inside / (height(row) / row.n_lanes));
        const found = row.its.find((it) => it.lane === lane && at >= it.start && at <= it.end);
        readout.textContent = found
          ? `${row.name}: ${found.batch}, individual ${found.individual}, trials ${found.trials[0]} to ${found.trials[1] - 1}; ${FATES[found.fate][0]}, ${decimals(found.end - found.start, 1)} ms`
          : row.name;
        return;
      }
      top += height(row) + GAP;
    }
  });
  node.show = (latest, workers) => {
    // Who points at something wants it to stay.
    if (picture.matches(":hover")) return;
    answer = latest;
    now = Date.now();
    slots = new Map(workers.map((it) => [it.id, it.slots]));
    arrange();
  };
  return node;
}
