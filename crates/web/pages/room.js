// The room of a world with bodies: its walls, what stands in it, and what robots push.

/** Fills and outlines everything that does not move, and the movables where they are. */
export function drawRoom(context, world) {
  const { camera, colors, episode, view } = world;
  const { boundary, walls, obstacles, movables } = episode.room;
  context.lineJoin = context.lineCap = "round";
  context.fillStyle = colors.muted;
  context.strokeStyle = colors.ink;
  context.lineWidth = 1;
  for (const obstacle of obstacles) {
    outline(context, camera, obstacle, { x: 0, y: 0, heading: 0 });
    context.globalAlpha = 0.45;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
  }
  context.lineWidth = Math.max(2, 1.2 * camera.scale);
  context.beginPath();
  path(context, camera, [...boundary, boundary[0]]);
  for (const wall of walls) path(context, camera, wall);
  context.stroke();
  context.fillStyle = colors.relay;
  context.lineWidth = 1.5;
  movables.forEach((movable, index) => {
    outline(context, camera, movable, episode.movable(index, view.step, view.share));
    context.globalAlpha = 0.55;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
  });
}

/** A ring around every robot whose body touches something. */
export function drawTouches(context, world) {
  const { camera, colors, episode, poses, view } = world;
  context.strokeStyle = colors.accent;
  context.lineWidth = 2;
  context.beginPath();
  poses.forEach(({ x, y }, robot) => {
    if (!episode.whole("touches", robot, view.step)) return;
    const [sx, sy] = camera.toScreen(x, y);
    const radius = world.radiusOf(robot) + 1;
    context.moveTo(sx + radius, sy);
    context.arc(sx, sy, radius, 0, 2 * Math.PI);
  });
  context.stroke();
}

function path(context, camera, places) {
  places.forEach(({ x, y }, index) => context[index ? "lineTo" : "moveTo"](...camera.toScreen(x, y)));
}

/** Begins the path of a disc or a polygon at a pose. */
function outline(context, camera, shape, { x, y, heading }) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const placed = (corner) => ({ x: x + cos * corner.x - sin * corner.y, y: y + sin * corner.x + cos * corner.y });
  context.beginPath();
  if (shape.disc) {
    const center = placed(shape.disc.center);
    const [sx, sy] = camera.toScreen(center.x, center.y);
    context.arc(sx, sy, shape.disc.radius * camera.scale, 0, 2 * Math.PI);
  } else {
    path(context, camera, [...shape.polygon, shape.polygon[0]].map(placed));
  }
}
