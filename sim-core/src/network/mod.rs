//! The neural network's structure: what is the same for all genotypes.

pub(crate) mod connections;
pub(crate) mod decoding;
pub(crate) mod dynamics;
mod json;
mod phenotype;

use std::ops::Range;
use std::sync::OnceLock;

use indexmap::IndexMap;

use crate::problems::Problems;
use connections::{Synapse, SynapseGroup};
use decoding::Output;
use dynamics::Wiring;
use experiment_file::{
    Activation, InitialRates, NamedMap, NeuronModel, NeuronParameter, SensorQuery, SynapseParams,
    TopologyConfig,
};
pub(crate) use phenotype::Phenotype;

/// Structure of a network.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    /// Euler step, seconds.
    pub dt: f64,
    /// Substeps per environment step.
    pub n_substeps: u32,
    /// How its neurons work.
    pub model: NeuronModel,
    /// Whether the gain multiplies the bias.
    pub bias_in_gain: bool,
    /// Activities before the first substep.
    pub initial_rates: InitialRates,
    /// Time constant of motor neurons, seconds; none: as for all neurons.
    pub motor_tau: Option<f64>,
    /// Receptors of dynamic synapses; none of static ones.
    pub receptors: Option<SynapseParams>,
    /// Inputs by name, in the order of their rows.
    pub stimuli: IndexMap<String, Stimulus>,
    /// Neurons by name of their ensemble, in their order.
    pub ensembles: IndexMap<String, Ensemble>,
    /// Synapse groups by name.
    pub groups: IndexMap<String, SynapseGroup>,
    /// All synapses, group by group.
    pub synapses: Vec<Synapse>,
    /// The order in which they are computed, once it is asked for: whoever merely checks
    /// experiments, as a coordinator does, needs none, and it may have a million synapses.
    wiring: OnceLock<Wiring>,
    /// What neurons do, in the order of the configuration.
    pub outputs: Vec<Output>,
}

/// A named input.
#[derive(Debug, Clone)]
pub(crate) struct Stimulus {
    /// Its rows among the inputs.
    pub inputs: Range<usize>,
    /// The reading that it carries.
    pub sensor: SensorQuery,
}

/// A named group of neurons.
#[derive(Debug, Clone)]
pub(crate) struct Ensemble {
    /// Its neurons.
    pub neurons: Range<usize>,
    /// Activation function F; none if the neuron model has none.
    pub activation: Option<Activation>,
    /// Values of the model's parameters that the genotype does not cover, by name.
    pub defaults: NamedMap<f64>,
    /// Whether an output reads it.
    pub motor: bool,
}

impl Ensemble {
    /// Value of a parameter that the genotype does not cover.
    pub fn default_of(&self, parameter: &NeuronParameter) -> f64 {
        self.defaults.get(parameter.name).copied().unwrap_or(parameter.default)
    }
}

impl Network {
    /// Draws the connections; notes names that nothing has.
    pub fn compile(config: &TopologyConfig, problems: &mut Problems) -> Self {
        let mut n_inputs = 0;
        let stimuli = config.stimuli.iter().map(|(name, stimulus)| {
            let inputs = n_inputs..n_inputs + stimulus.n as usize;
            n_inputs = inputs.end;
            (name.clone(), Stimulus { inputs, sensor: stimulus.sensor })
        });
        let stimuli: IndexMap<_, _> = stimuli.collect();
        let mut n_neurons = 0;
        let ensembles = config.ensembles.iter().map(|(name, ensemble)| {
            let neurons = n_neurons..n_neurons + ensemble.n as usize;
            n_neurons = neurons.end;
            let motor = config.outputs.values().any(|output| output.ensemble == *name);
            let mut defaults = ensemble.params.clone();
            if let Some(tau) = config.motor_tau.filter(|_| motor) {
                defaults.insert("tau".to_owned(), tau);
            }
            let ensemble = Ensemble { neurons, activation: ensemble.activation, defaults, motor };
            (name.clone(), ensemble)
        });
        let ensembles: IndexMap<_, _> = ensembles.collect();
        let outputs = decoding::compile(config, &ensembles, problems);
        let (groups, synapses) = connections::draw(config, &stimuli, &ensembles, problems);
        Self {
            dt: config.dt,
            n_substeps: config.time_scale,
            model: config.neuron_model,
            bias_in_gain: config.bias_in_gain,
            initial_rates: config.initial_rates,
            motor_tau: config.motor_tau,
            receptors: config.synapse_params,
            stimuli,
            ensembles,
            groups,
            synapses,
            wiring: OnceLock::new(),
            outputs,
        }
    }

    /// The order in which its neurons and synapses are computed.
    pub fn wiring(&self) -> &Wiring {
        let new = || Wiring::new(self.model, &self.ensembles, &self.groups, &self.synapses);
        self.wiring.get_or_init(new)
    }

    /// Axonal delays: one per neuron with dynamic synapses.
    pub fn n_delays(&self) -> usize {
        if self.receptors.is_some() { self.n_neurons() } else { 0 }
    }

    /// Number of neurons.
    pub fn n_neurons(&self) -> usize {
        self.ensembles.values().last().map_or(0, |ensemble| ensemble.neurons.end)
    }
}
