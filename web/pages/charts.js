// Charts as SVG: lines over bands, with axes, that zoom.

import { decimals, element } from "swarm/dom.js";

const SVG = "http://www.w3.org/2000/svg";

function shape(tag, attributes, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** A small curve without axes. */
export function sparkline(values, width = 120, height = 28) {
  const svg = shape("svg", { class: "sparkline", viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" });
  const [low, high] = [Math.min(...values), Math.max(...values)];
  if (values.length < 2) return svg;
  const x = (i) => (i / (values.length - 1)) * (width - 2) + 1;
  const y = (value) => height - 2 - ((value - low) / (high - low || 1)) * (height - 4);
  svg.append(shape("path", { d: path(values.map((value, i) => [x(i), y(value)])) }));
  return svg;
}

function path(points) {
  return points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}

/** Round numbers within a range, about `n` of them. */
function ticks(low, high, n) {
  const raw = (high - low) / n || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= raw);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => (first + i) * step);
}

/** At most a few hundred points of a curve, so that ten thousand generations draw at once:
 *  of each piece its first, least and greatest. */
function thinned(points, n) {
  if (points.length <= 3 * n) return points;
  const piece = Math.ceil(points.length / n);
  const kept = [];
  for (let i = 0; i < points.length; i += piece) {
    const part = points.slice(i, i + piece);
    const least = part.reduce((a, b) => (b[1] < a[1] ? b : a));
    const greatest = part.reduce((a, b) => (b[1] > a[1] ? b : a));
    kept.push(...[...new Set([part[0], least, greatest])].sort((a, b) => a[0] - b[0]));
  }
  return kept;
}

/** A chart. `show({ lines, bands, marks, xLabel, yLabel })`: a line is
 *  `{ name, color, points: [[x, y], ...] }`, a band the same with `[x, low, high]`, a mark a
 *  height with an interval. Dragging zooms along x, a double click shows all again. */
export function chart(label) {
  const node = element("figure", { className: "chart" });
  const legend = element("figcaption", {});
  const svg = shape("svg", { role: "img", "aria-label": label, tabindex: "0" });
  const readout = element("span", { className: "readout muted" });
  node.append(svg, legend);
  let shown = null;
  let zoom = null;
  let held = null;
  let frame = null;

  const draw = () => {
    if (!shown) return;
    const { lines = [], bands = [], marks = [], xLabel, yLabel } = shown;
    const [width, height] = [Math.max(260, svg.clientWidth), Math.max(160, svg.clientHeight)];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const inner = { left: 58, right: width - 12, top: 10, bottom: height - 40 };
    const all = [...lines.flatMap((line) => line.points), ...bands.flatMap((band) => band.points)];
    if (all.length === 0) return svg.replaceChildren(shape("text", { x: width / 2, y: height / 2, class: "axis", "text-anchor": "middle" }, "no generation is complete yet"));
    const range = (values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
    const [x0, x1] = zoom ?? range(all.map((point) => point[0]));
    const seen = all.filter(([x]) => x >= x0 && x <= x1);
    let [y0, y1] = range([...seen.flatMap((point) => point.slice(1)), ...marks.flatMap((mark) => [mark.low, mark.high])]);
    [y0, y1] = y1 - y0 < 1e-12 ? [y0 - 0.5, y1 + 0.5] : [y0 - 0.04 * (y1 - y0), y1 + 0.04 * (y1 - y0)];
    const x = (value) => inner.left + ((value - x0) / (x1 - x0 || 1)) * (inner.right - inner.left);
    const y = (value) => inner.bottom - ((value - y0) / (y1 - y0)) * (inner.bottom - inner.top);
    frame = { inner, x0, x1 };
    const parts = [];
    const text = (at, content, more = {}) => shape("text", { x: at[0], y: at[1], class: "axis", ...more }, content);
    const heights = ticks(y0, y1, 5);
    // As many as tell one from the next.
    const digits = Math.max(0, Math.ceil(-Math.log10(heights[1] - heights[0] || 1) - 1e-9));
    for (const tick of heights) {
      parts.push(shape("line", { x1: inner.left, x2: inner.right, y1: y(tick), y2: y(tick), class: "grid" }));
      parts.push(text([inner.left - 6, y(tick) + 4], decimals(tick, digits), { "text-anchor": "end" }));
    }
    for (const tick of ticks(x0, x1, Math.min(8, width / 90))) {
      parts.push(text([x(tick), inner.bottom + 16], String(Math.round(tick * 1000) / 1000), { "text-anchor": "middle" }));
    }
    parts.push(text([(inner.left + inner.right) / 2, height - 6], xLabel, { "text-anchor": "middle" }));
    const middle = (inner.top + inner.bottom) / 2;
    parts.push(text([14, middle], yLabel, { "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` }));
    const inView = (points) => points.filter((point, i) => (points[i + 1]?.[0] ?? point[0]) >= x0 && (points[i - 1]?.[0] ?? point[0]) <= x1);
    const clipped = shape("g", { "clip-path": "inset(0)" });
    for (const { color, points } of bands) {
      const kept = inView(points);
      const step = Math.ceil(kept.length / 800);
      const thin = kept.filter((_, i) => i % step === 0 || i === kept.length - 1);
      const outline = [...thin.map(([at, , high]) => [x(at), y(high)]), ...thin.map(([at, low]) => [x(at), y(low)]).reverse()];
      if (outline.length) clipped.append(shape("path", { d: `${path(outline)}Z`, fill: color, class: "band" }));
    }
    for (const { name, color, points } of lines) {
      const kept = thinned(inView(points), 500).map(([at, value]) => [x(at), y(value)]);
      if (kept.length) clipped.append(shape("path", { d: path(kept), stroke: color, class: "line", "data-name": name }));
    }
    for (const { low, high, value, color } of marks) {
      clipped.append(shape("rect", { x: inner.left, width: inner.right - inner.left, y: y(high), height: Math.max(1, y(low) - y(high)), fill: color, class: "band" }));
      clipped.append(shape("line", { x1: inner.left, x2: inner.right, y1: y(value), y2: y(value), stroke: color, "stroke-dasharray": "5 4" }));
    }
    svg.replaceChildren(...parts, clipped);
    const keys = [...lines, ...marks].map(({ name, color }) => {
      const swatch = element("i");
      swatch.style.background = color;
      return element("span", { className: "key" }, swatch, name);
    });
    legend.replaceChildren(...keys.slice(0, 14), readout);
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
    if (!frame || !shown) return;
    const at = xAt(event);
    const nearest = (points) => points.reduce((a, b) => (Math.abs(b[0] - at) < Math.abs(a[0] - at) ? b : a));
    const values = shown.lines.slice(0, 4).filter((line) => line.points.length).map((line) => `${line.name} ${decimals(nearest(line.points)[1], 3)}`);
    readout.textContent = `${shown.xLabel} ${Math.round(at)}: ${values.join(", ")}`;
  });
  svg.addEventListener("pointerup", (event) => {
    if (held === null) return;
    const [from, to] = [held, xAt(event)].sort((a, b) => a - b);
    held = null;
    if ((to - from) / (frame.x1 - frame.x0) > 0.02) zoom = [from, to];
    draw();
  });
  svg.addEventListener("dblclick", () => {
    zoom = null;
    draw();
  });
  new ResizeObserver(draw).observe(node);
  node.show = (content) => {
    shown = content;
    draw();
  };
  return node;
}
