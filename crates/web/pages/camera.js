// The visible part of the plane. The plane is a torus: every object is drawn at each
// of its images within view.

import { shortest } from "swarm/episode.js";

/** Maximum number of drawn images of a place to each side of the nearest one. */
const IMAGES_MAX = 3;

export class Camera {
  constructor(episode) {
    this.episode = episode;
    this.width = this.height = 1;
    this.showSwarm();
  }

  /** Shows all places that robots, lights and areas ever reach, or the whole world if these places
   *  are most of it. */
  showSwarm() {
    const { episode } = this;
    if (episode.room) return this.showWorld();
    const first = [episode.at("x", 0, 0), episode.at("y", 0, 0)];
    const low = [0, 0], high = [0, 0];
    const include = (x, y) => {
      const way = [shortest(x - first[0], episode.width), shortest(y - first[1], episode.height)];
      for (const axis of [0, 1]) {
        low[axis] = Math.min(low[axis], way[axis]);
        high[axis] = Math.max(high[axis], way[axis]);
      }
    };
    for (let step = 0; step < episode.steps; step += 5) {
      for (let robot = 0; robot < episode.n_robots; robot++) {
        include(episode.at("x", robot, step), episode.at("y", robot, step));
      }
      for (let light = 0; light < episode.lights.length; light++) {
        include(episode.at("light_x", light, step), episode.at("light_y", light, step));
      }
      for (let area = 0; area < episode.areas.length; area++) {
        include(episode.at("area_x", area, step), episode.at("area_y", area, step));
      }
    }
    const [across, along] = [high[0] - low[0], high[1] - low[1]];
    if (across > 0.7 * episode.width || along > 0.7 * episode.height) return this.showWorld();
    this.look(first[0] + (low[0] + high[0]) / 2, first[1] + (low[1] + high[1]) / 2, across + 70, along + 70);
  }

  /** Shows the whole world. */
  showWorld() {
    const { room, width, height } = this.episode;
    // Walls at the edge are seen whole.
    const margin = room ? 1.04 : 1;
    this.look(width / 2, height / 2, margin * width, margin * height);
  }

  /** Shows at least a rectangle of `across` x `along` around a centre, cm. */
  look(x, y, across, along) {
    Object.assign(this, { x, y, across, along, zoom: 1 });
  }

  /** Ignores the size 0 of a hidden canvas, so that the scale is never 0. */
  resize(width, height) {
    if (width > 0 && height > 0) Object.assign(this, { width, height });
  }

  /** Pixels per cm. */
  get scale() {
    return this.zoom * Math.min(this.width / this.across, this.height / this.along);
  }

  /** Pixels of a place; y points up. */
  toScreen(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  toWorld(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  move(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /** Zooms so that the place under a pixel stays there. */
  zoomAt(px, py, factor) {
    const [x, y] = this.toWorld(px, py);
    this.zoom = Math.min(40, Math.max(0.5, this.zoom * factor));
    const [nx, ny] = this.toWorld(px, py);
    this.x += x - nx;
    this.y += y - ny;
  }

  /** Half the drawn width and height, pixels: no object appears twice. */
  get halves() {
    const { periodX, periodY } = this.episode;
    return [Math.min(this.width, periodX * this.scale) / 2, Math.min(this.height, periodY * this.scale) / 2];
  }

  /** Calls `draw` with the pixels of every image of a place that is in view, or at most `radius`
   *  pixels outside. Their number is always small. */
  eachImage(x, y, radius, draw) {
    const { periodX: width, periodY: height } = this.episode;
    const { scale } = this;
    const [offX, offY] = [x - this.x, y - this.y];
    const halfX = (Math.min(this.width, width * scale) / 2 + radius) / scale;
    const halfY = (Math.min(this.height, height * scale) / 2 + radius) / scale;
    const [nearX, nearY] = [offX - Math.round(offX / width) * width, offY - Math.round(offY / height) * height];
    const [nX, nY] = [reached(halfX, width), reached(halfY, height)];
    for (let i = -nX; i <= nX; i++) {
      const awayX = nearX + i * width;
      if (Math.abs(awayX) > halfX) continue;
      for (let k = -nY; k <= nY; k++) {
        const awayY = nearY + k * height;
        if (Math.abs(awayY) <= halfY) draw(this.width / 2 + awayX * scale, this.height / 2 - awayY * scale);
      }
    }
  }
}

/** Number of images to each side of the nearest one within a distance. */
function reached(half, period) {
  const n = Math.ceil(half / period + 0.5);
  return n < IMAGES_MAX ? n : IMAGES_MAX;
}
