// The page of a file that `swarmctl replay` wrote: the episode is in it, and the simulator, if the
// program that wrote it had one.

import { element } from "swarm/dom.js";
import { unpack } from "swarm/episode.js";
import { laboratory } from "swarm/laboratory.js";
import { localSimulation, playedInFile } from "swarm/local-simulation.js";
import { Player, heading, readAddress } from "swarm/player.js";
import { bytesIn } from "swarm/simulator.js";
import { trialStrip } from "swarm/trials.js";

const page = document.getElementById("page");
const episode = await unpack(bytesIn("episode"));
document.title = `${episode.name} – replay`;
const individual = playedInFile();
const simulation = individual && (await localSimulation(individual.played, individual.genes));
const player = simulation ? live() : plain();
addEventListener("hashchange", () => player()?.goTo(readAddress()));

/** The player alone. */
function plain() {
  const alone = new Player(episode);
  page.append(heading(episode, { trials: episode.trials }), alone.node);
  if (episode.trials) page.append(trialStrip(episode.trials, episode.trial));
  alone.node.focus({ preventScroll: true });
  return () => alone;
}

/** The player, and the forms that change the episode. */
function live() {
  const trouble = element("p", { className: "bad", role: "alert", hidden: true });
  const fails = (error) => Object.assign(trouble, { hidden: error === null, textContent: error?.message ?? "" });
  const { simulate } = simulation;
  const shown = laboratory({ config: JSON.parse(individual.played.config), played: episode, trials: episode.trials, simulate, place: hashPlace(), fails, known: episode });
  page.append(trouble, ...shown.nodes);
  shown.start();
  return shown.first;
}

/** Changes after the # of the address, beside step and robot. */
function hashPlace() {
  const own = ["step", "robot"];
  const read = () => new URLSearchParams(location.hash.slice(1));
  return {
    read() {
      const words = read();
      for (const name of own) words.delete(name);
      return words;
    },
    write(words) {
      const kept = [...read()].filter(([name]) => own.includes(name));
      history.replaceState(history.state, "", `#${new URLSearchParams([...kept, ...words])}`);
    },
  };
}
