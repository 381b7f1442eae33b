// The loaded fitness of individuals. The page requests only as many generations as fit the
// picture, and each of them once.

import { ask } from "swarm/page.js";
import { quantile } from "swarm/scales.js";

/** Generations of a page. */
const PAGE = 500;
/** Maximum number of requested values, except when zooming in: some megabytes. */
const VALUES_MAX = 2_000_000;
/** Number of values that determine the scale of the colours. */
const SAMPLE = 20_000;
/** Quantiles that limit the scale of the colours, so that a few outliers do not darken all others. */
const SHARES = [0.005, 0.995];

export class FitnessPages {
  constructor(id) {
    Object.assign(this, { id, n_individuals: 0, low: Infinity, high: -Infinity });
    /** Fitness by generation. */
    this.generations = new Map();
    /** The next generation to request, by first generation and step. */
    this.next = new Map();
    this.isAsking = false;
  }

  at(generation) {
    return this.generations.get(generation);
  }

  /** The latest known generation up to this one. */
  nearest(generation) {
    for (let it = generation; it > generation - PAGE && it >= 0; it--) if (this.generations.has(it)) return it;
    return generation;
  }

  /** Pages with the generations from `from` to before `to`; one in `every` of these if not all fit. */
  needed(from, to, width, n_generations) {
    const n_values = (to - from) * Math.max(1, this.n_individuals);
    const every = 2 ** Math.max(0, Math.floor(Math.log2((to - from) / Math.max(1, width))), Math.ceil(Math.log2(n_values / VALUES_MAX)));
    const found = [];
    for (let page = Math.max(0, Math.floor(from / PAGE)); page * PAGE < to; page++) {
      const key = `${page * PAGE}/${every}`;
      found.push({ key, from: page * PAGE, to: Math.min(n_generations, (page + 1) * PAGE), every, count: this.next.get(key) ?? 0 });
    }
    return found;
  }

  /** Requests the missing parts of some pages; returns whether new values came. */
  async load(pages, n_generations) {
    if (this.isAsking) return false;
    this.isAsking = true;
    let isNew = false;
    try {
      for (const { key, from, every } of pages) {
        const next = this.next.get(key) ?? from;
        const end = Math.min(n_generations, from + PAGE);
        if (next >= end) continue;
        const response = await ask(`/api/experiments/${this.id}/fitness?from=${next}&n=${end - next}&every=${every}`);
        const reached = this.take(await response.arrayBuffer(), every);
        // The log may lack these generations: then the answer has no values.
        this.next.set(key, Math.max(next, reached ?? end));
        isNew = true;
        // Now the size of a generation is known: fewer generations may fit than were planned.
        if (from === pages[0].from && pages.length > 1 && this.n_individuals * n_generations > VALUES_MAX) break;
      }
    } finally {
      this.isAsking = false;
    }
    if (isNew) this.scale();
    return isNew;
  }

  /** Takes an answer. Returns the generation after its last one; null if it has none. */
  take(buffer, every) {
    const [start, n, individuals] = new Uint32Array(buffer, 0, 3);
    const values = new Float32Array(buffer, 12);
    for (let i = 0; i < n; i++) this.generations.set(start + i * every, values.subarray(i * individuals, (i + 1) * individuals));
    this.n_individuals = Math.max(this.n_individuals, individuals);
    return n ? start + n * every : null;
  }

  /** The range of fitness that the colours cover. */
  scale() {
    const rows = [...this.generations.values()];
    const step = Math.max(1, Math.floor((rows.length * this.n_individuals) / SAMPLE));
    const sample = [];
    rows.forEach((row, i) => {
      for (let k = i % step; k < row.length; k += step) if (!Number.isNaN(row[k])) sample.push(row[k]);
    });
    sample.sort((a, b) => a - b);
    if (sample.length) [this.low, this.high] = SHARES.map((share) => quantile(sample, share));
  }
}
