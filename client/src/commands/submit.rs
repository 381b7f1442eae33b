//! `swarmctl submit`: gives an experiment to the coordinator.

use clap::{Args, value_parser};
use swarm_proto::v1::SubmitExperimentRequest;

use crate::{
    args::ExperimentArgs,
    connection::{Connection, present},
    error::Error,
    experiment_file::random_request_id,
    json,
    progress::Progress,
    text,
};

use super::{Remote, watch};

/// Submit an experiment to the coordinator.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct SubmitArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Its share of the fleet relative to other experiments, 1 to 1000 [default: 100]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub priority: Option<u32>,
    /// Follow the experiment to its end, as `swarmctl watch` does.
    #[arg(long)]
    pub watch: bool,
}

const HELP: &str = "\
Examples:
  swarmctl submit experiment.json --watch
  swarmctl submit experiment.json --priority 200 --output json | jq .id";

impl Remote for SubmitArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        submit(&self, connection, progress).await
    }
}

async fn submit(
    args: &SubmitArgs,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let file = args.experiment.checked_file()?;
    let request = SubmitExperimentRequest {
        priority: args.priority,
        ..file.request(&args.experiment.overrides(), random_request_id("submit"))
    };
    let response = connection.submit(request).await.map_err(|error| file.locate(error))?;
    if let Some(warnings) = file.warnings(&response.warnings) {
        progress.remark(&warnings);
    }
    let experiment = present(response.experiment)?;
    match (progress.is_json(), args.watch) {
        (false, true) => progress.print(&text::submitted(&experiment))?,
        (false, false) => progress.print(&format!(
            "{}\nfollow it with: swarmctl watch {}",
            text::submitted(&experiment),
            experiment.id
        ))?,
        (true, true) => {}
        (true, false) => {
            progress.print(&json::document(&json::ExperimentDocument::from(&experiment)))?;
        }
    }
    if args.watch { watch::watch(connection, experiment.id, progress).await } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf};

    use swarm_proto::v1::Experiment;
    use tonic::Status;

    use super::*;
    use crate::{
        args::{OutputFormat, SeedArg},
        experiment_file::tests::quickstart,
        fake_coordinator::{FakeCoordinator, Script},
        progress::tests::Captured,
    };

    fn args(config: PathBuf) -> SubmitArgs {
        let seed = SeedArg { seed: Some(7) };
        let experiment = ExperimentArgs { config, generations: None, seed };
        SubmitArgs { experiment, priority: Some(200), watch: false }
    }

    #[tokio::test]
    async fn a_submission_is_repeated_under_the_same_id() {
        let (fake, connection) = FakeCoordinator::serve(Script {
            experiment: Experiment { id: 3, ..Experiment::default() },
            submit_refusals: [Status::unavailable("starting"), Status::unavailable("soon")].into(),
            ..Script::default()
        })
        .await;
        let captured = Captured::default();
        let mut progress = captured.progress(OutputFormat::Json);
        args(quickstart()).execute(&connection, &mut progress).await.unwrap();
        let submitted = fake.script(|script| script.submitted.clone());
        assert_eq!(submitted.len(), 3);
        assert_eq!(submitted[0].priority, Some(200));
        assert!(submitted[0].request_id.len() > 16);
        assert!(submitted.iter().all(|request| *request == submitted[0]));
        let document: serde_json::Value =
            serde_json::from_str(&captured.lines().join("\n")).unwrap();
        assert_eq!(document["id"], 3);
    }

    #[tokio::test]
    async fn a_refused_file_is_reported_line_by_line() {
        let (_fake, connection) = FakeCoordinator::serve(Script {
            submit_refusals: [Status::invalid_argument("line 1: a\nline 2: b")].into(),
            ..Script::default()
        })
        .await;
        let path = quickstart();
        let mut progress = Captured::default().progress(OutputFormat::Table);
        let error = args(path.clone()).execute(&connection, &mut progress).await.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let path = path.display();
        assert_eq!(error.report().unwrap(), format!("{path}: line 1: a\n{path}: line 2: b"));
    }

    #[tokio::test]
    async fn a_bad_file_is_not_submitted() {
        let (fake, connection) = FakeCoordinator::serve(Script::default()).await;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("bad.json");
        fs::write(&path, "{}").unwrap();
        let mut progress = Captured::default().progress(OutputFormat::Table);
        let error = args(path).execute(&connection, &mut progress).await.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        for key in ["topology", "algorithm", "world"] {
            assert!(error.report().unwrap().contains(key), "{}", error.report().unwrap());
        }
        assert!(fake.script(|script| script.submitted.is_empty()));
    }
}
