// The states of all robots over all steps, below the world, with a mark at the current
// step; dragging moves to another step.

import { canvas, decimals, element } from "swarm/dom.js";
import { palette, pixels, rgb } from "swarm/drawing.js";
import { exports } from "swarm/export.js";
import { extremes } from "swarm/scales.js";

/** A picture over all steps with a mark at the current one. `paint(context, width, height)`
 *  is called once per size and theme: in every frame, only the mark moves. */
export function track(view, seek, height, label, paint) {
  const picture = canvas((context, width, tall) => {
    context.clearRect(0, 0, width, tall);
    paint(context, width, tall);
  }, label);
  const mark = element("i", { className: "mark" });
  const node = element("div", { className: "track" }, picture, mark);
  node.style.height = `${height}px`;
  node.redraw = () => (mark.style.transform = `translateX(${(100 * (view.step + view.share + 0.5)) / view.steps}%)`);
  const go = (event) => {
    const box = node.getBoundingClientRect();
    seek(Math.floor(((event.clientX - box.left) / box.width) * view.steps));
  };
  node.addEventListener("pointerdown", (event) => {
    node.setPointerCapture(event.pointerId);
    go(event);
  });
  node.addEventListener("pointermove", (event) => event.buttons && go(event));
  return node;
}

/** A raster of whole numbers, one row per robot. */
function raster(episode, view, seek, label, height, colorAt) {
  return track(view, seek, height, label, (context, width, tall) => {
    const colors = palette();
    const map = pixels(episode.n_robots, episode.steps, (robot, step) => colorAt(robot, step, colors));
    context.imageSmoothingEnabled = false;
    context.drawImage(map, 0, 0, width, tall);
  });
}

/** Values over the steps as a line, with maximum and minimum at its side. */
function curve(values, view, seek, label) {
  const known = values.filter(Number.isFinite);
  const low = Math.min(0, ...extremes(known));
  const high = Math.max(...extremes(known), low + 1e-9);
  const node = track(view, seek, 44, label, (context, width, height) => {
    const colors = palette();
    context.strokeStyle = colors.line;
    context.lineWidth = 1.3;
    context.beginPath();
    let isDrawn = false;
    values.forEach((value, step) => {
      const x = ((step + 0.5) / values.length) * width;
      const y = height - 3 - ((value - low) / (high - low)) * (height - 6);
      if (Number.isFinite(value)) context[isDrawn ? "lineTo" : "moveTo"](x, y);
      isDrawn = Number.isFinite(value);
    });
    context.stroke();
  });
  return { node, low, high };
}

/** All tracks of an episode; `redraw` marks the current step. */
export function timeline(episode, view, seek, label) {
  const node = element("section", { className: "timeline", "aria-label": label });
  const tracks = [];
  const values = [];
  const add = (title, track, valueAt, help = "") => {
    const value = element("span", { className: "value" });
    node.append(element("div", { className: "label", title: help }, title), track, value);
    tracks.push(track);
    values.push([value, valueAt]);
  };
  const height = Math.max(40, Math.min(5 * episode.n_robots, 160));
  const count = (name) => (step) => {
    let n = 0;
    for (let robot = 0; robot < episode.n_robots; robot++) n += episode.whole(name, robot, step) > 0;
    return `${n} of ${episode.n_robots}`;
  };
  const has = (name) => episode.columns[name].values.some((value) => value > 0);
  if (has("led")) {
    const colorAt = (robot, step, colors) => {
      const led = episode.whole("led", robot, step);
      return led > 0 ? rgb(colors.led(led)) : rgb(colors.grid);
    };
    add("LEDs", raster(episode, view, seek, "LEDs of all robots", height, colorAt), count("led"), "a row per robot");
  }
  if (has("relays")) {
    const colorAt = (robot, step, colors) => rgb(episode.whole("relays", robot, step) ? colors.relay : colors.grid);
    add("relaying", raster(episode, view, seek, "modes of all robots", height, colorAt), count("relays"), "a row per robot");
  }
  const row = (name, index) => [...episode.row(name, index)];
  const series = [["fitness", row("fitness", 0)], ...episode.measure_names.map((name, index) => [name.replaceAll("_", " "), row("measures", index)])];
  for (const [name, numbers] of series) {
    if (!numbers.some(Number.isFinite)) continue;
    const { node: line, low, high } = curve(numbers, view, seek, name);
    add(name, line, (step) => decimals(numbers[step], 3), `from ${decimals(low, 2)} to ${decimals(high, 2)}`);
  }
  const sums = ["led", "relays"].filter(has);
  const table = () => [["step", ...sums.map((name) => ({ led: "LEDs on", relays: "relaying" })[name]), ...series.map(([name]) => name)],
    ...Array.from({ length: episode.steps }, (_, step) => [step, ...sums.map((name) => parseInt(count(name)(step))), ...series.map(([, numbers]) => numbers[step])])];
  node.append(exports({ table, name: () => "steps" }));
  const redraw = () => {
    for (const track of tracks) track.redraw();
    for (const [value, valueAt] of values) value.textContent = valueAt(view.step);
  };
  return { node, redraw };
}
