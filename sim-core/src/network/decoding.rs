//! Decodes activities of motor neurons to actions.

use std::ops::Range;

use indexmap::IndexMap;

use super::Ensemble;
use crate::communication::Mode;
use crate::controllers::Action;
use crate::lanes::Lanes;
use crate::network::dynamics::{NetworkState, SpikeWindow};
use crate::problems::Problems;
use determinism::random::{Stream, sample};
use experiment_file::{ActuatorQuery, DecodingConfig, TopologyConfig};

/// An ensemble that drives an actuator.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// The actuator.
    pub actuator: ActuatorQuery,
    /// The motor neurons.
    pub neurons: Range<usize>,
    /// The decoder.
    pub decoder: Decoder,
    /// Number of weights of the decoder.
    pub n_weights: usize,
}

/// A decoder of activities or spikes to an action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Decoder {
    /// The activity itself.
    Identity,
    /// 1 if the activity is at least one half, else 0.
    Threshold,
    /// 1 with the activity as probability, else 0.
    Bernoulli,
    /// The index of a neuron, with probabilities softmax(activities).
    Softmax,
    /// The index of the neuron that spiked first.
    FirstToSpike,
    /// Sums of weight * spikes * 0.25^rank.
    RankOrder,
    /// sigmoid(3 W a) + rest_value - 0.5
    LinearPopulation {
        /// The value where W a = 0.
        rest_value: f64,
    },
}

/// Outputs in the order of the configuration.
pub(super) fn compile(
    config: &TopologyConfig,
    ensembles: &IndexMap<String, Ensemble>,
    problems: &mut Problems,
) -> Vec<Output> {
    let mut outputs: Vec<Output> = Vec::new();
    for (name, output) in &config.outputs {
        let path = format!("topology.outputs.{name}");
        let Some(ensemble) = ensembles.get(&output.ensemble) else {
            problems.add(path, format!("no ensemble is named {:?}", output.ensemble));
            continue;
        };
        let decoding = config.decoding.get(name);
        let decoder = match decoding {
            Some(DecodingConfig::IdentityDecoding {}) => Decoder::Identity,
            Some(DecodingConfig::ThresholdDecoding { stochastic: false }) => Decoder::Threshold,
            Some(DecodingConfig::ThresholdDecoding { stochastic: true }) => Decoder::Bernoulli,
            Some(DecodingConfig::SoftmaxDecoding {}) => Decoder::Softmax,
            Some(DecodingConfig::FirstToSpike {}) => Decoder::FirstToSpike,
            Some(DecodingConfig::RankOrderDecoding { .. }) => Decoder::RankOrder,
            Some(&DecodingConfig::LinearPopulationDecoding { rest_value, .. }) => {
                Decoder::LinearPopulation { rest_value }
            }
            None => {
                problems.add(format!("topology.decoding.{name}"), "missing");
                continue;
            }
        };
        let neurons = ensemble.neurons.clone();
        let n_weights =
            decoding.map_or(0, |decoding| decoding.n_weights(neurons.len() as u32) as usize);
        outputs.push(Output { actuator: output.actuator, neurons, decoder, n_weights });
    }
    outputs
}

impl Output {
    /// Number of uniform numbers that the decoder draws in a step.
    pub fn n_draws(&self, message_len: usize) -> usize {
        match (self.decoder, self.actuator) {
            (Decoder::Softmax, ActuatorQuery::Led | ActuatorQuery::Mode) => 1,
            (Decoder::Bernoulli, ActuatorQuery::Message) => self.neurons.len().min(message_len),
            (Decoder::Bernoulli, ActuatorQuery::Wheels) => self.neurons.len().min(2),
            (Decoder::Bernoulli, ActuatorQuery::Led | ActuatorQuery::Mode) => 1,
            _ => 0,
        }
    }

    /// Decodes the neurons of one lane. `weights`: the weights of the decoder, value by value.
    pub fn decode(
        &self,
        state: &NetworkState,
        weights: &[f64],
        lane: usize,
        stream: &mut Stream,
        scratch: &mut Vec<f64>,
        action: &mut Action<'_>,
    ) {
        match state.window() {
            Some(window) => {
                self.decode_spikes(window, weights, lane, scratch);
                self.apply(scratch, action);
            }
            None => self.decode_activities(state.motor_activity(), lane, stream, scratch, action),
        }
    }

