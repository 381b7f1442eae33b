// Robots as small pictures: each appearance is drawn once and then copied, because there may be
// hundreds of robots.

import { disc } from "swarm/drawing.js";

/** Maximum number of cached pictures: with numbers, each robot has its own. */
const KEPT_MAX = 4000;
/** Half the side of a picture, in radii of a robot. */
const REACH = 2.4;
/** Radius up to which a robot has a thin line, pixels. */
const SMALL = 5;
/** Minimum radius of a robot with a legible number, pixels. */
const NUMBERED_FROM = 6;

export class RobotPictures {
  constructor() {
    this.pictures = new Map();
    this.madeFor = "";
  }

  draw(context, world) {
    const { camera, colors, episode, poses, view } = world;
    const ratio = context.getTransform().a;
    // While the user zooms, sizes with an invisible difference share pictures.
    const sizes = poses.map((_, robot) => Math.round(world.radiusOf(robot) * 4) / 4);
    const kinds = [...new Set(sizes)];
    const madeFor = `${kinds} ${ratio} ${colors.ground} ${colors.robot}`;
    if (madeFor !== this.madeFor || this.pictures.size > KEPT_MAX) this.pictures.clear();
    this.madeFor = madeFor;
    context.strokeStyle = colors.ink;
    // A line of one pixel is drawn several times as fast as any wider one.
    context.lineWidth = kinds[0] <= SMALL ? 1 : kinds[0] / 4;
    context.beginPath();
    poses.forEach(({ x, y, heading }, robot) => {
      const size = sizes[robot];
      const [aheadX, aheadY] = [1.75 * size * Math.cos(heading), -1.75 * size * Math.sin(heading)];
      camera.eachImage(x, y, 3 * size, (sx, sy) => {
        context.moveTo(sx, sy);
        context.lineTo(sx + aheadX, sy + aheadY);
      });
    });
    context.stroke();
    for (let robot = 0; robot < episode.n_robots; robot++) {
      const size = sizes[robot];
      const hasNumbers = view.numbers && size >= NUMBERED_FROM;
      const whole = (name) => episode.whole(name, robot, view.step);
      const look = {
        led: whole("led"), relays: whole("relays") > 0, carries: whole("carries") > 0, failed: whole("failed") > 0,
        isTarget: whole("target") > 0, isFollowed: robot === view.robot, number: hasNumbers ? robot : null,
      };
      const picture = this.of(look, size, kinds, ratio, colors);
      const side = picture.width / ratio;
      const { x, y } = poses[robot];
      // At whole pixels of the device and in its own size, a picture is copied; otherwise the
      // browser resamples it.
      const place = (at) => Math.round((at - side / 2) * ratio) / ratio;
      camera.eachImage(x, y, 3 * size, (sx, sy) => context.drawImage(picture, place(sx), place(sy), side, side));
    }
  }

  of(look, size, kinds, ratio, colors) {
    const { led, relays, carries, failed, isTarget, isFollowed, number } = look;
    const appearance = ((((led * 2 + relays) * 2 + carries) * 2 + failed) * 2 + isTarget) * 2 + isFollowed + (number === null ? 0 : 65536 * (number + 1));
    const key = appearance * kinds.length + kinds.indexOf(size);
    let picture = this.pictures.get(key);
    if (!picture) this.pictures.set(key, (picture = paint(look, size, ratio, colors)));
    return picture;
  }
}

/** The picture of an appearance, for the pixels of a device. */
function paint({ led, relays, carries, failed, isTarget, isFollowed, number }, radius, ratio, colors) {
  const side = Math.ceil(2 * REACH * radius * ratio);
  const picture = new OffscreenCanvas(side, side);
  const context = picture.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, side / 2, side / 2);
  if (led > 0) {
    context.globalAlpha = 0.22;
    context.fillStyle = colors.led(led);
    disc(context, 0, 0, 1.9 * radius).fill();
  }
  context.globalAlpha = failed ? 0.4 : 1;
  context.fillStyle = colors.led(led);
  disc(context, 0, 0, radius).fill();
  context.globalAlpha = 1;
  context.strokeStyle = relays ? colors.relay : colors["robot-edge"];
  context.lineWidth = relays ? 2 : 1;
  context.stroke();
  if (carries) {
    context.fillStyle = colors.target;
    disc(context, 0, 0, 0.55 * radius).fill();
  }
  if (failed) cross(context, radius, colors.ink);
  if (isTarget) ring(context, 1.55 * radius, colors.target, [3, 3]);
  if (isFollowed) ring(context, 2.1 * radius, colors.accent, []);
  if (number !== null) {
    context.fillStyle = led > 0 ? "#ffffff" : colors.ground;
    context.font = `600 ${Math.round(radius * 1.05)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(String(number), 0, 0.5);
  }
  return picture.transferToImageBitmap();
}

function ring(context, radius, style, dash) {
  context.strokeStyle = style;
  context.lineWidth = 2;
  context.setLineDash(dash);
  disc(context, 0, 0, radius).stroke();
  context.setLineDash([]);
}

/** Crosses out the centre. */
function cross(context, radius, style) {
  context.strokeStyle = style;
  context.lineWidth = 2;
  context.beginPath();
  for (const slope of [-radius, radius]) {
    context.moveTo(-radius, -slope);
    context.lineTo(radius, slope);
  }
  context.stroke();
}
