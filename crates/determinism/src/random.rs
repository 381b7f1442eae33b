//! Random streams, each addressed by its purpose.
//!
//! A stream is a ChaCha8 generator. Its 256-bit key is the address: four little-endian 64-bit
//! words, `[seed, trial set, trial, purpose]`. Its 64-bit stream number is the robot's number. A
//! trial set ([`TrialSet`]) is the word g for generation g, g + 2^48 b + 2^63 for block b of its
//! held-out trials, g + 2^62 + 2^63 for its judgement, and 2^62 for evaluations. Streams of
//! different addresses are independent, and no stream depends on other readers or on time. Any
//! program with ChaCha8 can reproduce every number of a run.
//!
//! The index of an individual is not part of an address: individuals of a
//! generation meet the same worlds and the same noise (common random numbers).
//!
//! Derived values, specified so that other programs can reproduce them, too:
//! - `u64`: two consecutive 32-bit outputs, low word first;
//! - uniform in \[0, 1): `(u64 >> 11) * 2^-53`;
//! - an integer below n: `floor(uniform * n)`;
//! - standard normal: the quantile function (Wichura 1988, AS 241, PPND16) of `(k + 0.5) * 2^-52`
//!   with `k = u64 >> 12`. One draw gives one normal, so draws stay countable. The logarithm comes
//!   from `libm`. Crates for distributions would use the platform's logarithm as soon as a
//!   dependency enables their `std` feature.

use std::fmt;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::normal::{standard_normal_quantile, standard_normal_quantiles};

/// The purpose of a stream. The numbers are part of the format of a run: never reuse one for
/// another purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u64)]
pub enum Purpose {
    /// Start positions of an object of the world; stream = index of the object.
    Positions = 1,
    /// Start headings; stream = index of the object.
    Orientations = 2,
    /// Robots affected by a perturbation; stream = its place in
    /// `PerturbationsConfig` of the experiment file.
    Perturbation = 3,
    /// A receiver's choice among valid frames; stream = robot, one draw per step.
    Reception = 4,
    /// Choice of the symbol of a message; stream = robot, one draw per step.
    Quantisation = 5,
    /// Stochastic decoding; stream = robot, per step one draw per stochastic
    /// output neuron (threshold) or output (softmax), in the order of outputs.
    Decoding = 6,
    /// Sensor noise; stream = robot + 2^32 k, one normal per value of the reading and step. Every
    /// kind of sensor has its own k, except that the light sensor and the distance sensor draw from
    /// k = 0, in this order.
    SensorNoise = 7,
    /// Movement of lights; stream = light.
    LightMovement = 8,
    /// Choice of the synapses that exist; seed = `topology.seed`, stream = index of the group.
    /// Stream 2^32 gives delays, first of neurons and then of nodes of encoders.
    Connections = 9,
    /// Weights outside the genotype, with the seed and stream of
    /// [`Connections`](Self::Connections). Weights of decoders use stream 2^32 + output.
    FixedWeights = 10,
    /// Draws of a task's script; stream = 0.
    Script = 12,
    /// Spikes of Poisson encoders; stream = robot, per step and substep one draw per node.
    Encoding = 13,
    /// Draws of robots whose actions a script decides; stream = robot.
    Control = 14,
    /// Movement of ground areas; stream = area.
    AreaMovement = 15,
    /// Draws of robots whose sensors a script reads; stream = robot.
    Sensing = 16,
    /// The pseudo-reality of a trial; stream = index of the object. Stream robot + 2^32 k gives,
    /// per step, the noise of the robot's sensors (k = 1, one normal per value), the loss of its
    /// frame (k = 2, one draw), and the noise of the frame's strength (k = 3, one normal).
    PseudoReality = 17,
    /// The pseudo-realities of a report; trial = number of the reality, stream 0, one draw per key.
    Realities = 18,
    /// Variation in evolution; trial = 0, stream = index of the population.
    Evolution = 11,
}

/// A set of trials, which determines their worlds and noise: trial t of one set has another world
/// than trial t of any other set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TrialSet {
    /// The trials by which evolution selects in generation g, from 0.
    Generation(u64),
    /// The held-out trials that compare candidates after generation g: worlds and noise that
    /// evolution never meets.
    HeldOut {
        /// Generation g.
        generation: u64,
        /// Index of the block, from 0; candidates that are close meet several blocks.
        block: u8,
    },
    /// The trials that judge the champion after the last generation, g. They select nothing.
    Judgement(u64),
    /// The trials of evaluations, which are the same for every run and belong to no generation.
    Evaluation,
}

impl TrialSet {
    /// The generation of the trials; `None` for evaluations.
    pub const fn generation(self) -> Option<u64> {
        match self {
            Self::Generation(generation)
            | Self::HeldOut { generation, .. }
            | Self::Judgement(generation) => Some(generation),
            Self::Evaluation => None,
        }
    }

