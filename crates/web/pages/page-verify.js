// The page that proves the claims of bundles.

import { bar, main } from "swarm/page.js";
import { proofForm } from "swarm/proof-form.js";

bar("Verify", "/verify");
main.append(proofForm());
