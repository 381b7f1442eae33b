//! `swarmctl submit`: gives an experiment to the coordinator.

use clap::Args;
use swarm_proto::v1::{Experiment, SubmitExperimentRequest};

use crate::{
    args::{ExperimentArgs, whole},
    connection::{Connection, present},
    error::Error,
    json::{ExperimentDocument, OneOrMore},
    place::Intent,
    progress::Progress,
    remote::{Remote, family},
    subject::Subject,
    sweep::{self, SweepRun},
    text,
};

use super::{reordered, watch};

family! {
    /// Commands that submit experiments.
    Evolve {
        Submit(SubmitArgs),
        Fork(super::fork::ForkArgs),
    }
}

/// Submit an experiment, or a group of runs of it, to the coordinator.
///
/// The runs of a group share the fleet: while one run waits for the last items of its
/// generation, workers compute items of other runs. If you repeat the command, it submits
/// only the runs that the group lacks.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct SubmitArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Share of the fleet relative to other experiments, 1 to 1000 [default: 100]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1000))]
    pub priority: Option<u32>,
    /// If an experiment with the same file, seed and version has completed, return it instead of
    /// computing it again.
    #[arg(long)]
    pub reuse: bool,
    /// Follow the experiment to its end, as `swarmctl watch` does.
    #[arg(long)]
    pub watch: bool,
}

const HELP: &str = "\
Examples:
  swarmctl submit experiment.json --watch
  swarmctl submit experiment.json --seeds 0..4
  swarmctl submit experiment.json --seeds 0..4 --group sizes \\
      --set algorithm.population_size=50,100,200
  swarmctl submit experiment.json --priority 200 --output json | jq .id";

impl Remote for SubmitArgs {
    fn intent(&self) -> Intent {
        Intent::Submit
    }

    fn check(&self) -> Result<(), Error> {
        sweep::runs(&self.experiment).map(drop)
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        submit(&self, connection, progress).await
    }
}

async fn submit(
    args: &SubmitArgs,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let runs = sweep::runs(&args.experiment)?;
    let group = runs[0].group();
    let submitted = submit_all(
        &runs,
        Manner { priority: args.priority, reuse: Some(args.reuse) },
        connection,
        progress,
    )
    .await?;
    let is_followed = args.watch || connection.computes();
    match (progress.is_json(), group) {
        (true, _) if is_followed => {}
        (true, Some(group)) => {
            let submitted = submitted.iter().map(ExperimentDocument::from).collect();
            let group = Subject::Group(group.to_owned());
            progress.print_document(&OneOrMore::about(&group, submitted))?;
        }
        (true, None) => {
            progress.print_document(&ExperimentDocument::from(&submitted[0]))?;
        }
        (false, Some(group)) => {
            progress.print(&text::submitted_group(group, &submitted))?;
            if !is_followed {
                let watch = connection.command(&["watch", group]);
                progress.print(&format!("follow it with: {watch}"))?;
            }
        }
        (false, None) => {
            let experiment = &submitted[0];
            progress.print(&text::submitted(experiment))?;
            if !is_followed {
                let watch = connection.command(&["watch", &experiment.id.to_string()]);
                progress.print(&format!("follow it with: {watch}"))?;
            }
        }
    }
    if is_followed { watch::watch(connection, submitted, progress).await } else { Ok(()) }
}

/// Options of a submission.
#[derive(Debug, Clone, Copy, Default)]
pub struct Manner {
    pub priority: Option<u32>,
    /// Whether to return an identical completed experiment; none: remarks about identical
    /// experiments are left out.
    pub reuse: Option<bool>,
}

