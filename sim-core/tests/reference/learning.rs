//! Plasticity: a robot's own weights, with the activities and rewards on which they depend.

use experiment_file::{ExperimentConfig, LearningConfig};

use super::network::{Decoded, Ends, Matrices, decode_genes, ends, matrices};

/// The weights of one robot's network.
pub struct Learner<'a> {
    experiment: &'a ExperimentConfig,
    config: &'a LearningConfig,
    weights: Vec<f64>,
    /// The ends of each synapse.
    ends: Vec<Ends>,
    /// A, B, C and D of each group.
    coefficients: Vec<[f64; 4]>,
    /// Activities of neurons, and then of sources of stimuli, after each step.
    activities: Vec<Vec<f64>>,
    /// The reward of each step.
    rewards: Vec<f64>,
}

impl<'a> Learner<'a> {
    /// The learner of a genotype; `None` if no weight is plastic.
    pub fn new(experiment: &'a ExperimentConfig, genotype: &[f64]) -> Option<Self> {
        let config = experiment.topology.learning.as_ref()?;
        let Decoded { weights, coefficients, .. } = decode_genes(experiment, genotype);
        Some(Self {
            experiment,
            config,
            weights,
            ends: ends(&experiment.topology),
            coefficients,
            activities: Vec::new(),
            rewards: Vec::new(),
        })
    }

    /// Stores the activities of a step.
    pub fn remember(&mut self, activities: Vec<f64>) {
        self.activities.push(activities);
    }

    /// Stores the reward of the step.
    pub fn reward(&mut self, reward: f64) {
        self.rewards.push(reward);
    }

    /// Changes the weights before a step, and returns them.
    pub fn learn(&mut self) -> Matrices {
        let delay = self.config.reward.map_or(1, |reward| reward.delay as usize);
        if self.activities.len() >= delay {
            let then = self.activities.len() - delay;
            let reward = self.config.reward.map_or(1.0, |config| {
                let since = self.rewards[then..].iter().enumerate();
                since.map(|(age, r)| config.discount.powi(age as i32) * r).sum()
            });
            let x = &self.activities[then];
            for (weight, ends) in self.weights.iter_mut().zip(&self.ends) {
                if self.config.synapses.contains(&ends.group) {
                    let [a, b, c, d] = self.coefficients[ends.group_idx];
                    let (x_i, x_j) = (x[ends.post], x[ends.pre]);
                    let change = a * x_i * x_j + b * x_i + c * x_j + d;
                    let max = self.config.max_weight;
                    *weight += self.config.learning_rate * reward * change;
                    *weight = weight.clamp(-max, max);
                }
            }
        }
        matrices(&self.experiment.topology, &self.weights)
    }
}
