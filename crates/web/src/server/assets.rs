//! Pages, modules, the style, and the simulator for browsers, which are part of this program.

use std::{collections::BTreeMap, sync::LazyLock};

use axum::{
    Router,
    http::{
        HeaderValue, StatusCode,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    response::{Html, IntoResponse, Response},
    routing::get,
};
use base64::{Engine as _, prelude::BASE64_STANDARD};
use sha2::{Digest as _, Sha256};

use super::problem::{Path, Problem};
use crate::{
    SIMULATOR,
    modules::{MODULES, STYLE, import_map},
};

/// The addresses of modules and the style.
pub const PREFIX: &str = "/assets/";

const SIMULATOR_NAME: &str = "simulator.wasm.gz";

/// The addresses of modules change with their content.
static IMPORT_MAP: LazyLock<String> =
    LazyLock::new(|| import_map(|name, text| format!("{PREFIX}{}/{name}", version(text))));

/// The import map is the only script within a page.
static POLICY: LazyLock<HeaderValue> = LazyLock::new(|| {
    let digest = BASE64_STANDARD.encode(Sha256::digest(IMPORT_MAP.as_bytes()));
    let policy = format!(
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' 'sha256-{digest}'; \
         worker-src blob:; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'self'; \
         frame-ancestors 'none'"
    );
    HeaderValue::from_str(&policy).expect("ASCII is fit for a header")
});

/// A page finds the simulator by this element.
static SIMULATOR_LINK: LazyLock<String> = LazyLock::new(|| match SIMULATOR {
    None => String::new(),
    Some(simulator) => format!(
        "<link rel=\"simulator\" href=\"{PREFIX}{}/{SIMULATOR_NAME}\">\n",
        version(simulator)
    ),
});

/// The content policy of pages.
pub fn policy() -> &'static HeaderValue {
    &POLICY
}

/// The pages by their paths, and the module of each.
pub fn routes() -> Router {
    let page = |module: &'static str| get(move || async move { page(module) });
    Router::new()
        .route("/", page("page-experiments.js"))
        .route("/experiment/{id}", page("page-experiment.js"))
        .route("/compare", page("page-compare.js"))
        .route("/fleet", page("page-fleet.js"))
        .route("/replay/{*address}", page("page-replay.js"))
        .route("/verify", page("page-verify.js"))
        .route("/demo", page("page-demo.js"))
        .route("/login", get(|| async { login() }))
        .route("/assets/{version}/{name}", get(asset))
        .fallback(|| async { (StatusCode::NOT_FOUND, missing()) })
}

/// The page that asks for the token.
pub fn login() -> Html<String> {
    page("page-login.js")
}

/// The page of unknown addresses.
fn missing() -> Html<String> {
    page("page-missing.js")
}

/// A page is empty: its module fills it.
fn page(module: &str) -> Html<String> {
    let address = |name: &str, text: &str| format!("{PREFIX}{}/{name}", version(text));
    let text = MODULES.iter().find(|(name, _)| *name == module).map_or("", |(_, text)| text);
    Html(format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>swarmevo</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="{style}">
{simulator}<script type="importmap">{map}</script>
<script type="module" src="{script}"></script>
</head>
<body>
<main id="page"><noscript>These pages need JavaScript.</noscript></main>
</body>
</html>
"#,
        style = address("style.css", STYLE),
        simulator = *SIMULATOR_LINK,
        map = *IMPORT_MAP,
        script = address(module, text),
    ))
}

async fn asset(Path((_, name)): Path<(String, String)>) -> Response {
    static ASSETS: LazyLock<BTreeMap<&str, (&str, &[u8])>> = LazyLock::new(|| {
        let modules = MODULES.iter().map(|&(name, text)| (name, (JAVASCRIPT, text.as_bytes())));
        let simulator = SIMULATOR.map(|bytes| (SIMULATOR_NAME, ("application/gzip", bytes)));
        modules.chain([("style.css", (CSS, STYLE.as_bytes()))]).chain(simulator).collect()
    });
    let Some(&(kind, content)) = ASSETS.get(name.as_str()) else {
        return Problem::new(StatusCode::NOT_FOUND, format!("there is no {name}")).into_response();
    };
    // Changed content gets another address, so browsers may cache it for ever.
    let headers = [(CONTENT_TYPE, kind), (CACHE_CONTROL, "public, max-age=31536000, immutable")];
    (headers, content).into_response()
}

const JAVASCRIPT: &str = "text/javascript; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";

/// A digest of some content.
fn version(content: impl AsRef<[u8]>) -> String {
    Sha256::digest(content).iter().take(6).map(|byte| format!("{byte:02x}")).collect()
}
