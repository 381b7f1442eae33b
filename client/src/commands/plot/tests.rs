//! The sources of the curves of a figure, and refused arguments.

use std::{fs, path::PathBuf};

use swarm_proto::v1::{Event, Experiment, GenerationSummary, event::Kind};

use super::*;
use crate::{
    fake_coordinator::{FakeCoordinator, Script},
    output_file::Overwrite,
    output_format::OutputFormat,
    progress::tests::Captured,
};

/// An address without a server.
const NOWHERE: &str = "http://127.0.0.1:1";
/// Files in the format of `history`, with columns that are not drawn, and a fitness that
/// is not finite.
const HISTORY: &str = "\
experiment,generation,best,mean,min,digest
3,0,0.5,0.25,0,ab
3,1,,0.5,0.25,cd
3,2,1.5,1,0.5,ef
";

fn csv(dir: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = dir.path().join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Plots to `to` and returns the output.
async fn run(coordinator: &str, runs: &[&str], to: PathBuf) -> Result<String, Error> {
    let captured = Captured::default();
    let settings = Settings { coordinator: Some(coordinator.into()), ..Settings::default() };
    let runs = runs.iter().map(ToString::to_string).collect();
    let args = PlotArgs {
        runs,
        steps: None,
        metric: None,
        conditions: Vec::new(),
        to,
        overwrite: Overwrite::default(),
    };
    plot(settings, &args, &mut captured.progress(OutputFormat::Table)).await?;
    Ok(captured.lines().join("\n"))
}

#[tokio::test]
async fn a_file_and_an_experiment_with_the_same_history_give_the_same_picture() {
    let past = [(0.5, 0.25, 0.0), (f64::INFINITY, 0.5, 0.25), (1.5, 1.0, 0.5)];
    let past = past.into_iter().zip(0..).map(|((best, mean, min), generation)| Event {
        sequence: generation + 1,
        at_ms: 0,
        kind: Some(Kind::GenerationCompleted(GenerationSummary {
            generation,
            best,
            mean,
            min,
            ..GenerationSummary::default()
        })),
    });
    let (_fake, connection) = FakeCoordinator::serve(Script {
        experiment: Experiment { id: 3, name: "leader".into(), ..Experiment::default() },
        past: past.collect(),
        ..Script::default()
    })
    .await;
    let dir = tempfile::tempdir().unwrap();
    let (remote, local) = (dir.path().join("remote.svg"), dir.path().join("local.svg"));
    let printed = run(connection.address(), &["3"], remote.clone()).await.unwrap();
    assert_eq!(printed, format!("leader: 2 generations in {}", remote.display()));
    let file = csv(&dir, "leader.csv", HISTORY);
    run(NOWHERE, &[&file], local.clone()).await.unwrap();
    assert_eq!(fs::read(remote).unwrap(), fs::read(local).unwrap());
}

#[tokio::test]
async fn the_band_goes_from_the_worst_to_the_best() {
    let dir = tempfile::tempdir().unwrap();
    let run = Run::read(csv(&dir, "leader.csv", HISTORY).as_ref()).unwrap();
    let figure = figure(&[run], &["a".into()], None);
    let points = &figure.curves[0].points;
    assert_eq!(points[0], Point { x: 0.0, low: 0.0, middle: 0.25, high: 0.5 });
    assert_eq!(points[1], Point { x: 2.0, low: 0.5, middle: 1.0, high: 1.5 });
    assert_eq!(points.len(), 2, "generation 1 has no finite best");
}

#[test]
fn runs_of_the_same_name_get_different_names() {
    let run = |name: &str, source: &str| Run {
        name: name.into(),
        source: source.into(),
        function: None,
        points: vec![],
    };
    let runs = [run("ga", "experiment 1"), run("snes", "experiment 2"), run("ga", "b/ga.csv")];
    assert_eq!(names(&runs), ["ga (experiment 1)", "snes", "ga (b/ga.csv)"]);
}

#[tokio::test]
async fn a_file_without_a_history_is_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    let header = "experiment,generation,best,mean,min,digest\n";
    for (text, expected) in [
        ("", "it has no generation with a fitness"),
        (header, "it has no generation with a fitness"),
        ("a,b\n1,2\n", "missing field `generation`"),
        ("generation,best,mean,min\n0,1,2,x\n", "line 2"),
        ("generation,best,mean,min\n0,1,2\n", "history ID --output csv"),
        ("generation,best,mean,min\n1,1,1,1\n0,1,1,1\n", "in order"),
        ("generation,best,mean,min\n0,1,1,1\n0,1,1,1\n", "those of one run"),
        ("\u{0}\u{1}", "no generation"),
    ] {
        let file = csv(&dir, "a.csv", text);
        let error = run(NOWHERE, &[&file], dir.path().join("a.svg")).await.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let report = error.report();
        assert!(report.contains(expected) && report.lines().count() == 1, "{report}");
    }
    let error = run(NOWHERE, &["missing.csv"], dir.path().join("a.svg")).await.unwrap_err();
    assert!(error.to_string().contains("No such file"), "{error}");
}

#[tokio::test]
async fn a_figure_that_cannot_be_drawn_is_refused_before_any_request() {
    let dir = tempfile::tempdir().unwrap();
    let pdf = run(NOWHERE, &["3"], dir.path().join("a.pdf")).await.unwrap_err();
    assert!(pdf.to_string().ends_with("a figure's name ends in .svg or .png"), "{pdf}");
    let many = run(NOWHERE, &["3"; 15], dir.path().join("a.svg")).await.unwrap_err();
    assert_eq!(many.to_string(), "a figure holds at most 14 runs");
}

#[tokio::test]
async fn an_experiment_without_generations_has_no_picture() {
    let (_fake, connection) = FakeCoordinator::serve(Script {
        experiment: Experiment { id: 3, ..Experiment::default() },
        ..Script::default()
    })
    .await;
    let dir = tempfile::tempdir().unwrap();
    let error = run(connection.address(), &["3"], dir.path().join("a.svg")).await.unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert_eq!(error.to_string(), "experiment 3 has no complete generation yet");
}
