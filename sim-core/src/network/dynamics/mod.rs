//! Networks at work: which implementation each neuron model has.
//!
//! To add a model: describe it in `experiment-file` (its module `neuron`), implement
//! [`Dynamics`] in a module beside `ctrnn`, and add a variant to [`Wiring`].

mod ctrnn;

use std::fmt;

use indexmap::IndexMap;

use super::connections::Synapse;
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
}

/// What a neuron model makes of a network's structure, once for all genotypes.
#[derive(Debug, Clone)]
pub(crate) enum Wiring {
    /// [`NeuronModel::Rate`]
    Rate(ctrnn::Wiring),
}

impl Wiring {
    /// Of the neurons of some ensembles and the synapses that join them.
    pub fn new(
        model: NeuronModel,
        ensembles: &IndexMap<String, Ensemble>,
        synapses: &[Synapse],
    ) -> Self {
        match model {
            NeuronModel::Rate => Self::Rate(ctrnn::Wiring::new(ensembles, synapses)),
        }
    }
}

/// A network with its values in every lane, and what its neurons show.
#[derive(Debug)]
pub(crate) struct NetworkState {
    dynamics: Box<dyn Dynamics>,
    /// `[neuron][lane]`. Read for every robot, hence not behind the trait.
    activity: Lanes,
}

impl NetworkState {
    /// At rest in every lane.
    pub fn new(isa: Isa, network: &Network, phenotype: &Phenotype, n_lanes: usize) -> Self {
        let dynamics = compile(isa, network, phenotype, n_lanes);
        let mut activity = Lanes::new(network.n_neurons(), n_lanes);
        dynamics.write_activity(&mut activity);
        Self { dynamics, activity }
    }

    /// Advances by one environment step, `stimuli` being held: `[input][lane]`.
    pub fn step(&mut self, stimuli: &Lanes) {
        self.dynamics.step(stimuli);
        self.dynamics.write_activity(&mut self.activity);
    }

    /// Activities of the neurons, `[neuron][lane]`.
    pub fn activity(&self) -> &Lanes {
        &self.activity
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
    }
}
