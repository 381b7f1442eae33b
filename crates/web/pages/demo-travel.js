// Draws items on their way between coordinator and workers, and what workers compute.

/** Radius of an item, pixels. */
const RADIUS = 4.5;
/** Height of the bar of progress of a worker, pixels. */
const BAR = 5;

/** The colour of each purpose of an item. */
const PURPOSES = { item: "--accent", copy: "--relay", audit: "--led-4" };

/** The moving part of the picture. */
export class Travel {
  constructor() {
    this.colors = {};
    this.context = null;
  }

  /** The places of coordinator and workers have changed. */
  resize(context, width, height, stage, coordinator, buttons) {
    const from = stage.getBoundingClientRect();
    const box = (node) => {
      const { left, top, width: w, height: h } = node.getBoundingClientRect();
      return { x: left - from.left - stage.clientLeft, y: top - from.top - stage.clientTop, w, h };
    };
    Object.assign(this, { context, width, height, center: box(coordinator), boxes: buttons.map(box) });
  }

  draw(items, now, isStill, workers) {
    const { context, boxes } = this;
    if (!context) return;
    context.clearRect(0, 0, this.width, this.height);
    if (!isStill) this.drawLinks(workers);
    for (const item of items.items.values()) {
      const isBack = item.place === "back";
      if (isStill || (item.place !== "out" && !isBack) || (item.place === "out" && item.until <= now)) continue;
      const share = Math.max(0, Math.min(1, (now - item.from) / (item.until - item.from)));
      const isLie = isBack && workers[item.worker].health === "lying";
      this.drawItem(boxes[item.worker], isBack ? 1 - share : share, isLie ? "--bad" : isBack ? "--good" : PURPOSES[item.purpose], isBack ? -1 : 1);
    }
    boxes.forEach((box, i) => this.drawWork(box, items.at(i, now), now, workers[i]));
  }

  /** Where the line from the coordinator to a worker begins and ends: at the edges of both. */
  line(box) {
    const { center } = this;
    const [x, y] = [box.x + box.w / 2, box.y + box.h / 2];
    const inside = (value, low, size, margin) => Math.max(low + margin, Math.min(low + size - margin, value));
    const [x0, y0] = [inside(x, center.x, center.w, 0), inside(y, center.y, center.h, 0)];
    return [[x0, y0], [inside(x0, box.x, box.w, 0), inside(y0, box.y, box.h, 0)]];
  }

  drawLinks(workers) {
    const { context, colors, boxes } = this;
    context.lineWidth = 1;
    boxes.forEach((box, i) => {
      const [[x0, y0], [x1, y1]] = this.line(box);
      context.strokeStyle = colors["--border"];
      context.setLineDash(workers[i].is_connected ? [] : [3, 5]);
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
      context.stroke();
    });
    context.setLineDash([]);
  }

  drawItem(box, share, name, side) {
    const { context, colors } = this;
    const [[x0, y0], [x1, y1]] = this.line(box);
    const length = Math.hypot(x1 - x0, y1 - y0) || 1;
    // Both directions have a lane of their own.
    const [dx, dy] = [(-(y1 - y0) / length) * 4 * side, ((x1 - x0) / length) * 4 * side];
    context.fillStyle = colors[name];
    context.beginPath();
    context.arc(x0 + (x1 - x0) * share + dx, y0 + (y1 - y0) * share + dy, RADIUS, 0, 2 * Math.PI);
    context.fill();
  }

  /** The progress of a worker's item, and a dot for each item that waits there. */
  drawWork(box, its, now, { health }) {
    const { context, colors } = this;
    const isComputing = its[0]?.place === "computed";
    const [left, width, y] = [box.x + 8, box.w - 16, box.y + box.h - BAR - 5];
    if (isComputing) {
      const share = health === "hung" ? 0.35 : Math.max(0, Math.min(1, (now - its[0].from) / (its[0].until - its[0].from)));
      context.fillStyle = colors["--border"];
      context.fillRect(left, y, width, BAR);
      context.fillStyle = health === "hung" ? colors["--muted"] : colors[PURPOSES[its[0].purpose]];
      context.fillRect(left, y, width * share, BAR);
    }
    its.slice(isComputing ? 1 : 0, 8).forEach((item, i) => {
      context.fillStyle = colors[PURPOSES[item.purpose]];
      context.beginPath();
      context.arc(box.x + box.w - 10 - 9 * i, box.y + 12, 3, 0, 2 * Math.PI);
      context.fill();
    });
  }
}
