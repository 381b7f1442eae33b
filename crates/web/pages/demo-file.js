// The page of a file that `swarmctl web --demo` wrote: the simulator is in it.

import { demo } from "swarm/demo.js";

document.title = "A fleet in a tab – swarmevo";
document.getElementById("page").append(demo());
