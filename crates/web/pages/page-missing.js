// The page of unknown addresses.

import { bar, endPage } from "swarm/page.js";

bar("Not found", "");
endPage("There is nothing at this address", location.pathname, ["/", "All experiments"], ["/fleet", "Fleet"]);
