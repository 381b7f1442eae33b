//! `algorithm`: what evolves, by which rule, and on which task.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FitnessFunction, GenotypeQuery, NamedMap, limits, schema};

/// Evolution and evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("champion_every, champion_trials")
)]
pub struct AlgorithmConfig {
    /// The evolutionary algorithm.
    pub name: AlgorithmName,
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
    /// Fitness of a trial.
    pub fitness_function: FitnessFunction,
    /// Stop when the mean fitness of a generation reaches this.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default, with = "f64")]
    pub target_fitness: Option<f64>,
    /// Generations between re-evaluations of the champion; default 10. There is
    /// one at the end, too.
    #[schemars(range(min = 1, max = limits::GENERATIONS))]
    pub champion_every: u64,
    /// Held-out trials of a re-evaluation; default 50.
    #[schemars(range(min = 1, max = limits::TRIALS))]
    pub champion_trials: u32,
    /// Populations, in genotype order; several evolve cooperatively.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub populations: NamedMap<PopulationConfig>,
}

/// Evolutionary algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AlgorithmName {
    /// Genetic algorithm.
    #[serde(rename = "GA")]
    Ga,
    /// Separable natural evolution strategy.
    #[serde(rename = "SNES")]
    Snes,
    /// Exponential natural evolution strategy.
    #[serde(rename = "xNES")]
    Xnes,
    /// Covariance matrix adaptation evolution strategy.
    #[serde(rename = "CMA-ES")]
    CmaEs,
    /// CMA-ES with a diagonal covariance.
    #[serde(rename = "sep-CMA-ES")]
    SepCmaEs,
    /// OpenAI's evolution strategy.
    #[serde(rename = "openaiES")]
    OpenAiEs,
}

/// One population: its segment of the genotype and its algorithm's parameters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("params"),
    transform = schema::params_without_params
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
    /// Parameters of the algorithm; of the variant that `algorithm.name` names.
    pub params: AlgorithmParams,
}

/// Keys of the genetic algorithm that files of the original simulator may have
/// for any algorithm.
pub(super) const GENETIC_KEYS: &str = "selection_operator, mating_operator, crossover_operator, \
    crossover_prob, mutation_operator, mutation_prob, num_elite";

/// Parameters of an algorithm. `algorithm.name` says which variant applies, so
/// the canonical form carries no tag.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum AlgorithmParams {
    /// [`AlgorithmName::Ga`]
    Ga(GaParams),
    /// [`AlgorithmName::Snes`]
    Snes(SnesParams),
    /// [`AlgorithmName::Xnes`]
    Xnes(XnesParams),
    /// [`AlgorithmName::CmaEs`] and [`AlgorithmName::SepCmaEs`]
    CmaEs(CmaEsParams),
    /// [`AlgorithmName::OpenAiEs`]
    OpenAiEs(OpenAiEsParams),
}

/// Genetic algorithm (Table 3.4).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::encoded)]
pub struct GaParams {
    /// How parents are chosen.
    pub selection_operator: SelectionOperator,
    /// Contestants of a tournament, drawn with replacement; default 3.
    #[schemars(range(min = 1, max = limits::POPULATION))]
    pub tournament_size: u32,
    /// How parents are paired.
    pub mating_operator: MatingOperator,
    /// How two parents yield two children.
    pub crossover_operator: CrossoverOperator,
    /// BLX-alpha's alpha; default 0.5.
    #[schemars(range(min = 0))]
    pub alpha: f64,
    /// Probability that a pair is crossed; default 0.9.
    #[schemars(range(min = 0, max = 1))]
    pub crossover_prob: f64,
    /// How a gene mutates.
    pub mutation_operator: MutationOperator,
    /// Probability that a gene mutates; default 0.05.
    #[schemars(range(min = 0, max = 1))]
    pub mutation_prob: f64,
    /// Standard deviation of Gaussian mutation; default sqrt(0.3).
    #[schemars(range(min = 0))]
    pub mutation_sigma: f64,
    /// Individuals that survive unchanged; default 3.
    pub num_elite: u32,
}

impl Default for GaParams {
    fn default() -> Self {
        Self {
            selection_operator: SelectionOperator::Tournament,
            tournament_size: 3,
            mating_operator: MatingOperator::Random,
            crossover_operator: CrossoverOperator::BlxAlpha,
            alpha: 0.5,
            crossover_prob: 0.9,
            mutation_operator: MutationOperator::Gaussian,
            mutation_prob: 0.05,
            mutation_sigma: 0.3_f64.sqrt(),
            num_elite: 3,
        }
    }
}

