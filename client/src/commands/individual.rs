//! `swarmctl individual`: any genotype that was ever evaluated, as JSON.

use std::path::PathBuf;

use clap::Args;
use coordinator::Who;
use swarm_proto::v1::{Experiment, GetChampionResponse};

use crate::{
    address::NamedAddress, archive::Archive, error::Error, json, progress::Progress,
    settings::Settings,
};

/// Print a genotype and the network that it encodes, as JSON: the champion, or any
/// individual of any generation.
///
/// Individuals are computed again from the fitness that evolution was told, to the same
/// bits; nothing is simulated. Of a champion, `judged` says what it is worth: the mean, with
/// its 95 % interval, on trials that selected nothing, once the run has ended. `selection` is
/// the mean on the held-out trials by which it was compared with other candidates, and
/// `fitness_when_chosen` that of its generation, for which it became one: both are optimistic.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct IndividualArgs {
    /// Whom: ID or NAME, the champion of an experiment; ID@G/I, individual I of generation G;
    /// ID@G/mean, the mean of the distribution after generation G; ID@G, all individuals
    /// of generation G, without their networks.
    #[arg(value_name = "ADDRESS")]
    address: NamedAddress,
    /// Read the database in this directory, of a coordinator or of `run`, instead of asking
    /// a coordinator. One may use it meanwhile.
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
}

const HELP: &str = "\
Examples:
  swarmctl individual 3 > champion.json
  swarmctl individual 3 | jq .network
  swarmctl individual 3@0/17
  swarmctl individual 3@59/mean --data-dir swarm-data";

/// Reads, and prints a document.
pub async fn individual(
    settings: Settings,
    args: &IndividualArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    let archive = Archive::open(settings, args.data_dir.as_deref())?;
    let address = archive.resolve(&args.address).await?;
    let (experiment, _) = archive.experiment(address.experiment.0).await?;
    let mut answer = archive.individuals(address, 0).await?;
    let mut individuals = answer.individuals;
    while let Some(next) = answer.next_individual {
        answer = archive.individuals(address, next).await?;
        individuals.append(&mut answer.individuals);
    }
    let text = match (address.who, &individuals[..]) {
        (Who::Generation(generation), individuals) => {
            json::document(&json::PopulationDocument::new(&experiment, generation, individuals))
        }
        (Who::Champion, [champion]) => champion_document(&experiment, champion)?,
        (_, [individual]) => {
            let document = json::IndividualDocument::new(&experiment, individual);
            json::document(&document.map_err(|error| not_json(&error))?)
        }
        _ => return Err(Error::Internal("the coordinator's answer is incomplete".into())),
    };
    progress.print(&text)
}

/// A champion as `individual` prints it and `run` stores it.
pub fn champion_document(
    experiment: &Experiment,
    champion: &GetChampionResponse,
) -> Result<String, Error> {
    let document = json::ChampionDocument::new(experiment, champion);
    Ok(json::document(&document.map_err(|error| not_json(&error))?))
}

fn not_json(error: &serde_json::Error) -> Error {
    Error::Internal(format!("the coordinator's network is not JSON: {error}"))
}
