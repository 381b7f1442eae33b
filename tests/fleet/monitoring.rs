//! The dashboard uses only existing metrics, and a real Prometheus has
//! data for every panel.

use std::{collections::BTreeSet, fs, thread, time::Duration};

use harness::{
    CoordinatorProcess, Experiment, Prometheus, WorkerProcess, metrics_address,
    promtool_check_config, skipped_for_want_of, workspace_file,
};
use serde_json::Value;
use swarm_telemetry::{Kind, Metric};

const INSTALL: &str = "apt-get install prometheus";

fn all_metrics() -> Vec<&'static Metric> {
    coordinator::metrics::METRICS.iter().chain(worker::metrics::METRICS).collect()
}

fn dashboard() -> Value {
    let text = fs::read_to_string(workspace_file("docker/grafana/dashboard.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// Title and expressions of every panel.
fn panels() -> Vec<(String, Vec<String>)> {
    let mut panels = Vec::new();
    for panel in dashboard()["panels"].as_array().unwrap() {
        let Some(targets) = panel["targets"].as_array() else { continue };
        let expressions = targets.iter().map(|t| t["expr"].as_str().unwrap().to_owned()).collect();
        panels.push((panel["title"].as_str().unwrap().to_owned(), expressions));
    }
    assert!(panels.len() > 20);
    panels
}

/// The names of our metrics in an expression.
fn names_in(expression: &str) -> impl Iterator<Item = &str> {
    let words = expression.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    words.filter(|word| word.starts_with("swarm_"))
}

#[test]
fn names_are_unique_and_say_what_the_metric_is() {
    let metrics = all_metrics();
    let names: BTreeSet<&str> = metrics.iter().map(|metric| metric.name).collect();
    assert_eq!(names.len(), metrics.len());
    for Metric { name, kind, help, .. } in metrics {
        assert_eq!(*kind == Kind::Counter, name.ends_with("_total"), "{name}");
        assert!(help.ends_with('.') && !help.contains('|'), "{name}: {help}");
    }
}

#[test]
fn the_dashboard_asks_for_existing_metrics() {
    let mut names = BTreeSet::new();
    for metric in all_metrics() {
        match metric.kind {
            Kind::Histogram => names
                .extend(["bucket", "sum", "count"].map(|part| format!("{}_{part}", metric.name))),
            Kind::Gauge | Kind::Counter => drop(names.insert(metric.name.to_owned())),
        }
    }
    let variables = dashboard()["templating"].to_string();
    let panels = panels();
    let expressions = panels.iter().flat_map(|(_, expressions)| expressions).chain([&variables]);
    let asked: BTreeSet<&str> = expressions.flat_map(|expression| names_in(expression)).collect();
    assert!(asked.len() > 20, "{asked:?}");
    let missing: Vec<&&str> = asked.iter().filter(|name| !names.contains(**name)).collect();
    assert!(missing.is_empty(), "no such metrics: {missing:?}");
}

#[test]
fn promtool_accepts_the_configuration() {
    match promtool_check_config(&workspace_file("docker/prometheus.yml")) {
        Some(verdict) => assert_eq!(verdict, Ok(())),
        None => skipped_for_want_of("promtool", INSTALL),
    }
}

/// The fleet is at work on an endless experiment, and a call has failed.
#[test]
fn every_panel_shows_something_to_a_real_prometheus() {
    let listen = ["--metrics-listen", "127.0.0.1:0"];
    let coordinator = CoordinatorProcess::start_with(&listen);
    let worker = WorkerProcess::start_with(&coordinator.url(), "ada", &listen);
    let addresses = [&coordinator.process, &worker.process].map(metrics_address);
    let targets = [("coordinator", addresses[0].as_str()), ("worker", addresses[1].as_str())];
    let Some(prometheus) = Prometheus::start(&targets) else {
        skipped_for_want_of("Prometheus", INSTALL);
        return;
    };
    coordinator.submit(&Experiment::tiny(1_000_000).path());
    let mut expressions: Vec<String> = panels()
        .into_iter()
        .flat_map(|(_, expressions)| expressions)
        .map(|expression| expression.replace("$__rate_interval", "1m").replace("$experiment", ".*"))
        .collect();
    // Two scrapes, a second apart, are enough; a busy machine takes longer.
    for _ in 0..240 {
        assert_eq!(coordinator.swarmctl(&["watch", "77"]).code, Some(3));
        expressions.retain(|expression| {
            let series = prometheus.query(expression);
            let shows = |series: &Value| series["value"][1].as_str() != Some("NaN");
            !series.iter().any(shows)
        });
        if expressions.is_empty() {
            return;
        }
        thread::sleep(Duration::from_millis(500));
    }
    panic!("nothing to show for {expressions:#?}");
}
