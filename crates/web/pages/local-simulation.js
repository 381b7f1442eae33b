// Changed episodes, simulated by this browser.

import { unpack } from "swarm/episode.js";
import { Thread, bytesIn, loadSimulator } from "swarm/simulator.js";

/** Simulates an individual's episodes. `played`: its experiment file, name and unchanged episode;
 *  `genes`: the bytes of its genotype. Null without a simulator. */
export async function localSimulation(played, genes) {
  const module = await loadSimulator();
  if (!module) return null;
  let thread = null;
  return {
    /** The episode with these changes, the query of an address. A later call ends this one. */
    async simulate(words) {
      thread?.end("another simulation has begun");
      thread = new Thread(module);
      const mine = thread;
      try {
        return await unpack((await mine.call({ call: "replay", played, what_if: String(words) }, genes)).bytes);
      } finally {
        mine.end();
      }
    },
  };
}

/** The individual of a file, and its genes; null in a file that only plays. */
export function playedInFile() {
  if (document.getElementById("played") === null) return null;
  return { played: JSON.parse(new TextDecoder().decode(bytesIn("played"))), genes: bytesIn("genotype") };
}
