//! `swarmctl fork`: an experiment that continues from a generation of another one.

use clap::Args;
use clap_complete::ArgValueCompleter;
use experiment_file::limits;
use model::Who;
use swarm_proto::v1::ForkPoint;

use crate::{
    address::NamedAddress,
    args::{SeedArg, whole},
    change::{self, Change, Json, SetArg},
    complete,
    connection::{Connection, present},
    error::{Code, Error},
    experiment_file::{ExperimentFile, Overrides, random_request_id},
    json,
    place::Intent,
    progress::Progress,
    remote::Remote,
    text,
};

use super::watch;

/// Continue an experiment from one of its generations as a new experiment, with changes.
///
/// The new experiment shares the history of its parent up to that generation, and continues
/// from the parent's state. Fitness, world, perturbations, the number of robots, trials or
/// individuals and the seed may change; the algorithm, its parameters and the length of
/// genotypes may not. A fork of a repertoire or a front cannot change fitness or world either,
/// because its elites keep the evidence of their trials. All later digests cover the changes; a
/// fork without changes has the digests of its parent.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ForkArgs {
    /// The generation to continue after: ID@G or NAME@G, generation G of an experiment.
    #[arg(value_name = "ID@G", add = ArgValueCompleter::new(complete::experiments))]
    address: NamedAddress,
    #[command(flatten)]
    set: SetArg,
    #[command(flatten)]
    seed: SeedArg,
    /// Total number of generations, including the shared ones, instead of the parent's.
    #[arg(long, value_name = "G", value_parser = whole(1..=limits::GENERATIONS))]
    generations: Option<u64>,
    /// Name of the new experiment [default: the parent's]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Share of the fleet relative to other experiments, 1 to 1000 [default: 100]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1000))]
    priority: Option<u32>,
    /// Follow the experiment to its end, as `swarmctl watch` does.
    #[arg(long)]
    watch: bool,
}

const HELP: &str = "\
Examples:
  swarmctl fork 3@499 --seed 8
  swarmctl fork 3@499 --set world.objects.robotA.num_instances=20 --generations 1500 --watch";

impl Remote for ForkArgs {
    fn intent(&self) -> Intent {
        Intent::Continue
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Who::Generation(generation) = self.address.who else {
            let (address, experiment) = (&self.address, &self.address.experiment);
            let message = format!("`{address}` is no generation; name one, such as {experiment}@9");
            return Err(Error::at(Code::BadArgument, address, message));
        };
        let experiment_id = connection.one(&self.address.experiment).await?.id;
        let (_, parent) = connection.stored(experiment_id).await?;
        let file = self.changed(&parent)?;
        let overrides = Overrides {
            seed: self.seed.seed,
            generations: self.generations,
            ..Overrides::default()
        };
        let mut request = file.request(&overrides, random_request_id("fork"));
        request.priority = self.priority;
        request.fork_of = Some(ForkPoint { experiment_id, generation });
        let response = connection
            .submit(request)
            .await
            .map_err(|error| file.locate(error).about(&self.address))?;
        let experiment = present(response.experiment)?;
        let is_followed = self.watch || connection.computes();
        if !progress.is_json() {
            let mut lines = vec![text::submitted(&experiment)];
            lines.extend(text::origin(&experiment));
            if !is_followed {
                let watch = connection.command(&["watch", &experiment.id.to_string()]);
                lines.push(format!("follow it with: {watch}"));
            }
            progress.print(&lines.join("\n"))?;
        } else if !is_followed {
            progress.print_document(&json::ExperimentDocument::from(&experiment))?;
        }
        if is_followed {
            watch::watch(connection, vec![experiment], progress).await
        } else {
            Ok(())
        }
    }
}

impl ForkArgs {
    /// The parent's file with the changes.
    fn changed(&self, config_json: &str) -> Result<ExperimentFile, Error> {
        let mut file = Json::parse(config_json);
        let mut changes = Vec::new();
        let mut problems: Vec<String> = Vec::new();
        for text in &self.set.set {
            match Change::parse_all(text) {
                Ok(parsed) => changes.extend(parsed),
                Err(problem) => problems.push(format!("--set {problem}")),
            }
        }
        let options = [
            ("seed", "--seed", self.seed.seed.is_some()),
            ("name", "--name", self.name.is_some()),
            ("algorithm.generations", "--generations", self.generations.is_some()),
        ];
        for (path, option, is_given) in options {
            if is_given && changes.iter().any(|change: &Change| change.path == path) {
                problems.push(format!("--set {path}: {option} also sets it; give one of them"));
            }
        }
        if let Some(name) = &self.name {
            let name = Json::Scalar(name.clone().into());
            changes.push(Change::new("name".to_owned(), name));
        }
        if let Err(unplaced) = change::apply_all(&changes, &mut file) {
            problems.extend(unplaced.into_iter().map(|problem| format!("--set {problem}")));
        }
        if !problems.is_empty() {
            return Err(Error::at(Code::BadArgument, "--set", problems.join("\n")));
        }
        let name = format!("experiment {} with changes", self.address.experiment);
        Ok(ExperimentFile::new(name.into(), json::line(&file)))
    }
}
