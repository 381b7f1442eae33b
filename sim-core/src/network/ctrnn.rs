//! Continuous-time recurrent neural network (sections 2.1 and 3.4 of the thesis;
//! Beer 1995), by synchronous Euler steps:
//!
//! v(t+dt) = v + (dt/tau) * (-v + W_N u + W_I phi), u = F(g * (v + beta)), v(0) = 0.
//!
//! All lanes share the weights; no value of one lane ever meets another's.

use std::ops::Range;

use super::connections::Source;
use super::{Network, Phenotype};
use crate::config::Activation;
use crate::lanes::{BLOCK, Block, Lanes};

/// A network with its weights, and its state in every lane.
#[derive(Debug, Clone)]
pub(crate) struct Ctrnn {
    n_substeps: u32,
    neurons: Vec<Neuron>,
    /// Synapses between neurons, by postsynaptic neuron.
    recurrent: Vec<Weighted>,
    /// Synapses from inputs, by postsynaptic neuron.
    afferent: Vec<Weighted>,
    /// v, `[neuron][lane]`.
    potential: Lanes,
    /// u, `[neuron][lane]`; always the one of `potential`.
    activity: Lanes,
    /// W_I phi, `[neuron][lane]`.
    input: Lanes,
}

#[derive(Debug, Clone)]
struct Neuron {
    /// dt / tau
    rate: f64,
    gain: f64,
    bias: f64,
    activation: Activation,
    /// Its synapses in `recurrent`.
    recurrent: Range<usize>,
    /// Its synapses in `afferent`.
    afferent: Range<usize>,
}

/// A synapse, seen from its postsynaptic neuron.
#[derive(Debug, Clone, Copy)]
struct Weighted {
    /// Row of the presynaptic neuron or input.
    pre: usize,
    weight: f64,
}

impl Ctrnn {
    /// At rest: v = 0 in every lane.
    pub fn new(network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let mut incoming: Vec<usize> = (0..network.synapses.len()).collect();
        incoming.sort_by_key(|&index| network.synapses[index].post); // stable
        let mut incoming = incoming.into_iter().peekable();
        let mut recurrent = Vec::new();
        let mut afferent = Vec::new();
        let mut neurons = Vec::with_capacity(network.n_neurons());
        for ensemble in network.ensembles.values() {
            for neuron in ensemble.neurons.clone() {
                let (first_recurrent, first_afferent) = (recurrent.len(), afferent.len());
                while let Some(index) =
                    incoming.next_if(|&index| network.synapses[index].post == neuron)
                {
                    let weight = phenotype.weights[index];
                    match network.synapses[index].pre {
                        Source::Neuron(pre) => recurrent.push(Weighted { pre, weight }),
                        Source::Input(pre) => afferent.push(Weighted { pre, weight }),
                    }
                }
                neurons.push(Neuron {
                    rate: network.dt / phenotype.tau[neuron],
                    gain: phenotype.gain[neuron],
                    bias: phenotype.bias[neuron],
                    activation: ensemble.activation,
                    recurrent: first_recurrent..recurrent.len(),
                    afferent: first_afferent..afferent.len(),
                });
            }
        }
        let state = Lanes::new(neurons.len(), n_lanes);
        let mut network = Self {
            n_substeps: network.n_substeps,
            neurons,
            recurrent,
            afferent,
            potential: state.clone(),
            activity: state.clone(),
            input: state,
        };
        network.activate();
        network
    }

    /// Advances by one environment step, `stimuli` being held: `[input][lane]`.
    pub fn step(&mut self, stimuli: &Lanes) {
        for (row, neuron) in self.neurons.iter().enumerate() {
            let synapses = &self.afferent[neuron.afferent.clone()];
            for (block, input) in self.input.row_mut(row).iter_mut().enumerate() {
                *input = accumulate([0.0; BLOCK], synapses, stimuli, block);
            }
        }
        for _ in 0..self.n_substeps {
            self.integrate();
            self.activate();
        }
    }

    /// u, `[neuron][lane]`.
    pub fn activity(&self) -> &Lanes {
        &self.activity
    }

    /// One Euler step of v. All of v is computed from the u before it.
    fn integrate(&mut self) {
        for (row, neuron) in self.neurons.iter().enumerate() {
            let synapses = &self.recurrent[neuron.recurrent.clone()];
            let blocks = self.potential.row_mut(row).iter_mut().zip(self.input.row(row));
            for (block, (potential, &input)) in blocks.enumerate() {
                let drive = accumulate(input, synapses, &self.activity, block);
                for (v, drive) in potential.iter_mut().zip(drive) {
                    *v += neuron.rate * (drive - *v);
                }
            }
        }
    }

