// A packed episode; crates/replay/src/lib.rs describes the format.

/** Farther than anything in a world between walls, cm. */
const BEYOND = 1e9;

const ARRAYS = { i8: Int8Array, i16: Int16Array, i32: Int32Array, f32: Float32Array };

/** Unpacks an episode from an ArrayBuffer or Uint8Array. */
export async function unpack(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return new Episode(header, buffer, 4 + length);
}

/** The constants of all steps, from the header, and the columns. */
export class Episode {
  constructor(header, buffer, start) {
    Object.assign(this, header);
    this.columns = {};
    for (const place of header.columns) {
      const n = place.n_rows * this.steps;
      const values = new ARRAYS[place.type](buffer, start + place.offset, n);
      if (place.is_difference) {
        for (let i = 0; i < n; i++) if (i % this.steps) values[i] += values[i - 1];
      }
      this.columns[place.name] = { values, scale: place.scale, n_rows: place.n_rows };
    }
    // What lies this far apart is at the same place on a torus. Between walls, nothing is.
    [this.periodX, this.periodY] = this.room ? [BEYOND, BEYOND] : [this.width, this.height];
    // The object of each robot.
    this.kinds = this.robots.flatMap((robots) => Array(robots.n).fill(robots));
    this.has_targets = this.columns.target.values.some((target) => target >= 0);
    // Whether any robot moves.
    const isStill = (name, robot) => this.row(name, robot).every((value, _, row) => value === row[0]);
    this.moves = this.kinds.map((_, robot) => !(isStill("x", robot) && isStill("y", robot)));
    this.has_radio = this.columns.emitter.values.some((emitter) => emitter >= 0);
  }

  /** A value of a row. */
  at(name, row, step) {
    const { values, scale } = this.columns[name];
    return values[row * this.steps + step] * scale;
  }

  /** A whole number of a row, such as a colour. */
  whole(name, row, step) {
    return this.columns[name].values[row * this.steps + step];
  }

  /** The components of a robot's value. */
  components(name, robot, step) {
    const n = this.columns[name].n_rows / this.n_robots;
    return Array.from({ length: n }, (_, i) => this.at(name, robot * n + i, step));
  }

  /** All steps of a row, unscaled. */
  row(name, row) {
    return this.columns[name].values.subarray(row * this.steps, (row + 1) * this.steps);
  }

  /** Position and heading of a robot; between steps, at a share of the way. Called for every robot
   *  in every frame. */
  pose(robot, step, share = 0) {
    const { x: xs, y: ys, heading: headings } = this.columns;
    const at = robot * this.steps + step;
    const [x, y, heading] = [xs.values[at] * xs.scale, ys.values[at] * ys.scale, headings.values[at] * headings.scale];
    if (share === 0 || step + 1 >= this.steps) return { x, y, heading };
    const turn = shortest(headings.values[at + 1] * headings.scale - heading, 2 * Math.PI);
    const dx = shortest(xs.values[at + 1] * xs.scale - x, this.periodX);
    const dy = shortest(ys.values[at + 1] * ys.scale - y, this.periodY);
    // A robot that is moved elsewhere does not glide there.
    const part = Math.abs(dx) + Math.abs(dy) > 50 ? 0 : share;
    return { x: x + part * dx, y: y + part * dy, heading: heading + part * turn };
  }

  /** The coordinates of a robot, light, area or movable, cm. */
  placeOf(kind, number, step) {
    const prefix = kind === "robot" ? "" : `${kind}_`;
    return ["x", "y"].map((axis) => this.at(`${prefix}${axis}`, number, step));
  }

  /** Number of robots, lights, areas or movables. */
  countOf(kind) {
    return { robot: this.n_robots, light: this.lights.length, area: this.areas.length, movable: this.room?.movables.length ?? 0 }[kind];
  }

  /** Position and heading of a movable; between steps, at a share of the way. */
  movable(index, step, share = 0) {
    const at = (name, step) => this.at(`movable_${name}`, index, step);
    const [x, y, heading] = ["x", "y", "heading"].map((name) => at(name, step));
    if (share === 0 || step + 1 >= this.steps) return { x, y, heading };
    const turn = shortest(at("heading", step + 1) - heading, 2 * Math.PI);
    return { x: x + share * (at("x", step + 1) - x), y: y + share * (at("y", step + 1) - y), heading: heading + share * turn };
  }

  /** The distance at which a robot is heard, cm; 0 if it does not emit. */
  reach(robot) {
    const heard = this.robots.map((robots) => robots.hears_within).filter((range) => range !== null);
    const emits = this.kinds[robot].emits_within;
    return emits === null || heard.length === 0 ? 0 : Math.min(emits, Math.max(...heard));
  }

  /** The number of a message on its lattice; null if messages are not quantised. */
  symbol(robot, message) {
    const levels = this.kinds[robot].n_levels;
    if (levels === null) return null;
    return message.reduce((number, value) => number * levels + Math.round(value * (levels - 1)), 0);
  }

  /** The symbol of the message that a robot hears; null without a lattice. The first call computes
   *  all symbols, because every frame needs them. */
  heardSymbol(robot, step) {
    this.heardSymbols ??= Int32Array.from({ length: this.n_robots * this.steps }, (_, i) => {
      const [robot, step] = [Math.floor(i / this.steps), i % this.steps];
      const emitter = this.whole("emitter", robot, step);
      return emitter < 0 ? -1 : this.symbol(emitter, this.components("heard", robot, step)) ?? -1;
    });
    const symbol = this.heardSymbols[robot * this.steps + step];
    return symbol < 0 ? null : symbol;
  }

  /** The number of symbols. */
  get n_symbols() {
    const levels = Math.max(1, ...this.robots.map((robots) => robots.n_levels ?? 1));
    return levels ** this.message_len;
  }
}

/** A difference on the torus, by the shorter way. */
export function shortest(difference, period) {
  return difference - period * Math.round(difference / period);
}
