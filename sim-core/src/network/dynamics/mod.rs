//! Networks at work: which implementation each neuron model has.
//!
//! To add a model: describe it in `experiment-file` (its module `neuron`), implement
//! [`Dynamics`] in a module beside `ctrnn`, and add a variant to [`Wiring`].

mod aligned;
mod ctrnn;
mod spiking;

use std::fmt;

use indexmap::IndexMap;

use super::connections::{Synapse, SynapseGroup};
use super::{Ensemble, Network, Phenotype};
use crate::lanes::Lanes;
use ctrnn::Ctrnn;
use experiment_file::NeuronModel;
use numeric::Isa;

/// The neurons of a network with their synapses, by one model, and their state in
/// every lane. An implementation must give a lane the same bits whatever its place,
/// its neighbours and the instruction set.
pub(crate) trait Dynamics: fmt::Debug {
    /// Advances by one environment step, which is `Network::n_substeps` substeps.
    /// `stimuli` are held: `[input][lane]`.
    fn step(&mut self, stimuli: &Lanes);

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
    /// Of the neurons of some ensembles and the synapses that join them.
    pub fn new(
        model: NeuronModel,
        ensembles: &IndexMap<String, Ensemble>,
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
                Self::Spiking(spiking::Wiring::new(n_neurons, groups, synapses))
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
        Self { dynamics, n_lanes, activity, window }
    }

    /// Advances by one environment step, `stimuli` being held: `[input][lane]`.
    pub fn step(&mut self, stimuli: &Lanes) {
        self.dynamics.step(stimuli);
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
        Wiring::Rate(wiring) => Box::new(Ctrnn::new(isa, network, wiring, phenotype, n_lanes)),
        Wiring::Spiking(wiring) => spiking::compile(isa, network, wiring, phenotype, n_lanes),
    }
}
