// Charts as SVG: lines over bands with axes, with zoom, keys and export.

import { decimals, element, onKeys } from "swarm/dom.js";
import { exports, seriesTable } from "swarm/export.js";
import { STOPS, clamp, extremes, thinned, ticks } from "swarm/scales.js";

const SVG = "http://www.w3.org/2000/svg";
/** Maximum number of entries in a closed legend. */
const LEGEND_MAX = 14;
/** Maximum number of lines whose values are read out. */
const READ_MAX = 4;

export function shape(tag, attributes, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** A text of an axis. */
export function text(x, y, content, more = {}) {
  return shape("text", { x, y, class: "axis", ...more }, content);
}

/** A small curve without axes. */
export function sparkline(values, width = 120, height = 28) {
  const svg = shape("svg", { class: "sparkline", viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" });
  const [low, high] = extremes(values);
  if (values.length < 2) return svg;
  const x = (i) => (i / (values.length - 1)) * (width - 2) + 1;
  const y = (value) => height - 2 - ((value - low) / (high - low || 1)) * (height - 4);
  svg.append(shape("path", { d: path(values.map((value, i) => [x(i), y(value)])) }));
  return svg;
}

export function path(points) {
  return points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}

/** Margins around the cells of a map, pixels; left and right as in charts, so that generations are
 *  aligned. */
export const EDGE = { left: 58, right: 12, top: 6, bottom: 40 };

/** A frame around a cell of a map, visible on every colour. */
export function markCell(context, x, y, width, height) {
  for (const [style, wide] of [["#000000", 4], ["#ffffff", 2]]) {
    context.strokeStyle = style;
    context.lineWidth = wide;
    context.strokeRect(x, y, Math.max(width, 3), Math.max(height, 3));
  }
}

/** The legend of the colours of fitness. */
export function fitnessScale(low, high) {
  const ramp = element("i", { className: "ramp" });
  ramp.style.background = `linear-gradient(to right, ${STOPS.map((color) => `rgb(${color.join(" ")})`).join(", ")})`;
  return [`fitness ≤ ${decimals(low, 2)} `, ramp, ` ≥ ${decimals(high, 2)}`];
}

/** A map for a file: its axes, and the canvas of its cells within them. `stage`: the element of the
 *  page that holds both. */
export function mapFigure(stage, axes, cells) {
  const svg = axes.cloneNode(true);
  const box = { x: EDGE.left, y: EDGE.top, width: cells.clientWidth, height: cells.clientHeight };
  svg.append(shape("image", { ...box, preserveAspectRatio: "none", href: cells.toDataURL() }), shape("path", { d: path([[box.x, box.y], [box.x, box.y + box.height], [box.x + box.width, box.y + box.height]]), fill: "none" }));
  // Only elements of a page have a style.
  svg.style.position = "absolute";
  svg.style.visibility = "hidden";
  stage.append(svg);
  queueMicrotask(() => svg.remove());
  return svg;
}

/** The plane of a figure. `inner`: the edges of its area; `x0` to `x1` and `y0` to `y1`: the visible
 *  values; `x` and `y`: the pixel of a value. */
function planeOf(inner, [x0, x1], [y0, y1]) {
  const x = (value) => inner.left + ((value - x0) / (x1 - x0 || 1)) * (inner.right - inner.left);
  const y = (value) => inner.bottom - ((value - y0) / (y1 - y0)) * (inner.bottom - inner.top);
  return { inner, x0, x1, x, y0, y1, y };
}

/** The range of values with room at both ends, a share of its length. */
function roomy(values, share) {
  const [low, high] = extremes(values);
  const room = high - low < 1e-12 ? 0.5 : share * (high - low);
  return [low - room, high + room];
}

/** Draws the axes of a scatter plot into the SVG `frame`, and returns its plane; null without points
 *  or size. `xs` and `ys`: the values of the points; `room`: around them, as shares of their ranges. */
export function scatterPlane(stage, frame, xs, ys, room, xLabel, yLabel) {
  const [width, height] = [stage.clientWidth, stage.clientHeight];
  frame.replaceChildren();
  if (!width || xs.length === 0) return null;
  const inner = { left: EDGE.left, right: width - EDGE.right, top: EDGE.top, bottom: height - EDGE.bottom };
  const plane = planeOf(inner, roomy(xs, room), roomy(ys, room));
  frame.setAttribute("viewBox", `0 0 ${width} ${height}`);
  frame.append(...axes(plane, height, xLabel, yLabel));
  return plane;
}

/** Lines and labels of both axes of a plane. */
function axes({ inner, x0, x1, x, y0, y1, y }, height, xLabel, yLabel) {
  const heights = ticks(y0, y1, 5);
  const places = ticks(x0, x1, Math.min(8, (inner.right - inner.left) / 90));
  // As many digits as distinguish neighbouring ticks.
  const digits = Math.max(0, Math.ceil(-Math.log10(heights[1] - heights[0] || 1) - 1e-9));
  const middle = (inner.top + inner.bottom) / 2;
  return [
    ...heights.flatMap((tick) => [
      shape("line", { x1: inner.left, x2: inner.right, y1: y(tick), y2: y(tick), class: "grid" }),
      text(inner.left - 6, y(tick) + 4, decimals(tick, digits), { "text-anchor": "end" })]),
    ...places.map((tick) => text(x(tick), inner.bottom + 16, String(Number(tick.toPrecision(6))).replace("-", "−"), { "text-anchor": "middle" })),
    text((inner.left + inner.right) / 2, height - 6, xLabel, { "text-anchor": "middle" }),
    text(14, middle, yLabel, { "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` }),
  ];
}

/** A chart. `show({ lines, bands, marks, xLabel, yLabel })`: a line is `{ name, color, dash,
 *  points: [[x, y], ...] }`, a band the same with `[x, low, high]`, a mark a height with an
 *  interval. Dragging zooms along x, a double click shows all again; with the focus, arrows go
 *  through the points, + and - zoom, and Escape shows all. `onZoom(range)`: called with the visible
 *  part, null for all; `zoom(range)` shows a part. `empty`: the text while there are no data. */
export function chart(label, { onZoom = () => {}, empty = "there is nothing to show yet" } = {}) {
  const node = element("figure", { className: "chart" });
  const legend = element("div", { className: "keys" });
  const svg = shape("svg", { role: "group", "aria-roledescription": "chart", "aria-label": `${label}; arrow keys go through it, + and - zoom`, tabindex: "0" });
  const readout = element("span", { className: "readout muted", role: "status" });
  const files = exports({ svg: () => svg, table: () => seriesTable(shown.xLabel, shown.lines, shown.bands ?? []), name: () => label.replaceAll(/\W+/g, "-") });
  node.append(svg, element("figcaption", {}, legend, readout, files));
  let shown = null;
  let zoom = null;
  let held = null;
  let frame = null;
  /** The position of the readout; null: none. */
  let cursor = null;
  /** The highlighted line; null: none. */
  let marked = null;
  let isLong = false;

  const draw = () => {
    if (!shown) return;
    const { lines = [], bands = [], marks = [], xLabel, yLabel } = shown;
    const [width, height] = [Math.max(260, svg.clientWidth), Math.max(160, svg.clientHeight)];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const inner = { left: 58, right: width - 12, top: 10, bottom: height - 40 };
    const all = [...lines.flatMap((line) => line.points), ...bands.flatMap((band) => band.points)];
    files.hidden = all.length === 0;
    frame = null;
    if (all.length === 0) {
      legend.replaceChildren();
      return svg.replaceChildren(text(width / 2, height / 2, empty, { "text-anchor": "middle" }));
    }
    const [x0, x1] = zoom ?? extremes(all.map((point) => point[0]));
    const seen = all.filter(([x]) => x >= x0 && x <= x1);
    const heights = [...seen.flatMap((point) => point.slice(1)), ...marks.flatMap((mark) => [mark.low, mark.high])];
    frame = planeOf(inner, [x0, x1], roomy(heights, 0.04));
    svg.replaceChildren(...axes(frame, height, xLabel, yLabel), curves(frame, { lines, bands, marks }), shape("g", { class: "cursor" }));
    drawLegend([...lines, ...marks]);
    drawCursor();
  };

  const curves = ({ inner, x0, x1, x, y }, { lines, bands, marks }) => {
    const inView = (points) => points.filter((point, i) => (points[i + 1]?.[0] ?? point[0]) >= x0 && (points[i - 1]?.[0] ?? point[0]) <= x1);
    const clip = shape("clipPath", { id: clipId }, shape("rect", { x: inner.left, y: 0, width: inner.right - inner.left, height: inner.bottom + 2 }));
    const clipped = shape("g", { "clip-path": `url(#${clipId})` }, clip);
    for (const { color, points } of bands) {
      const kept = inView(points);
      const step = Math.ceil(kept.length / 800);
      const thin = kept.filter((_, i) => i % step === 0 || i === kept.length - 1);
      const outline = [...thin.map(([at, , high]) => [x(at), y(high)]), ...thin.map(([at, low]) => [x(at), y(low)]).reverse()];
      if (outline.length) clipped.append(shape("path", { d: `${path(outline)}Z`, fill: color, class: "band" }));
    }
    for (const { name, color, dash, points } of lines) {
      const kept = thinned(inView(points), 500).map(([at, value]) => [x(at), y(value)]);
      const isFaint = marked !== null && marked !== name;
      if (kept.length) clipped.append(shape("path", { d: path(kept), stroke: color, "stroke-dasharray": dash || "none", class: isFaint ? "line faint" : "line", "data-name": name }));
    }
    for (const { low, high, value, color } of marks) {
      clipped.append(shape("rect", { x: inner.left, width: inner.right - inner.left, y: y(high), height: Math.max(1, y(low) - y(high)), fill: color, class: "band" }));
      clipped.append(shape("line", { x1: inner.left, x2: inner.right, y1: y(value), y2: y(value), stroke: color, "stroke-dasharray": "5 4" }));
    }
    return clipped;
  };

  const drawLegend = (entries) => {
    const says = JSON.stringify([entries.map((it) => [it.name, it.color, it.dash]), marked, isLong]);
    if (legend.dataset.says === says) return;
    legend.dataset.says = says;
    const held = legend.contains(document.activeElement) ? document.activeElement.dataset.name : null;
    const keys = entries.map(({ name, color, dash }) => {
      const swatch = shape("svg", { class: "swatch", viewBox: "0 0 22 8", "aria-hidden": "true" }, shape("line", { x1: 1, x2: 21, y1: 4, y2: 4, stroke: color, "stroke-dasharray": dash || "none" }));
      const key = element("button", { type: "button", className: "key", title: "highlight it", "aria-pressed": String(marked === name), onclick: () => {
        marked = marked === name ? null : name;
        draw();
      } }, swatch, name);
      key.dataset.name = name;
      return key;
    });
    const rest = keys.length - LEGEND_MAX;
    const more = rest > 0 ? element("button", { type: "button", className: "key muted", onclick: () => {
      isLong = !isLong;
      draw();
    } }, isLong ? "fewer" : `${rest} more`) : null;
    legend.replaceChildren(...(isLong ? keys : keys.slice(0, LEGEND_MAX)), ...(more ? [more] : []));
    if (held) [...legend.children].find((it) => it.dataset.name === held)?.focus();
  };

  /** Reads out the points next to the cursor. */
  const drawCursor = () => {
    const group = svg.querySelector(".cursor");
    if (!group || !frame || cursor === null) {
      group?.replaceChildren();
      readout.textContent = "";
      return;
    }
    const nearest = (points) => points.reduce((a, b) => (Math.abs(b[0] - cursor) < Math.abs(a[0] - cursor) ? b : a));
    const lines = shown.lines.filter((line) => line.points.length);
    const read = marked === null ? lines.slice(0, READ_MAX) : lines.filter((line) => line.name === marked);
    const values = read.map((line) => [line.name, nearest(line.points)]);
    const at = values[0]?.[1][0] ?? cursor;
    readout.textContent = `${shown.xLabel} ${Math.round(at)}: ${values.map(([name, [, value]]) => `${name} ${decimals(value, 3)}`).join(", ")}`;
    const x = frame.x(at);
    group.replaceChildren(shape("line", { x1: x, x2: x, y1: frame.inner.top, y2: frame.inner.bottom }));
  };

  const zoomTo = (range, isOurs = true) => {
    if (String(range) === String(zoom)) return;
    zoom = range;
    draw();
    if (isOurs) onZoom(zoom);
  };

  const xAt = (event) => {
    const box = svg.getBoundingClientRect();
    const share = (event.clientX - box.left - frame.inner.left) / (frame.inner.right - frame.inner.left);
    return frame.x0 + Math.max(0, Math.min(1, share)) * (frame.x1 - frame.x0);
  };
  svg.addEventListener("pointerdown", (event) => {
    if (!frame) return;
    held = xAt(event);
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    if (!frame) return;
    cursor = xAt(event);
    drawCursor();
  });
  svg.addEventListener("pointerleave", () => {
    cursor = null;
    drawCursor();
  });
  svg.addEventListener("pointerup", (event) => {
    if (held === null || !frame) return;
    const [from, to] = [held, xAt(event)].sort((a, b) => a - b);
    held = null;
    if ((to - from) / (frame.x1 - frame.x0) > 0.02) zoomTo([from, to]);
  });
  svg.addEventListener("dblclick", () => zoomTo(null));
  onKeys(svg, (by) => {
    if (!frame) return null;
    const points = shown.lines.find((line) => line.points.length)?.points ?? [];
    const inside = points.map(([x]) => x).filter((x) => x >= frame.x0 && x <= frame.x1);
    const place = cursor === null ? -1 : inside.findLastIndex((x) => x <= cursor);
    const look = (at) => {
      cursor = at ?? null;
      drawCursor();
    };
    const go = (to) => look(inside[clamp(to, inside.length)]);
    const scaled = (factor) => {
      const middle = cursor ?? (frame.x0 + frame.x1) / 2;
      const [low, high] = extremes(points.map(([x]) => x));
      const range = [middle - (middle - frame.x0) * factor, middle + (frame.x1 - middle) * factor];
      const isAll = range[0] <= low && range[1] >= high;
      zoomTo(isAll ? null : [Math.max(low, range[0]), Math.min(high, range[1])]);
    };
    return {
      ArrowRight: () => go(place + by), ArrowLeft: () => go((place < 0 ? inside.length : place) - by), Home: () => go(0), End: () => go(inside.length - 1),
      "+": () => scaled(0.5), "=": () => scaled(0.5), "-": () => scaled(2), Escape: () => {
        look(null);
        zoomTo(null);
      },
    };
  });
  new ResizeObserver(draw).observe(node);
  node.show = (content) => {
    shown = content;
    draw();
  };
  node.zoom = (range) => zoomTo(range, false);
  const clipId = `clip-${++n_charts}`;
  return node;
}

let n_charts = 0;
