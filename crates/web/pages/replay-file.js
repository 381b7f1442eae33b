// The page of a file that `swarmctl replay` wrote: the episode is in it.

import { unpack } from "swarm/episode.js";
import { Player, heading, readAddress } from "swarm/player.js";
import { bytesIn } from "swarm/simulator.js";
import { trialStrip } from "swarm/trials.js";

const episode = await unpack(bytesIn("episode"));
document.title = `${episode.name} – replay`;
const player = new Player(episode);
document.getElementById("page").append(heading(episode, { trials: episode.trials }), player.node);
if (episode.trials) document.getElementById("page").append(trialStrip(episode.trials, episode.trial));
player.node.focus({ preventScroll: true });
addEventListener("hashchange", () => player.goTo(readAddress()));
