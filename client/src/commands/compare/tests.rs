//! The grouping of runs into samples, and the printed comparison.

use std::fs;

use serde_json::Value;
use swarm_proto::v1::{Experiment, ExperimentState, GenerationSummary, event::Kind};

use super::*;
use crate::{
    fake_coordinator::{FakeCoordinator, Script},
    output_format::OutputFormat,
    progress::Part,
    progress::tests::Captured,
};

/// A history whose mean rises by `rise` per generation.
fn history(rise: f64) -> String {
    let row =
        |g: u32| format!("1,{g},{},{},0,100\n", 1.5 * rise * f64::from(g), rise * f64::from(g));
    "experiment,generation,best,mean,min,episodes\n".to_owned()
        + &(0..4).map(row).collect::<String>()
}

/// Files of runs: two samples of three runs each, one with champions.
fn files() -> (tempfile::TempDir, Vec<String>) {
    let dir = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    for (name, rises) in [("snes", [3.0, 4.0, 5.0]), ("ga", [1.0, 2.0, 0.5])] {
        for (seed, rise) in rises.into_iter().enumerate() {
            let path = dir.path().join(format!("{name}-{seed}.csv"));
            fs::write(&path, history(rise)).unwrap();
            paths.push(path.to_str().unwrap().to_owned());
            if name == "snes" {
                let path = path.with_extension("json");
                let judged = format!(r#"{{"mean": {rise}, "trials": 200}}"#);
                fs::write(&path, format!(r#"{{"seed": {seed}, "judged": {judged}}}"#)).unwrap();
                paths.push(path.to_str().unwrap().to_owned());
            }
        }
    }
    (dir, paths)
}

async fn run(
    coordinator: &str,
    runs: &[String],
    target: Option<f64>,
    format: OutputFormat,
) -> Result<String, Error> {
    let captured = Captured::default();
    let settings = Settings { coordinator: Some(coordinator.into()), ..Settings::default() };
    let args = CompareArgs {
        runs: runs.to_vec(),
        last: 2,
        target,
        to: None,
        overwrite: Overwrite::default(),
    };
    compare(settings, &args, &mut captured.progress(format)).await?;
    Ok(captured.lines().join("\n"))
}

/// An address without a server.
const NOWHERE: &str = "http://127.0.0.1:1";

#[tokio::test]
async fn files_of_one_name_are_a_sample_and_each_quantity_has_its_numbers() {
    let (_dir, paths) = files();
    let text = run(NOWHERE, &paths, Some(6.0), OutputFormat::Json).await.unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let quantities: Vec<&Value> = report["quantities"].as_array().unwrap().iter().collect();
    let names: Vec<&str> =
        quantities.iter().map(|quantity| quantity["name"].as_str().unwrap()).collect();
    let to_target = ["generations_to_target", "episodes_to_target"];
    assert_eq!(names[..3], ["judged", "mean", "best"]);
    assert_eq!(names[3..], to_target);
    let judged = quantities[0];
    assert_eq!(judged["samples"].as_array().unwrap().len(), 1, "ga has no champions");
    assert_eq!(judged["samples"][0]["median"]["value"], 4.0);
    let mean = quantities[1];
    // The mean of generations 2 and 3 is 2.5 times the rise.
    assert_eq!(mean["samples"][0]["values"], serde_json::json!([7.5, 10.0, 12.5]));
    assert_eq!(mean["samples"][1]["median"]["value"], 2.5);
    assert_eq!(mean["pairs"][0]["probability_of_improvement"]["value"], 1.0);
    // All six in order: 2 of the 20 ways are as extreme.
    assert!((mean["pairs"][0]["p"].as_f64().unwrap() - 0.1).abs() < 1e-12);
    let generations = quantities[3];
    assert_eq!(generations["samples"][0]["values"], serde_json::json!([3.0, 3.0, 3.0]));
    assert_eq!(generations["samples"][1]["values"], serde_json::json!([null, 4.0, null]));
    assert_eq!(generations["pairs"][0]["probability_of_improvement"]["value"], 1.0);
    assert_eq!(quantities[4]["samples"][1]["values"][1], 400.0);
}

#[tokio::test]
async fn people_read_tables() {
    let (_dir, paths) = files();
    let text = run(NOWHERE, &paths, Some(6.0), OutputFormat::Table).await.unwrap();
    insta::assert_snapshot!(text);
}

#[tokio::test]
async fn tables_fit_the_terminal() {
    let (_dir, runs) = files();
    for width in [40, 80, 200] {
        let captured = Captured::default();
        let args = CompareArgs {
            runs: runs.clone(),
            last: 2,
            target: Some(6.0),
            to: None,
            overwrite: Overwrite::default(),
        };
        let mut progress = captured.progress_on(OutputFormat::Table, width);
        compare(Settings::default(), &args, &mut progress).await.unwrap();
        let lines = captured.lines();
        for line in lines.iter().flat_map(|text| text.lines()) {
            assert!(console::measure_text_width(line) <= width, "{width}: {line}");
        }
        insta::assert_snapshot!(format!("tables_at_{width}_columns"), lines.join("\n"));
    }
}

#[tokio::test]
async fn all_wrong_files_are_named_at_once() {
    let (dir, mut paths) = files();
    let write = |name: &str, text: &str| {
        fs::write(dir.path().join(name), text).unwrap();
        dir.path().join(name).to_str().unwrap().to_owned()
    };
    paths.push(paths[0].clone());
    paths.push(write("unnamed.csv", &history(1.0)));
    paths.push(write("ga-7.json", r#"{"seed": 8}"#));
    paths.push(write("ga-9.csv", "a,b\n1,2\n"));
    paths.push("missing-1.csv".to_owned());
    let error = run(NOWHERE, &paths, None, OutputFormat::Table).await.unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let text = error.to_string();
    for part in
        ["given twice", "NAME-SEED.csv", "its seed is 8", "swarmctl history", "No such file"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(text.lines().count(), 5, "{text}");
}

#[tokio::test]
async fn titles_state_the_number_of_averaged_generations() {
    let dir = tempfile::tempdir().unwrap();
    let run_of = |seed: u32, n: usize| {
        let path = dir.path().join(format!("a-{seed}.csv"));
        let lines: Vec<String> = history(1.0).lines().take(n + 1).map(str::to_owned).collect();
        fs::write(&path, lines.join("\n")).unwrap();
        path
    };
    let paths = [run_of(0, 1), run_of(1, 2), run_of(2, 2), run_of(3, 4)];
    let title = |paths: &[PathBuf], last| {
        let mut samples = Samples::default();
        samples.read(paths).unwrap();
        let report = Report::new(&samples.finish().unwrap(), last, None);
        let Part::Text(heading) = &report.to_parts()[0] else { panic!() };
        heading.trim_end().to_owned()
    };
    let mean = "mean: mean fitness of a generation";
    assert_eq!(title(&paths[1..3], 50), format!("{mean}, average of the last 2"));
    assert_eq!(title(&paths[3..], 3), format!("{mean}, average of the last 3"));
    assert_eq!(title(&paths, 3), format!("{mean}, average of the last 1 to 3"));
    assert_eq!(title(&paths[..1], 50), format!("{mean}, the last one"));
}

#[tokio::test]
async fn champion_files_of_run_contain_their_name_and_seed() {
    let dir = tempfile::tempdir().unwrap();
    let champion = |file: &str, name: &str, seed: u64, mean: f64| {
        let path = dir.path().join(file);
        let text = format!(r#"{{"name": "{name}", "seed": {seed}, "judged": {{"mean": {mean}}}}}"#);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let paths = [
        champion("a-1.champion.json", "a", 7, 1.0),
        champion("a-2.champion.json", "a", 8, 2.0),
        champion("a-9.json", "another name", 9, 3.0),
        champion("champion.json", "b", 7, 0.5),
    ];
    let text = run(NOWHERE, &paths, None, OutputFormat::Json).await.unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let samples = &report["quantities"][0]["samples"];
    assert_eq!(samples[0]["values"], serde_json::json!([1.0, 2.0, 3.0]), "the file's name counts");
    assert_eq!((&samples[1]["sample"], &samples[1]["values"][0]), (&"b".into(), &0.5.into()));
    let unnamed = [champion("champion.json", "", 7, 0.5)];
    let error = run(NOWHERE, &unnamed, None, OutputFormat::Table).await.unwrap_err().to_string();
    assert!(error.contains("NAME-SEED.json") && error.contains("names its experiment"), "{error}");
}

#[tokio::test]
async fn a_group_is_compared_by_its_variants_and_unfinished_runs_are_left_out() {
    let generation = |g: u64| {
        let summary = GenerationSummary { generation: g, mean: g as f64, ..Default::default() };
        swarm_proto::v1::Event {
            sequence: g + 1,
            at_ms: 0,
            kind: Some(Kind::GenerationCompleted(summary)),
        }
    };
    let experiment = Experiment {
        id: 3,
        group: "sizes".into(),
        variant: "a=1".into(),
        state: ExperimentState::Completed.into(),
        champion_fitness: Some(1.25),
        ..Experiment::default()
    };
    let past: Vec<_> = (0..3).map(generation).collect();
    let script = Script { experiment, past, ..Script::default() };
    let (fake, connection) = FakeCoordinator::serve(script).await;
    let group = ["sizes".to_owned()];
    let text = run(connection.address(), &group, None, OutputFormat::Json).await.unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["quantities"][0]["samples"][0]["sample"], "sizes a=1");
    assert_eq!(report["quantities"][0]["samples"][0]["values"][0], 1.25);
    assert_eq!(report["quantities"][1]["samples"][0]["values"][0], 1.5);

    let twice = ["sizes", "sizes"].map(str::to_owned);
    let error = run(connection.address(), &twice, None, OutputFormat::Json).await.unwrap_err();
    assert!(error.to_string().ends_with("is named twice"), "{error}");

    fake.script(|script| script.experiment.set_state(ExperimentState::Running));
    let error = run(connection.address(), &group, None, OutputFormat::Json).await.unwrap_err();
    assert_eq!((error.exit_code(), error.to_string().as_str()), (3, "no run has completed yet"));
}

#[test]
fn champions_that_nobody_has_judged_have_nothing_to_compare() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a-1.json");
    fs::write(&path, r#"{"name": "a", "seed": 1, "genotype": [1]}"#).unwrap();
    let mut samples = Samples::default();
    samples.read(&[path]).unwrap();
    let error = samples.finish().unwrap_err().to_string();
    assert!(
        error.starts_with("no champion has been judged, and no run has a history; "),
        "{error}"
    );
}

#[tokio::test]
async fn the_figure_has_a_curve_for_each_sample() {
    let (_dir, paths) = files();
    let mut samples = Samples::default();
    let histories = paths.iter().filter(|path| path.ends_with("csv")).map(Into::into);
    samples.read(&histories.collect::<Vec<PathBuf>>()).unwrap();
    let figure = figure(&samples.finish().unwrap()).unwrap();
    let names: Vec<&str> = figure.curves.iter().map(|curve| &*curve.name).collect();
    assert_eq!(names, ["snes", "ga"]);
    let last = figure.curves[0].points[3];
    assert_eq!((last.x, last.low, last.middle, last.high), (3.0, 9.0, 12.0, 15.0));
}
