//! `algorithm`: what evolves, by which rule, and on which task.

use schemars::JsonSchema;
use serde::Serialize;

use super::{FitnessFunction, FitnessParams, GenotypeQuery, NamedMap, Params, limits, schema};

/// Evolution and evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("champion_every, champion_trials, judgement_trials, fitness_function, fitness_params")
)]
pub struct AlgorithmConfig {
    /// The evolutionary algorithm, by the name in its
    /// [description](super::AlgorithmDescription).
    #[schemars(description = "The evolutionary algorithm.", schema_with = "schema::filled_in")]
    pub name: String,
    /// Name of the world object whose controller evolves.
    pub evolvable_object: String,
    /// Individuals per generation, P.
    #[schemars(range(min = 1, max = limits::POPULATION))]
    pub population_size: u32,
    /// Number of generations.
    #[schemars(range(min = 1, max = limits::GENERATIONS))]
    pub generations: u64,
    /// Environment steps per trial, T_E.
    #[schemars(range(min = 1, max = limits::STEPS))]
    pub evaluation_steps: u32,
    /// Trials per individual.
    #[schemars(range(min = 1, max = limits::TRIALS))]
    pub num_evaluations: u32,
    /// Fitness of a trial; may be left out if there is a `task`.
    pub fitness_function: FitnessFunction,
    /// Constants of the task.
    #[serde(skip_serializing_if = "FitnessParams::is_default")]
    pub fitness_params: FitnessParams,
    /// Stop when the mean fitness of a generation reaches this.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default, with = "f64")]
    pub target_fitness: Option<f64>,
    /// Generations between re-evaluations of candidates for the champion; default 10.
    /// There is one at the end, too.
    #[schemars(range(min = 1, max = limits::GENERATIONS))]
    pub champion_every: u64,
    /// Held-out trials of a re-evaluation; default 50. Candidates that are close get up
    /// to four times as many.
    #[schemars(range(min = 1, max = limits::TRIALS))]
    pub champion_trials: u32,
    /// Trials that judge the champion at the end and select nothing; default 200.
    // 0 leaves the key out, for digests of generations alone.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(range(min = 1, max = limits::TRIALS))]
    pub judgement_trials: u32,
    /// Populations, in genotype order; several evolve cooperatively.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub populations: NamedMap<PopulationConfig>,
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// One population: its segment of the genotype and its algorithm's parameters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("params")
)]
pub struct PopulationConfig {
    /// What its genes encode, in genotype order.
    #[schemars(length(min = 1, max = limits::ENTRIES))]
    pub objects: Vec<GenotypeQuery>,
    /// Upper bound of the decoded values, per query.
    #[schemars(schema_with = "schema::number_or_numbers")]
    pub max_vals: Vec<f64>,
    /// Lower bound of the decoded values, per query.
    #[schemars(schema_with = "schema::number_or_numbers")]
    pub min_vals: Vec<f64>,
    /// Parameters of the algorithm that `algorithm.name` names.
    #[schemars(schema_with = "schema::filled_in")]
    pub params: Params,
}

/// Keys of the genetic algorithm that files of the original simulator may have
/// for any algorithm.
pub(super) const GENETIC_KEYS: [&str; 7] = [
    "selection_operator",
    "mating_operator",
    "crossover_operator",
    "crossover_prob",
    "mutation_operator",
    "mutation_prob",
    "num_elite",
];
