//! Prometheus and its tool, from Debian's package `prometheus`, if they are installed.

use std::{
    fmt::Write as _,
    fs,
    io::Write as _,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::{LoggingProcess, http_get, process::Source};

/// The complaints of `promtool check metrics` about a scrape; `None` without promtool.
pub fn promtool_check_metrics(text: &str) -> Option<String> {
    let mut promtool = Command::new("promtool")
        .args(["check", "metrics"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .ok()?;
    let mut stdin = promtool.stdin.take().expect("piped");
    stdin.write_all(text.as_bytes()).expect("promtool reads");
    drop(stdin);
    let output = promtool.wait_with_output().expect("promtool ends");
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    Some(if output.status.success() { said.into() } else { format!("{}: {said}", output.status) })
}

/// The result of `promtool check config` for a file; `None` without promtool.
pub fn promtool_check_config(path: &Path) -> Option<Result<(), String>> {
    let output = Command::new("promtool").args(["check", "config"]).arg(path).output().ok()?;
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    Some(if output.status.success() { Ok(()) } else { Err(said.into()) })
}

/// A Prometheus of its own.
#[derive(Debug)]
pub struct Prometheus {
    _process: LoggingProcess,
    address: String,
    _directory: TempDir,
}

impl Prometheus {
    /// Starts a Prometheus that scrapes each `(job, address)` every second; `None` if it is not
    /// installed.
    pub fn start(targets: &[(&str, &str)]) -> Option<Self> {
        Command::new("prometheus").arg("--version").output().ok()?;
        let directory = tempfile::tempdir().expect("a temporary directory");
        let mut config = "global: {scrape_interval: 1s}\nscrape_configs:\n".to_owned();
        for (job, address) in targets {
            let target =
                format!("{{job_name: {job}, static_configs: [{{targets: ['{address}']}}]}}");
            writeln!(config, "- {target}").expect("a string can be written");
        }
        let file = directory.path().join("prometheus.yml");
        fs::write(&file, config).expect("the temporary directory is writable");
        let mut command = Command::new("prometheus");
        command
            .args(["--web.listen-address=127.0.0.1:0", "--log.format=json"])
            .arg(format!("--config.file={}", file.display()))
            .arg(format!("--storage.tsdb.path={}", directory.path().join("data").display()))
            .stdout(Stdio::null());
        let process = LoggingProcess::spawn(command, Source::Stderr);
        let line = process.wait_for("address", |line| line["msg"] == "Listening on");
        let address = line["address"].as_str().expect("text").to_owned();
        Some(Self { _process: process, address, _directory: directory })
    }

    /// The present series of an expression.
    pub fn query(&self, expression: &str) -> Vec<Value> {
        let encoded: String = expression.bytes().map(|byte| format!("%{byte:02X}")).collect();
        let path = format!("/api/v1/query?query={encoded}");
        let (status, text) = http_get(&self.address, &path);
        // While Prometheus starts, it answers with 503.
        if status == 503 {
            return Vec::new();
        }
        assert_eq!(status, 200, "{expression}: {text}");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        answer["data"]["result"].as_array().expect("a vector").clone()
    }
}
