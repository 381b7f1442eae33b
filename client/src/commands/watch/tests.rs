//! Following, against a scripted coordinator.

use serde_json::Value;
use tonic::Status;

use super::*;
use crate::{
    commands::tests::one_world::output,
    experiment_file::tests::quickstart,
    fake_coordinator::{FakeCoordinator, Script, generation, state, unreachable_connection},
    output_format::OutputFormat,
    progress::tests::Captured,
    subject::Subject,
};

fn args(id: u64) -> WatchArgs {
    WatchArgs {
        subject: Some(Subject::Experiment(id)),
        events: false,
        from_sequence: 1,
        so_far: false,
        quiet: false,
        end: WaitFor::Completed,
        timeout: None,
    }
}

fn experiment(state: ExperimentState) -> Experiment {
    Experiment { id: 3, generations: 3, state: state.into(), ..Experiment::default() }
}

#[tokio::test]
async fn events_are_shown_once_and_in_order_however_often_the_stream_breaks() {
    let completed = ExperimentState::Completed;
    let (fake, connection) = FakeCoordinator::serve(Script {
        experiment: experiment(completed),
        champion: Some(GetChampionResponse {
            experiment_id: 3,
            fitness: Some(2.5),
            ..Default::default()
        }),
        watches: [
            (vec![state(1, ExperimentState::Running), generation(2, 0)], None),
            (vec![], Some(Status::unavailable("shutting down"))),
            // One more than requested.
            (vec![generation(2, 0), generation(3, 1)], None),
            (vec![generation(4, 2), state(5, completed)], None),
        ]
        .into(),
        ..Script::default()
    })
    .await;
    let captured = Captured::default();
    let followed = vec![experiment(completed)];
    watch(&connection, followed, &mut captured.progress(OutputFormat::Json)).await.unwrap();
    let lines: Vec<Value> =
        captured.lines().iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    let generations: Vec<_> = lines.iter().filter_map(|line| line["generation"].as_u64()).collect();
    assert_eq!(generations, [0, 1, 2]);
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[3]["state"], "completed");
    assert_eq!(lines[3]["champion"]["fitness_when_chosen"], 2.5);
    assert_eq!(fake.script(|script| script.watched_from.clone()), [1, 3, 3, 4]);
}

#[tokio::test]
async fn an_experiment_that_fails_is_reported_and_is_a_failure() {
    let failed = ExperimentState::Failed;
    let (_fake, connection) = FakeCoordinator::serve(Script {
        experiment: Experiment { reason: "item 7".into(), ..experiment(failed) },
        watches: [(vec![state(1, failed)], None)].into(),
        ..Script::default()
    })
    .await;
    let captured = Captured::default();
    let followed = vec![experiment(failed)];
    let result = watch(&connection, followed, &mut captured.progress(OutputFormat::Table)).await;
    let error = result.unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert_eq!(error.to_string(), "experiment 3 failed: item 7");
    assert_eq!(captured.lines(), ["experiment 3 () failed after 0 of 3 generations: item 7"]);
}

#[tokio::test]
async fn waiting_follows_the_events_instead_of_asking_again() {
    let completed = ExperimentState::Completed;
    let running = Experiment { last_sequence: 4, ..experiment(ExperimentState::Running) };
    let (fake, connection) = FakeCoordinator::serve(Script {
        experiment: running.clone(),
        watches: [
            (vec![generation(5, 2)], Some(Status::unavailable("shutting down"))),
            (vec![generation(6, 3), state(7, completed)], None),
        ]
        .into(),
        ..Script::default()
    })
    .await;
    let progress = Captured::default().progress(OutputFormat::Table);
    let experiment = ended(&connection, running, &progress).await.unwrap();
    assert_eq!(experiment.state(), completed);
    assert_eq!(fake.script(|script| script.watched_from.clone()), [5, 6]);
}

#[tokio::test]
async fn an_unknown_experiment_is_not_found() {
    let (_fake, connection) = FakeCoordinator::serve(Script::default()).await;
    let mut progress = Captured::default().progress(OutputFormat::Table);
    let args = args(9);
    let error = args.execute(&connection, &mut progress).await.unwrap_err();
    assert_eq!((error.exit_code(), error.to_string().as_str()), (3, "there is no experiment 9"));
}

#[tokio::test]
async fn a_coordinator_that_stays_away_is_unreachable() {
    let connection = unreachable_connection().await;
    let mut progress = Captured::default().progress(OutputFormat::Table);
    let args = args(3);
    let error = args.execute(&connection, &mut progress).await.unwrap_err();
    assert_eq!(error.exit_code(), 4);
    let follower = Follower { connection, experiment_id: 3, news: mpsc::channel(1).0 };
    let error = follower.run(1).await.unwrap_err();
    assert_eq!(error.exit_code(), 4);
    assert!(error.to_string().to_lowercase().contains("connection refused"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_group_ends_with_its_comparison_and_the_next_commands() {
    let directory = tempfile::tempdir().unwrap();
    let data = directory.path().join("data");
    let at = ["--data-dir", data.to_str().unwrap()];
    let run = format!("run {} --generations 2 --group pair --seeds", quickstart().display());
    let said = output(&format!("{run} 0..1"), &at).await;
    let end = said.rfind("completed after 2 of 2 generations").unwrap();
    let after = &said[end..];
    let compared = after.find("mean").unwrap();
    let next = after.find("\nnext:\n").unwrap();
    assert!(compared < next, "{after}");
    for command in ["compare pair --to comparison.svg", "plot pair --to fitness.svg", "list pair"] {
        let line = format!("\n  swarmctl {command} --data-dir {}", data.display());
        assert!(after[next..].contains(&line), "{after}");
        // The suggested command works.
        let to = directory.path().join("figure.svg");
        let words = command.replace("comparison.svg", to.to_str().unwrap());
        let words = words.replace("fitness.svg", to.to_str().unwrap());
        let forced = if words.contains("--to") { " --force" } else { "" };
        let answer = output(&format!("{words}{forced}"), &at).await;
        assert!(!answer.contains("[exit code"), "{answer}");
    }
    let one = output(&run.replace(" --group pair --seeds", " --seed 9"), &at).await;
    assert!(!one.contains("\nnext:"), "{one}");
}
