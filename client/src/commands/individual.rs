//! `swarmctl individual`: any evaluated genotype, as JSON.

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::Who;
use swarm_proto::v1::{Experiment, GetChampionResponse};

use crate::{
    address::NamedAddress,
    complete,
    connection::Connection,
    error::Error,
    json::{ChampionDocument, IndividualDocument, PopulationDocument},
    progress::Progress,
    remote::{Remote, family},
};

family! {
    /// Commands for genotypes.
    Measure {
        #[command(visible_alias = "champion")]
        Individual(IndividualArgs),
        Lineage(super::lineage::LineageArgs),
        Repertoire(super::repertoire::RepertoireArgs),
        Front(super::front::FrontArgs),
    }
}

/// Print a genotype and the network that it encodes, as JSON: the champion, or any
/// individual of any generation.
///
/// The command recomputes individuals from the stored fitness, to the same bits, without
/// simulating. For a champion, `judged` is the fair estimate of its fitness: the mean, with
/// its 95 % interval, on trials that selected nothing, once the run has ended. `selection` is
/// the mean on the held-out trials that selected it among the candidates, and
/// `fitness_when_chosen` the mean in its generation, which made it a candidate: both are
/// optimistic.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct IndividualArgs {
    /// The genotype: ID or NAME, the champion of an experiment; ID@G/I, individual I of
    /// generation G; ID@G/mean, the mean of the distribution after generation G; 'ID@G/cell(A,B)',
    /// an elite of the repertoire after generation G; ID@G, all individuals of generation G,
    /// without their networks.
    #[arg(value_name = "ADDRESS", add = ArgValueCompleter::new(complete::experiments))]
    address: NamedAddress,
}

const HELP: &str = "\
Examples:
  swarmctl individual 3 > champion.json
  swarmctl individual 3 | jq .network
  swarmctl individual 3@0/17
  swarmctl individual 3@59/mean --data-dir swarm-data";

impl Remote for IndividualArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let address = connection.resolve(&self.address).await?;
        let (mut experiment, _) = connection.stored(address.experiment.0).await?;
        let mut answer = connection.individuals(address, 0).await?;
        let mut individuals = answer.individuals;
        while let Some(next) = answer.next_individual {
            answer = connection.individuals(address, next).await?;
            individuals.append(&mut answer.individuals);
        }
        if let (Who::Cell(..), [elite]) = (address.who, &individuals[..]) {
            // The elite of a fork may have been born in the parent.
            (experiment, _) = connection.stored(elite.experiment_id).await?;
        }
        match (address.who, &individuals[..]) {
            (Who::Generation(generation), all) => {
                progress.print_document(&PopulationDocument::new(&experiment, generation, all))
            }
            (Who::Champion, [champion]) => {
                progress.print_document(&champion_document(&experiment, champion)?)
            }
            (_, [individual]) => {
                let document = IndividualDocument::new(&experiment, individual);
                progress.print_document(&document.map_err(|error| not_json(&error))?)
            }
            _ => Err(Error::Internal("the coordinator's answer is incomplete".into())),
        }
    }
}

/// A champion in the format that `individual` prints and `run` stores.
pub fn champion_document<'a>(
    experiment: &'a Experiment,
    champion: &'a GetChampionResponse,
) -> Result<ChampionDocument<'a>, Error> {
    ChampionDocument::new(experiment, champion).map_err(|error| not_json(&error))
}

fn not_json(error: &serde_json::Error) -> Error {
    Error::Internal(format!("the coordinator's network is not JSON: {error}"))
}
