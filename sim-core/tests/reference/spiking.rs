//! Spiking neurons and decoders of their spikes (sections 4.1 and 4.2), with dense
//! matrices.

use determinism::random::{Purpose, Stream};
use experiment_file::{
    ActuatorQuery, DecodingConfig, ExperimentConfig, NamedMap, NeuronModel, OutputSelector,
    SynapseParams, TopologyConfig,
};

use super::actuators::Actions;
use super::encoding::{Encoder, EncoderState, encoders as encoders_of};
use super::network::{Decoded, Matrices, decode_genes, neurons_of};

/// The phenotype: N neurons, I inputs.
#[derive(Clone)]
pub struct SpikingNetwork {
    model: NeuronModel,
    dt: f64,
    time_scale: u32,
    matrices: Matrices,
    /// Per neuron.
    params: Vec<NamedMap<f64>>,
    /// Per output.
    decoders: Vec<Vec<f64>>,
    /// The receptors of dynamic synapses.
    receptors: Option<SynapseParams>,
    /// Delays in substeps, per neuron, and then per source of stimuli.
    delays: Vec<usize>,
    encoders: Vec<Encoder>,
}

/// The state of a robot's network, per neuron.
#[derive(Clone, Default)]
pub struct SpikingState {
    /// v and the other variables of the model.
    neurons: Vec<[f64; 3]>,
    spikes: Vec<bool>,
    /// With dynamic synapses, the spikes of neurons and sources of stimuli in all substeps so
    /// far.
    history: Vec<Vec<bool>>,
    /// `None` for rate neurons.
    encoders: Option<EncoderState>,
    /// Activities of neurons and sources of stimuli after a step: the share of substeps with a
    /// spike, or the mean value.
    pub activities: Vec<f64>,
    /// s_ampa, s_gaba, x, s_nmda
    open: Vec<[f64; 4]>,
    /// x and a of the linear population decoding.
    filters: Vec<[f64; 2]>,
}

/// The spikes of an environment step, per neuron.
struct Window {
    counts: Vec<f64>,
    /// Substep of the first spike.
    first: Vec<u32>,
}

/// The outputs that a query of decoders covers, with their numbers of weights.
pub fn decoders(topology: &TopologyConfig, selector: &OutputSelector) -> Vec<(usize, usize)> {
    let outputs = topology.outputs.iter().enumerate();
    let selected = outputs.filter(|(_, (name, _))| match selector {
        OutputSelector::All => true,
        OutputSelector::Named(selected) => selected == *name,
    });
    selected
        .map(|(output, (name, config))| {
            (output, n_weights(topology.decoding[name], topology.ensembles[&config.ensemble].n))
        })
        .collect()
}

fn n_weights(decoding: DecodingConfig, n: u32) -> usize {
    match decoding {
        DecodingConfig::RankOrderDecoding { num_outputs }
        | DecodingConfig::LinearPopulationDecoding { num_outputs, .. } => {
            (num_outputs * n) as usize
        }
        _ => 0,
    }
}

