//! The files of the folder `pages`, which are part of this program.
//!
//! Modules import each other by bare names, `swarm/NAME`, which a page's import map
//! resolves: to data within a single file, or to addresses of a server.

use std::collections::BTreeMap;

use serde_json::json;

/// The style of all pages.
pub const STYLE: &str = include_str!("../pages/style.css");

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        /// All modules: name and text.
        pub const MODULES: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../pages/", $name)))),*];
    };
}

modules!(
    "camera.js",
    "clock.js",
    "comparison.js",
    "controller.js",
    "demo.js",
    "demo-digests.js",
    "demo-file.js",
    "demo-items.js",
    "demo-stage.js",
    "demo-travel.js",
    "demo-words.js",
    "dom.js",
    "doing.js",
    "difference.js",
    "drawing.js",
    "dynamics.js",
    "charts.js",
    "episode.js",
    "experiment-list.js",
    "export.js",
    "families.js",
    "fitness-pages.js",
    "fleet-timeline.js",
    "front.js",
    "generation-row.js",
    "hearing.js",
    "heat-map.js",
    "interventions.js",
    "laboratory.js",
    "list-columns.js",
    "list-table.js",
    "list-view.js",
    "local-simulation.js",
    "page.js",
    "page-compare.js",
    "page-demo.js",
    "page-experiment.js",
    "page-experiments.js",
    "page-fleet.js",
    "page-login.js",
    "page-missing.js",
    "page-replay.js",
    "page-verify.js",
    "player.js",
    "proof.js",
    "proof-file.js",
    "proof-form.js",
    "recording.js",
    "repertoire.js",
    "replay-file.js",
    "robot-panel.js",
    "robot-pictures.js",
    "robot-trails.js",
    "room.js",
    "scales.js",
    "simulator.js",
    "swept-values.js",
    "timeline.js",
    "trials.js",
    "what-if.js",
    "world.js",
);

/// The import map; `address` maps each module to its address.
pub fn import_map(address: impl Fn(&str, &str) -> String) -> String {
    let imports: BTreeMap<String, String> =
        MODULES.iter().map(|(name, text)| (format!("swarm/{name}"), address(name, text))).collect();
    json!({ "imports": imports }).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_import_only_each_other() {
        let known: Vec<String> = MODULES.iter().map(|(name, _)| format!("swarm/{name}")).collect();
        for (name, text) in MODULES {
            let imports = text.lines().filter(|line| line.starts_with("import "));
            for line in imports {
                let from = line.split('"').nth(1).expect("a name in double quotes");
                assert!(known.iter().any(|known| known == from), "{name}: {line}");
            }
        }
    }

    #[test]
    fn nothing_is_fetched_from_elsewhere() {
        for (name, text) in MODULES.iter().chain(&[("style.css", STYLE)]) {
            let svg = "http://www.w3.org/2000/svg";
            let text = text.replace(svg, "");
            assert!(!text.contains("http:") && !text.contains("https:"), "{name}");
        }
    }
}
