//! HTML files that need no server: the player with an episode, a bundle that proves itself, and a
//! fleet.

use base64::{Engine as _, prelude::BASE64_STANDARD};

use replay::{Episode, Replay};
use serde_json::json;

use crate::{
    SIMULATOR,
    modules::{STYLE, import_map},
};

/// A file loads nothing: its modules and data are within it. Threads begin with a blob.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; \
                      style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:";

/// The player with an episode; and the simulator, if this program has it, so that readers can
/// intervene. `generation`: that of the individual.
pub fn replay_file(episode: &Episode<'_>, generation: u64, replay: &Replay) -> String {
    let mut elements = vec![data("episode", "", &replay.encode())];
    if let Some(simulator) = SIMULATOR {
        let played = json!({
            "config": episode.config.to_canonical_json(),
            "name": episode.name,
            "generation": generation,
            "trials": episode.trial_set,
            "trial": episode.trial,
        });
        let genes: Vec<u8> = episode.genotype.iter().flat_map(|gene| gene.to_le_bytes()).collect();
        elements.push(data("simulator", "", simulator));
        elements.push(data("played", "", played.to_string().as_bytes()));
        elements.push(data("genotype", "", &genes));
    }
    single_file("Replay", "replay-file.js", &elements)
}

/// A bundle, and the page that proves its claims. `name`: the name of the bundle's file;
/// `simulator`: [`SIMULATOR`](crate::SIMULATOR).
pub fn proof_file(name: &str, bundle: &[u8], simulator: &[u8]) -> String {
    let elements = [data("simulator", "", simulator), data("bundle", name, bundle)];
    single_file("Verify", "proof-file.js", &elements)
}

/// A fleet that runs within the page. `simulator`: [`SIMULATOR`](crate::SIMULATOR).
pub fn demo_file(simulator: &[u8]) -> String {
    single_file("A fleet in a tab", "demo-file.js", &[data("simulator", "", simulator)])
}

/// An element with data. `name`: the name of the file with this content, if it is one.
fn data(id: &str, name: &str, bytes: &[u8]) -> String {
    let name = name.replace('&', "&amp;").replace('"', "&quot;");
    let content = BASE64_STANDARD.encode(bytes);
    format!("<script id=\"{id}\" data-name=\"{name}\" type=\"text/plain\">{content}</script>\n")
}

/// A page with a module that fills it.
fn single_file(title: &str, module: &str, elements: &[String]) -> String {
    let modules = import_map(|_, text| {
        format!("data:text/javascript;base64,{}", BASE64_STANDARD.encode(text))
    });
    let elements = elements.concat();
    format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>{title}</title>
<style>
{STYLE}</style>
<script type="importmap">{modules}</script>
</head>
<body>
<main id="page"></main>
{elements}<script type="module">import "swarm/{module}";</script>
</body>
</html>
"#
    )
}