impl SpikingNetwork {
    /// Decodes a genotype.
    pub fn decode(config: &ExperimentConfig, genotype: &[f64]) -> Self {
        let topology = &config.topology;
        let Decoded { matrices, neurons, delays, encoders, decoders: covered, .. } =
            decode_genes(config, genotype);
        let of_ensembles = topology.ensembles.values();
        let mut params: Vec<NamedMap<f64>> = of_ensembles
            .flat_map(|ensemble| vec![ensemble.params.clone(); ensemble.n as usize])
            .collect();
        for (name, neuron, value) in neurons {
            params[neuron][name] = value;
        }
        let mut decoders = Vec::new();
        for (output, (name, config)) in topology.outputs.iter().enumerate() {
            let number = (1 << 32) + output as u64;
            let mut stream = Stream::new(topology.seed, 0, 0, Purpose::FixedWeights, number);
            let n = n_weights(topology.decoding[name], topology.ensembles[&config.ensemble].n);
            decoders.push((0..n).map(|_| 2.0 * stream.uniform() - 1.0).collect::<Vec<_>>());
        }
        for (output, weight, value) in covered {
            decoders[output][weight] = value;
        }
        let mut stream = Stream::new(topology.seed, 0, 0, Purpose::Connections, 1 << 32);
        let mut all_delays: Vec<usize> = params.iter().map(|_| 1 + stream.below(9)).collect();
        for name in topology.stimuli.keys() {
            let is_encoded = topology.encoding.contains_key(name);
            all_delays.extend(
                (0..topology.n_sources(name))
                    .map(|_| if is_encoded { 1 + stream.below(9) } else { 1 }),
            );
        }
        for (neuron, delay) in delays {
            all_delays[neuron] = delay.round() as usize;
        }
        let &TopologyConfig {
            neuron_model: model, dt, time_scale, synapse_params: receptors, ..
        } = topology;
        let delays = all_delays;
        Self {
            model,
            dt,
            time_scale,
            matrices,
            params,
            decoders,
            receptors,
            delays,
            encoders: encoders_of(topology, &encoders),
        }
    }

    pub fn set_weights(&mut self, matrices: Matrices) {
        self.matrices = matrices;
    }

    /// The state before the first step; encoders draw from the stream.
    pub fn rest(&self, stream: Stream) -> SpikingState {
        let start = |p: &NamedMap<f64>| match self.model {
            NeuronModel::Rate => panic!("rate neurons do not spike"),
            NeuronModel::Lif | NeuronModel::ExpLif => [p["v_rest"], 0.0, 0.0],
            NeuronModel::AdEx => [p["V_rest"], 0.0, p["theta_rest"]],
            NeuronModel::Izhikevich => [p["C"], p["B"] * p["C"], 0.0],
            NeuronModel::MorrisLecar => {
                [-50.0, (1.0 + ((-50.0 - p["V3"]) / p["V4"]).tanh()) / 2.0, 0.0]
            }
        };
        SpikingState {
            neurons: self.params.iter().map(start).collect(),
            spikes: vec![false; self.params.len()],
            history: Vec::new(),
            open: vec![[0.0; 4]; self.delays.len()],
            activities: Vec::new(),
            encoders: Some(EncoderState::new(
                &self.encoders,
                self.delays.len() - self.params.len(),
                stream,
            )),
            filters: vec![[0.0; 2]; self.params.len()],
        }
    }

    /// One environment step, phi held, and the actions that follow from it.
    pub fn step(
        &self,
        topology: &TopologyConfig,
        state: &mut SpikingState,
        phi: &[f64],
        msg_length: usize,
    ) -> Actions {
        let n = self.params.len();
        let mut sums = vec![0.0; self.delays.len()];
        let mut window = Window { counts: vec![0.0; n], first: vec![self.time_scale; n] };
        for substep in 0..self.time_scale {
            let s: Vec<f64> = state.spikes.iter().map(|&s| if s { 1.0 } else { 0.0 }).collect();
            let encoders = state.encoders.as_mut().expect("spiking neurons have encoders");
            let (inputs, encoded) = encoders.encode(&self.encoders, phi, substep, self.time_scale);
            sums[n..].iter_mut().zip(&inputs).for_each(|(sum, input)| *sum += input);
            if let Some(params) = &self.receptors {
                state.history.push([&state.spikes[..], &encoded].concat());
                self.release(params, state);
            }
            for i in 0..n {
                let from_neurons = match &self.receptors {
                    None => dot(&self.matrices.w_neurons[i], &s),
                    Some(params) => self.receive(params, state, i),
                };
                let current = from_neurons + dot(&self.matrices.w_inputs[i], &inputs);
                let (next, spiked) =
                    neuron(self.model, &self.params[i], state.neurons[i], current, self.dt);
                state.neurons[i] = next;
                state.spikes[i] = spiked;
                let [x, a] = &mut state.filters[i];
                *x = if spiked { 1.0 } else { *x - self.dt * *x / 5.0 };
                *a += self.dt * (0.5 * *x * (1.0 - *a) - *a / 30.0);
                if spiked {
                    window.counts[i] += 1.0;
                    window.first[i] = window.first[i].min(substep);
                }
            }
        }
        sums[..n].copy_from_slice(&window.counts);
        state.activities = sums.iter().map(|sum| sum / f64::from(self.time_scale)).collect();
        self.act(topology, state, &window, msg_length)
    }

