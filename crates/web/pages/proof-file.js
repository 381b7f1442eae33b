// The page of a file that `swarmctl verify --page` wrote: bundle and simulator are in it.

import { proofForm } from "swarm/proof-form.js";
import { bytesIn } from "swarm/simulator.js";

const { name } = document.getElementById("bundle").dataset;
document.title = `${name} – verify`;
document.getElementById("page").append(proofForm({ name, bytes: bytesIn("bundle") }));
