//! HTML files that need no server: the player with an episode, and a bundle that proves itself.

use base64::{Engine as _, prelude::BASE64_STANDARD};

use crate::{
    modules::{STYLE, import_map},
    replay::Replay,
};

/// A file loads nothing: its modules and data are within it. Threads begin with a blob.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; \
                      style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:";

/// The player with an episode.
pub fn replay_file(replay: &Replay) -> String {
    single_file("Replay", "replay-file.js", &[data("episode", "", &replay.encode())])
}

/// A bundle, and the page that proves its claims. `name`: the name of the bundle's file;
/// `simulator`: [`SIMULATOR`](crate::SIMULATOR).
pub fn proof_file(name: &str, bundle: &[u8], simulator: &[u8]) -> String {
    let elements = [data("simulator", "", simulator), data("bundle", name, bundle)];
    single_file("Verify", "proof-file.js", &elements)
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
