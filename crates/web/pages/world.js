// The world on a canvas: robots, lights, areas, and received messages.

import { canvas } from "swarm/dom.js";
import { Camera } from "swarm/camera.js";
import { disc, palette } from "swarm/drawing.js";
import { drawHearing } from "swarm/hearing.js";
import { drawRoom, drawTouches } from "swarm/room.js";
import { RobotPictures } from "swarm/robot-pictures.js";
import { drawTrails } from "swarm/robot-trails.js";

/** Radius of a robot, cm, and its minimum on the screen, pixels. */
const RADIUS = 5.5;
const RADIUS_MIN = 4;

export class World {
  /** `view`: step, share, robot, and the shown layers: trails, radio, reach, numbers. */
  constructor(episode, view, onRobot) {
    this.episode = episode;
    this.view = view;
    this.camera = new Camera(episode);
    this.robots = new RobotPictures();
    this.node = canvas((context, width, height) => this.draw(context, width, height), "the world");
    this.node.className = "world";
    // The canvas is opaque, so the browser need not blend it.
    this.node.getContext("2d", { alpha: false });
    /** Takes a thing and its new place, while the user may drag things. */
    this.hand = null;
    /** The dragged thing, and the pixel where it is. */
    this.carried = null;
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
    /** The middle of two fingers, and their distance. */
    const pinch = () => {
      const [[ax, ay], [bx, by]] = [...fingers.values()];
      return { x: (ax + bx) / 2, y: (ay + by) / 2, apart: Math.max(1, Math.hypot(ax - bx, ay - by)) };
    };
    node.addEventListener("pointerdown", (event) => {
      const thing = this.hand && this.thingAt(...place(event));
      if (thing) {
        this.carried = { ...thing, at: place(event) };
        node.setPointerCapture(event.pointerId);
        return node.redraw();
      }
      fingers.set(event.pointerId, place(event));
      held = { at: place(event), moved: fingers.size > 1 };
      // A single finger scrolls the page, as anywhere else.
      if (event.pointerType !== "touch") node.setPointerCapture(event.pointerId);
    });
    node.addEventListener("pointermove", (event) => {
      if (this.carried) {
        this.carried.at = place(event);
        return node.redraw();
      }
      if (this.hand) node.style.cursor = this.thingAt(...place(event)) ? "grab" : "";
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
      if (this.carried) return this.drop(place(event));
      if (held && !held.moved) onRobot(this.robotAt(...place(event)));
      fingers.delete(event.pointerId);
      if (fingers.size === 0) held = null;
    });
    for (const kind of ["pointercancel", "lostpointercapture"]) {
      node.addEventListener(kind, (event) => {
        if (this.carried && kind === "pointercancel") this.drop(null);
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

  /** Lets the user drag robots and things: calls `hand` with the thing and its new place. Null: no
   *  more. */
  carry(hand) {
    this.hand = hand;
    this.carried = null;
    this.node.classList.toggle("carries", hand !== null);
    this.node.style.cursor = "";
    this.node.redraw();
  }

  /** Ends the dragging of a thing at a pixel; null: where it was. */
  drop(at) {
    const { kind, number } = this.carried;
    this.carried = null;
    this.node.redraw();
    if (at === null) return;
    const { room, width, height } = this.episode;
    const within = (value, size) => Math.round(10 * (room ? Math.max(0, Math.min(size, value)) : ((value % size) + size) % size)) / 10;
    const [x, y] = this.camera.toWorld(...at);
    this.hand({ kind, number }, { x: within(x, width), y: within(y, height) });
  }

  /** The nearest thing at a pixel that can be dragged; null without one. */
  thingAt(px, py) {
    const { camera, episode, view } = this;
    let [nearest, distance] = [null, 24];
    for (const kind of ["area", "light", "movable", "robot"]) {
      for (let number = 0; number < episode.countOf(kind); number++) {
        const [x, y] = episode.placeOf(kind, number, view.step);
        camera.eachImage(x, y, 30, (sx, sy) => {
          const d = Math.hypot(sx - px, sy - py);
          if (d <= distance) [nearest, distance] = [{ kind, number }, d];
        });
      }
    }
    return nearest;
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
    const [halfX, halfY] = camera.halves;
    if (2 * halfX < width || 2 * halfY < height) {
      context.fillStyle = colors.page;
      context.fillRect(0, 0, width, height);
    }
    // Clip along whole pixels of the device: other edges double the drawing time.
    const ratio = context.getTransform().a;
    const [left, right, top, bottom] = [width / 2 - halfX, width / 2 + halfX, height / 2 - halfY, height / 2 + halfY].map((edge) => Math.round(edge * ratio) / ratio);
    context.beginPath();
    context.rect(left, top, right - left, bottom - top);
    context.clip();
    context.fillStyle = colors.ground;
    context.fillRect(0, 0, width, height);
    this.drawPlane(context);
    this.drawPlaces(context);
    if (episode.room) drawRoom(context, this);
    if (view.reach || view.robot !== null) this.drawReach(context);
    if (view.trails) drawTrails(context, this);
    if (view.radio) drawHearing(context, this);
    this.robots.draw(context, this);
    if (episode.room) drawTouches(context, this);
    if (this.carried) this.drawCarried(context);
    context.restore();
    this.drawScaleBar(context);
  }

  /** A ring at the pointer, and the way from where the thing is. */
  drawCarried(context) {
    const { camera, carried, colors, episode, view } = this;
    const from = camera.toScreen(...episode.placeOf(carried.kind, carried.number, view.step));
    context.strokeStyle = colors.relay;
    context.lineWidth = 2;
    context.setLineDash([4, 4]);
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...carried.at);
    context.stroke();
    context.setLineDash([]);
    disc(context, ...carried.at, 12).stroke();
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
    if (!episode.room) lines(episode.width, episode.height);
    context.setLineDash([]);
  }

  /** Ground areas and lights. On a torus, an image is drawn only within half a world around it,
   *  where it is the nearest one; beyond, the next image is nearer. */
  drawPlaces(context) {
    const { camera, episode, view } = this;
    const [halfX, halfY] = [(episode.periodX / 2) * camera.scale, (episode.periodY / 2) * camera.scale];
    const eachOf = (name, discs, fill) => discs.forEach(({ range, color }, i) => {
      const [x, y] = ["x", "y"].map((axis) => episode.at(`${name}_${axis}`, i, view.step));
      const radius = range * camera.scale;
      const isCut = radius > Math.min(halfX, halfY);
      camera.eachImage(x, y, radius, (sx, sy) => {
        if (isCut) {
          context.save();
          context.beginPath();
          context.rect(sx - halfX, sy - halfY, 2 * halfX, 2 * halfY);
          context.clip();
        }
        fill(sx, sy, radius, color);
        if (isCut) context.restore();
      });
    });
    eachOf("area", episode.areas, (sx, sy, radius, color) => {
      context.globalAlpha = 0.25;
      context.fillStyle = color;
      disc(context, sx, sy, radius).fill();
    });
    context.globalAlpha = 1;
    eachOf("light", episode.lights, (sx, sy, radius, color) => {
      context.fillStyle = glowColor(context, context.createRadialGradient(sx, sy, 0, sx, sy, radius), color);
      disc(context, sx, sy, radius).fill();
      context.fillStyle = color;
      disc(context, sx, sy, 5).fill();
    });
  }

  /** The radio reach of all robots, or of the followed one. The circles of the others form one
   *  path: filling each of 500 takes too long for a frame. */
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

  /** Of the first robot on the screen, pixels. */
  get radius() {
    return this.radiusOf(0);
  }

  /** Of a robot on the screen, pixels: to scale, if it has a body. */
  radiusOf(robot) {
    const { room } = this.episode;
    if (room) return Math.max(2, room.radii[robot] * this.camera.scale);
    return Math.max(RADIUS_MIN, Math.min(RADIUS * this.camera.scale, 26));
  }

  /** A scale bar. */
  drawScaleBar(context) {
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

/** A glow that fades with the distance, in any colour of a file. */
function glowColor(context, glow, name) {
  context.fillStyle = name;
  const color = context.fillStyle;
  const transparent = (alpha) => (color.startsWith("#") ? color + alpha : color);
  glow.addColorStop(0, transparent("66"));
  glow.addColorStop(1, transparent("08"));
  return glow;
}