    /// Opens receptors at arriving spikes, and lets them close.
    fn release(&self, params: &SynapseParams, state: &mut SpikingState) {
        let SynapseParams { ampa, gaba, nmda } = params;
        let now = state.history.len();
        for (i, [s_ampa, s_gaba, x, s_nmda]) in state.open.iter_mut().enumerate() {
            let arrives = now >= self.delays[i] && state.history[now - self.delays[i]][i];
            for (s, tau) in [(s_ampa, ampa.tau), (s_gaba, gaba.tau), (&mut *x, nmda.tau_rise)] {
                *s = if arrives { 1.0 } else { *s - self.dt * *s / tau };
            }
            *s_nmda += self.dt * (0.5 * *x * (1.0 - *s_nmda) - *s_nmda / nmda.tau_decay);
        }
    }

    /// The current of a neuron.
    fn receive(&self, params: &SynapseParams, state: &SpikingState, i: usize) -> f64 {
        let SynapseParams { ampa, gaba, nmda } = params;
        let v = state.neurons[i][0];
        let flow = |receptor: usize, variable: usize| {
            let s: Vec<f64> = state.open.iter().map(|open| open[variable]).collect();
            dot(&self.matrices.w_receptors[receptor][i], &s)
        };
        ampa.gain * flow(0, 0) * ampa.reversal.map_or(1.0, |e| e - v)
            + gaba.gain * flow(1, 1) * gaba.reversal.map_or(-1.0, |e| e - v)
            + nmda.gain * flow(2, 3) * nmda.reversal.map_or(1.0, |e| e - v)
                / (1.0 + nmda.magnesium * (-0.062 * v).exp() / 3.57)
    }

    fn act(
        &self,
        topology: &TopologyConfig,
        state: &SpikingState,
        window: &Window,
        msg_length: usize,
    ) -> Actions {
        let mut actions =
            Actions { wheels: [0.0, 0.0], led: 0, send: None, message: vec![0.0; msg_length] };
        for ((name, output), weights) in topology.outputs.iter().zip(&self.decoders) {
            let neurons = neurons_of(topology, &output.ensemble).expect("outputs name an ensemble");
            let decoding = topology.decoding[name];
            let values: Vec<f64> = match decoding {
                DecodingConfig::FirstToSpike {} => {
                    let first = &window.first[neurons.clone()];
                    let earliest = first.iter().min().expect("ensembles have neurons");
                    vec![
                        first
                            .iter()
                            .position(|spike| spike == earliest)
                            .expect("the earliest spike is one of them")
                            as f64,
                    ]
                }
                DecodingConfig::RankOrderDecoding { .. } => weights
                    .chunks(neurons.len())
                    .map(|weights| {
                        let mut sum = 0.0;
                        for (i, w) in neurons.clone().zip(weights) {
                            let before = |j: &usize| window.first[*j] < window.first[i];
                            let rank = neurons.clone().filter(before).count();
                            sum += w * window.counts[i] * 0.25f64.powi(rank as i32);
                        }
                        sum
                    })
                    .collect(),
                DecodingConfig::LinearPopulationDecoding { rest_value, .. } => weights
                    .chunks(neurons.len())
                    .map(|weights| {
                        let a: Vec<f64> = neurons.clone().map(|i| state.filters[i][1]).collect();
                        1.0 / (1.0 + (-3.0 * dot(weights, &a)).exp()) + rest_value - 0.5
                    })
                    .collect(),
                _ => panic!("this decoding reads no spikes"),
            };
            let category = match decoding {
                DecodingConfig::FirstToSpike {} => values[0] as u32,
                _ => u32::from(values[0] >= 0.5),
            };
            match output.actuator {
                ActuatorQuery::Wheels => {
                    let [right, left] = match values[..] {
                        [w] => [w, -w],
                        [right, left] => [right, left],
                        _ => panic!("wheels have one or two outputs"),
                    };
                    actions.wheels = [right.clamp(-1.0, 1.0), left.clamp(-1.0, 1.0)];
                }
                ActuatorQuery::Led => actions.led = category,
                ActuatorQuery::Mode => actions.send = Some(category > 0),
                ActuatorQuery::Message => actions.message = values,
            }
        }
        actions
    }
}

