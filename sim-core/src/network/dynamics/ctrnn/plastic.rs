//! The network with plastic weights: the same equations, synapse by synapse, because every lane has
//! its own weights.
//!
//! y(t+dt) = (1 - r) y + r k g (W_N u + W_I phi) + r k g beta, with beta / g in place of beta
//! where the gain does not multiply the bias.

use std::mem;

use determinism::simd::{Simd, WithSimd};

use super::super::aligned::Aligned;
use super::super::learning::{Memory, Rule};
use super::super::{Dynamics, Inputs};
use super::squash::{scale, squash, squash_in_one_lane};
use crate::blueprint::{Link, RateNeurons, RateRow};
use crate::lanes::Lanes;
use crate::network::connections::Source;
use crate::network::{Network, Phenotype};
use determinism::Isa;
use experiment_file::{Activation, InitialRates};

/// A network with its weights, and its state in every lane.
#[derive(Debug)]
pub(crate) struct PlasticCtrnn {
    isa: Isa,
    kernel: Kernel,
    chunks: Vec<Chunk>,
}

/// The values that all lanes share.
#[derive(Debug)]
struct Kernel {
    n_substeps: u32,
    neurons: Vec<Neuron>,
    rule: Rule,
}

#[derive(Debug)]
struct Neuron {
    /// F
    activation: Activation,
    /// y at the start.
    start: f32,
    /// Factor of y in a substep, 1 - r.
    retention: f32,
    /// Contribution of the bias to y per substep.
    drive: f32,
    /// Contribution to y per substep and unit of its current.
    scale: f32,
    /// Presynaptic neuron and number of each synapse from neurons.
    recurrent: Vec<(usize, usize)>,
    /// Input and number of each synapse from stimuli.
    afferent: Vec<(usize, usize)>,
}

/// The state of a network in one vector of lanes.
#[derive(Debug)]
struct Chunk {
    first_lane: usize,
    /// y, `[neuron][lane]`
    state: Aligned,
    /// u, `[neuron][lane]`
    activity: Aligned,
    scratch: Aligned,
    /// Contribution of inputs to the current, `[neuron][lane]`.
    drive: Aligned,
    memory: Memory,
}

impl PlasticCtrnn {
    /// A network at rest: v = 0 in every lane.
    pub fn new(isa: Isa, network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let kernel = Kernel::compile(network, phenotype);
        let vector_len = isa.vector_len();
        let chunks = (0..n_lanes).step_by(vector_len).map(|first_lane| {
            let rows = || Aligned::new(kernel.neurons.len() * vector_len);
            let memory = Memory::new(&kernel.rule, vector_len);
            let (mut state, mut activity) = (rows(), rows());
            for (index, neuron) in kernel.neurons.iter().enumerate() {
                let lanes = index * vector_len..(index + 1) * vector_len;
                state.values_mut()[lanes.clone()].fill(neuron.start);
                if network.initial_rates == InitialRates::Activation {
                    let [u, _] = squash_in_one_lane(isa, neuron.activation, [neuron.start; 2]);
                    activity.values_mut()[lanes].fill(u);
                }
            }
            Chunk { first_lane, state, activity, scratch: rows(), drive: rows(), memory }
        });
        let chunks = chunks.collect();
        Self { isa, kernel, chunks }
    }
}

impl Kernel {
    fn compile(network: &Network, phenotype: &Phenotype) -> Self {
        let [tau, gain, bias] = ["tau", "gain", "bias"].map(|name| &phenotype.neurons[name]);
        let mut neurons = Vec::with_capacity(network.n_neurons());
        for ensemble in network.ensembles.values() {
            let activation = ensemble.activation.unwrap_or_default();
            for neuron in ensemble.neurons.clone() {
                let rate = network.dt / tau[neuron];
                let squash_scale = scale(activation);
                let gain_scale = squash_scale * gain[neuron];
                let bias_scale = if network.bias_in_gain { gain_scale } else { squash_scale };
                neurons.push(Neuron {
                    activation,
                    start: (bias_scale * bias[neuron]) as f32,
                    retention: (1.0 - rate) as f32,
                    drive: (rate * bias_scale * bias[neuron]) as f32,
                    scale: (rate * gain_scale) as f32,
                    recurrent: Vec::new(),
                    afferent: Vec::new(),
                });
            }
        }
        for (number, synapse) in network.synapses.iter().enumerate() {
            let post = &mut neurons[synapse.post];
            match synapse.pre {
                Source::Neuron(pre) => post.recurrent.push((pre, number)),
                Source::Input(input) => post.afferent.push((input, number)),
                // The reader guarantees that only spiking neurons take spikes.
                Source::Encoded(_) => {}
            }
        }
        let rule = Rule::compile(network, phenotype).expect("the network learns");
        Self { n_substeps: network.n_substeps, neurons, rule }
    }
}

