//! The structure of the neural network, which all genotypes share.

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
    Activation, EncodingConfig, EncodingScheme, InitialRates, LearningConfig, NamedMap,
    NeuronModel, NeuronParameter, SensorQuery, SynapseParams, TopologyConfig,
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
    /// Fixed time constant of motor neurons, seconds; `None` if they have none.
    pub motor_tau: Option<f64>,
    /// Receptors of dynamic synapses; `None` for static synapses.
    pub receptors: Option<SynapseParams>,
    /// The plasticity of weights; `None`: weights are constant.
    pub learning: Option<LearningConfig>,
    /// Inputs by name, in the order of their rows.
    pub stimuli: IndexMap<String, Stimulus>,
    /// Neurons by name of their ensemble, in their order.
    pub ensembles: IndexMap<String, Ensemble>,
    /// Synapse groups by name.
    pub groups: IndexMap<String, SynapseGroup>,
    /// All synapses, group by group.
    pub synapses: Vec<Synapse>,
    /// The order of computation, made on first use: it may have a million synapses, and programs
    /// that only check experiments do not need it.
    wiring: OnceLock<Wiring>,
    /// Outputs, in the order of the configuration.
    pub outputs: Vec<Output>,
}

/// A named input.
#[derive(Debug, Clone)]
pub(crate) struct Stimulus {
    /// Its rows among the inputs.
    pub inputs: Range<usize>,
    /// The reading that it carries.
    pub sensor: SensorQuery,
    /// Its encoder; `None` if it has none.
    pub encoder: Option<Encoder>,
}

/// An encoder, which turns a stimulus into spikes.
#[derive(Debug, Clone)]
pub(crate) struct Encoder {
    /// Its nodes among those of all encoders.
    pub nodes: Range<usize>,
    /// Its configuration.
    pub config: EncodingConfig,
    /// Number of weights of its receptive field.
    pub n_weights: usize,
}

/// A named group of neurons.
#[derive(Debug, Clone)]
pub(crate) struct Ensemble {
    /// Its neurons.
    pub neurons: Range<usize>,
    /// Activation function F; `None` if the neuron model has none.
    pub activation: Option<Activation>,
    /// Values of the model's parameters that the genotype does not cover, by name.
    pub defaults: NamedMap<f64>,
    /// Whether an output reads it.
    pub motor: bool,
}

impl Ensemble {
    /// Value of a parameter that the genotype does not cover.
    pub fn default_of(&self, parameter: &NeuronParameter) -> f64 {
        self.defaults.get(parameter.name()).copied().unwrap_or(parameter.default())
    }
}

impl Network {
    /// Compiles the network, and draws its connections; notes unknown names.
    pub fn compile(config: &TopologyConfig, problems: &mut Problems) -> Self {
        let (mut n_inputs, mut n_encoded) = (0, 0);
        let stimuli = config.stimuli.iter().map(|(name, stimulus)| {
            let inputs = n_inputs..n_inputs + stimulus.n as usize;
            n_inputs = inputs.end;
            let encoder = config.encoding.get(name).map(|&encoding| {
                let nodes = n_encoded..n_encoded + config.n_sources(name) as usize;
                n_encoded = nodes.end;
                let n_weights = encoding.receptive_field.n_weights(stimulus.n) as usize;
                Encoder { nodes, config: encoding, n_weights }
            });
            (name.clone(), Stimulus { inputs, sensor: stimulus.sensor, encoder })
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
            learning: config.learning.clone(),
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
        let new = || {
            let n_encoded = self.n_encoded();
            Wiring::new(self.model, &self.ensembles, n_encoded, &self.groups, &self.synapses)
        };
        self.wiring.get_or_init(new)
    }

    /// Number of axonal delays: with dynamic synapses, one per neuron and node of an encoder.
    pub fn n_delays(&self) -> usize {
        if self.receptors.is_some() { self.n_neurons() + self.n_encoded() } else { 0 }
    }

    /// Encoders, in the order of their nodes, with the inputs that they encode.
    pub fn encoders(&self) -> impl Iterator<Item = (Range<usize>, &Encoder)> {
        let stimuli = self.stimuli.values();
        stimuli.filter_map(|stimulus| Some((stimulus.inputs.clone(), stimulus.encoder.as_ref()?)))
    }

    /// Number of nodes of all encoders.
    pub fn n_encoded(&self) -> usize {
        self.encoders().last().map_or(0, |(_, encoder)| encoder.nodes.end)
    }

    /// Number of nodes that draw a random number in every substep.
    pub fn n_drawing(&self) -> usize {
        let poisson = |encoder: &&Encoder| encoder.config.scheme == EncodingScheme::PoissonRate;
        let drawing = self.encoders().map(|(_, encoder)| encoder).filter(poisson);
        drawing.map(|encoder| encoder.nodes.len()).sum()
    }

    /// Number of neurons.
    pub fn n_neurons(&self) -> usize {
        self.ensembles.values().last().map_or(0, |ensemble| ensemble.neurons.end)
    }
}
