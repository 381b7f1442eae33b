//! The dynamics of networks, with an implementation for each neuron model.
//!
//! To add a model: describe it in `experiment-file` (its module `neuron`). Equations of a spiking
//! neuron are a file in `spiking`. Any other model implements [`Dynamics`] in a module beside
//! `ctrnn`, with a variant of [`Wiring`].

mod aligned;
mod ctrnn;
mod learning;
mod spiking;

use std::fmt;

use indexmap::IndexMap;

use super::connections::{Synapse, SynapseGroup};
use super::{Ensemble, Network, Phenotype};
use crate::blueprint::{Neurons, Plasticity};
use crate::lanes::Lanes;
use ctrnn::{Ctrnn, PlasticCtrnn};
use determinism::Isa;
use determinism::random::Stream;
use experiment_file::NeuronModel;
use learning::Rule;

/// The neurons of a network with their synapses, by one model, and their state in every lane. An
/// implementation must give a lane the same bits for any place, any neighbouring lanes and any
/// instruction set.
pub(crate) trait Dynamics: fmt::Debug {
    /// Advances by one environment step, which is `Network::n_substeps` substeps.
    fn step(&mut self, inputs: Inputs<'_>);

    /// Writes the activities of these neurons into their rows of `[neuron][lane]`.
    fn write_activity(&self, neurons: &[usize], activity: &mut Lanes);

    /// Writes the spikes of the last environment step for decoders. Rate neurons have none.
    fn write_window(&self, _window: &mut SpikeWindow) {}

    /// Writes voltages, mV: `[neuron][lane]`. Returns false if the neurons have none.
    fn write_voltages(&self, _voltages: &mut Lanes) -> bool {
        false
    }
}

/// The inputs of a network in an environment step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inputs<'a> {
    /// Constant for all substeps, `[input][lane]`.
    pub stimuli: &'a Lanes,
    /// Uniform random numbers, substep by substep one for each of `Network::n_drawing` nodes,
    /// `[draw][lane]`.
    pub draws: &'a Lanes,
    /// Reward of the previous step, one row; no rows without plasticity.
    pub rewards: &'a Lanes,
}

/// Data of the spikes in an environment step for decoders, `[neuron][lane]`; only for neurons
/// that outputs decode.
#[derive(Debug)]
pub(crate) struct SpikeWindow {
    /// Numbers of spikes.
    pub counts: Lanes,
    /// The substep of the first spike, from 0; without a spike, the number of substeps.
    pub first: Lanes,
    /// a of `LinearPopulationDecoding`, over all steps.
    pub filtered: Lanes,
}

/// A neuron model's arrangement of a network's structure, shared by all genotypes.
#[derive(Debug, Clone)]
pub(crate) enum Wiring {
    /// [`NeuronModel::Rate`]
    Rate(ctrnn::Wiring),
    /// All spiking models.
    Spiking(spiking::Wiring),
}

impl Wiring {
    /// The arrangement of ensembles, nodes of encoders, and the synapses between them.
    pub fn new(
        model: NeuronModel,
        ensembles: &IndexMap<String, Ensemble>,
        n_encoded: usize,
        groups: &IndexMap<String, SynapseGroup>,
        synapses: &[Synapse],
    ) -> Self {
        match model {
            NeuronModel::Rate => Self::Rate(ctrnn::Wiring::new(ensembles, synapses)),
            NeuronModel::Lif
            | NeuronModel::ExpLif
            | NeuronModel::AdEx
            | NeuronModel::Izhikevich
            | NeuronModel::MorrisLecar => {
                let n_neurons = ensembles.values().last().map_or(0, |last| last.neurons.end);
                Self::Spiking(spiking::Wiring::new(n_neurons, n_encoded, groups, synapses))
            }
        }
    }
}

/// A network with its state in every lane, and what outputs decode of it.
#[derive(Debug)]
pub(crate) struct NetworkState {
    dynamics: Box<dyn Dynamics>,
    n_lanes: usize,
    /// The neurons whose activities outputs decode; none of a spiking network.
    motor_neurons: Vec<usize>,
    /// Their rows of `[neuron][lane]`; the others are unused. Every robot reads them, so they are
    /// not behind the trait.
    motor_activity: Lanes,
    /// `None` for rate neurons.
    window: Option<SpikeWindow>,
    /// Random streams of encoders, per lane.
    streams: Vec<Stream>,
    /// The encoders' draws for this environment step, `[draw][lane]`.
    draws: Lanes,
    /// The last rewards, one row; no rows without plasticity.
    rewards: Lanes,
}

