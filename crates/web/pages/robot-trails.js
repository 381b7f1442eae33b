// The last positions of robots, as thin lines behind them.

/** Steps of a trail. */
const TRAIL = 60;
/** Points nearer than this to the previous point are not drawn, pixels. */
const NEAR = 2.5;
/** A robot that moves farther than this in a step was placed elsewhere, cm. */
const JUMP = 50;

/** Draws the trails of all robots, and highlights that of the followed robot. */
export function drawTrails(context, { camera, colors, episode, poses, view }) {
  const first = Math.max(0, view.step - TRAIL);
  // A wider line takes several times as long to draw.
  context.lineWidth = 1;
  context.strokeStyle = colors.trail;
  /** One path for several robots: stroking each of 500 takes too long for a frame. */
  const stroke = (alpha, robots) => {
    context.globalAlpha = alpha;
    context.beginPath();
    for (const robot of robots) if (episode.moves[robot]) addTrail(context, camera, episode, robot, poses[robot], view.step, first);
    context.stroke();
  };
  const others = [...poses.keys()].filter((robot) => robot !== view.robot);
  stroke(view.robot === null ? 1 : 0.3, others);
  if (view.robot !== null) stroke(1, [view.robot]);
  context.globalAlpha = 1;
}

/** Points of the present trail, relative to the robot, pixels; and whether a line leads to each. */
const way = new Float32Array(2 * (TRAIL + 2));
const isLine = new Uint8Array(TRAIL + 2);

/** Adds the trail of a robot back to the step `first`, across the seam if the robot crossed it. */
function addTrail(context, camera, episode, robot, { x, y }, step, first) {
  const { values: xs, scale: unit } = episode.columns.x;
  const { values: ys } = episode.columns.y;
  const { scale } = camera;
  const { periodX: width, periodY: height } = episode;
  const start = robot * episode.steps;
  let [lastX, lastY, dx, dy, drawnX, drawnY, longest, n] = [x, y, 0, 0, 0, 0, 0, 0];
  let isJump = false;
  for (let k = step; k >= first; k--) {
    const [px, py] = [xs[start + k] * unit, ys[start + k] * unit];
    let [wayX, wayY] = [px - lastX, py - lastY];
    if (wayX > width / 2 || wayX < -width / 2) wayX -= width * Math.round(wayX / width);
    if (wayY > height / 2 || wayY < -height / 2) wayY -= height * Math.round(wayY / height);
    isJump ||= Math.abs(wayX) + Math.abs(wayY) > JUMP;
    dx += wayX * scale;
    dy -= wayY * scale;
    [lastX, lastY] = [px, py];
    if (k > first && !isJump && Math.abs(dx - drawnX) + Math.abs(dy - drawnY) < NEAR) continue;
    way[2 * n] = drawnX = dx;
    way[2 * n + 1] = drawnY = dy;
    isLine[n++] = isJump ? 0 : 1;
    isJump = false;
    longest = Math.max(longest, Math.abs(dx), Math.abs(dy));
  }
  if (longest < NEAR) return;
  camera.eachImage(x, y, longest, (sx, sy) => {
    context.moveTo(sx, sy);
    for (let i = 0; i < n; i++) {
      if (isLine[i]) context.lineTo(sx + way[2 * i], sy + way[2 * i + 1]);
      else context.moveTo(sx + way[2 * i], sy + way[2 * i + 1]);
    }
  });
}
