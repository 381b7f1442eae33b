// Colours and shapes of drawings on canvases.

import { color, onTheme } from "swarm/dom.js";

/** Colours of LEDs by their number: red, then others; 0 is off. */
const LEDS = ["", "--led-1", "--led-2", "--led-3", "--led-4"];

let known = null;
onTheme(() => (known = null));

/** The colours of this theme, read once per change of it. */
export function palette() {
  known ??= read();
  return known;
}

function read() {
  const names = ["page", "ground", "grid", "ink", "muted", "line", "accent", "robot", "robot-edge", "trail", "relay", "good", "target"];
  const colors = Object.fromEntries(names.map((name) => [name, color(`--${name}`)]));
  colors.leds = LEDS.map((name) => (name ? color(name) : colors.robot));
  colors.led = (led) => (led <= 0 ? colors.robot : colors.leds[((led - 1) % (LEDS.length - 1)) + 1]);
  colors.isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  return colors;
}

/** The colour of symbol `number` of `n`, from a rainbow. */
export function symbolColor(number, n, isDark) {
  if (number === null) return isDark ? "hsl(210 70% 65%)" : "hsl(215 70% 45%)";
  return `hsl(${Math.round((360 * number) / Math.max(n, 1) + 200) % 360} 72% ${isDark ? 66 : 44}%)`;
}

/** Red, green and blue of a reading: from blue over the ground to orange. */
export function readingColor(value, isDark) {
  const share = Math.max(-1, Math.min(1, value));
  const ground = isDark ? [24, 29, 40] : [246, 247, 250];
  const end = share < 0 ? [52, 120, 214] : isDark ? [255, 176, 82] : [214, 96, 12];
  return ground.map((from, i) => Math.round(from + (end[i] - from) * Math.abs(share)));
}

/** A map of rows and steps as a canvas of one pixel per value. */
export function pixels(n_rows, n_steps, valueAt) {
  const node = document.createElement("canvas");
  node.width = Math.max(1, n_steps);
  node.height = Math.max(1, n_rows);
  const context = node.getContext("2d");
  const image = context.createImageData(node.width, node.height);
  for (let row = 0; row < n_rows; row++) {
    for (let step = 0; step < n_steps; step++) {
      const [red, green, blue, alpha = 255] = valueAt(row, step);
      image.data.set([red, green, blue, alpha], 4 * (row * n_steps + step));
    }
  }
  context.putImageData(image, 0, 0);
  return node;
}

/** Red, green and blue of a colour of the style, such as #2b59c3. */
export function rgb(text) {
  const number = parseInt(text.replace("#", ""), 16);
  return [(number >> 16) & 255, (number >> 8) & 255, number & 255];
}

/** Sets a disc as the path of the canvas. */
export function disc(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  return context;
}
