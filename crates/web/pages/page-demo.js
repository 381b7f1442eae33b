// The page with a fleet that runs within it.

import { demo } from "swarm/demo.js";
import { bar, main } from "swarm/page.js";

bar("Demo", "/demo");
main.append(demo());