/// Selection operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionOperator {
    /// The best of K drawn uniformly.
    Tournament,
    /// Proportional to fitness.
    Roulette,
    /// Linear in rank.
    LinRank,
    /// Exponential in rank.
    NonlinRank,
    /// Proportional to fitness, evenly spaced pointers.
    StochasticUniversal,
}

/// Mating operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatingOperator {
    /// Uniformly random pairs.
    Random,
}

/// Crossover operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CrossoverOperator {
    /// BLX-alpha.
    #[serde(rename = "blxalpha")]
    BlxAlpha,
    /// Each gene from either parent.
    Uniform,
    /// Tails swapped after one point.
    #[serde(rename = "onepoint")]
    OnePoint,
    /// Every other piece swapped between three points.
    #[serde(rename = "multipoint")]
    MultiPoint,
    /// Simulated binary crossover.
    SimulatedBinary,
}

/// Mutation operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MutationOperator {
    /// Adds N(0, mutation_sigma^2).
    Gaussian,
    /// Redraws from U(0, 1).
    Uniform,
}

/// SNES (Algorithm 3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::encoded,
    transform = schema::ignored(GENETIC_KEYS)
)]
pub struct SnesParams {
    /// Learning rate of mu; default 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub eta_mu: f64,
    /// Learning rate of sigma; none: (3 + ln d) / (5 sqrt d).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub eta_sigma: Option<f64>,
    /// First mean of every gene; default 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub mu_init: f64,
    /// First standard deviation of every gene; default 0.2.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub sigma_init: f64,
}

impl Default for SnesParams {
    fn default() -> Self {
        Self { eta_mu: 1.0, eta_sigma: None, mu_init: 0.5, sigma_init: 0.2 }
    }
}

/// xNES (Algorithm 2).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::encoded,
    transform = schema::ignored(GENETIC_KEYS)
)]
pub struct XnesParams {
    /// Learning rate of mu; default 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub eta_mu: f64,
    /// Learning rate of sigma; none: (9 + 3 ln d) / (5 d sqrt d).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub eta_sigma: Option<f64>,
    /// Learning rate of the shape B; none: as `eta_sigma`.
    #[serde(rename = "eta_B", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub eta_b: Option<f64>,
    /// First mean of every gene; default 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub mu_init: f64,
    /// First standard deviation of every gene; default 0.2.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub sigma_init: f64,
}

impl Default for XnesParams {
    fn default() -> Self {
        Self { eta_mu: 1.0, eta_sigma: None, eta_b: None, mu_init: 0.5, sigma_init: 0.2 }
    }
}

/// CMA-ES and sep-CMA-ES.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::encoded,
    transform = schema::ignored(GENETIC_KEYS)
)]
pub struct CmaEsParams {
    /// First mean of every gene; default 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub mu_init: f64,
    /// First step size; default 0.2.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub sigma_init: f64,
}

impl Default for CmaEsParams {
    fn default() -> Self {
        Self { mu_init: 0.5, sigma_init: 0.2 }
    }
}

/// OpenAI-ES.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::encoded,
    transform = schema::ignored(GENETIC_KEYS)
)]
pub struct OpenAiEsParams {
    /// First mean of every gene; default 0.5.
    #[schemars(range(min = 0, max = 1))]
    pub mu_init: f64,
    /// Standard deviation of the perturbations; default 0.1.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub sigma: f64,
    /// Adam's step size; default 0.02.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub learning_rate: f64,
    /// Adam's decay of the first moment; default 0.9.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
    pub beta1: f64,
    /// Adam's decay of the second moment; default 0.999.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 1))]
    pub beta2: f64,
    /// L2 pull towards `mu_init` per generation; default 0.
    #[schemars(range(min = 0, max = 1))]
    pub weight_decay: f64,
}

impl Default for OpenAiEsParams {
    fn default() -> Self {
        Self {
            mu_init: 0.5,
            sigma: 0.1,
            learning_rate: 0.02,
            beta1: 0.9,
            beta2: 0.999,
            weight_decay: 0.0,
        }
    }
}
