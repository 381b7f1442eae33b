//! The page on metrics has a table of each program.

use std::fs;

use harness::workspace_file;
use swarm_telemetry::Metric;

use super::{expect_page, with_part};

const PAGE: &str = "docs/metrics.md";

/// The table of a program's metrics.
fn table(metrics: &[Metric]) -> String {
    let row = |metric: &Metric| {
        let labels: Vec<String> = metric.labels.iter().map(|label| format!("`{label}`")).collect();
        let (name, kind, labels) = (metric.name, metric.kind.name(), labels.join(", "));
        format!("| `{name}` | {kind} | {labels} | {} |\n", metric.help).replace("|  |", "| |")
    };
    let rows: String = metrics.iter().map(row).collect();
    format!("| name | type | labels | meaning |\n|---|---|---|---|\n{rows}")
}

#[test]
fn the_page_on_metrics_has_the_tables_of_the_programs() {
    let page = fs::read_to_string(workspace_file(PAGE)).unwrap();
    let expected = with_part(&page, "coordinator", &table(coordinator::metrics::METRICS));
    expect_page(PAGE, &with_part(&expected, "worker", &table(worker::metrics::METRICS)));
}
