//! Access to the pages, and the headers for browsers.

use std::time::Duration;

use axum::{
    body::{Body, to_bytes},
    http::{Request, Response, StatusCode},
};
use evolution::Operator;
use model::{queries::Families, store::Store, submission::Submission};
use serde_json::json;
use swarm_proto::v1::{Experiment, ExperimentState};
use tempfile::TempDir;
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
};
use tower::ServiceExt as _;

use super::*;

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

fn running() -> Experiment {
    let state = ExperimentState::Running.into();
    Experiment { id: 1, name: "first".into(), state, ..Experiment::default() }
}

/// Pages of a data directory with one experiment, which has no generation yet.
fn site(token: Option<&str>) -> (TempDir, Site) {
    let directory = tempfile::tempdir().unwrap();
    let config_json = include_str!("../../../../configs/quickstart.json").to_owned();
    let mut new = Submission { config_json, ..Submission::default() }.check(&|| true).unwrap().new;
    new.config.name = "first".to_owned();
    Store::open(directory.path()).unwrap().create(&new, 0).unwrap();
    let site = Site {
        reader: Arc::new(Reader::open_alone(directory.path()).unwrap()),
        control: None,
        token: token.map(|token| Token::parse(token).unwrap()),
        tls: None,
    };
    (directory, site)
}

async fn answer(listen: &str, token: Option<&str>, request: Request<Body>) -> Response<Body> {
    let (_directory, site) = site(token);
    let router = site.router(listen.parse().unwrap(), CancellationToken::new());
    router.oneshot(request).await.unwrap()
}

fn get(path: &str, host: &str, cookie: &str) -> Request<Body> {
    let request = Request::get(path).header("host", host).header("cookie", cookie);
    request.body(Body::empty()).unwrap()
}

fn post(path: &str, host: &str, origin: Option<&str>, body: &str) -> Request<Body> {
    let mut request = Request::post(path).header("host", host);
    if let Some(origin) = origin {
        request = request.header("origin", origin);
    }
    request.header("content-type", "application/json").body(Body::from(body.to_owned())).unwrap()
}

async fn text(response: Response<Body>) -> String {
    String::from_utf8(to_bytes(response.into_body(), 1 << 20).await.unwrap().into()).unwrap()
}

const HERE: &str = "127.0.0.1:7780";
const ORIGIN: Option<&str> = Some("http://127.0.0.1:7780");

