//! The summary: the subject of an evaluation, and estimates of its fitness and measures.

use experiment_file::{FitnessFunction, Seed};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::change::Json;
use evolution::Digest;

use super::{
    conditions::Condition,
    measured::Measured,
    realities::Robustness,
    statistics::{Estimate, mean},
};

/// The evaluated genotype and experiment.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Subject {
    /// Name of the experiment.
    name: String,
    /// The version of swarmctl.
    swarmctl: &'static str,
    /// The version of the simulation.
    simulation: &'static str,
    /// SHA-256 of the genes, each as little-endian f64; 64 hexadecimal digits.
    genotype_digest: String,
    /// Number of genes.
    genes: usize,
    fitness_function: FitnessFunction,
    seed: Seed,
    /// The set of the trials.
    trials_of: String,
    /// Number of steps of a trial.
    steps: u32,
}

impl Subject {
    /// The subject of an evaluation; the first condition is the nominal one.
    pub fn new(conditions: &[Condition], genotype: &[f64]) -> Self {
        let config = &conditions[0].config;
        let algorithm = &config.algorithm;
        let mut hash = Sha256::new();
        genotype.iter().for_each(|gene| hash.update(gene.to_bits().to_le_bytes()));
        let digest: [u8; 32] = hash.finalize().into();
        Self {
            name: config.name.clone(),
            swarmctl: env!("CARGO_PKG_VERSION"),
            simulation: sim_core::FINGERPRINT,
            genotype_digest: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
            genes: genotype.len(),
            fitness_function: algorithm.fitness_function,
            seed: Seed(config.seed),
            trials_of: sim_core::TrialSet::Evaluation.to_string(),
            steps: algorithm.evaluation_steps,
        }
    }
}

/// The file summary.json.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Evaluation")]
pub struct Summary {
    #[serde(flatten)]
    subject: Subject,
    /// The first is the nominal one.
    pub conditions: Vec<ConditionSummary>,
    /// With --pseudo-realities only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pseudo_realities: Option<Robustness>,
}

/// The results of one condition.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Condition")]
pub struct ConditionSummary {
    /// Name of the condition.
    pub name: String,
    /// Digest of the changed experiment file, as the coordinator shows it; 64 hexadecimal digits.
    config_digest: String,
    /// The changed values, by their places in the experiment file.
    changes: IndexMap<String, Json>,
    /// Number of robots.
    robots: u32,
    /// Estimate of the fitness.
    pub fitness: Estimate,
    /// The measures that have a value, by name.
    pub metrics: IndexMap<String, MetricSummary>,
}

/// The results of one measure.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Metric")]
pub struct MetricSummary {
    /// The unit; absent for the measures of a script, which declares no unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'static str>,
    /// Estimate of the mean over the steps.
    pub time_mean: Estimate,
    /// Estimate of the value in the last step; absent if no trial has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<Estimate>,
}

impl Summary {
    pub fn new(subject: &Subject, conditions: &[Condition], measured: &[Measured]) -> Self {
        let conditions = conditions.iter().zip(measured).map(|(condition, measured)| {
            let fitness: Vec<f64> = measured.trials.iter().map(|trial| trial.fitness).collect();
            let changes = condition.changes.iter();
            ConditionSummary {
                name: condition.name.clone(),
                config_digest: Digest::of_config(&condition.config, sim_core::FINGERPRINT)
                    .to_string(),
                changes: changes
                    .map(|change| (change.path.clone(), change.value.clone()))
                    .collect(),
                robots: condition.n_robots(),
                fitness: Estimate::from_values(&fitness, false).expect("there are trials"),
                metrics: metrics(measured),
            }
        });
        let conditions = conditions.collect();
        Self { subject: subject.clone(), conditions, pseudo_realities: None }
    }

    /// The same with what pseudo-realities cost.
    pub fn with(self, pseudo_realities: Option<Robustness>) -> Self {
        Self { pseudo_realities, ..self }
    }

    /// All measures of all conditions.
    pub fn metric_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.conditions.iter().flat_map(|condition| condition.metrics.keys()) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }
}

fn metrics(measured: &Measured) -> IndexMap<String, MetricSummary> {
    let summary = |(metric, name): (usize, &String)| {
        let means: Vec<f64> = (0..measured.trials.len())
            .filter_map(|trial| time_mean(measured, trial, metric))
            .collect();
        let ends = measured.at_step(measured.n_steps - 1, metric);
        let (unit, is_share) = unit(name);
        let summary = MetricSummary {
            unit,
            time_mean: Estimate::from_values(&means, is_share)?,
            end: Estimate::from_values(&ends, is_share),
        };
        Some((name.clone(), summary))
    };
    measured.metrics.iter().enumerate().filter_map(summary).collect()
}

/// Mean of a measure over the steps of a trial that have a value.
pub fn time_mean(measured: &Measured, trial: usize, metric: usize) -> Option<f64> {
    let values: Vec<f64> = measured.course(trial, metric).filter(|value| !value.is_nan()).collect();
    mean(&values)
}

/// The unit of a measure of a built-in task, and whether it is a share.
fn unit(metric: &str) -> (Option<&'static str>, bool) {
    match metric {
        "leaders" => (Some("robots"), false),
        "misalignment" => (Some("rad"), false),
        "turning" => (Some("share of the greatest speed"), true),
        "one_leader"
        | "true_positive_rate"
        | "true_negative_rate"
        | "precision"
        | "accuracy"
        | "near_light_photosensitive"
        | "near_light_others" => (Some("share"), true),
        "light_distance_photosensitive"
        | "light_distance_others"
        | "center_distance_photosensitive"
        | "center_distance_others"
        | "center_distance" => (Some("cm"), false),
        _ => (None, false),
    }
}

#[cfg(test)]
mod tests {
    use super::unit;

    #[test]
    fn shares_are_known_by_name_and_measures_of_scripts_are_not_shares() {
        assert_eq!(unit("near_light_others"), (Some("share"), true));
        assert_eq!(unit("center_distance"), (Some("cm"), false));
        assert_eq!(unit("delivered"), (None, false));
    }
}
