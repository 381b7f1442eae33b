//! Peers without a token: their effect on other peers and on the log.
#![allow(clippy::needless_update, reason = "messages get more fields as the protocol grows")]

use std::{fs, io::Write as _, net::TcpStream, sync::mpsc, thread, time::Duration};

use harness::{CoordinatorProcess, HandWorker, LogLine, hello, http_get, metrics_address, skipped};
use swarm_proto::v1::{
    Hello, ListExperimentsRequest, experiment_service_client::ExperimentServiceClient,
};
use tonic::{Code, Request, transport::Endpoint};

const CLIENT_TOKEN: &str = "client-token-0123456789abcdef0123";
const WORKER_TOKEN: &str = "worker-token-0123456789abcdef0123";

/// A coordinator with tokens.
fn coordinator(args: &[&str]) -> CoordinatorProcess {
    let directory = tempfile::tempdir().unwrap();
    let files = [("client", CLIENT_TOKEN), ("worker", WORKER_TOKEN)].map(|(name, token)| {
        let path = directory.path().join(name);
        fs::write(&path, token).unwrap();
        path.to_str().unwrap().to_owned()
    });
    let tokens = ["--client-token-file", &files[0], "--worker-token-file", &files[1]];
    CoordinatorProcess::start_with(&[&tokens[..], args].concat())
}

/// Files that this process may have open.
fn n_files_max() -> usize {
    let limits = fs::read_to_string("/proc/self/limits").unwrap();
    let line = limits.lines().find_map(|line| line.strip_prefix("Max open files"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(usize::MAX)
}

/// Makes a call with the client's token on a connection of its own. The call must not take long.
async fn list(url: &str) {
    let endpoint = Endpoint::from_shared(url.to_owned()).unwrap();
    let call = async {
        let mut client = ExperimentServiceClient::new(endpoint.connect().await.unwrap());
        let mut request = Request::new(ListExperimentsRequest::default());
        let value = format!("Bearer {CLIENT_TOKEN}").parse().unwrap();
        request.metadata_mut().insert("authorization", value);
        client.list_experiments(request).await.unwrap();
    };
    tokio::time::timeout(Duration::from_secs(10), call).await.expect("the call is not delayed");
}

#[tokio::test]
async fn six_thousand_idle_connections_do_not_delay_calls() {
    const N_IDLE: usize = 6_000;
    if n_files_max() < N_IDLE + 500 {
        return skipped("too few open files are allowed");
    }
    let coordinator = coordinator(&[]);
    list(&coordinator.url()).await;
    let connect = || TcpStream::connect(coordinator.address()).unwrap();
    let idle: Vec<TcpStream> = (0..N_IDLE).map(|_| connect()).collect();
    for _ in 0..22 {
        list(&coordinator.url()).await;
    }
    let closed = "many connections make no permitted call; the oldest is closed";
    coordinator.process.wait_for("closing", |line| line["message"] == closed);
    drop(idle);
}

/// HTTP/2: the beginning of a connection, and calls that are reset at once.
fn resets(n: u32) -> Vec<u8> {
    let mut bytes = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec();
    let mut frame = |kind: u8, flags: u8, stream: u32, payload: &[u8]| {
        bytes.extend_from_slice(&(payload.len() as u32).to_be_bytes()[1..]);
        bytes.extend_from_slice(&[kind, flags]);
        bytes.extend_from_slice(&stream.to_be_bytes());
        bytes.extend_from_slice(payload);
    };
    frame(4, 0, 0, &[]); // SETTINGS
    for i in 0..n {
        frame(1, 0b101, 2 * i + 1, &[0x83, 0x86, 0x84]); // HEADERS: POST http /
        frame(3, 0, 2 * i + 1, &8_u32.to_be_bytes()); // RST_STREAM: CANCEL
    }
    bytes
}

/// The lines of libraries in a log.
fn of_libraries(lines: &[LogLine]) -> usize {
    let is_h2 = |line: &&LogLine| line["target"].as_str().unwrap().starts_with("h2");
    lines.iter().filter(is_h2).count()
}

#[test]
fn resets_do_not_fill_the_log_and_are_counted() {
    let coordinator = coordinator(&[]);
    let bytes = resets(500);
    let mut n_connections = 0;
    // One line is withheld, and another line reports that a second later.
    let withheld = loop {
        for _ in 0..20 {
            let mut stream = TcpStream::connect(coordinator.address()).unwrap();
            // The coordinator ends the connection.
            let _ = stream.write_all(&bytes);
            n_connections += 1;
        }
        let lines = coordinator.process.lines();
        let is_count = |line: &&LogLine| line["message"] == "a library's log lines were withheld";
        if let Some(line) = lines.iter().find(is_count) {
            break line.clone();
        }
        assert!(n_connections < 100_000, "{} lines of libraries", of_libraries(&lines));
    };
    assert_eq!((&withheld["library"], &withheld["level"]), (&"h2".into(), &"WARN".into()));
    assert!(withheld["withheld"].as_u64().unwrap() > 0);
    let n_lines = of_libraries(&coordinator.process.lines());
    assert!((1..=10).contains(&n_lines), "{n_lines} lines after {n_connections} connections");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn workers_of_another_version_do_not_fill_the_log() {
    let coordinator = CoordinatorProcess::start();
    let mut n_refused = 0;
    let is_refusal = |line: &&LogLine| line["message"] == "worker refused";
    let counted = loop {
        let old = Hello { protocol_version: 1, ..hello() };
        let status = HandWorker::connect(&coordinator.url(), old).await.unwrap_err();
        assert_eq!(status.code(), Code::FailedPrecondition);
        n_refused += 1;
        let lines = coordinator.process.lines();
        let counts = |line: &&LogLine| is_refusal(line) && line["withheld"] != 0;
        if let Some(line) = lines.iter().find(counts) {
            break line.clone();
        }
        assert!(n_refused < 100_000);
    };
    let n_lines = coordinator.process.lines().iter().filter(is_refusal).count() as u64;
    assert_eq!(n_lines, 2, "{n_refused} workers in somewhat more than a second");
    assert!(counted["withheld"].as_u64().unwrap() + n_lines <= n_refused, "{counted}");
}

#[test]
fn slow_connections_do_not_delay_a_scrape() {
    let coordinator = CoordinatorProcess::start_with(&["--metrics-listen", "127.0.0.1:0"]);
    let address = metrics_address(&coordinator.process);
    let slow: Vec<TcpStream> = (0..100)
        .map(|_| {
            let mut stream = TcpStream::connect(&address).unwrap();
            stream.write_all(b"GET /metrics HTTP/1.1\r\n").unwrap();
            stream
        })
        .collect();
    let (answered, answer) = mpsc::channel();
    thread::spawn(move || answered.send(http_get(&address, "/metrics")));
    let (status, _) = answer.recv_timeout(Duration::from_secs(10)).expect("it is not delayed");
    assert_eq!(status, 200);
    drop(slow);
}
