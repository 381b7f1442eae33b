//! From activities of motor neurons to actions.

use std::ops::Range;

use indexmap::IndexMap;

use super::Ensemble;
use crate::communication::Mode;
use crate::controllers::Action;
use crate::lanes::Lanes;
use crate::problems::Problems;
use experiment_file::{ActuatorQuery, DecodingConfig, TopologyConfig};
use numeric::random::{Stream, sample};

/// An ensemble that drives an actuator.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// What it drives.
    pub actuator: ActuatorQuery,
    /// The motor neurons.
    pub neurons: Range<usize>,
    /// How.
    pub decoder: Decoder,
}

/// How activities become an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Decoder {
    /// The activity itself.
    Identity,
    /// 1 if the activity is at least one half, else 0.
    Threshold,
    /// 1 with the activity as probability, else 0.
    Bernoulli,
    /// The index of a neuron, with probabilities softmax(activities).
    Softmax,
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
        let decoder = match config.decoding.get(name) {
            Some(DecodingConfig::IdentityDecoding {}) => Decoder::Identity,
            Some(DecodingConfig::ThresholdDecoding { stochastic: false }) => Decoder::Threshold,
            Some(DecodingConfig::ThresholdDecoding { stochastic: true }) => Decoder::Bernoulli,
            Some(DecodingConfig::SoftmaxDecoding {}) => Decoder::Softmax,
            None => {
                problems.add(format!("topology.decoding.{name}"), "missing");
                continue;
            }
        };
        let neurons = ensemble.neurons.clone();
        outputs.push(Output { actuator: output.actuator, neurons, decoder });
    }
    outputs
}

impl Output {
    /// Decodes the activities of one lane. `weights` is scratch.
    pub fn decode(
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
    /// The value that one activity stands for; a category is not one's own.
    fn value(self, activity: f64, stream: &mut Stream) -> f64 {
        match self {
            Self::Identity | Self::Softmax => activity,
            Self::Threshold => f64::from(activity >= 0.5),
            Self::Bernoulli => f64::from(stream.bernoulli(activity)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numeric::random::Purpose;

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
        let output = Output { actuator, neurons: 0..activities.len(), decoder };
        output.decode(&lanes, 0, stream, &mut Vec::new(), &mut action);
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