    /// Decodes the spikes of one lane to values.
    fn decode_spikes(
        &self,
        window: &SpikeWindow,
        weights: &[f64],
        lane: usize,
        values: &mut Vec<f64>,
    ) {
        let first = |neuron: usize| window.first.get(neuron, lane);
        values.clear();
        match self.decoder {
            Decoder::RankOrder => {
                for weights in weights.chunks_exact(self.neurons.len().max(1)) {
                    let terms = self.neurons.clone().zip(weights).map(|(neuron, weight)| {
                        let earlier =
                            self.neurons.clone().filter(|&other| first(other) < first(neuron));
                        let share = libm::exp2(-2.0 * earlier.count() as f64);
                        f64::from(window.counts.get(neuron, lane)) * weight * share
                    });
                    values.push(terms.sum());
                }
            }
            Decoder::LinearPopulation { rest_value } => {
                for weights in weights.chunks_exact(self.neurons.len().max(1)) {
                    let terms = self.neurons.clone().zip(weights);
                    let sum: f64 = terms
                        .map(|(neuron, weight)| {
                            f64::from(window.filtered.get(neuron, lane)) * weight
                        })
                        .sum();
                    values.push(1.0 / (1.0 + libm::exp(-3.0 * sum)) + rest_value - 0.5);
                }
            }
            // The reader guarantees that decoders of activities have rate neurons.
            _ => {
                let earliest = self.neurons.clone().min_by(|&a, &b| first(a).total_cmp(&first(b)));
                values.push(earliest.map_or(0.0, |neuron| (neuron - self.neurons.start) as f64));
            }
        }
    }

    /// Sets an action from numbers.
    fn apply(&self, values: &[f64], action: &mut Action<'_>) {
        let value = values.first().copied().unwrap_or_default();
        let category = if self.decoder == Decoder::FirstToSpike {
            value as u32
        } else {
            u32::from(value >= 0.5)
        };
        match self.actuator {
            ActuatorQuery::Message => {
                for (component, &value) in action.message.iter_mut().zip(values) {
                    *component = value;
                }
            }
            ActuatorQuery::Wheels => {
                let left = values.get(1).copied().unwrap_or(-value);
                *action.wheels = [value.clamp(-1.0, 1.0), left.clamp(-1.0, 1.0)];
            }
            ActuatorQuery::Led => *action.led = category,
            ActuatorQuery::Mode => {
                *action.mode = if category > 0 { Mode::Send } else { Mode::Relay };
            }
        }
    }

    /// `weights` is scratch.
    fn decode_activities(
        &self,
        activities: &Lanes,
        lane: usize,
        stream: &mut Stream,
        weights: &mut Vec<f64>,
        action: &mut Action<'_>,
    ) {
        let first = self.neurons.start;
        match self.actuator {
            ActuatorQuery::Message => {
                for (component, neuron) in action.message.iter_mut().zip(self.neurons.clone()) {
                    *component =
                        self.decoder.value(f64::from(activities.get(neuron, lane)), stream);
                }
            }
            ActuatorQuery::Wheels => {
                let right = self.decoder.value(f64::from(activities.get(first, lane)), stream);
                let left = if self.neurons.len() == 1 {
                    -right
                } else {
                    self.decoder.value(f64::from(activities.get(first + 1, lane)), stream)
                };
                *action.wheels = [right.clamp(-1.0, 1.0), left.clamp(-1.0, 1.0)];
            }
            ActuatorQuery::Led => *action.led = self.category(activities, lane, stream, weights),
            ActuatorQuery::Mode => {
                let send = self.category(activities, lane, stream, weights) > 0;
                *action.mode = if send { Mode::Send } else { Mode::Relay };
            }
        }
    }