    /// The kind of trials in one word, for logs: `selection`, `held-out`,
    /// `judgement` or `evaluation`.
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Generation(_) => "selection",
            Self::HeldOut { .. } => "held-out",
            Self::Judgement(_) => "judgement",
            Self::Evaluation => "evaluation",
        }
    }

    /// The second word of a stream's address. The numbers are part of the format of
    /// a run.
    const fn word(self) -> u64 {
        match self {
            Self::Generation(generation) => {
                debug_assert!(generation < BLOCK, "no run has so many generations");
                generation
            }
            Self::HeldOut { generation, block } => {
                generation | HELD_OUT_BIT | (block as u64 * BLOCK)
            }
            Self::Judgement(generation) => generation | HELD_OUT_BIT | EVALUATION_BIT,
            Self::Evaluation => EVALUATION_BIT,
        }
    }
}

const BLOCK: u64 = 1 << 48;
const EVALUATION_BIT: u64 = 1 << 62;
const HELD_OUT_BIT: u64 = 1 << 63;

/// The trials of a generation.
impl From<u64> for TrialSet {
    fn from(generation: u64) -> Self {
        Self::Generation(generation)
    }
}

impl fmt::Display for TrialSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Generation(generation) => write!(f, "generation {generation}"),
            Self::HeldOut { generation, block: 0 } => {
                write!(f, "held-out trials of generation {generation}")
            }
            Self::HeldOut { generation, block } => {
                write!(f, "held-out trials of generation {generation}, block {block}")
            }
            Self::Judgement(generation) => {
                write!(f, "judgement after generation {generation}")
            }
            Self::Evaluation => f.write_str("evaluation"),
        }
    }
}

/// A random stream; the [module](self) describes addresses and values.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of this address, at its beginning. `trial_set`: a [`TrialSet`], or
    /// the number of a generation.
    pub fn new(
        seed: u64,
        trial_set: impl Into<TrialSet>,
        trial: u64,
        purpose: Purpose,
        stream: u64,
    ) -> Self {
        let mut key = [0; 32];
        let words = [seed, trial_set.into().word(), trial, purpose as u64];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Uniform in \[0, 1), a multiple of 2^-53.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * TWO_POW_MINUS_53
    }

    /// Uniform in 0..n. `n` must not be 0.
    #[inline]
    pub fn below(&mut self, n: usize) -> usize {
        debug_assert!(n > 0, "`n` is at least 1");
        // For huge n, the product can round up to n; `min` keeps it below.
        ((self.uniform() * n as f64) as usize).min(n - 1)
    }

    /// True with probability `p`.
    #[inline]
    pub fn bernoulli(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// Skips `n` draws of any kind.
    pub fn skip(&mut self, n: usize) {
        for _ in 0..n {
            self.0.next_u64();
        }
    }

    /// Moves to draw `n` of the stream, counted from 0, forwards or backwards.
    pub fn seek(&mut self, n: u64) {
        self.0.set_word_pos(2 * u128::from(n));
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        standard_normal_quantile(self.probability())
    }

    /// Fills `values` with the same bits as repeated calls of [`normal`](Self::normal), in less
    /// than half the time.
    pub fn fill_normal(&mut self, values: &mut [f64]) {
        self.fill_probability(values);
        standard_normal_quantiles(values);
    }

    /// Fills `values` with uniform numbers in (0, 1); [`standard_normal_quantiles`] turns them into
    /// the draws of [`fill_normal`](Self::fill_normal). It is meant for callers that draw a few
    /// numbers from each of many streams.
    pub fn fill_probability(&mut self, values: &mut [f64]) {
        const N: usize = 64;
        let mut bytes = [[0; size_of::<u64>()]; N];
        for values in values.chunks_mut(N) {
            let bytes = &mut bytes[..values.len()];
            self.0.fill_bytes(bytes.as_flattened_mut());
            for (value, bytes) in values.iter_mut().zip(bytes) {
                *value = probability(u64::from_le_bytes(*bytes));
            }
        }
    }

    /// Uniform in (0, 1).
    fn probability(&mut self) -> f64 {
        probability(self.0.next_u64())
    }
}

/// The probability of a draw, (k + 0.5) * 2^-52: k has 52 bits, so that adding a half is exact and
/// the quantile stays finite. The bits of k are the fraction of 1 + k * 2^-52, because processors
/// convert whole numbers one by one.
#[inline(always)]
fn probability(draw: u64) -> f64 {
    f64::from_bits(1.0_f64.to_bits() | (draw >> 12)) - 1.0 + TWO_POW_MINUS_53
}

