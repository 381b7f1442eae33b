//! `algorithm`: what evolves, by which rule, and on which task.

use schemars::JsonSchema;
use serde::Serialize;

use super::{
    AimConfig, DescriptorConfig, FitnessFunction, FitnessParams, GenotypeQuery, NamedMap, Params,
    limits, schema,
};
use crate::DefaultValue::{Depends, Empty, Null, Required};
use crate::Domain;
use crate::parameters::parameters;

parameters! {
    /// Evolution: what evolves, by which algorithm, and on which trials.
    pub struct AlgorithmConfig {
        /// The algorithm.
        name: String = of(Domain::Text, Required),
        /// Name of the world object whose controller evolves.
        evolvable_object: String = of(Domain::Text, Required),
        /// Individuals per generation, P.
        population_size: u32 = of(Domain::Whole(1, limits::POPULATION), Required),
        /// Number of generations.
        generations: u64 = of(Domain::Whole(1, limits::GENERATIONS as u32), Required),
        /// Environment steps per trial, T_E.
        evaluation_steps: u32 = of(Domain::Whole(1, limits::STEPS), Required),
        /// Trials per individual.
        num_evaluations: u32 = of(Domain::Whole(1, limits::TRIALS), Required),
        /// Fitness of a trial. Optional if there is a `task`.
        fitness_function: FitnessFunction =
            of(Domain::Variant(FitnessFunction::VARIANTS), Depends("")),
        /// Constants of fitness functions.
        fitness_params: FitnessParams =
            of(Domain::Object(FitnessParams::OBJECT), Empty).recent(),
        /// What tells behaviours apart, for algorithms that evolve a repertoire of different ones
        /// (MAP-Elites, DNS, novelty, CMA-MAE, sep-CMA-MAE). A single descriptor needs no list.
        descriptors: Vec<DescriptorConfig> =
            of(Domain::Objects(DescriptorConfig::OBJECT, limits::DESCRIPTORS), Null),
        /// What counts beside fitness, for algorithms that evolve a front of compromises (NSGA-II).
        /// A single aim needs no list.
        aims: Vec<AimConfig> = of(Domain::Objects(AimConfig::OBJECT, limits::AIMS), Null),
        /// Stop when the mean fitness of a generation reaches this.
        target_fitness: Option<f64> = of(Domain::QUANTITY, Null),
        /// Generations between two comparisons of candidates for the champion. The last comparison
        /// is at the end of the run.
        champion_every: u64 = whole([1, limits::GENERATIONS as u32], 10),
        /// Held-out trials of a comparison. Close candidates get up to four times this number.
        champion_trials: u32 = whole([1, limits::TRIALS], 50),
        // Digests of generations do not cover this key: they hash the canonical form with 0, which
        // omits it.
        /// Trials that judge the champion at the end of a run, and every elite of a repertoire or
        /// of a front. They select nothing.
        judgement_trials: u32 = whole([1, limits::TRIALS], 200).unless_zero(),
    }
    parts {
        /// Populations, by names that you choose, in the order of the genotype. Several populations
        /// evolve together.
        populations: NamedMap<PopulationConfig> = required(schema::map::<PopulationConfig>);
    }
}

/// One population: its part of the genotype, and the parameters of its algorithm, which may also
/// stand beside these keys instead of in `params`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("params")
)]
pub struct PopulationConfig {
    /// The parameters of the network that its genes encode, in the order of the genotype.
    #[schemars(length(min = 1, max = limits::ENTRIES))]
    pub objects: Vec<GenotypeQuery>,
    /// Upper bounds of the values: one per query, or one for all.
    #[schemars(schema_with = "schema::number_or_numbers")]
    pub max_vals: Vec<f64>,
    /// Lower bounds of the values: one per query, or one for all.
    #[schemars(schema_with = "schema::number_or_numbers")]
    pub min_vals: Vec<f64>,
    /// Parameters of the algorithm that `algorithm.name` names.
    #[schemars(schema_with = "schema::filled_in")]
    pub params: Params,
}

/// Keys of the genetic algorithm that files of SpikeSwarmSim may have
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