    fn category(
        &self,
        activities: &Lanes,
        lane: usize,
        stream: &mut Stream,
        weights: &mut Vec<f64>,
    ) -> u32 {
        if self.decoder != Decoder::Softmax {
            return self.decoder.value(f64::from(activities.get(self.neurons.start, lane)), stream)
                as u32;
        }
        weights.clear();
        weights.extend(self.neurons.clone().map(|neuron| f64::from(activities.get(neuron, lane))));
        let max = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for weight in &mut *weights {
            *weight = libm::exp(*weight - max);
        }
        sample(weights, stream.uniform()) as u32
    }
}

impl Decoder {
    /// The value of one activity. Categories depend on all activities, so this does not decode
    /// them.
    fn value(self, activity: f64, stream: &mut Stream) -> f64 {
        match self {
            Self::Threshold => f64::from(activity >= 0.5),
            Self::Bernoulli => f64::from(stream.bernoulli(activity)),
            _ => activity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    /// Actions of `n` neurons with the given activities.
    fn decode(
        actuator: ActuatorQuery,
        decoder: Decoder,
        activities: &[f64],
        stream: &mut Stream,
    ) -> ([f64; 2], u32, Mode, [f64; 2]) {
        let mut lanes = Lanes::new(activities.len(), 1);
        for (neuron, &u) in activities.iter().enumerate() {
            lanes.set(neuron, 0, u as f32);
        }
        let (mut wheels, mut led, mut mode, mut message) = ([0.0; 2], 0, Mode::Send, [0.0; 2]);
        let mut action =
            Action { wheels: &mut wheels, led: &mut led, mode: &mut mode, message: &mut message };
        let output = Output { actuator, neurons: 0..activities.len(), decoder, n_weights: 0 };
        output.decode_activities(&lanes, 0, stream, &mut Vec::new(), &mut action);
        (wheels, led, mode, message)
    }

    fn stream() -> Stream {
        Stream::new(0, 0, 0, Purpose::Decoding, 0)
    }

    #[test]
    fn real_valued_actuators_take_activities() {
        let mut s = stream();
        let two = [0.25, -1.5];
        assert_eq!(decode(ActuatorQuery::Wheels, Decoder::Identity, &two, &mut s).0, [0.25, -1.0]);
        assert_eq!(
            decode(ActuatorQuery::Wheels, Decoder::Identity, &[0.375], &mut s).0,
            [0.375, -0.375]
        );
        assert_eq!(decode(ActuatorQuery::Message, Decoder::Identity, &two, &mut s).3, two);
        assert_eq!(decode(ActuatorQuery::Message, Decoder::Threshold, &two, &mut s).3, [0.0; 2]);
        assert_eq!(s.uniform(), stream().uniform(), "nothing was drawn");
    }

    #[test]
    fn thresholds_are_inclusive() {
        let mut s = stream();
        assert_eq!(decode(ActuatorQuery::Led, Decoder::Threshold, &[0.5], &mut s).1, 1);
        assert_eq!(decode(ActuatorQuery::Led, Decoder::Threshold, &[0.4999], &mut s).1, 0);
        assert_eq!(decode(ActuatorQuery::Mode, Decoder::Threshold, &[0.5], &mut s).2, Mode::Send);
        assert_eq!(decode(ActuatorQuery::Mode, Decoder::Threshold, &[0.2], &mut s).2, Mode::Relay);
    }

    #[test]
    fn stochastic_thresholds_draw_one_bit_per_neuron() {
        let (mut s, mut draws) = (stream(), stream());
        for _ in 0..100 {
            let message = decode(ActuatorQuery::Message, Decoder::Bernoulli, &[0.3, 0.7], &mut s).3;
            let bits = [draws.uniform() < 0.3, draws.uniform() < 0.7].map(f64::from);
            assert_eq!(message, bits);
        }
    }

    #[test]
    fn softmax_draws_a_colour_with_its_probability() {
        let activities = [0.0, libm::log(2.0), -50.0];
        let (mut s, mut draws) = (stream(), stream());
        for _ in 0..100 {
            let led = decode(ActuatorQuery::Led, Decoder::Softmax, &activities, &mut s).1;
            assert_eq!(led, u32::from(draws.uniform() > 1.0 / 3.0));
        }
    }
}
