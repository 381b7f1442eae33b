// Received messages as arrows: those of the last steps, older ones fainter.

import { symbolColor } from "swarm/drawing.js";
import { shortest } from "swarm/episode.js";

/** Steps until an arrow has faded, for few robots and for many robots, whose arrows overlap. */
const [FADE, FADE_OF_MANY, MANY] = [4, 2, 200];
/** Maximum number of robots for which symbols appear beside all arrows. */
const LABELS_MAX = 60;
/** Length of an arrow's head, pixels. */
const HEAD = 7;

/** Draws the arrows; arrows of the same look form one path, because there may be thousands. */
export function drawHearing(context, { camera, colors, episode, poses, radius, view }) {
  const n = episode.n_symbols;
  const hasLabels = view.numbers && (view.robot !== null || episode.n_robots <= LABELS_MAX);
  const labels = [];
  const isMany = episode.n_robots > MANY;
  const fade = isMany ? FADE_OF_MANY : FADE;
  // A line of one pixel is drawn several times as fast as any wider one.
  context.lineWidth = 1;
  for (let age = Math.min(fade - 1, view.step); age >= 0; age--) {
    const step = view.step - age;
    const looks = new Map();
    for (let robot = 0; robot < episode.n_robots; robot++) {
      const emitter = episode.whole("emitter", robot, step);
      if (emitter < 0) continue;
      const isOurs = view.robot === null || robot === view.robot || emitter === view.robot;
      const symbol = episode.heardSymbol(robot, step);
      const key = `${symbol} ${isOurs}`;
      if (!looks.has(key)) looks.set(key, { symbol, isOurs, path: new Path2D() });
      const { path } = looks.get(key);
      const [from, to] = [poses[emitter], poses[robot]];
      const dx = shortest(to.x - from.x, episode.periodX) * camera.scale;
      const dy = -shortest(to.y - from.y, episode.periodY) * camera.scale;
      const length = Math.hypot(dx, dy);
      if (length < 2 * radius) continue;
      camera.eachImage(from.x, from.y, length, (sx, sy) => {
        const at = addArrow(path, sx, sy, dx, dy, length, radius, age === 0 ? HEAD : 0);
        if (hasLabels && age === 0 && isOurs && symbol !== null && length > 4 * radius) labels.push([String(symbol), symbolColor(symbol, n, colors.isDark), ...at]);
      });
    }
    for (const { symbol, isOurs, path } of looks.values()) {
      context.globalAlpha = (isOurs ? 0.9 : 0.14) * (1 - (age + view.share) / fade);
      context.strokeStyle = symbolColor(symbol, n, colors.isDark);
      context.stroke(path);
    }
  }
  context.globalAlpha = 0.9;
  context.font = "600 11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (const [text, color, x, y] of labels) {
    context.fillStyle = color;
    context.fillText(text, x, y);
  }
  context.globalAlpha = 1;
}

/** Adds a slightly bent arrow, so that both directions stay visible; returns the place of its label. */
function addArrow(path, x, y, dx, dy, length, radius, head) {
  const [ux, uy] = [dx / length, dy / length];
  const bend = Math.min(14, 0.12 * length);
  const [endX, endY] = [x + dx - ux * (radius + 3), y + dy - uy * (radius + 3)];
  const [midX, midY] = [x + dx / 2 - uy * bend, y + dy / 2 + ux * bend];
  path.moveTo(x + ux * radius, y + uy * radius);
  path.quadraticCurveTo(midX, midY, endX, endY);
  if (head > 0) {
    const angle = Math.atan2(endY - midY, endX - midX);
    path.moveTo(endX - head * Math.cos(angle - 0.45), endY - head * Math.sin(angle - 0.45));
    path.lineTo(endX, endY);
    path.lineTo(endX - head * Math.cos(angle + 0.45), endY - head * Math.sin(angle + 0.45));
  }
  return [(midX + x + dx / 2) / 2 - uy * 7, (midY + y + dy / 2) / 2 + ux * 7];
}