/// Submits runs one after the other. For an existing run of a group, returns that run.
pub async fn submit_all(
    runs: &[SweepRun],
    manner: Manner,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<Vec<Experiment>, Error> {
    let mut submitted = Vec::new();
    let mut last_warnings = None;
    for run in runs {
        if runs.len() > 1 {
            progress.step(submitted.len() as u64, runs.len() as u64, "runs are submitted");
        }
        let Manner { priority, reuse } = manner;
        let request = SubmitExperimentRequest {
            priority,
            reuse: reuse.unwrap_or_default(),
            ..run.request.clone()
        };
        let response = connection.submit(request).await.map_err(|error| match submitted.len() {
            0 => run.file.locate(error),
            n => Error::Incomplete { n_submitted: n, n_runs: runs.len(), cause: error.into() },
        })?;
        let warnings = run.file.warnings(&response.warnings);
        // The runs of one file mostly have the same warnings.
        if warnings != last_warnings {
            warnings.iter().for_each(|warnings| progress.remark(warnings));
            last_warnings = warnings;
        }
        let experiment = present(response.experiment)?;
        if let Some(reuse) = reuse
            && response.identical > 0
        {
            let old = connection.stored(response.identical).await.ok().map(|(old, _)| old.name);
            let name = run.file.name();
            let names = old.as_deref().zip(name.as_deref());
            let remark = text::identical(&experiment, response.identical, reuse, names);
            remark.iter().for_each(|remark| progress.remark(remark));
        }
        submitted.push(experiment);
    }
    progress.clear();
    let remark = reordered::remark(connection, &submitted).await;
    remark.iter().for_each(|remark| progress.remark(remark));
    Ok(submitted)
}

#[cfg(test)]
mod tests {
    use std::{fs, path::PathBuf};

    use tonic::Status;

    use super::*;
    use crate::{
        args::SeedArg,
        experiment_file::tests::quickstart,
        fake_coordinator::{FakeCoordinator, Script},
        output_format::OutputFormat,
        progress::tests::Captured,
    };

    fn args(config: PathBuf) -> SubmitArgs {
        let seed = SeedArg { seed: Some(7) };
        let mut experiment = ExperimentArgs::only(config);
        experiment.seed = seed;
        SubmitArgs { experiment, priority: Some(200), reuse: false, watch: false }
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
        assert_eq!(error.report(), format!("{path}: line 1: a\n{path}: line 2: b"));
    }

    #[test]
    fn an_identical_experiment_of_another_name_is_remarked_on() {
        let submitted = Experiment { id: 3, ..Experiment::default() };
        let said = |identical, reuse, name| {
            text::identical(&submitted, identical, reuse, Some(("old", name))).unwrap()
        };
        let reused = said(3, true, "new");
        let way = "under the name `old`, and without `--reuse` it is computed under `new`";
        assert!(reused.contains(way), "{reused}");
        assert!(said(1, false, "new").contains("under the name `old`"));
        for same in [said(3, true, "old"), said(1, false, "old")] {
            assert!(!same.contains("name"), "{same}");
        }
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
            assert!(error.report().contains(key), "{}", error.report());
        }
        assert!(fake.script(|script| script.submitted.is_empty()));
    }

    #[tokio::test]
    async fn a_repeated_group_is_submitted_under_the_same_ids() {
        let (fake, connection) = FakeCoordinator::serve(Script::default()).await;
        let mut progress = Captured::default().progress(OutputFormat::Json);
        for _ in 0..2 {
            let mut args = args(quickstart());
            args.experiment.seed = SeedArg::default();
            args.experiment.sweep.seeds = Some("0..2".parse().unwrap());
            args.execute(&connection, &mut progress).await.unwrap();
        }
        let submitted = fake.script(|script| script.submitted.clone());
        assert_eq!(submitted.len(), 6);
        assert_eq!(submitted[..3], submitted[3..]);
        let seeds: Vec<Option<u64>> = submitted.iter().map(|request| request.seed).collect();
        assert_eq!(seeds[..3], [Some(0), Some(1), Some(2)]);
        assert!(submitted.iter().all(|request| request.group == "quickstart"));
    }

    #[tokio::test]
    async fn the_error_of_a_partly_accepted_group_says_so() {
        let full = Status::failed_precondition("1000 experiments are unfinished already");
        let (_fake, connection) = FakeCoordinator::serve(Script {
            submit_refusals: [Status::ok(""), full].into(),
            ..Script::default()
        })
        .await;
        let mut progress = Captured::default().progress(OutputFormat::Json);
        let mut args = args(quickstart());
        args.experiment.sweep.seeds = Some("0..2".parse().unwrap());
        let error = args.execute(&connection, &mut progress).await.unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let report = error.report();
        for part in ["1 of 3 runs", "1000 experiments", "repeat the command"] {
            assert!(report.contains(part), "{report}");
        }
    }
}
