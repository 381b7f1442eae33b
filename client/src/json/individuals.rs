//! Documents with genotypes: champions, individuals, whole generations.

use experiment_file::Seed;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};
use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::ChampionSummary;

/// The experiment of a genotype.
#[derive(Debug, Serialize, JsonSchema)]
struct OfExperiment<'a> {
    /// Number of the experiment.
    experiment: u64,
    /// Name of the experiment.
    name: &'a str,
    seed: Seed,
    /// The version of the simulation.
    simulation: &'a str,
    /// Digest of the experiment file with its seed, 64 hexadecimal digits.
    config_digest: &'a str,
}

/// A champion with its genes, network and experiment, as `individual ID` prints it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Champion")]
pub struct ChampionDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    #[serde(flatten)]
    summary: ChampionSummary,
    /// Fitness in each trial of its generation; empty for the mean of a distribution.
    #[schemars(with = "Vec<Option<f64>>")]
    trial_fitness: &'a [f64],
    /// Its genes, from 0 to 1.
    genotype: &'a [f64],
    /// The network that the genes encode; null if this version cannot decode it.
    #[schemars(with = "Option<Map<String, Value>>")]
    network: Value,
}

/// An individual, or the mean of a distribution, as `individual` prints it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Individual")]
pub struct IndividualDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    /// Its generation, from 0.
    generation: u64,
    #[serde(flatten)]
    individual: IndividualFields<'a>,
    /// The network that the genes encode; null if this version cannot decode it.
    #[schemars(with = "Option<Map<String, Value>>")]
    network: Value,
}

/// All individuals of a generation, as `individual` prints them.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Population")]
pub struct PopulationDocument<'a> {
    #[serde(flatten)]
    of: OfExperiment<'a>,
    /// The generation, from 0.
    generation: u64,
    /// In the order of their indices.
    individuals: Vec<IndividualFields<'a>>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Genotype")]
struct IndividualFields<'a> {
    /// Its index in the generation, from 0; null for the mean of a distribution.
    individual: Option<u32>,
    /// Mean fitness of its trials; null for the mean of a distribution.
    fitness: Option<f64>,
    /// Fitness in each trial; empty for the mean of a distribution.
    #[schemars(with = "Vec<Option<f64>>")]
    trial_fitness: &'a [f64],
    /// Its genes, from 0 to 1.
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
fn network(json: &str) -> serde_json::Result<Value> {
    if json.is_empty() { Ok(Value::Null) } else { serde_json::from_str(json) }
}
