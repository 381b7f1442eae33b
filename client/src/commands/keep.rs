//! `swarmctl delete`, `prune`, `archive` and `label`: stored experiments, and the
//! labels that find them.

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::wire::has_ended;
use swarm_proto::v1::{
    ArchiveExperimentRequest, DeleteExperimentRequest, Experiment, LabelExperimentRequest,
    PruneExperimentRequest,
};

use super::{
    control::{print, print_of},
    export, get, import,
};
use crate::{
    args::{Label, Target},
    complete,
    connection::{Connection, present},
    consent::Consent,
    error::Error,
    group::{Outcome, change_each, members},
    place::Intent,
    progress::Progress,
    remote::{Remote, family},
    text,
};

family! {
    /// Commands for stored experiments.
    Keep {
        Get(get::GetArgs),
        Label(LabelArgs),
        Archive(ArchiveArgs),
        Prune(PruneArgs),
        Delete(DeleteArgs),
        Export(export::ExportArgs),
        Import(import::ImportArgs),
    }
}

/// The error of a command for ended experiments if a group has none.
const NONE_HAS_ENDED: &str = "no experiment of group `NAME` has ended";

/// Delete an ended experiment, or those of a group, with all their data.
///
/// Only its bundle or a backup can restore it. Its number is not used again. An experiment with
/// forks is refused: delete its forks first. The database reuses the freed space: its file keeps
/// its size, but backups get smaller. `prune` deletes less, `archive` nothing.
#[derive(Debug, Args)]
pub struct DeleteArgs {
    #[command(flatten)]
    target: Target,
    #[command(flatten)]
    consent: Consent,
}

impl Remote for DeleteArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let members = members(&self.target, connection, has_ended, NONE_HAS_ENDED).await?;
        if !self.consent.is_given("delete", &members, progress).await? {
            return Ok(());
        }
        let members = latest_first(members);
        let delete = async |experiment_id| {
            let request = DeleteExperimentRequest { experiment_id };
            let call = connection.call(async |client| client.delete_experiment(request).await);
            let response = call.await?;
            Ok((present(response.experiment)?, response.freed_bytes))
        };
        let deleted = change_each(&members, progress, delete).await;
        print_with(&self.target, deleted, progress, |bytes| {
            format!("deleted, {} of the database are free", mib(bytes))
        })
    }
}

/// Delete the fitness log of an ended experiment, or of those of a group.
///
/// Its individuals cannot be recovered afterwards. History, champion and digests stay, and
/// `resume --generations` still works. The database reuses the freed space; backups get
/// smaller.
#[derive(Debug, Args)]
pub struct PruneArgs {
    #[command(flatten)]
    target: Target,
    #[command(flatten)]
    consent: Consent,
}

impl Remote for PruneArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let members = members(&self.target, connection, has_ended, NONE_HAS_ENDED).await?;
        if !self.consent.is_given("prune", &members, progress).await? {
            return Ok(());
        }
        let members = latest_first(members);
        let prune = async |experiment_id| {
            let request = PruneExperimentRequest { experiment_id };
            let call = connection.call(async |client| client.prune_experiment(request).await);
            let response = call.await?;
            Ok((present(response.experiment)?, response.freed_bytes))
        };
        let pruned = change_each(&members, progress, prune).await;
        print_with(&self.target, pruned, progress, |bytes| {
            format!("{} of the database are free", mib(bytes))
        })
    }
}

/// Archive an ended experiment, or those of a group, so that `list` leaves it out.
///
/// Archiving deletes nothing: every command still accepts the experiment, and `list --all`
/// shows it. An experiment that you resume leaves the archive.
#[derive(Debug, Args)]
pub struct ArchiveArgs {
    #[command(flatten)]
    target: Target,
    /// Take the experiment out of the archive.
    #[arg(long)]
    restore: bool,
}

impl Remote for ArchiveArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { target, restore } = self;
        let archive = async |experiment_id| {
            let request = ArchiveExperimentRequest { experiment_id, restore };
            let call = connection.call(async |client| client.archive_experiment(request).await);
            let response = call.await?;
            Ok((present(response.experiment)?, response.log_bytes))
        };
        let members = members(&target, connection, has_ended, NONE_HAS_ENDED).await?;
        let archived = change_each(&members, progress, archive).await;
        print_with(&target, archived, progress, |bytes| match restore {
            true => "listed again".to_owned(),
            false => format!("archived; its fitness log takes {}, see swarmctl prune", mib(bytes)),
        })
    }
}

