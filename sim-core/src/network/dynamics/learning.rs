//! Plasticity: weights that change while robots live, by a generalised Hebbian rule (Niv, Joel,
//! Meilijson and Ruppin 2002, Adaptive Behavior 10, 5), with reward after a delay.
//!
//! Before every environment step except the first ones, w += rate R (A x_i x_j + B x_i + C x_j + D)
//! for the synapses of plastic groups, clipped to the largest weight. x_i is the activity of the
//! postsynaptic and x_j that of the presynaptic neuron. Without reward, both are activities of the
//! previous step, and R = 1. With reward, both are activities of an earlier step, and R is the
//! discounted sum of the rewards since then. Every lane has its own weights.

use determinism::simd::Simd;

use super::aligned::Aligned;
use crate::blueprint::{PlasticSynapse, Plasticity};
use crate::lanes::Lanes;
use crate::network::connections::Source;
use crate::network::{Network, Phenotype};

/// The learning rule with the values of a genotype.
#[derive(Debug)]
pub(super) struct Rule {
    /// All weights at the start, by number of the synapse.
    weights: Vec<f32>,
    plastic: Vec<PlasticSynapse>,
    max_weight: f32,
    /// Factors of the rewards, beginning at the step of the activities; `None` without reward.
    discounts: Option<Vec<f32>>,
    /// Number of rows with an activity: neurons, nodes of encoders, inputs.
    n_rows: usize,
}

/// The weights in some neighbouring vectors of lanes, and the past activities and rewards that
/// learning needs.
#[derive(Debug)]
pub(super) struct Memory {
    /// Number of environment steps so far.
    clock: usize,
    /// `[synapse][lane]`
    weights: Aligned,
    /// Activities of the last steps, `[slot][row][lane]`.
    activities: Aligned,
    /// Rewards of the last steps, `[slot][lane]`.
    rewards: Aligned,
}

impl Rule {
    /// The rule of a genotype; `None` if no weight is plastic.
    pub fn compile(network: &Network, phenotype: &Phenotype) -> Option<Self> {
        let config = network.learning.as_ref()?;
        let n_sources = network.n_neurons() + network.n_encoded();
        let n_inputs = network.stimuli.values().last().map_or(0, |stimulus| stimulus.inputs.end);
        let row = |source| match source {
            Source::Neuron(neuron) => neuron,
            Source::Encoded(node) => network.n_neurons() + node,
            Source::Input(input) => n_sources + input,
        };
        let mut plastic = Vec::new();
        for (group, coefficients) in network.groups.values().zip(&phenotype.learning) {
            let coefficients = coefficients.map(|factor| (config.learning_rate * factor) as f32);
            let synapses = group.synapses.clone().filter(|_| group.is_plastic);
            plastic.extend(synapses.map(|synapse| {
                let ends = network.synapses[synapse];
                PlasticSynapse { synapse, pre: row(ends.pre), post: ends.post, coefficients }
            }));
        }
        let discounts = config.reward.map(|reward| {
            let factor = |step| libm::pow(reward.discount, f64::from(step)) as f32;
            (0..reward.delay).map(factor).collect()
        });
        Some(Self {
            weights: phenotype.weights.iter().map(|&weight| weight as f32).collect(),
            plastic,
            max_weight: config.max_weight as f32,
            discounts,
            n_rows: n_sources + n_inputs,
        })
    }

    /// The rule as numbers.
    pub fn blueprint(self) -> Plasticity {
        let Self { weights, plastic: synapses, max_weight, discounts, .. } = self;
        Plasticity { weights, synapses, max_weight, discounts }
    }

    /// Number of environment steps whose activities are stored.
    fn n_slots(&self) -> usize {
        self.discounts.as_ref().map_or(1, Vec::len)
    }

