//! Access: admitted peers, errors for the others, and secrets that stay hidden.
#![allow(clippy::needless_update, reason = "messages get more fields as the protocol grows")]

use std::{
    fs,
    process::Command,
    time::{Duration, SystemTime},
};

use harness::{
    CoordinatorProcess, Experiment, LogLine, Outcome, PythonClient, WorkerProcess, binary, swarmctl,
};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        Hello, ListExperimentsRequest, ListWorkersRequest, WorkRequest, WorkResponse,
        experiment_service_client::ExperimentServiceClient,
        fleet_service_client::FleetServiceClient, work_request,
        worker_service_client::WorkerServiceClient,
    },
};
use tempfile::TempDir;
use tonic::{
    Code, Request, Status, Streaming,
    transport::{Channel, Endpoint},
};
use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};
use tonic_reflection::pb::v1::{
    ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
    server_reflection_request::MessageRequest,
};

const CLIENT_TOKEN: &str = "client-token-0123456789abcdef0123";
const WORKER_TOKEN: &str = "worker-token-0123456789abcdef0123";
const WRONG_TOKEN: &str = "wrong--token-0123456789abcdef0123";

/// A directory of tokens and certificates.
struct Files(TempDir);

impl Files {
    fn new() -> Self {
        let files = Self(tempfile::tempdir().unwrap());
        files.write("client.token", CLIENT_TOKEN);
        files.write("worker.token", WORKER_TOKEN);
        files.write("wrong.token", WRONG_TOKEN);
        files
    }

    /// Adds an authority, and certificates by it: the coordinator's, for
    /// `localhost`, and a peer's.
    fn with_certificates(self) -> Self {
        for name in ["ca", "other-ca"] {
            let mut params = CertificateParams::new([]).unwrap();
            params.distinguished_name.push(DnType::CommonName, name);
            params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
            let ca = CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap();
            self.write(&format!("{name}.pem"), &ca.pem());
            if name == "ca" {
                for (name, host) in [("coordinator", "localhost"), ("peer", "peer")] {
                    let key = KeyPair::generate().unwrap();
                    let params = CertificateParams::new([host.to_owned()]).unwrap();
                    let certificate = params.signed_by(&key, &ca).unwrap();
                    self.write(&format!("{name}.pem"), &certificate.pem());
                    self.write(&format!("{name}.key"), &key.serialize_pem());
                }
            }
        }
        self
    }

    fn write(&self, name: &str, content: &str) {
        fs::write(self.0.path().join(name), content).unwrap();
    }

    /// Options, with `@name` for the path of a file.
    fn options(&self, options: &str) -> Vec<String> {
        let path = |name: &str| self.0.path().join(name).to_str().unwrap().to_owned();
        let option = |word: &str| word.strip_prefix('@').map_or_else(|| word.to_owned(), path);
        options.split_whitespace().map(option).collect()
    }