/// Label an experiment, or all of a group, so that `list --label KEY=VALUE` finds it.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct LabelArgs {
    #[command(flatten)]
    target: Target,
    /// Labels to add or to change.
    #[arg(value_name = "KEY=VALUE", add = ArgValueCompleter::new(complete::labels), required_unless_present = "remove")]
    labels: Vec<Label>,
    /// Keys of labels to remove.
    #[arg(long, value_name = "KEY", add = ArgValueCompleter::new(complete::label_keys))]
    remove: Vec<String>,
}

const HELP: &str = "\
Examples:
  swarmctl label 3 user=ada purpose=thesis
  swarmctl label leader_selection_snes --remove purpose";

impl Remote for LabelArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let set: std::collections::BTreeMap<String, String> =
            self.labels.into_iter().map(|Label { key, value }| (key, value)).collect();
        if let Some(key) = self.remove.iter().find(|key| set.contains_key(*key)) {
            let problem = format!("{key}: it is also to be set; give one of them");
            return Err(Error::option("--remove", problem));
        }
        let label = async |experiment_id| {
            let (set, remove) = (set.clone(), self.remove.clone());
            let request = LabelExperimentRequest { experiment_id, set, remove };
            let call =
                connection.call(async |client| client.label_experiment(request.clone()).await);
            present(call.await?.experiment)
        };
        let members = members(&self.target, connection, |_| true, NONE_HAS_ENDED).await?;
        let changed = change_each(&members, progress, label).await;
        let line = |experiment: &Experiment| match text::labels(experiment) {
            labels if labels.is_empty() => format!("{}: no labels", text::title(experiment)),
            labels => format!("{}: {labels}", text::title(experiment)),
        };
        print(&self.target, changed, line, progress)
    }
}

/// Forks come before their parents: a parent stays as long as a fork shares its
/// generations.
fn latest_first(mut members: Vec<Experiment>) -> Vec<Experiment> {
    members.sort_by_key(|experiment| std::cmp::Reverse(experiment.id));
    members
}

/// Prints experiments, each with the freed or remaining bytes.
fn print_with(
    target: &Target,
    outcome: Outcome<(Experiment, u64)>,
    progress: &mut Progress,
    what: impl Fn(u64) -> String,
) -> Result<(), Error> {
    let line = |(experiment, bytes): &(Experiment, u64)| {
        format!("{}: {}", text::title(experiment), what(*bytes))
    };
    print_of(target, outcome, |(experiment, _)| experiment, line, progress)
}

fn mib(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use swarm_proto::v1::{ForkPoint, SubmitExperimentRequest};

    use super::{super::tests::one_world::output, *};
    use crate::{experiment_file::tests::quickstart, place::Place};

    #[tokio::test(flavor = "multi_thread")]
    async fn contradictions_are_refused_and_archived_runs_are_counted() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path().join("data");
        let at = ["--data-dir", path.to_str().unwrap()];
        let file = quickstart().display().to_string();
        output(&format!("run {file} --generations 1 --group both"), &at).await;
        let refused = output("label 1 a=b --remove a", &at).await;
        assert!(
            refused.ends_with("--remove a: it is also to be set; give one of them"),
            "{refused}"
        );
        let refused = output("fork 1@0 --seed 5 --set seed=6", &at).await;
        let expected = "--set seed: --seed also sets it; give one of them";
        assert!(refused.ends_with(expected), "{refused}");
        output("archive both", &at).await;
        let none = "no such experiments but 1 archived: --all lists them";
        assert_eq!(output("list both", &at).await, none);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn forks_are_deleted_before_their_parents() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path().join("data");
        let at = ["--data-dir", path.to_str().unwrap()];
        let file = quickstart().display().to_string();
        output(&format!("run {file} --generations 3 --group both"), &at).await;
        let place = Place::Directory { path: path.clone(), is_found: false };
        let connection = Connection::to(place, Intent::Submit).await.unwrap();
        let fork = SubmitExperimentRequest {
            config_json: connection.stored(1).await.unwrap().1,
            seed: Some(9),
            group: "both".into(),
            fork_of: Some(ForkPoint { experiment_id: 1, generation: 1 }),
            ..SubmitExperimentRequest::default()
        };
        connection.submit(fork).await.unwrap();
        connection.close().await;
        output("resume 2", &at).await;
        let refused = output("delete 1 --yes", &at).await;
        assert!(refused.contains("[exit code"), "{refused}");
        let next = format!("delete that first: swarmctl delete 2 --data-dir {}", path.display());
        assert!(refused.ends_with(&next), "{refused}");
        let deleted = output("delete both --yes", &at).await;
        assert!(!deleted.contains("[exit code"), "{deleted}");
        assert_eq!(deleted.matches("deleted, ").count(), 2, "{deleted}");
    }
}