impl NetworkState {
    /// A network at rest in every lane.
    pub fn new(isa: Isa, network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let dynamics = compile(isa, network, phenotype, n_lanes);
        let rows = || Lanes::new(network.n_neurons(), n_lanes);
        let motor_neurons = match network.model {
            NeuronModel::Rate => {
                network.outputs.iter().flat_map(|out| out.neurons.clone()).collect()
            }
            _ => Vec::new(),
        };
        let motor_activity = rows();
        let window = network.model.is_spiking().then(|| SpikeWindow {
            counts: rows(),
            first: rows(),
            filtered: rows(),
        });
        let mut draws = Lanes::new(network.n_drawing() * network.n_substeps as usize, n_lanes);
        let rewards = Lanes::new(usize::from(network.learning.is_some()), n_lanes);
        // Draws of 1 keep nodes in lanes without a robot from spiking.
        (0..draws.n_rows()).for_each(|draw| draws.row_mut(draw).fill(1.0));
        let streams = Vec::new();
        Self { dynamics, n_lanes, motor_neurons, motor_activity, window, streams, draws, rewards }
    }

    /// The same network with a stream of random numbers per lane, for encoders that draw.
    pub fn drawing_from(self, streams: Vec<Stream>) -> Self {
        Self { streams, ..self }
    }

    /// Sets a lane's reward for the previous step; 0 if never set.
    pub fn reward(&mut self, lane: usize, reward: f32) {
        if self.rewards.n_rows() > 0 {
            self.rewards.set(0, lane, reward);
        }
    }

    /// Advances by one environment step with constant `stimuli`, `[input][lane]`.
    pub fn step(&mut self, stimuli: &Lanes) {
        for (lane, stream) in self.streams.iter_mut().enumerate() {
            for draw in 0..self.draws.n_rows() {
                self.draws.set(draw, lane, stream.uniform() as f32);
            }
        }
        let (draws, rewards) = (&self.draws, &self.rewards);
        self.dynamics.step(Inputs { stimuli, draws, rewards });
        self.dynamics.write_activity(&self.motor_neurons, &mut self.motor_activity);
        if let Some(window) = &mut self.window {
            self.dynamics.write_window(window);
        }
    }

    /// Activities of the rate neurons that outputs decode, after a step: their rows of
    /// `[neuron][lane]`.
    pub fn motor_activity(&self) -> &Lanes {
        &self.motor_activity
    }

    /// Activities of all neurons, `[neuron][lane]`; for spiking neurons, the share of substeps with
    /// a spike.
    pub fn activity(&self) -> Lanes {
        let n_neurons = self.motor_activity.n_rows();
        let mut activity = Lanes::new(n_neurons, self.n_lanes);
        self.dynamics.write_activity(&(0..n_neurons).collect::<Vec<_>>(), &mut activity);
        activity
    }

    /// The spikes of the last environment step; `None` for rate neurons.
    pub fn window(&self) -> Option<&SpikeWindow> {
        self.window.as_ref()
    }

    /// Voltages of the neurons, mV, `[neuron][lane]`; `None` for rate neurons.
    pub fn voltages(&self) -> Option<Lanes> {
        let n_neurons = self.motor_activity.n_rows();
        let mut voltages = Lanes::new(n_neurons, self.n_lanes);
        self.dynamics.write_voltages(&mut voltages).then_some(voltages)
    }
}

/// The dynamics of the network's neuron model, at rest.
fn compile(
    isa: Isa,
    network: &Network,
    phenotype: &Phenotype,
    n_lanes: usize,
) -> Box<dyn Dynamics> {
    match network.wiring() {
        Wiring::Rate(_) if network.learning.is_some() => {
            Box::new(PlasticCtrnn::new(isa, network, phenotype, n_lanes))
        }
        Wiring::Rate(wiring) => Box::new(Ctrnn::new(isa, network, wiring, phenotype, n_lanes)),
        Wiring::Spiking(wiring) => spiking::compile(isa, network, wiring, phenotype, n_lanes),
    }
}

/// The neurons of a genotype as numbers, and the plasticity of their weights.
pub(crate) fn blueprint(network: &Network, phenotype: &Phenotype) -> (Neurons, Option<Plasticity>) {
    let neurons = match network.wiring() {
        Wiring::Rate(_) if network.learning.is_some() => {
            Neurons::Rate(ctrnn::plastic_blueprint(network, phenotype))
        }
        Wiring::Rate(wiring) => Neurons::Rate(ctrnn::blueprint(network, wiring, phenotype)),
        Wiring::Spiking(wiring) => {
            Neurons::Spiking(Box::new(spiking::blueprint(network, wiring, phenotype)))
        }
    };
    (neurons, Rule::compile(network, phenotype).map(Rule::blueprint))
}