    /// A coordinator with both tokens and more options.
    fn coordinator(&self, options: &str) -> CoordinatorProcess {
        let tokens = "--client-token-file @client.token --worker-token-file @worker.token";
        let options = self.options(&format!("{tokens} {options}"));
        CoordinatorProcess::start_with(&options.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// The error of a coordinator that should not start.
    fn refused_coordinator(&self, options: &str) -> String {
        let mut command = Command::new(binary("coordinator"));
        command.args(self.options(options)).arg("--data-dir").arg(self.0.path().join("data"));
        let outcome = Outcome::of_command(&mut command);
        assert_eq!(outcome.code, Some(2), "{outcome:#?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
        outcome.stderr
    }

    /// `swarmctl list`.
    fn list(&self, url: &str, options: &str) -> Outcome {
        let options = self.options(options);
        swarmctl(
            ["--coordinator", url, "list"].into_iter().chain(options.iter().map(String::as_str)),
        )
    }

    /// Runs `swarmctl list`, and asserts that its error is one line with all these parts.
    fn list_fails(&self, url: &str, options: &str, code: i32, expected: &[&str]) {
        let outcome = self.list(url, options);
        assert_eq!(outcome.code, Some(code), "{outcome:#?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
        for expected in expected {
            assert!(outcome.stderr.contains(expected), "`{expected}` in {}", outcome.stderr);
        }
    }

    fn worker(&self, url: &str, options: &str) -> WorkerProcess {
        let options = self.options(options);
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        WorkerProcess::start_with(url, "w", &options)
    }
}

fn port(coordinator: &CoordinatorProcess) -> &str {
    coordinator.address().rsplit(':').next().unwrap()
}

fn https(coordinator: &CoordinatorProcess) -> String {
    format!("https://localhost:{}", port(coordinator))
}

#[test]
fn a_network_is_not_served_without_tokens_or_without_tls() {
    let files = Files::new();
    let tokens = "--client-token-file @client.token --worker-token-file @worker.token";
    for listen in ["0.0.0.0:0", "[::]:0", "192.0.2.1:7700"] {
        let error = files.refused_coordinator(&format!("--listen {listen}"));
        assert!(error.contains("--client-token-file") && error.contains(listen), "{error}");
        let error = files.refused_coordinator(&format!("--listen {listen} --plaintext"));
        assert!(error.contains("--client-token-file"), "{error}");
        let error = files.refused_coordinator(&format!("--listen {listen} {tokens}"));
        assert!(error.contains("--tls-cert") && error.contains("--plaintext"), "{error}");
    }
    let private = files.coordinator("--listen 0.0.0.0:0 --plaintext");
    private.process.wait_for("warning", |line| {
        line["level"] == "WARN" && line["message"].as_str().unwrap().contains("no TLS")
    });
}

#[test]
fn bad_secrets_are_refused_by_the_name_of_their_file() {
    let files = Files::new().with_certificates();
    files.write("empty.token", "\n");
    files.write("short.token", "0123456789");
    let with_worker = |client: &str| {
        files.refused_coordinator(&format!(
            "--client-token-file {client} --worker-token-file @worker.token"
        ))
    };
    assert!(with_worker("@empty.token").contains("empty.token is empty"));
    let error = with_worker("@short.token");
    assert!(error.contains("short.token has 10 characters"), "{error}");
    assert!(!error.contains("0123456789"), "{error}");
    assert!(with_worker("@missing.token").contains("missing.token"));
    assert!(with_worker("@worker.token").contains("the same"));
    let error = files.refused_coordinator("--client-token-file @client.token");
    assert!(error.contains("no worker token"), "{error}");
    let error = files.refused_coordinator("--tls-cert @client.token --tls-key @coordinator.key");
    assert!(error.contains("client.token holds no certificate"), "{error}");
    let error = files.refused_coordinator("--tls-cert @peer.pem --tls-key @coordinator.key");
    assert!(error.contains("TLS files cannot be used"), "{error}");

    let mut command = Command::new(binary("coordinator"));
    command.args(["--listen", "127.0.0.1:0"]).env("SWARM_CLIENT_TOKEN", "");
    let outcome = Outcome::of_command(&mut command);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert!(outcome.stderr.contains("SWARM_CLIENT_TOKEN is empty"), "{}", outcome.stderr);
}

/// Calls with a token, or without.
struct Caller {
    channel: Channel,
    token: Option<&'static str>,
}

impl Caller {
    fn request<T>(&self, message: T) -> Request<T> {
        let mut request = Request::new(message);
        if let Some(token) = self.token {
            let value = format!("Bearer {token}").parse().unwrap();
            request.metadata_mut().insert("authorization", value);
        }
        request
    }

    async fn list(&self) -> Code {
        let mut client = ExperimentServiceClient::new(self.channel.clone());
        code(client.list_experiments(self.request(ListExperimentsRequest::default())).await)
    }

    async fn list_workers(&self) -> Code {
        let mut client = FleetServiceClient::new(self.channel.clone());
        code(client.list_workers(self.request(ListWorkersRequest {})).await)
    }

    async fn work(&self, name: &str) -> Result<Streaming<WorkResponse>, Status> {
        let hello = work_request::Message::Hello(Hello {
            protocol_version: PROTOCOL_VERSION,
            sim_core_fingerprint: sim_core::FINGERPRINT.to_owned(),
            name: name.to_owned(),
            slots: 1,
            ..Default::default()
        });
        let requests = tokio_stream::once(WorkRequest { message: Some(hello) });
        let mut client = WorkerServiceClient::new(self.channel.clone());
        client.work(self.request(requests)).await.map(tonic::Response::into_inner)
    }

    async fn reflect(&self) -> Code {
        let request = ServerReflectionRequest {
            message_request: Some(MessageRequest::ListServices(String::new())),
            ..Default::default()
        };
        let mut client = ServerReflectionClient::new(self.channel.clone());
        code(client.server_reflection_info(self.request(tokio_stream::once(request))).await)
    }
}

fn code<T>(result: Result<T, Status>) -> Code {
    result.map_or_else(|status| status.code(), |_| Code::Ok)
}

#[tokio::test]
async fn every_token_opens_its_own_door_and_health_has_none() {
    let files = Files::new();
    let coordinator = files.coordinator("");
    let channel = Endpoint::from_shared(coordinator.url()).unwrap().connect().await.unwrap();
    for (token, clients, workers) in [
        (Some(CLIENT_TOKEN), Code::Ok, Code::PermissionDenied),
        (Some(WORKER_TOKEN), Code::PermissionDenied, Code::Ok),
        (Some(WRONG_TOKEN), Code::Unauthenticated, Code::Unauthenticated),
        (None, Code::Unauthenticated, Code::Unauthenticated),
    ] {
        let caller = Caller { channel: channel.clone(), token };
        assert_eq!(caller.list().await, clients, "{token:?}");
        assert_eq!(caller.list_workers().await, clients, "{token:?}");
        assert_eq!(caller.reflect().await, clients, "{token:?}");
        assert_eq!(code(caller.work("w").await), workers, "{token:?}");
    }
    let mut health = HealthClient::new(channel);
    health.check(HealthCheckRequest::default()).await.unwrap();
}

#[tokio::test]
async fn a_name_cannot_forge_lines_of_a_log() {
    let coordinator = CoordinatorProcess::start();
    let channel = Endpoint::from_shared(coordinator.url()).unwrap().connect().await.unwrap();
    let caller = Caller { channel, token: None };
    caller.work("w\n2026 INFO \u{1b}[31mall is well\u{202e}").await.unwrap();
    let joined = coordinator.process.wait_for("worker", |line| line["message"] == "worker joined");
    assert_eq!(joined["name"], "w 2026 INFO  [31mall is well ");
}

#[test]
fn a_refused_token_is_one_line_and_an_exit_code() {
    let files = Files::new();
    let coordinator = files.coordinator("");
    let url = coordinator.url();
    assert_eq!(files.list(&url, "--token-file @client.token").code, Some(0));
    files.list_fails(&url, "--token-file @wrong.token", 7, &[&url, "not the coordinator's client"]);
    files.list_fails(&url, "--token-file @worker.token", 7, &["takes the client token"]);
    files.list_fails(&url, "", 7, &["got none", "--token-file"]);
    let refused = coordinator.process.wait_for("refusal", |line| line["message"] == "call refused");
    assert_eq!(refused["path"], "/swarm.v1.ExperimentService/ListExperiments");

    let mut command = Command::new(binary("swarmctl"));
    command.args(["--coordinator", &url, "list"]).env("SWARM_CLIENT_TOKEN", CLIENT_TOKEN);
    Outcome::of_command(&mut command).expect_success();

    for token in ["@client.token", "@wrong.token"] {
        let mut worker = files.worker(&url, &format!("--token-file {token}"));
        assert_eq!(worker.process.wait().code(), Some(7));
        let last = worker.process.lines().pop().unwrap();
        assert!(
            last["message"].as_str().unwrap().contains("does not let this worker in"),
            "{last}"
        );
    }
    files.list_fails("http://192.0.2.1:1", "--token-file @client.token", 2, &["unencrypted"]);
}

#[test]
fn a_fleet_works_over_tls_with_certificates_on_both_sides() {
    let files = Files::new().with_certificates();
    let coordinator = files.coordinator(
        "--tls-cert @coordinator.pem --tls-key @coordinator.key --tls-client-ca @ca.pem",
    );
    let tls = "--tls-ca @ca.pem --tls-cert @peer.pem --tls-key @peer.key";
    let _worker = files.worker(&https(&coordinator), &format!("{tls} --token-file @worker.token"));
    let experiment = Experiment::small(2);
    let mut args = files.options(&format!("{tls} --token-file @client.token submit --watch"));
    args.push(experiment.path().to_str().unwrap().to_owned());
    let url = https(&coordinator);
    let args = ["--coordinator", &url].into_iter().chain(args.iter().map(String::as_str));
    let lines = swarmctl(args).expect_success().json_lines();
    assert_eq!(lines.last().unwrap()["state"], "completed");

    files.list_fails(
        &url,
        "--tls-ca @ca.pem --token-file @client.token",
        4,
        &["client certificate", "--tls-cert"],
    );
}

#[test]
fn every_program_warns_of_its_certificates_that_expire_soon() {
    let files = Files::new().with_certificates();
    let mut params = CertificateParams::new(["localhost".to_owned()]).unwrap();
    #[expect(clippy::disallowed_methods, reason = "the programs compare it with their clock")]
    let end = SystemTime::now() + Duration::from_hours(5 * 24 + 1);
    params.not_after = end.into();
    let key = KeyPair::generate().unwrap();
    let certificate = params.self_signed(&key).unwrap();
    files.write("own.pem", &certificate.pem());
    files.write("own.key", &key.serialize_pem());
    let coordinator = files.coordinator("--tls-cert @own.pem --tls-key @own.key");
    let is_said =
        |line: &str| line.contains("own.pem expires on ") && line.contains(", in 5 days; ");
    let is_logged = |line: &LogLine| line["message"].as_str().is_some_and(is_said);
    coordinator.process.wait_for("the date", is_logged);
    let url = https(&coordinator);
    let worker = files.worker(&url, "--tls-ca @own.pem --token-file @worker.token");
    worker.process.wait_for("the date", is_logged);
    let outcome = files.list(&url, "--tls-ca @own.pem --token-file @client.token");
    assert!(outcome.code == Some(0) && is_said(&outcome.stderr), "{outcome:#?}");
}

#[test]
fn a_python_script_speaks_tls() {
    let Some(python) = PythonClient::find() else { return };
    let files = Files::new().with_certificates();
    let coordinator = files.coordinator("--tls-cert @coordinator.pem --tls-key @coordinator.key");
    let url = https(&coordinator);
    let _worker = files.worker(&url, "--tls-ca @ca.pem --token-file @worker.token");
    let experiment = Experiment::tiny(1);
    let run = |options: &str| {
        let mut args = files.options(&format!("--token-file @client.token --patience 0 {options}"));
        args.extend([experiment.path().to_str().unwrap(), "--coordinator", &url].map(String::from));
        python.run(&args.iter().map(String::as_str).collect::<Vec<_>>())
    };
    run("--tls-ca @ca.pem").expect_success();
    let outcome = run("--tls-ca @other-ca.pem");
    assert_eq!(outcome.code, Some(4), "{outcome:#?}");
    assert!(outcome.stderr.contains("CERTIFICATE_VERIFY_FAILED"), "{}", outcome.stderr);
}

#[test]
fn mistakes_with_tls_are_explained() {
    let files = Files::new().with_certificates();
    let encrypted = files.coordinator("--tls-cert @coordinator.pem --tls-key @coordinator.key");
    let url = https(&encrypted);
    let token = "--token-file @client.token";
    assert_eq!(files.list(&url, &format!("{token} --tls-ca @ca.pem")).code, Some(0));
    for (options, code, expected) in [
        ("", 2, "--tls-ca"),
        ("--tls-ca @other-ca.pem", 8, "signed by none"),
        ("--tls-ca @ca.pem --tls-domain elsewhere", 8, "--tls-domain"),
        ("--tls-ca @client.token", 2, "client.token holds no certificate"),
    ] {
        files.list_fails(&url, &format!("{token} {options}"), code, &[expected]);
    }
    // The certificate is valid for the name, and not for the address.
    let by_address = format!("https://{}", encrypted.address());
    files.list_fails(&by_address, &format!("{token} --tls-ca @ca.pem"), 8, &["--tls-domain"]);
    let named = format!("{token} --tls-ca @ca.pem --tls-domain localhost");
    assert_eq!(files.list(&by_address, &named).code, Some(0));
    // Only one side uses TLS.
    files.list_fails(&encrypted.url(), token, 8, &["https://"]);
    files.list_fails(&encrypted.url(), &format!("{token} --tls-ca @ca.pem"), 2, &["https://"]);
    let plain = files.coordinator("");
    files.list_fails(&https(&plain), &format!("{token} --tls-ca @ca.pem"), 8, &["http://"]);

    let worker = files.worker(&https(&plain), "--tls-ca @ca.pem --token-file @worker.token");
    worker.process.wait_for("reason", |line| {
        line["reason"].as_str().is_some_and(|reason| reason.contains("does not speak TLS"))
    });
}

#[test]
fn no_log_at_any_level_shows_a_token() {
    let files = Files::new().with_certificates();
    for (options, tls) in
        [("", ""), ("--tls-cert @coordinator.pem --tls-key @coordinator.key", "--tls-ca @ca.pem")]
    {
        let mut coordinator = files.coordinator(&format!("--log-level trace {options}"));
        let url = if tls.is_empty() { coordinator.url() } else { https(&coordinator) };
        let worker = |token: &str| {
            files.worker(&url, &format!("--log-level trace --token-file {token} {tls}"))
        };
        let (mut good, mut bad) = (worker("@worker.token"), worker("@wrong.token"));
        bad.process.wait();
        coordinator.process.wait_for("worker", |line| line["message"] == "worker joined");
        files.list(&url, &format!("--token-file @client.token {tls}"));
        files.list(&url, &format!("--token-file @wrong.token {tls}"));
        good.process.kill();
        coordinator.process.kill();
        for process in [&coordinator.process, &good.process, &bad.process] {
            let lines = process.lines();
            assert!(lines.iter().any(|line| line["level"] == "TRACE"), "it is a trace");
            for line in lines {
                let line = line.to_string();
                for token in [CLIENT_TOKEN, WORKER_TOKEN, WRONG_TOKEN] {
                    // Even half of the token would be too much.
                    assert!(!line.contains(&token[..20]), "{line}");
                }
            }
        }
    }
}
