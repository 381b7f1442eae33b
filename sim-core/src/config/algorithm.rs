//! `algorithm`: what evolves, by which rule, and on which task.

use std::fmt;

use serde::{Serialize, Serializer};

use super::NamedMap;

/// Evolution and evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AlgorithmConfig {
    /// The evolutionary algorithm.
    pub name: AlgorithmName,
    /// Name of the world object whose controller evolves.
    pub evolvable_object: String,
    /// Individuals per generation, P.
    pub population_size: u32,
    /// Number of generations.
    pub generations: u64,
    /// Environment steps per trial, T_E.
    pub evaluation_steps: u32,
    /// Trials per individual.
    pub num_evaluations: u32,
    /// Fitness of a trial.
    pub fitness_function: FitnessFunction,
    /// Stop when the mean fitness of a generation reaches this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_fitness: Option<f64>,
    /// Populations, in genotype order; several evolve cooperatively.
    pub populations: NamedMap<PopulationConfig>,
}

/// Evolutionary algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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

/// Fitness functions; see `fitness`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FitnessFunction {
    /// Experiment A: one robot, and the same one, has its LED on.
    IdentifyLeader,
    /// Experiment B: robots on the swarm's border have their LED on.
    IdentifyBorderline,
    /// Experiment C, Eq. 5.5.
    OrientationConsensus,
    /// Experiment C as in the original simulator.
    Alignment,
    /// Experiment D: robots near the light.
    GotoLight,
    /// Robots near their centroid, but not on top of each other.
    Grouping,
}

/// One population: its segment of the genotype and its algorithm's parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PopulationConfig {
    /// What its genes encode, in genotype order.
    pub objects: Vec<GenotypeQuery>,
    /// Upper bound of the decoded values, per query.
    pub max_vals: Vec<f64>,
    /// Lower bound of the decoded values, per query.
    pub min_vals: Vec<f64>,
    /// Parameters of the algorithm; of the variant that `algorithm.name` names.
    pub params: AlgorithmParams,
}

/// Names a part of the network's parameters (Table 4.1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GenotypeQuery {
    /// `synapses:weights:...`
    Weights(SynapseSelector),
    /// `neurons:PARAMETER:...`
    Neurons(NeuronParameter, EnsembleSelector),
}

/// The last part of `synapses:weights:...`. Kinds refer to the *presynaptic*
/// side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SynapseSelector {
    /// Every trainable synapse.
    All,
    /// From stimuli.
    Sensory,
    /// From ensembles that drive no output.
    Hidden,
    /// From ensembles that drive an output.
    Motor,
    /// From the ensemble (or stimulus) of this name, or in the synapse group of
    /// this name.
    Named(String),
}

/// The middle part of `neurons:...:...`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NeuronParameter {
    /// beta
    Bias,
    /// tau, decoded on a logarithmic scale: 2 * 10^x.
    Tau,
    /// g
    Gain,
}

/// The last part of `neurons:...:...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum EnsembleSelector {
    /// Every ensemble.
    All,
    /// One ensemble.
    Named(String),
}

impl fmt::Display for GenotypeQuery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Weights(selector) => {
                let selector = match selector {
                    SynapseSelector::All => "all",
                    SynapseSelector::Sensory => "sensory",
                    SynapseSelector::Hidden => "hidden",
                    SynapseSelector::Motor => "motor",
                    SynapseSelector::Named(name) => name,
                };
                write!(f, "synapses:weights:{selector}")
            }
            Self::Neurons(parameter, selector) => {
                let parameter = match parameter {
                    NeuronParameter::Bias => "bias",
                    NeuronParameter::Tau => "tau",
                    NeuronParameter::Gain => "gain",
                };
                let selector = match selector {
                    EnsembleSelector::All => "all",
                    EnsembleSelector::Named(name) => name,
                };
                write!(f, "neurons:{parameter}:{selector}")
            }
        }
    }
}

impl Serialize for GenotypeQuery {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Parameters of an algorithm. `algorithm.name` says which variant applies, so
/// the canonical form carries no tag.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GaParams {
    /// How parents are chosen.
    pub selection_operator: SelectionOperator,
    /// Contestants of a tournament, drawn with replacement; default 3.
    pub tournament_size: u32,
    /// How parents are paired.
    pub mating_operator: MatingOperator,
    /// How two parents yield two children.
    pub crossover_operator: CrossoverOperator,
    /// BLX-alpha's alpha; default 0.5.
    pub alpha: f64,
    /// Probability that a pair is crossed; default 0.9.
    pub crossover_prob: f64,
    /// How a gene mutates.
    pub mutation_operator: MutationOperator,
    /// Probability that a gene mutates; default 0.05.
    pub mutation_prob: f64,
    /// Standard deviation of Gaussian mutation; default sqrt(0.3).
    pub mutation_sigma: f64,
    /// Individuals that survive unchanged; default 3.
    pub num_elite: u32,
}

/// Selection operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MatingOperator {
    /// Uniformly random pairs.
    Random,
}

/// Crossover operators of the GA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MutationOperator {
    /// Adds N(0, mutation_sigma^2).
    Gaussian,
    /// Redraws from U(0, 1).
    Uniform,
}

/// SNES (Algorithm 3).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SnesParams {
    /// Learning rate of mu; default 1.
    pub eta_mu: f64,
    /// Learning rate of sigma; none: (3 + ln d) / (5 sqrt d).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eta_sigma: Option<f64>,
    /// First mean of every gene; default 0.5.
    pub mu_init: f64,
    /// First standard deviation of every gene; default 0.2.
    pub sigma_init: f64,
}

/// xNES (Algorithm 2).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct XnesParams {
    /// Learning rate of mu; default 1.
    pub eta_mu: f64,
    /// Learning rate of sigma; none: (9 + 3 ln d) / (5 d sqrt d).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eta_sigma: Option<f64>,
    /// Learning rate of the shape B; none: as `eta_sigma`.
    #[serde(rename = "eta_B", skip_serializing_if = "Option::is_none")]
    pub eta_b: Option<f64>,
    /// First mean of every gene; default 0.5.
    pub mu_init: f64,
    /// First standard deviation of every gene; default 0.2.
    pub sigma_init: f64,
}

/// CMA-ES and sep-CMA-ES.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CmaEsParams {
    /// First mean of every gene; default 0.5.
    pub mu_init: f64,
    /// First step size; default 0.2.
    pub sigma_init: f64,
}

/// OpenAI-ES.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpenAiEsParams {
    /// First mean of every gene; default 0.5.
    pub mu_init: f64,
    /// Standard deviation of the perturbations; default 0.1.
    pub sigma: f64,
    /// Adam's step size; default 0.02.
    pub learning_rate: f64,
    /// Adam's decay of the first moment; default 0.9.
    pub beta1: f64,
    /// Adam's decay of the second moment; default 0.999.
    pub beta2: f64,
    /// L2 pull towards `mu_init` per generation; default 0.
    pub weight_decay: f64,
}
