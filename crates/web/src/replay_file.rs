//! One HTML file with the player and an episode, which needs no server.

use base64::{Engine as _, prelude::BASE64_STANDARD};

use crate::{
    modules::{STYLE, import_map},
    replay::Replay,
};

/// The file loads nothing: its modules are data within it.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' data:; \
                      style-src 'unsafe-inline'; img-src data: blob:";

/// The file as text.
pub fn replay_file(replay: &Replay) -> String {
    let modules = import_map(|_, text| {
        format!("data:text/javascript;base64,{}", BASE64_STANDARD.encode(text))
    });
    let episode = BASE64_STANDARD.encode(replay.encode());
    format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>Replay</title>
<style>
{STYLE}</style>
<script type="importmap">{modules}</script>
</head>
<body>
<main id="page"></main>
<script id="episode" type="text/plain">{episode}</script>
<script type="module">import "swarm/replay-file.js";</script>
</body>
</html>
"#
    )
}
