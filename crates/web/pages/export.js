// Figures as files: SVG for papers, CSV for other drawing programs.

import { element } from "swarm/dom.js";

/** Properties of shapes from the style of the pages, which a file must contain itself. */
const STYLED = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "opacity", "paint-order", "font-size", "font-family", "font-weight", "text-anchor"];

/** Makes a browser save a text or a recording. */
export function save(name, kind, content) {
  const url = URL.createObjectURL(new Blob([content], { type: kind }));
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Buttons that save a figure. `svg()`: the element, if it is an SVG; `table()`: rows of cells, the
 *  first with the names; `name()`: the name of the files, without extension. */
export function exports({ svg, table, name }) {
  const button = (text, title, onclick) => element("button", { type: "button", className: "save", title, onclick }, text);
  return element("span", { className: "saves" },
    ...(svg ? [button("SVG", "save this figure as SVG", () => save(`${name()}.svg`, "image/svg+xml", svgText(svg())))] : []),
    button("CSV", "save its values as a table", () => save(`${name()}.csv`, "text/csv", csvText(table()))));
}

/** A copy of an SVG that looks the same without the pages' style. */
function svgText(svg) {
  const copy = svg.cloneNode(true);
  const [shown, copied] = [svg, copy].map((root) => [root, ...root.querySelectorAll("*")]);
  shown.forEach((node, i) => {
    const style = getComputedStyle(node);
    for (const name of STYLED) copied[i].setAttribute(name, style.getPropertyValue(name));
    for (const name of ["class", "tabindex", "role"]) copied[i].removeAttribute(name);
  });
  const [, , width, height] = (svg.getAttribute("viewBox") ?? "0 0 600 300").split(" ");
  for (const [name, value] of Object.entries({ width, height, xmlns: "http://www.w3.org/2000/svg" })) copy.setAttribute(name, value);
  const ground = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  for (const [name, value] of Object.entries({ width, height, fill: getComputedStyle(document.documentElement).getPropertyValue("--panel").trim() })) ground.setAttribute(name, value);
  copy.prepend(ground);
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(copy)}\n`;
}

/** Quotes cells with commas, quotes or line breaks. */
function csvText(rows) {
  const cell = (value) => {
    const text = value === null || value === undefined || Number.isNaN(value) ? "" : String(value);
    return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  return rows.map((row) => `${row.map(cell).join(",")}\n`).join("");
}

/** Lines and bands over the same x as a table. */
export function seriesTable(xLabel, lines, bands) {
  const names = [xLabel];
  const rows = new Map();
  const add = (at, place, values) => {
    if (!rows.has(at)) rows.set(at, [at]);
    values.forEach((value, i) => (rows.get(at)[place + i] = value));
  };
  for (const { name, points } of lines) {
    const place = names.push(name) - 1;
    for (const [at, value] of points) add(at, place, [value]);
  }
  bands.forEach(({ name = "", points }, i) => {
    const prefix = name || (bands.length > 1 ? `band ${i}` : "band");
    const place = names.push(`${prefix} low`, `${prefix} high`) - 2;
    for (const [at, low, high] of points) add(at, place, [low, high]);
  });
  const table = [...rows.values()].sort((a, b) => a[0] - b[0]);
  return [names, ...table.map((row) => names.map((_, i) => row[i]))];
}
