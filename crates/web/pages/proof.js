// Proves the claims of a bundle: a thread repeats its evolution, and other threads simulate.

import { Thread } from "swarm/simulator.js";

/** Threads for this machine. */
export const THREADS = Math.max(1, Math.min(16, navigator.hardwareConcurrency ?? 1));

/** Proves a bundle. `file`: name and bytes; `generations`: the number of generations to simulate
 *  again, null for all; `onProgress({ done, generations, what })`; `signal` cancels. Returns the
 *  proof, a line per claim. Fails with the first flaw. */
export async function prove(simulator, { file, bytes, generations, onProgress, signal }) {
  const threads = Array.from({ length: 1 + THREADS }, () => new Thread(simulator));
  const end = () => threads.forEach((thread) => thread.end());
  signal.addEventListener("abort", end);
  try {
    const [repeating, ...simulating] = threads;
    const opened = (await repeating.call({ call: "open", file, generations }, bytes)).header;
    await Promise.all(simulating.map((thread) => thread.call({ call: "compile", config: opened.config })));
    for (;;) {
      const { header, bytes: genes } = await repeating.call({ call: "repeat" });
      const { done, batch } = header;
      onProgress({ done, generations: opened.generations, what: batch ? `simulating ${batch.name}` : "" });
      if (batch) await repeating.call({ call: "compare" }, await simulate(simulating, batch, genes));
      else if (header.is_over) break;
    }
    return (await repeating.call({ call: "finish" })).header.proof;
  } finally {
    signal.removeEventListener("abort", end);
    end();
  }
}

/** The numbers of all genotypes of a batch, in their order, as bytes. */
async function simulate(threads, batch, genes) {
  const { n_genotypes: n, n_trials, values_per_trial, trials } = batch;
  const size = genes.length / n;
  const length = n_trials * values_per_trial * 8;
  const values = new Uint8Array(n * length);
  let next = 0;
  await Promise.all(threads.map(async (thread) => {
    while (next < n) {
      const i = next++;
      const { bytes } = await thread.call({ call: "evaluate", trials, n_trials, values_per_trial }, genes.slice(i * size, (i + 1) * size));
      values.set(bytes, i * length);
    }
  }));
  return values;
}