    /// Changes the weights at the start of an environment step. `rewards`: the rewards of the
    /// previous step, per lane.
    #[inline(always)]
    pub fn learn<S: Simd, const W: usize>(&self, simd: S, memory: &mut Memory, rewards: &[f32]) {
        let n_slots = self.n_slots();
        let now = memory.clock;
        let rings: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(memory.rewards.values_mut()).0.as_chunks_mut().0;
        if now > 0 {
            rings[(now - 1) % n_slots] = S::as_simd_f32s(rewards).0.as_chunks().0[0];
        }
        if now < n_slots {
            return;
        }
        let mut reward = [simd.splat_f32s(1.0); W];
        if let Some(discounts) = &self.discounts {
            reward = [simd.splat_f32s(0.0); W];
            for (age, &discount) in discounts.iter().enumerate() {
                let received = &rings[(now + age) % n_slots];
                for (sum, r) in reward.iter_mut().zip(received) {
                    *sum = simd.mul_add_f32s(simd.splat_f32s(discount), *r, *sum);
                }
            }
        }
        let activities: &[[S::f32s; W]] =
            S::as_simd_f32s(memory.activities.values()).0.as_chunks().0;
        let activities = &activities[now % n_slots * self.n_rows..][..self.n_rows];
        let weights: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(memory.weights.values_mut()).0.as_chunks_mut().0;
        let (max, min) = (simd.splat_f32s(self.max_weight), simd.splat_f32s(-self.max_weight));
        for &PlasticSynapse { synapse, pre, post, coefficients } in &self.plastic {
            let [a, b, c, d] = coefficients;
            for vector in 0..W {
                let (x_j, x_i) = (activities[pre][vector], activities[post][vector]);
                let slope = simd.mul_add_f32s(simd.splat_f32s(a), x_i, simd.splat_f32s(c));
                let rest = simd.mul_add_f32s(simd.splat_f32s(b), x_i, simd.splat_f32s(d));
                let change = simd.mul_add_f32s(slope, x_j, rest);
                let weight = &mut weights[synapse][vector];
                let grown = simd.mul_add_f32s(reward[vector], change, *weight);
                *weight = simd.max_f32s(simd.min_f32s(grown, max), min);
            }
        }
    }

    /// Stores the activities at the end of an environment step, times `scale`. `activities`: those
    /// of neurons and nodes of encoders, `[row][lane]`.
    #[inline(always)]
    pub fn remember(
        &self,
        memory: &mut Memory,
        activities: &[f32],
        scale: f32,
        stimuli: &Lanes,
        first_lane: usize,
    ) {
        let n_lanes = memory.activities.values().len() / (self.n_slots() * self.n_rows);
        let slot = memory.clock % self.n_slots();
        let rows = &mut memory.activities.values_mut()[slot * self.n_rows * n_lanes..];
        let (own, inputs) = rows[..self.n_rows * n_lanes].split_at_mut(activities.len());
        for (row, activity) in own.iter_mut().zip(activities) {
            *row = activity * scale;
        }
        for (input, row) in inputs.chunks_exact_mut(n_lanes).enumerate() {
            row.copy_from_slice(&stimuli.row(input)[first_lane..][..n_lanes]);
        }
        memory.clock += 1;
    }
}

impl Memory {
    /// Before the first step.
    pub fn new(rule: &Rule, n_lanes: usize) -> Self {
        let n_slots = rule.n_slots();
        let mut weights = Aligned::new(rule.weights.len() * n_lanes);
        for (row, &weight) in weights.values_mut().chunks_exact_mut(n_lanes).zip(&rule.weights) {
            row.fill(weight);
        }
        Self {
            clock: 0,
            weights,
            activities: Aligned::new(n_slots * rule.n_rows * n_lanes),
            rewards: Aligned::new(n_slots * n_lanes),
        }
    }

    /// All weights, `[synapse][lane]`.
    #[inline(always)]
    pub fn weights(&self) -> &[f32] {
        self.weights.values()
    }
}

#[cfg(test)]
mod tests;