#[tokio::test]
async fn only_browsers_with_the_token_see_anything() {
    let list = "/api/experiments";
    let refused = answer(HERE, Some(TOKEN), get(list, HERE, "")).await;
    assert_eq!(refused.status(), StatusCode::UNAUTHORIZED);
    let asked = answer(HERE, Some(TOKEN), get("/replay/1?robots=7", HERE, "")).await;
    assert_eq!(asked.status(), StatusCode::UNAUTHORIZED);
    assert!(text(asked).await.contains("page-login.js"), "the login page does not replace it");

    let login = |token: &str| post("/login", HERE, ORIGIN, &format!(r#"{{"token":"{token}"}}"#));
    let wrong = answer(HERE, Some(TOKEN), login(&"x".repeat(32))).await;
    assert_eq!(wrong.status(), StatusCode::UNAUTHORIZED);
    assert!(!wrong.headers().contains_key("set-cookie"));
    let right = answer(HERE, Some(TOKEN), login(TOKEN)).await;
    assert_eq!(right.status(), StatusCode::NO_CONTENT);
    let cookie = right.headers()["set-cookie"].to_str().unwrap();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    assert!(!cookie.contains(TOKEN), "the cookie reveals the token");

    let cookie = cookie.split(';').next().unwrap();
    let seen = answer(HERE, Some(TOKEN), get(list, HERE, &format!("other=1; {cookie}"))).await;
    assert!(text(seen).await.contains("first"));
    let other = Some("fedcba9876543210fedcba9876543210");
    let stale = answer(HERE, other, get(list, HERE, cookie)).await;
    assert_eq!(stale.status(), StatusCode::UNAUTHORIZED, "the token has changed");
}

#[tokio::test]
async fn names_of_other_sites_do_not_lead_to_pages_of_this_machine() {
    for host in ["localhost:7780", "127.0.0.1", "[::1]:9", "localhost"] {
        assert_eq!(answer(HERE, None, get("/", host, "")).await.status(), StatusCode::OK, "{host}");
    }
    for host in ["evil.example", "evil.example:7780", "localhost.evil.example", "", "127.0.0.1.x"] {
        let status = answer(HERE, None, get("/api/experiments", host, "")).await.status();
        assert_eq!(status, StatusCode::MISDIRECTED_REQUEST, "{host}");
    }
    let network = answer("10.0.0.1:80", Some(TOKEN), get("/login", "fleet.example", "")).await;
    assert_eq!(network.status(), StatusCode::OK);
}

#[tokio::test]
async fn other_sites_change_nothing() {
    let beginning = Some("http://127.0.0.1:778");
    let longer = Some("http://127.0.0.1:7780.evil.example");
    for origin in [None, Some("null"), Some("http://evil.example"), beginning, longer] {
        let request = post("/api/experiments/1/cancel", HERE, origin, "{}");
        assert_eq!(answer(HERE, None, request).await.status(), StatusCode::FORBIDDEN, "{origin:?}");
    }
    let alone = answer(HERE, None, post("/api/experiments/1/cancel", HERE, ORIGIN, "{}")).await;
    assert_eq!(alone.status(), StatusCode::CONFLICT);
    assert!(text(alone).await.contains("only a coordinator can do this"));
}

#[tokio::test]
async fn browsers_load_nothing_from_elsewhere() {
    for path in ["/", "/experiment/1", "/replay/1@0/3", "/verify", "/demo", "/login"] {
        let page = answer(HERE, None, get(path, HERE, "")).await;
        let policy = page.headers()["content-security-policy"].to_str().unwrap().to_owned();
        let scripts = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' 'sha256-";
        assert!(policy.starts_with(scripts), "{policy}");
        // WebAssembly alone may be compiled by a page.
        let policy = policy.replace("wasm-unsafe-eval", "");
        assert!(!policy.contains("unsafe") && !policy.contains('*'), "{policy}");
        assert!(!text(page).await.contains("://"), "{path}");
    }
}

#[tokio::test]
async fn every_error_is_one_line() {
    for (path, status, part) in [
        ("/api/experiments/9", StatusCode::NOT_FOUND, "there is no experiment 9"),
        ("/api/replay/1", StatusCode::CONFLICT, "has no champion yet"),
        ("/api/replay/x", StatusCode::BAD_REQUEST, "names no genotype"),
        ("/api/workers", StatusCode::CONFLICT, "only a coordinator"),
        ("/api/experiments/x", StatusCode::BAD_REQUEST, "an experiment has a number"),
        ("/api/experiments/-1/events", StatusCode::BAD_REQUEST, "an experiment has a number"),
        ("/api/experiments/1/live?from=x", StatusCode::BAD_REQUEST, "from"),
        ("/api/experiments/1/families?every=0", StatusCode::BAD_REQUEST, "every"),
        ("/api/individual/1", StatusCode::CONFLICT, "has no champion yet"),
        ("/api/individual/x", StatusCode::BAD_REQUEST, "names no genotype"),
        (
            "/api/replay/1?interventions=5:robot:1:dance",
            StatusCode::BAD_REQUEST,
            "is no intervention",
        ),
        ("/api/replay/1?robots=many", StatusCode::BAD_REQUEST, "robots"),
        ("/api/replay/1?colour=red", StatusCode::BAD_REQUEST, "colour"),
        ("/api/nothing", StatusCode::NOT_FOUND, "there is nothing at /nothing"),
    ] {
        let refused = answer(HERE, None, get(path, HERE, "")).await;
        assert_eq!(refused.status(), status, "{path}");
        let text = text(refused).await;
        assert!(text.contains(part) && text.lines().count() == 1, "{text}");
        assert!(text.starts_with(r#"{"error":""#), "{text}");
    }
    for body in ["", "{", r#"{"token":7}"#, "[]"] {
        let refused = answer(HERE, Some(TOKEN), post("/login", HERE, ORIGIN, body)).await;
        assert!(refused.status().is_client_error(), "{body}");
        assert!(text(refused).await.starts_with(r#"{"error":""#), "{body}");
    }
}

#[tokio::test]
async fn head_requests_get_the_headers_of_the_answer() {
    let head = |path: &str| {
        let request = Request::head(path).header("host", HERE);
        request.body(Body::empty()).unwrap()
    };
    for (path, status) in [
        ("/", StatusCode::OK),
        ("/replay/1", StatusCode::OK),
        ("/api/experiments", StatusCode::OK),
        ("/api/experiments/9", StatusCode::NOT_FOUND),
        ("/no/such/page", StatusCode::NOT_FOUND),
    ] {
        assert_eq!(answer(HERE, None, head(path)).await.status(), status, "{path}");
        let stranger = answer(HERE, Some(TOKEN), head(path)).await;
        assert_eq!(stranger.status(), StatusCode::UNAUTHORIZED, "{path}");
    }
}

/// A database has an interrupted run as running.
#[tokio::test]
async fn without_a_coordinator_no_experiment_runs() {
    let list = text(answer(HERE, None, get("/api/experiments", HERE, "")).await).await;
    assert!(list.contains(r#""state":"unfinished""#), "{list}");
    let beside_a_coordinator = json!(answers::ExperimentAnswer::new(running(), true));
    assert_eq!(beside_a_coordinator["state"], "running");
}

#[test]
fn generations_of_different_sizes_share_a_map() {
    let bytes = experiments::packed(7, &[vec![0.5, 1.0], vec![2.0]]);
    let words: Vec<[u8; 4]> = bytes.chunks(4).map(|four| four.try_into().unwrap()).collect();
    assert_eq!([words[0], words[1], words[2]].map(u32::from_le_bytes), [7, 2, 2]);
    let values: Vec<f32> = words[3..].iter().map(|word| f32::from_le_bytes(*word)).collect();
    assert_eq!(values[..3], [0.5, 1.0, 2.0]);
    assert!(values[3].is_nan());
}

#[test]
fn children_are_beside_their_parents() {
    let birth = |operator, parents| evolution::BirthOf { operator, parents, n_new: 1 };
    let of = |individual, n_genes| evolution::Parent { generation: 3, individual, n_genes };
    let births = vec![
        birth(Operator::Crossover, vec![of(1, 2), of(0, 3)]),
        birth(Operator::Copy, vec![of(1, 5)]),
    ];
    let children = vec![0.5, f64::NAN];
    let of = evolution::Families { parents: vec![0.25, 1.5], children, births: vec![births] };
    let page = Families { populations: vec!["p".into()], generations: vec![(4, of)], next: 5 };
    let families = experiments::children(&page);
    let children =
        json!([[4, 0, 0, "crossover", 0.5, 1, 1.5, 0, 0.25], [4, 1, 0, "copy", null, 1, 1.5]]);
    assert_eq!(families, json!({ "populations": ["p"], "children": children, "next": 5 }));
}

/// Open connections of strangers do not keep others from the pages.
#[tokio::test]
async fn idle_connections_slow_ones_and_streams_keep_nobody_out() {
    for (token, bytes) in [
        (None, ""),
        (None, "GET / HTTP/1.1\r\nhost: "),
        (None, "GET /api/live HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        (None, "GET / HTTP/1.1\r\nhost: localhost\r\n\r\n"),
        (
            None,
            "POST /login HTTP/1.1\r\nhost: localhost\r\norigin: http://localhost\r\ncontent-length: 9\r\n\r\n{",
        ),
        (Some(TOKEN), ""),
    ] {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (_directory, site) = site(token);
        let served = tokio::spawn(site.serve(listener, CancellationToken::new()));
        let mut open = Vec::new();
        for _ in 0..600 {
            let mut stream = TcpStream::connect(address).await.unwrap();
            // The connection may already be closed.
            let _ = stream.write_all(bytes.as_bytes()).await;
            open.push(stream);
        }
        let mut stream = TcpStream::connect(address).await.unwrap();
        let request = b"GET /login HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n";
        stream.write_all(request).await.unwrap();
        let mut page = Vec::new();
        let read = stream.read_to_end(&mut page);
        tokio::time::timeout(Duration::from_secs(20), read).await.unwrap().unwrap();
        assert!(page.starts_with(b"HTTP/1.1 200 "), "{token:?} {bytes}");
        served.abort();
    }
}

#[tokio::test]
async fn long_answers_that_nobody_reads_are_bounded() {
    let room = AnswerRoom::default();
    let long = || async { vec![0_u8; 64 << 20] };
    let router = Router::new()
        .route("/", axum::routing::get(long))
        .route("/short", axum::routing::get(|| async { "short" }))
        .layer(middleware::from_fn_with_state(room, limits::hold_answers));
    let ask = |path: &'static str| router.clone().oneshot(get(path, HERE, ""));
    let mut waiting = Vec::new();
    for _ in 0..4 {
        waiting.push(ask("/").await.unwrap());
    }
    assert!(waiting.iter().all(|answer| answer.status() == StatusCode::OK));
    assert_eq!(ask("/").await.unwrap().status(), StatusCode::SERVICE_UNAVAILABLE);
    assert_eq!(ask("/short").await.unwrap().status(), StatusCode::OK);
    waiting.pop();
    assert_eq!(ask("/").await.unwrap().status(), StatusCode::OK);
}