/// Samples an index with probabilities proportional to `weights`, from a uniform `u` in \[0, 1):
/// the smallest i with w_0 + ... + w_i > u * total. `weights` are not negative, and at least one
/// is positive.
pub fn sample(weights: &[f64], u: f64) -> usize {
    let total = weights.iter().fold(0.0, |sum, weight| sum + weight);
    let mut sum = 0.0;
    let drawn = weights.iter().position(|weight| {
        sum += weight;
        sum > u * total
    });
    drawn.unwrap_or(weights.len() - 1)
}

pub(crate) const TWO_POW_MINUS_53: f64 = 1.0 / (1u64 << 53) as f64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Isa;
    use crate::normal::StandardNormalQuantiles;

    #[test]
    fn many_normals_at_once_have_the_bits_of_single_draws() {
        for n in [0, 1, 63, 64, 65, 256, 257, 100_000] {
            let stream = Stream::new(n, 1, 0, Purpose::Evolution, 2);
            let mut one_by_one = stream.clone();
            let expected: Vec<u64> = (0..n).map(|_| one_by_one.normal().to_bits()).collect();
            for isa in Isa::available() {
                let mut stream = stream.clone();
                let mut values: Vec<f64> = (0..n).map(|_| stream.probability()).collect();
                isa.run(StandardNormalQuantiles(&mut values));
                let bits: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
                assert_eq!(bits, expected, "{n} by {isa}");
            }
            let mut at_once = stream;
            at_once.fill_normal(&mut vec![0.0; n as usize]);
            assert_eq!(at_once.uniform(), one_by_one.uniform(), "the number of draws is the same");
        }
    }

    #[test]
    fn sampling_follows_the_weights_in_order() {
        let weights = [0.0, 1.0, 0.0, 3.0];
        assert_eq!(sample(&weights, 0.0), 1);
        assert_eq!(sample(&weights, 0.249), 1);
        assert_eq!(sample(&weights, 0.25), 3);
        assert_eq!(sample(&weights, 1.0 - TWO_POW_MINUS_53), 3);
    }

    #[test]
    fn streams_of_different_addresses_differ() {
        let addresses = [
            Stream::new(1, 2, 3, Purpose::Positions, 4),
            Stream::new(0, 2, 3, Purpose::Positions, 4),
            Stream::new(1, 0, 3, Purpose::Positions, 4),
            Stream::new(1, 2, 0, Purpose::Positions, 4),
            Stream::new(1, 2, 3, Purpose::Orientations, 4),
            Stream::new(1, 2, 3, Purpose::Positions, 0),
        ];
        let mut first: Vec<u64> = addresses.map(|mut s| s.uniform().to_bits()).to_vec();
        first.sort_unstable();
        first.dedup();
        assert_eq!(first.len(), 6);
    }

    /// These words are part of the format of a run, as are the numbers of purposes.
    #[test]
    fn the_words_of_trial_sets_are_fixed() {
        for (trial_set, word) in [
            (TrialSet::Generation(0), 0),
            (TrialSet::Generation(39), 39),
            (TrialSet::HeldOut { generation: 0, block: 0 }, 9_223_372_036_854_775_808),
            (TrialSet::HeldOut { generation: 39, block: 0 }, 9_223_372_036_854_775_847),
            (TrialSet::HeldOut { generation: 39, block: 2 }, 9_223_934_986_808_197_159),
            (TrialSet::Judgement(39), 13_835_058_055_282_163_751),
            (TrialSet::Evaluation, 4_611_686_018_427_387_904),
        ] {
            assert_eq!(trial_set.word(), word, "{trial_set}");
        }
    }

    #[test]
    fn values_have_the_moments_of_their_distribution() {
        let mut stream = Stream::new(0, 0, 0, Purpose::Evolution, 0);
        let n = 100_000;
        let normals: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
        let mean = normals.iter().sum::<f64>() / n as f64;
        let variance = normals.iter().map(|x| x * x).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.015 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        let counts = (0..n).fold([0u32; 7], |mut counts, _| {
            counts[stream.below(7)] += 1;
            counts
        });
        for count in counts {
            assert!((f64::from(count) * 7.0 / n as f64 - 1.0).abs() < 0.04, "{counts:?}");
        }
    }

    /// The first version of the format fixed these values. A change of them changes every run.
    #[test]
    fn first_values_of_a_stream_are_fixed() {
        let mut stream = Stream::new(7, 1, 2, Purpose::Reception, 3);
        let bits: Vec<u64> = (0..3).map(|_| stream.uniform().to_bits()).collect();
        assert_eq!(bits, GOLDEN, "{bits:#x?}");
    }

    const GOLDEN: [u64; 3] = [0x3fc9_d8a5_d071_9b48, 0x3fd1_2cdc_bff9_8392, 0x3fec_a42c_521e_63da];
}
