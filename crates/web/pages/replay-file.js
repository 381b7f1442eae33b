// The page of a file that `swarmctl replay` wrote: the episode is in it.

import { unpack } from "swarm/episode.js";
import { Player, heading, readAddress } from "swarm/player.js";
import { trialStrip } from "swarm/trials.js";

const text = atob(document.getElementById("episode").textContent);
const episode = await unpack(Uint8Array.from(text, (letter) => letter.charCodeAt(0)));
document.title = `${episode.name} – replay`;
const player = new Player(episode);
document.getElementById("page").append(heading(episode, { trials: episode.trials }), player.node);
if (episode.trials) document.getElementById("page").append(trialStrip(episode.trials, episode.trial));
player.node.focus({ preventScroll: true });
addEventListener("hashchange", () => player.goTo(readAddress()));
