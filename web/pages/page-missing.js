// What stands at addresses that lead nowhere.

import { bar, endPage } from "swarm/page.js";

bar("Not found", "");
endPage("There is nothing at this address", location.pathname, ["/", "All experiments"], ["/fleet", "Fleet"]);