    /// u = F(g * (v + beta)).
    fn activate(&mut self) {
        for (row, neuron) in self.neurons.iter().enumerate() {
            let f = match neuron.activation {
                Activation::Sigmoid => sigmoid,
                Activation::Tanh => libm::tanh,
            };
            let potential = self.potential.row(row).as_flattened();
            let activity = self.activity.row_mut(row).as_flattened_mut();
            for (u, v) in activity.iter_mut().zip(potential) {
                *u = f(neuron.gain * (v + neuron.bias));
            }
        }
    }
}

/// `sum` + weights * values of one block, synapse by synapse.
fn accumulate(mut sum: Block, synapses: &[Weighted], values: &Lanes, block: usize) -> Block {
    for synapse in synapses {
        let values = &values.row(synapse.pre)[block];
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += synapse.weight * value;
        }
    }
    sum
}

/// 1 / (1 + exp(-x))
fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problems::Problems;
    use crate::testing::experiment_a;

    /// The equation as it stands, for one robot.
    fn reference(
        network: &Network,
        phenotype: &Phenotype,
        stimuli: &[f64],
        v: &mut [f64],
    ) -> Vec<f64> {
        let activities = |v: &[f64]| -> Vec<f64> {
            (0..v.len()).map(|i| sigmoid(phenotype.gain[i] * (v[i] + phenotype.bias[i]))).collect()
        };
        for _ in 0..network.n_substeps {
            let u = activities(v);
            let mut drive = vec![0.0; v.len()];
            for (synapse, weight) in network.synapses.iter().zip(&phenotype.weights) {
                drive[synapse.post] += weight
                    * match synapse.pre {
                        Source::Input(input) => stimuli[input],
                        Source::Neuron(neuron) => u[neuron],
                    };
            }
            for i in 0..v.len() {
                v[i] += network.dt / phenotype.tau[i] * (drive[i] - v[i]);
            }
        }
        activities(v)
    }

    #[test]
    fn every_lane_follows_the_equation() {
        let mut problems = Problems::default();
        let config = experiment_a();
        let network = Network::compile(&config.topology, &mut problems);
        let codec = crate::genotype::Codec::compile(&config, &network, &mut problems);
        problems.check().unwrap();
        let genotype = crate::testing::genotype(codec.genotype_len(), 5);
        let phenotype = codec.decode(&genotype);
        let (n_lanes, n_inputs) = (11, 5);
        let mut ctrnn = Ctrnn::new(&network, &phenotype, n_lanes);
        let mut v = vec![vec![0.0; network.n_neurons()]; n_lanes];
        let mut stimuli = Lanes::new(n_inputs, n_lanes);
        for step in 0..5 {
            let value = |lane: usize, input: usize| libm::sin((lane + 3 * input + 7 * step) as f64);
            for lane in 0..n_lanes {
                for input in 0..n_inputs {
                    stimuli.set(input, lane, value(lane, input));
                }
            }
            ctrnn.step(&stimuli);
            for (lane, v) in v.iter_mut().enumerate() {
                let phi: Vec<f64> = (0..n_inputs).map(|i| value(lane, i)).collect();
                let u = reference(&network, &phenotype, &phi, v);
                for (neuron, u) in u.into_iter().enumerate() {
                    let difference = (ctrnn.activity().get(neuron, lane) - u).abs();
                    assert!(difference < 1e-12, "step {step}, lane {lane}: {difference}");
                }
            }
        }
    }

    #[test]
    fn one_neuron_relaxes_as_euler_says() {
        let mut config = experiment_a();
        config.topology.stimuli.clear();
        config.topology.synapses.clear();
        config.topology.outputs.clear();
        config.topology.decoding.clear();
        config.topology.ensembles.truncate(1);
        config.topology.ensembles[0].n = 1;
        let network = Network::compile(&config.topology, &mut Problems::default());
        let one = |x| vec![x];
        let phenotype =
            Phenotype { weights: vec![], tau: one(0.2), gain: one(2.0), bias: one(0.5) };
        let mut ctrnn = Ctrnn::new(&network, &phenotype, 1);
        ctrnn.potential.set(0, 0, 1.0);
        ctrnn.step(&Lanes::new(0, 1));
        // v halves in each of the 20 substeps.
        let v = 1.0 / f64::from(1 << 20);
        assert_eq!(ctrnn.potential.get(0, 0), v);
        assert_eq!(ctrnn.activity().get(0, 0), sigmoid(2.0 * (v + 0.5)));
    }

    #[test]
    fn extreme_activities_are_finite() {
        assert_eq!(sigmoid(1e9), 1.0);
        assert_eq!(sigmoid(-1e9), 0.0);
        assert_eq!(sigmoid(0.0), 0.5);
    }
}