/// The neurons as numbers; their weights are those at the start.
pub(in super::super) fn blueprint(network: &Network, phenotype: &Phenotype) -> RateNeurons {
    let kernel = Kernel::compile(network, phenotype);
    let links = |synapses: &[(usize, usize)]| {
        let weight = |number: usize| phenotype.weights[number] as f32;
        let link = |&(other, synapse)| Link { other, weight: weight(synapse), synapse };
        synapses.iter().map(link).collect()
    };
    let rows = kernel.neurons.iter().map(|neuron| RateRow {
        activation: neuron.activation,
        start: neuron.start,
        retention: neuron.retention,
        drive: neuron.drive,
        scale: neuron.scale,
        afferent: links(&neuron.afferent),
        recurrent: links(&neuron.recurrent),
    });
    RateNeurons {
        rows_of: (0..kernel.neurons.len()).collect(),
        rows: rows.collect(),
        start_active: network.initial_rates == InitialRates::Activation,
    }
}

impl Dynamics for PlasticCtrnn {
    fn step(&mut self, inputs: Inputs<'_>) {
        for chunk in &mut self.chunks {
            self.isa.run(Advance { kernel: &self.kernel, chunk, inputs });
        }
    }

    /// u
    fn write_activity(&self, neurons: &[usize], activity: &mut Lanes) {
        let n_lanes = self.isa.vector_len();
        for chunk in &self.chunks {
            for &neuron in neurons {
                let row = &chunk.activity.values()[neuron * n_lanes..][..n_lanes];
                activity.row_mut(neuron)[chunk.first_lane..][..n_lanes].copy_from_slice(row);
            }
        }
    }
}

/// An environment step.
struct Advance<'a> {
    kernel: &'a Kernel,
    chunk: &'a mut Chunk,
    inputs: Inputs<'a>,
}

impl WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { kernel, chunk, inputs } = self;
        let Kernel { n_substeps, neurons, rule } = kernel;
        let lanes = chunk.first_lane..chunk.first_lane + S::F32_LANES;
        rule.learn::<S, 1>(simd, &mut chunk.memory, &inputs.rewards.row(0)[lanes.clone()]);
        let weights = S::as_simd_f32s(chunk.memory.weights()).0;
        let drives = S::as_mut_simd_f32s(chunk.drive.values_mut()).0;
        for (neuron, drive) in neurons.iter().zip(&mut *drives) {
            let mut sum = simd.splat_f32s(0.0);
            for &(input, synapse) in &neuron.afferent {
                let stimulus = S::as_simd_f32s(&inputs.stimuli.row(input)[lanes.clone()]).0[0];
                sum = simd.mul_add_f32s(weights[synapse], stimulus, sum);
            }
            *drive = sum;
        }
        for _ in 0..*n_substeps {
            let before = S::as_simd_f32s(chunk.activity.values()).0;
            let after = S::as_mut_simd_f32s(chunk.scratch.values_mut()).0;
            let states = S::as_mut_simd_f32s(chunk.state.values_mut()).0;
            for (index, neuron) in neurons.iter().enumerate() {
                let mut current = drives[index];
                for &(pre, synapse) in &neuron.recurrent {
                    current = simd.mul_add_f32s(weights[synapse], before[pre], current);
                }
                let drive = simd.splat_f32s(neuron.drive);
                let change = simd.mul_add_f32s(simd.splat_f32s(neuron.scale), current, drive);
                let y = simd.mul_add_f32s(simd.splat_f32s(neuron.retention), states[index], change);
                states[index] = y;
                after[index] = activate(simd, neuron.activation, y);
            }
            mem::swap(&mut chunk.activity, &mut chunk.scratch);
        }
        let activity = chunk.activity.values();
        rule.remember(&mut chunk.memory, activity, 1.0, inputs.stimuli, lanes.start);
    }
}

/// F(y)
#[inline(always)]
fn activate<S: Simd>(simd: S, activation: Activation, y: S::f32s) -> S::f32s {
    let mut u = [[y]; 2];
    squash(simd, activation, &[[y]; 2], &mut u);
    u[0][0]
}
