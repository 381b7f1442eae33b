//! Documents with genotypes: champions, individuals, whole generations.

use experiment_file::Seed;
use serde::Serialize;
use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::ChampionSummary;

/// The experiment of a genotype.
#[derive(Debug, Serialize)]
struct OfExperiment<'a> {
    experiment: u64,
    name: &'a str,
    seed: Seed,
    simulation: &'a str,
    config_digest: &'a str,
}

/// A champion with its genes, network and experiment, as `individual ID` prints it.
#[derive(Debug, Serialize)]
pub struct ChampionDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    #[serde(flatten)]
    summary: ChampionSummary,
    trial_fitness: &'a [f64],
    genotype: &'a [f64],
    network: serde_json::Value,
}

/// An individual, or the mean of a distribution, as `individual` prints it.
#[derive(Debug, Serialize)]
pub struct IndividualDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    generation: u64,
    #[serde(flatten)]
    individual: IndividualFields<'a>,
    network: serde_json::Value,
}

/// All individuals of a generation, as `individual` prints them.
#[derive(Debug, Serialize)]
pub struct PopulationDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    generation: u64,
    individuals: Vec<IndividualFields<'a>>,
}

#[derive(Debug, Serialize)]
struct IndividualFields<'a> {
    /// None for the mean of a distribution.
    individual: Option<u32>,
    fitness: Option<f64>,
    trial_fitness: &'a [f64],
    genotype: &'a [f64],
}

impl<'a> From<&'a Experiment> for OfExperiment<'a> {
    fn from(experiment: &'a Experiment) -> Self {
        let Experiment { id, name, seed, simulation, config_digest, .. } = experiment;
        Self { experiment: *id, name, seed: Seed(*seed), simulation, config_digest }
    }
}

impl<'a> From<&'a GetChampionResponse> for IndividualFields<'a> {
    fn from(individual: &'a GetChampionResponse) -> Self {
        let GetChampionResponse { individual, fitness, trial_fitness, genotype, .. } = individual;
        Self { individual: *individual, fitness: *fitness, trial_fitness, genotype }
    }
}

impl<'a> ChampionDocument<'a> {
    /// Fails if the network is not JSON.
    pub fn new(
        experiment: &'a Experiment,
        champion: &'a GetChampionResponse,
    ) -> serde_json::Result<Self> {
        Ok(Self {
            of: experiment.into(),
            summary: champion.into(),
            trial_fitness: &champion.trial_fitness,
            genotype: &champion.genotype,
            network: network(&champion.network_json)?,
        })
    }
}

impl<'a> IndividualDocument<'a> {
    /// Fails if the network is not JSON.
    pub fn new(
        experiment: &'a Experiment,
        individual: &'a GetChampionResponse,
    ) -> serde_json::Result<Self> {
        Ok(Self {
            of: experiment.into(),
            generation: individual.generation,
            individual: individual.into(),
            network: network(&individual.network_json)?,
        })
    }
}

impl<'a> PopulationDocument<'a> {
    pub fn new(
        experiment: &'a Experiment,
        generation: u64,
        individuals: &'a [GetChampionResponse],
    ) -> Self {
        let individuals = individuals.iter().map(Into::into).collect();
        Self { of: experiment.into(), generation, individuals }
    }
}

/// A network; null if the coordinator cannot decode it.
fn network(json: &str) -> serde_json::Result<serde_json::Value> {
    if json.is_empty() { Ok(serde_json::Value::Null) } else { serde_json::from_str(json) }
}