/// The state of a neuron after one Euler step, and whether it spikes.
fn neuron(
    model: NeuronModel,
    p: &NamedMap<f64>,
    [v, x, y]: [f64; 3],
    current: f64,
    dt: f64,
) -> ([f64; 3], bool) {
    match model {
        NeuronModel::Rate => panic!("rate neurons do not spike"),
        NeuronModel::Lif | NeuronModel::ExpLif => {
            let current = if x > 0.0 { 0.0 } else { current };
            let (slope, threshold) = if model == NeuronModel::Lif {
                (p["v_rest"] - v + p["R"] * current, p["thresh"])
            } else {
                (p["v_rest"] - v + 0.3 * (v - p["thresh"]).exp() + 0.6 * current, 30.0)
            };
            let next = v + dt / p["tau"] * slope;
            if next >= threshold {
                ([p["v_rest"], p["time_refrac"], 0.0], true)
            } else {
                ([next, (x - 1.0).max(0.0), 0.0], false)
            }
        }
        NeuronModel::AdEx => {
            let slope = p["V_rest"] - v + 2.0 * ((v - y) / 2.0).exp() - x + current;
            let next = v + dt / p["tau_m"] * slope;
            let spiked = next >= 30.0;
            let s = if spiked { 1.0 } else { 0.0 };
            let slope_w = p["A"] * (v - p["V_rest"]) - x + p["B"] * p["tau_w"] * s;
            let theta = y + dt * ((1.0 - s) * (p["theta_rest"] - y) / 50.0 + 20.0 * s);
            let v = if spiked { p["V_reset"] } else { next };
            ([v, x + dt / p["tau_w"] * slope_w, theta], spiked)
        }
        NeuronModel::Izhikevich => {
            let (v, u) = if v >= 30.0 { (p["C"], x + p["D"]) } else { (v, x) };
            let next = v + dt * (0.04 * v * v + 5.0 * v + 140.0 - u + 0.1 * current);
            let next = next.clamp(-85.0, 30.0);
            ([next, u + dt * p["A"] * (p["B"] * v - u), 0.0], next >= 30.0)
        }
        NeuronModel::MorrisLecar => {
            let m = (1.0 + ((v - p["V1"]) / p["V2"]).tanh()) / 2.0;
            let n_inf = (1.0 + ((v - p["V3"]) / p["V4"]).tanh()) / 2.0;
            let tau_n = 1.0 / ((v - p["V3"]) / (2.0 * p["V4"])).cosh();
            let out = p["g_L"] * (v - p["E_L"])
                + p["g_K"] * x * (v - p["E_K"])
                + p["g_Ca"] * m * (v - p["E_Ca"]);
            let next = (v + dt / p["Cm"] * (current - out)).clamp(-85.0, 40.0);
            ([next, x + dt * p["phi"] * (n_inf - x) / tau_n, 0.0], next >= 35.5)
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
