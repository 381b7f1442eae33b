// The world on a canvas: robots, lights, areas, and who heard whom.

import { canvas } from "swarm/dom.js";
import { Camera } from "swarm/camera.js";
import { palette, symbolColor } from "swarm/drawing.js";
import { shortest } from "swarm/episode.js";

/** Steps of a robot's trail, and of a frame until it has faded. */
const TRAIL = 60;
const FADE = 4;
/** Robots whose symbols are written beside the arrows, unless one is followed. */
const LABELS_MAX = 60;
/** Radius of a robot, cm, and the least one on the screen, pixels. */
const RADIUS = 5.5;
const RADIUS_MIN = 4;

export class World {
  /** `view`: step, share, robot, and what is shown: trails, radio, reach, numbers. */
  constructor(episode, view, onRobot) {
    this.episode = episode;
    this.view = view;
    this.camera = new Camera(episode);
    this.node = canvas((context, width, height) => this.draw(context, width, height), "the world");
    this.node.className = "world";
    this.listen(onRobot);
  }

  listen(onRobot) {
    const { node, camera } = this;
    let held = null;
    /** Fingers on the world, by their ids. */
    const fingers = new Map();
    const place = (event) => {
      const box = node.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    /** Where two fingers are, and how far apart. */
    const pinch = () => {
      const [[ax, ay], [bx, by]] = [...fingers.values()];
      return { x: (ax + bx) / 2, y: (ay + by) / 2, apart: Math.max(1, Math.hypot(ax - bx, ay - by)) };
    };
    node.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, place(event));
      held = { at: place(event), moved: fingers.size > 1 };
      // A single finger scrolls the page, as anywhere else.
      if (event.pointerType !== "touch") node.setPointerCapture(event.pointerId);
    });
    node.addEventListener("pointermove", (event) => {
      if (!held || !fingers.has(event.pointerId)) return;
      if (fingers.size === 2) {
        const before = pinch();
        fingers.set(event.pointerId, place(event));
        const { x, y, apart } = pinch();
        camera.move(x - before.x, y - before.y);
        camera.zoomAt(x, y, apart / before.apart);
        return node.redraw();
      }
      const [x, y] = place(event);
      const [dx, dy] = [x - held.at[0], y - held.at[1]];
      if (!held.moved && Math.hypot(dx, dy) < 4) return;
      held = { at: [x, y], moved: true };
      if (event.pointerType === "touch") return;
      camera.move(dx, dy);
      node.redraw();
    });
    node.addEventListener("pointerup", (event) => {
      if (held && !held.moved) onRobot(this.robotAt(...place(event)));
      fingers.delete(event.pointerId);
      if (fingers.size === 0) held = null;
    });
    for (const kind of ["pointercancel", "lostpointercapture"]) {
      node.addEventListener(kind, (event) => {
        fingers.delete(event.pointerId);
        if (fingers.size === 0) held = null;
      });
    }
    node.addEventListener("wheel", (event) => {
      event.preventDefault();
      camera.zoomAt(...place(event), Math.exp(-event.deltaY * 0.0015));
      node.redraw();
    }, { passive: false });
  }

  /** The robot at a pixel; null without one. */
  robotAt(px, py) {
    let [nearest, distance] = [null, Math.max(14, RADIUS * this.camera.scale)];
    for (let robot = 0; robot < this.episode.n_robots; robot++) {
      const { x, y } = this.poses[robot];
      this.camera.eachImage(x, y, 20, (sx, sy) => {
        const d = Math.hypot(sx - px, sy - py);
        if (d < distance) [nearest, distance] = [robot, d];
      });
    }
    return nearest;
  }

  draw(context, width, height) {
    this.colors = palette();
    const { camera, colors, episode, view } = this;
    camera.resize(width, height);
    this.poses = Array.from({ length: episode.n_robots }, (_, robot) => episode.pose(robot, view.step, view.share));
    context.save();
    context.fillStyle = colors.page;
    context.fillRect(0, 0, width, height);
    const [halfX, halfY] = camera.halves;
    context.beginPath();
    context.rect(width / 2 - halfX, height / 2 - halfY, 2 * halfX, 2 * halfY);
    context.clip();
    context.fillStyle = colors.ground;
    context.fillRect(0, 0, width, height);
    this.drawPlane(context);
    this.drawPlaces(context);
    if (view.reach || view.robot !== null) this.drawReach(context);
    if (view.trails) this.drawTrails(context);
    if (view.radio) this.drawFrames(context);
    this.drawRobots(context);
    context.restore();
    this.drawRuler(context);
  }

  /** A grid of a metre, and the seam where the torus closes. */
  drawPlane(context) {
    const { camera, colors, episode } = this;
    const [halfX, halfY] = camera.halves.map((half) => half / camera.scale);
    const [left, right] = [camera.x - halfX, camera.x + halfX];
    const [bottom, top] = [camera.y - halfY, camera.y + halfY];
    const line = (x0, y0, x1, y1) => {
      const [from, to] = [camera.toScreen(x0, y0), camera.toScreen(x1, y1)];
      context.moveTo(...from);
      context.lineTo(...to);
    };
    const lines = (spacingX, spacingY) => {
      context.beginPath();
      for (let x = Math.ceil(left / spacingX) * spacingX; x <= right; x += spacingX) line(x, top, x, bottom);
      for (let y = Math.ceil(bottom / spacingY) * spacingY; y <= top; y += spacingY) line(left, y, right, y);
      context.stroke();
    };
    context.lineWidth = 1;
    context.strokeStyle = colors.grid;
    if (100 * camera.scale > 12) lines(100, 100);
    context.strokeStyle = colors.muted;
    context.setLineDash([2, 5]);
    lines(episode.width, episode.height);
    context.setLineDash([]);
  }

  /** Ground areas and lights. */
  drawPlaces(context) {
    const { camera, episode, view } = this;
    episode.areas.forEach(({ range, color }, area) => {
      const [x, y] = ["area_x", "area_y"].map((name) => episode.at(name, area, view.step));
      camera.eachImage(x, y, range * camera.scale, (sx, sy) => {
        context.globalAlpha = 0.25;
        context.fillStyle = color;
        disc(context, sx, sy, range * camera.scale).fill();
      });
    });
    context.globalAlpha = 1;
    episode.lights.forEach(({ range, color }, light) => {
      const [x, y] = ["light_x", "light_y"].map((name) => episode.at(name, light, view.step));
      const radius = range * camera.scale;
      camera.eachImage(x, y, radius, (sx, sy) => {
        const glow = context.createRadialGradient(sx, sy, 0, sx, sy, radius);
        context.fillStyle = glowColor(context, glow, color);
        disc(context, sx, sy, radius).fill();
        context.fillStyle = color;
        disc(context, sx, sy, 5).fill();
      });
    });
  }

  /** How far robots are heard: all, or the one that is followed. The circles of the others are
   *  one path: to fill each of 500 takes longer than a frame may. */
  drawReach(context) {
    const { colors, episode, view } = this;
    context.strokeStyle = colors.accent;
    context.fillStyle = colors.accent;
    if (view.reach) {
      context.beginPath();
      for (let robot = 0; robot < episode.n_robots; robot++) if (robot !== view.robot) this.addReach(context, robot);
      context.globalAlpha = 0.18;
      context.stroke();
    }
    if (view.robot !== null) {
      context.beginPath();
      this.addReach(context, view.robot);
      context.globalAlpha = 0.07;
      context.fill();
      context.globalAlpha = 0.55;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  addReach(context, robot) {
    const { camera, episode } = this;
    const radius = episode.reach(robot) * camera.scale;
    if (radius === 0) return;
    const { x, y } = this.poses[robot];
    camera.eachImage(x, y, radius, (sx, sy) => {
      context.moveTo(sx + radius, sy);
      context.arc(sx, sy, radius, 0, 2 * Math.PI);
    });
  }

  drawTrails(context) {
    const { camera, colors, episode, view } = this;
    const first = Math.max(0, view.step - TRAIL);
    // A wider line takes several times as long to draw.
    context.lineWidth = 1;
    context.strokeStyle = colors.trail;
    for (let robot = 0; robot < episode.n_robots; robot++) {
      if (!episode.moves[robot]) continue;
      const { x, y } = this.poses[robot];
      const way = this.wayBack(robot, first, x, y);
      const length = way.reduce((most, [dx, dy]) => Math.max(most, Math.abs(dx), Math.abs(dy)), 0);
      if (length < 1) continue;
      context.globalAlpha = view.robot === null || view.robot === robot ? 1 : 0.3;
      camera.eachImage(x, y, length * camera.scale, (sx, sy) => {
        context.beginPath();
        context.moveTo(sx, sy);
        let isDrawn = true;
        for (const [dx, dy, jumps] of way) {
          isDrawn = !jumps;
          context[isDrawn ? "lineTo" : "moveTo"](sx + dx * camera.scale, sy - dy * camera.scale);
        }
        context.stroke();
      });
    }
    context.globalAlpha = 1;
  }

  /** Where a robot was before, relative to where it is, over the seam if it came over it. */
  wayBack(robot, first, x, y) {
    const { episode, view } = this;
    const way = [];
    let [lastX, lastY, dx, dy] = [x, y, 0, 0];
    for (let step = view.step; step >= first; step--) {
      const [px, py] = [episode.at("x", robot, step), episode.at("y", robot, step)];
      const [wayX, wayY] = [shortest(px - lastX, episode.width), shortest(py - lastY, episode.height)];
      [dx, dy] = [dx + wayX, dy + wayY];
      way.push([dx, dy, Math.hypot(wayX, wayY) > 50]);
      [lastX, lastY] = [px, py];
    }
    return way;
  }

  /** Frames of the last steps, the older the fainter. */
  drawFrames(context) {
    const { camera, colors, episode, view } = this;
    const n = episode.n_symbols;
    for (let age = Math.min(FADE - 1, view.step); age >= 0; age--) {
      const step = view.step - age;
      for (let robot = 0; robot < episode.n_robots; robot++) {
        const emitter = episode.whole("emitter", robot, step);
        if (emitter < 0) continue;
        const isOurs = view.robot === null || robot === view.robot || emitter === view.robot;
        context.globalAlpha = (isOurs ? 0.9 : 0.14) * (1 - (age + view.share) / FADE);
        const symbol = episode.heardSymbol(robot, step);
        context.strokeStyle = context.fillStyle = symbolColor(symbol, n, colors.isDark);
        const from = this.poses[emitter];
        const to = this.poses[robot];
        const dx = shortest(to.x - from.x, episode.width) * camera.scale;
        const dy = -shortest(to.y - from.y, episode.height) * camera.scale;
        const hasLabel = age === 0 && view.numbers && isOurs && symbol !== null;
        const label = hasLabel && (view.robot !== null || episode.n_robots <= LABELS_MAX) ? String(symbol) : "";
        const length = Math.hypot(dx, dy);
        const head = age === 0 ? 7 : 0;
        camera.eachImage(from.x, from.y, length, (sx, sy) => arrow(context, sx, sy, dx, dy, this.radius, head, label));
      }
    }
    context.globalAlpha = 1;
  }

  get radius() {
    return Math.max(RADIUS_MIN, Math.min(RADIUS * this.camera.scale, 26));
  }

  drawRobots(context) {
    const { camera, colors, episode, radius, view } = this;
    for (let robot = 0; robot < episode.n_robots; robot++) {
      const { x, y, heading } = this.poses[robot];
      const led = episode.whole("led", robot, view.step);
      const relays = episode.whole("relays", robot, view.step) > 0;
      const target = episode.whole("target", robot, view.step);
      const [ux, uy] = [Math.cos(heading), -Math.sin(heading)];
      camera.eachImage(x, y, 3 * radius, (sx, sy) => {
        if (led > 0) {
          context.globalAlpha = 0.22;
          context.fillStyle = colors.led(led);
          disc(context, sx, sy, 1.9 * radius).fill();
          context.globalAlpha = 1;
        }
        context.strokeStyle = colors.ink;
        context.lineWidth = Math.max(1.5, radius / 4);
        context.beginPath();
        context.moveTo(sx, sy);
        context.lineTo(sx + 1.75 * radius * ux, sy + 1.75 * radius * uy);
        context.stroke();
        const hasFailed = episode.whole("failed", robot, view.step) > 0;
        context.globalAlpha = hasFailed ? 0.4 : 1;
        context.fillStyle = colors.led(led);
        disc(context, sx, sy, radius).fill();
        context.globalAlpha = 1;
        context.strokeStyle = relays ? colors.relay : colors["robot-edge"];
        context.lineWidth = relays ? 2 : 1;
        context.stroke();
        if (episode.whole("carries", robot, view.step) > 0) {
          context.fillStyle = colors.target;
          disc(context, sx, sy, 0.55 * radius).fill();
        }
        if (hasFailed) cross(context, sx, sy, radius, colors.ink);
        if (target > 0) ring(context, sx, sy, 1.55 * radius, colors.target, [3, 3]);
        if (robot === view.robot) ring(context, sx, sy, 2.1 * radius, colors.accent, []);
        if (view.numbers && radius >= 6) this.drawNumber(context, sx, sy, robot, led);
      });
    }
  }

  drawNumber(context, x, y, robot, led) {
    context.fillStyle = led > 0 ? "#ffffff" : this.colors.ground;
    context.font = `600 ${Math.round(this.radius * 1.05)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(String(robot), x, y + 0.5);
  }

  /** A length to compare with. */
  drawRuler(context) {
    const { camera, colors } = this;
    const length = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000].find((cm) => cm * camera.scale > 50) ?? 10000;
    const y = camera.height - 14;
    context.strokeStyle = context.fillStyle = colors.muted;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(14, y - 4);
    context.lineTo(14, y);
    context.lineTo(14 + length * camera.scale, y);
    context.lineTo(14 + length * camera.scale, y - 4);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillText(length < 100 ? `${length} cm` : `${length / 100} m`, 18, y - 6);
  }
}

function disc(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  return context;
}

function ring(context, x, y, radius, style, dash) {
  context.strokeStyle = style;
  context.lineWidth = 2;
  context.setLineDash(dash);
  disc(context, x, y, radius).stroke();
  context.setLineDash([]);
}

/** Crosses out what is at a place. */
function cross(context, x, y, radius, style) {
  context.strokeStyle = style;
  context.lineWidth = 2;
  context.beginPath();
  for (const slope of [-radius, radius]) {
    context.moveTo(x - radius, y - slope);
    context.lineTo(x + radius, y + slope);
  }
  context.stroke();
}

/** A glow that fades with the distance, in any colour that a file names. */
function glowColor(context, glow, name) {
  context.fillStyle = name;
  const color = context.fillStyle;
  const transparent = (alpha) => (color.startsWith("#") ? color + alpha : color);
  glow.addColorStop(0, transparent("66"));
  glow.addColorStop(1, transparent("08"));
  return glow;
}

/** An arrow that is slightly bent, so that both directions are seen. */
function arrow(context, x, y, dx, dy, radius, head, label) {
  const length = Math.hypot(dx, dy);
  if (length < 2 * radius) return;
  const [ux, uy] = [dx / length, dy / length];
  const bend = Math.min(14, 0.12 * length);
  const [startX, startY] = [x + ux * radius, y + uy * radius];
  const [endX, endY] = [x + dx - ux * (radius + 3), y + dy - uy * (radius + 3)];
  const [midX, midY] = [x + dx / 2 - uy * bend, y + dy / 2 + ux * bend];
  // Those that fade are thin, which takes less time to draw.
  context.lineWidth = head > 0 ? 1.6 : 1;
  context.beginPath();
  context.moveTo(startX, startY);
  context.quadraticCurveTo(midX, midY, endX, endY);
  if (head > 0) {
    const angle = Math.atan2(endY - midY, endX - midX);
    const barb = (side) => [endX - head * Math.cos(angle + side), endY - head * Math.sin(angle + side)];
    context.moveTo(...barb(-0.45));
    context.lineTo(endX, endY);
    context.lineTo(...barb(0.45));
  }
  context.stroke();
  if (label && length > 4 * radius) {
    context.font = "600 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(label, (midX + x + dx / 2) / 2 - uy * 7, (midY + y + dy / 2) / 2 + ux * 7);
  }
}
