//! Networks at work: which implementation each neuron model has.
//!
//! To add a model: describe it in `experiment-file` (its module `neuron`), implement
//! [`Dynamics`] in a module beside `ctrnn`, and add a variant to [`Wiring`].

mod aligned;
mod ctrnn;
mod learning;
mod spiking;

use std::fmt;

use indexmap::IndexMap;

use super::connections::{Synapse, SynapseGroup};
use super::{Ensemble, Network, Phenotype};
use crate::lanes::Lanes;
use ctrnn::{Ctrnn, PlasticCtrnn};
use determinism::Isa;
use determinism::random::Stream;
use experiment_file::NeuronModel;

/// The neurons of a network with their synapses, by one model, and their state in
/// every lane. An implementation must give a lane the same bits whatever its place,
/// its neighbours and the instruction set.
pub(crate) trait Dynamics: fmt::Debug {
    /// Advances by one environment step, which is `Network::n_substeps` substeps.
    fn step(&mut self, inputs: Inputs<'_>);

    /// Writes the activities that outputs decode: `[neuron][lane]`.
    fn write_activity(&self, activity: &mut Lanes);

    /// Writes what the spikes of the last environment step leave for decoders. Rate
    /// neurons have none.
    fn write_window(&self, _window: &mut SpikeWindow) {}

    /// Writes voltages, mV: `[neuron][lane]`; false if its neurons have none.
    fn write_voltages(&self, _voltages: &mut Lanes) -> bool {
        false
    }
}

/// What a network gets in an environment step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inputs<'a> {
    /// Held for all substeps, `[input][lane]`.
    pub stimuli: &'a Lanes,
    /// Uniform random numbers, substep by substep one for each of `Network::n_drawing` nodes,
    /// `[draw][lane]`.
    pub draws: &'a Lanes,
    /// Reward of the step before, one row; none if nothing learns.
    pub rewards: &'a Lanes,
}

/// What the spikes of the neurons that outputs decode leave behind in an environment step,
/// `[neuron][lane]`; of other neurons, nothing.
#[derive(Debug)]
pub(crate) struct SpikeWindow {
    /// Spikes.
    pub counts: Lanes,
    /// The substep of the first spike, from 0; the number of substeps without one.
    pub first: Lanes,
    /// a of `LinearPopulationDecoding`, over all steps.
    pub filtered: Lanes,
}

/// What a neuron model makes of a network's structure, once for all genotypes.
#[derive(Debug, Clone)]
pub(crate) enum Wiring {
    /// [`NeuronModel::Rate`]
    Rate(ctrnn::Wiring),
    /// All others.
    Spiking(spiking::Wiring),
}

impl Wiring {
    /// Of the neurons of some ensembles, the nodes of encoders, and the synapses that join
    /// them.
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

/// A network with its values in every lane, and what its neurons show.
#[derive(Debug)]
pub(crate) struct NetworkState {
    dynamics: Box<dyn Dynamics>,
    n_lanes: usize,
    /// `[neuron][lane]`. Read for every robot, hence not behind the trait.
    activity: Lanes,
    /// None of rate neurons.
    window: Option<SpikeWindow>,
    /// What encoders draw from, per lane.
    streams: Vec<Stream>,
    /// What they drew for this environment step, `[draw][lane]`.
    draws: Lanes,
    /// The last rewards, one row; none if nothing learns.
    rewards: Lanes,
}

impl NetworkState {
    /// At rest in every lane.
    pub fn new(isa: Isa, network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let dynamics = compile(isa, network, phenotype, n_lanes);
        let rows = || Lanes::new(network.n_neurons(), n_lanes);
        let mut activity = rows();
        dynamics.write_activity(&mut activity);
        let window = network.model.is_spiking().then(|| SpikeWindow {
            counts: rows(),
            first: rows(),
            filtered: rows(),
        });
        let mut draws = Lanes::new(network.n_drawing() * network.n_substeps as usize, n_lanes);
        let rewards = Lanes::new(usize::from(network.learning.is_some()), n_lanes);
        // Nothing spikes in lanes without a robot.
        (0..draws.n_rows()).for_each(|draw| draws.row_mut(draw).fill(1.0));
        Self { dynamics, n_lanes, activity, window, streams: Vec::new(), draws, rewards }
    }

    /// The same with a stream of random numbers per lane, for encoders that draw.
    pub fn drawing_from(self, streams: Vec<Stream>) -> Self {
        Self { streams, ..self }
    }

    /// What a lane is rewarded with for the step before; 0 if nobody says.
    pub fn reward(&mut self, lane: usize, reward: f32) {
        if self.rewards.n_rows() > 0 {
            self.rewards.set(0, lane, reward);
        }
    }

    /// Advances by one environment step, `stimuli` being held: `[input][lane]`.
    pub fn step(&mut self, stimuli: &Lanes) {
        for (lane, stream) in self.streams.iter_mut().enumerate() {
            for draw in 0..self.draws.n_rows() {
                self.draws.set(draw, lane, stream.uniform() as f32);
            }
        }
        let (draws, rewards) = (&self.draws, &self.rewards);
        self.dynamics.step(Inputs { stimuli, draws, rewards });
        self.dynamics.write_activity(&mut self.activity);
        if let Some(window) = &mut self.window {
            self.dynamics.write_window(window);
        }
    }

    /// Activities of the neurons, `[neuron][lane]`: of spiking ones, the share of the
    /// substeps in which they spiked.
    pub fn activity(&self) -> &Lanes {
        &self.activity
    }

    /// The spikes of the last environment step; none of rate neurons.
    pub fn window(&self) -> Option<&SpikeWindow> {
        self.window.as_ref()
    }

    /// Voltages of the neurons, mV, `[neuron][lane]`; none of rate neurons.
    pub fn voltages(&self) -> Option<Lanes> {
        let n_neurons = self.activity.n_rows();
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
