//! Encoders: stimuli pass receptive fields, whose nodes spike.
//!
//! A radial field has a node for each of its centres c: with d = s - c and k its steepness, x =
//! exp(-k d^2), max(1 - k |d|, 0) or max(1 - k d^2, 0), scaled to x (max - min) + min. A substep
//! counts as 1 ms. A node spikes in a substep if
//! - a LIF neuron with its default parameters and the current x spikes (LIF);
//! - a uniform number is below 1 - s, after s -= x / 10,000 s; then s = 1 (Poisson);
//! - the number of the substep, from 1, is x rounded down and clipped to the substeps (rank order).

use std::ops::Range;

use determinism::simd::Simd;

use super::super::aligned::Aligned;
use super::functions::exp;
use super::lif::Lif;
use super::model::Model;
use super::row::Row;
use crate::blueprint::{self, Field};
use crate::lanes::Lanes;
use crate::network::{Encoder as Structure, Network, Phenotype};
use experiment_file::{
    EncodingScheme, NeuronModel, RadialField, RadialShape, ReceptiveField, limits,
};

/// Number of variables of a node: v and refractory substeps in LIF encoders, survival in Poisson
/// encoders.
const N_VARIABLES: usize = 2;

/// The encoders of a network, with the weights of a genotype.
#[derive(Debug)]
pub(super) struct Encoders {
    encoders: Vec<Encoder>,
    n_nodes: usize,
    /// Number of nodes that draw in every substep.
    n_drawing: usize,
    n_substeps: u32,
    lif: [f32; 5],
}

#[derive(Debug)]
struct Encoder {
    scheme: EncodingScheme,
    /// The rows of its stimulus.
    inputs: Range<usize>,
    /// Its nodes among those of all encoders.
    nodes: Range<usize>,
    /// Index of its first draw in a substep.
    first_draw: usize,
    field: Field,
}

/// The state of the nodes of a chunk.
#[derive(Debug)]
pub(super) struct EncoderState {
    /// Values of the nodes in this environment step, `[node][lane]`.
    values: Aligned,
    /// `[node][variable][lane]`
    held: Aligned,
}

impl Encoders {
    pub fn compile(network: &Network, phenotype: &Phenotype) -> Self {
        let mut n_drawing = 0;
        let encoders = network.encoders().zip(&phenotype.encoders);
        let encoders = encoders.map(|((inputs, Structure { nodes, config, .. }), weights)| {
            let (scheme, nodes, first_draw) = (config.scheme, nodes.clone(), n_drawing);
            if scheme == EncodingScheme::PoissonRate {
                n_drawing += nodes.len();
            }
            let field = field(&config.receptive_field, weights);
            Encoder { scheme, inputs, nodes, first_draw, field }
        });
        let encoders = encoders.collect();
        let spec = NeuronModel::Lif.spec();
        let default =
            |name: &str| spec.parameter(name).map_or(0.0, |parameter| parameter.default());
        Self {
            encoders,
            n_nodes: network.n_encoded(),
            n_drawing,
            n_substeps: network.n_substeps,
            lif: Lif::constants(&default, 1.0).map(|constant| constant as f32),
        }
    }

    /// Nodes of all encoders.
    #[inline(always)]
    pub fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// Smallest and largest value of a node; `None` without limits.
    #[inline(always)]
    fn limits(&self, scheme: EncodingScheme) -> Option<[f32; 2]> {
        match scheme {
            EncodingScheme::Lif => None,
            EncodingScheme::PoissonRate => Some([0.0, *limits::POISSON_RATE.end() as f32]),
            EncodingScheme::RankOrder => Some([1.0, self.n_substeps as f32]),
        }
    }

    /// The constants of the nodes' LIF neurons.
    pub fn lif(&self) -> [f32; 5] {
        self.lif
    }

    /// The encoders as numbers.
    pub fn blueprint(&self) -> Vec<blueprint::Encoder> {
        let encoders = self.encoders.iter().map(|encoder| blueprint::Encoder {
            scheme: encoder.scheme,
            inputs: encoder.inputs.clone(),
            nodes: encoder.nodes.clone(),
            field: encoder.field.clone(),
            limits: self.limits(encoder.scheme),
        });
        encoders.collect()
    }

    /// The values of all nodes in an environment step, from its stimuli, `[input][lane]`.
    #[inline(always)]
    pub fn perceive<S: Simd, const W: usize>(
        &self,
        simd: S,
        state: &mut EncoderState,
        stimuli: &Lanes,
        lanes: Range<usize>,
    ) {
        let values: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(state.values.values_mut()).0.as_chunks_mut().0;
        for Encoder { scheme, inputs, nodes, field, .. } in &self.encoders {
            let values = &mut values[nodes.clone()];
            let n_per_input = values.len() / inputs.len().max(1);
            for (index, input) in inputs.clone().enumerate() {
                let row = &stimuli.row(input)[lanes.clone()];
                let stimulus = Row::new(simd, S::as_simd_f32s(row).0.as_chunks().0[0]);
                match field {
                    Field::Identity => values[index] = stimulus.vectors,
                    Field::Radial { shape, steepness, centres, scale, offset } => {
                        let nodes = &mut values[index * n_per_input..][..n_per_input];
                        for (value, &centre) in nodes.iter_mut().zip(centres) {
                            let d = stimulus - Row::splat(simd, centre);
                            let x = respond(*shape, Row::splat(simd, *steepness), d);
                            let x = Row::splat(simd, *scale).mul_add(x, Row::splat(simd, *offset));
                            *value = x.vectors;
                        }
                    }
                    Field::Linear(weights) => {
                        for (value, weights) in
                            values.iter_mut().zip(weights.chunks_exact(inputs.len()))
                        {
                            let before = Row::new(simd, *value);
                            let sum = if index == 0 { Row::splat(simd, 0.0) } else { before };
                            let weight = Row::splat(simd, weights[index]);
                            *value = weight.mul_add(stimulus, sum).vectors;
                        }
                    }
                }
            }
            let Some([low, high]) = self.limits(*scheme) else { continue };
            for value in values.iter_mut() {
                *value = Row::new(simd, *value).at_most(high).at_least(low).vectors;
            }
        }
    }

    /// The spikes of all nodes in a substep, 1 or 0. `draws`: `[draw][lane]`.
    #[inline(always)]
    pub fn encode<S: Simd, const W: usize>(
        &self,
        simd: S,
        state: &mut EncoderState,
        draws: &Lanes,
        lanes: Range<usize>,
        substep: u32,
        spikes: &mut [[S::f32s; W]],
    ) {
        let values: &[[S::f32s; W]] = S::as_simd_f32s(state.values.values()).0.as_chunks().0;
        let held: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(state.held.values_mut()).0.as_chunks_mut().0;
        let held = held.as_chunks_mut::<N_VARIABLES>().0;
        let (zero, one) = (Row::splat(simd, 0.0), Row::splat(simd, 1.0));
        let hazard = Row::splat(simd, 1.0 / *limits::POISSON_RATE.end() as f32);
        let now = Row::splat(simd, (substep + 1) as f32);
        let mut lif = [zero; 5];
        for (splat, &constant) in lif.iter_mut().zip(&self.lif) {
            *splat = Row::splat(simd, constant);
        }
        for Encoder { scheme, nodes, first_draw, .. } in &self.encoders {
            let first_draw = substep as usize * self.n_drawing + first_draw;
            for (index, node) in nodes.clone().enumerate() {
                let [first, second] = &mut held[node];
                let value = Row::new(simd, values[node]);
                let before = Row::new(simd, *first);
                let spiked = match scheme {
                    EncodingScheme::Lif => {
                        let waiting = Row::new(simd, *second);
                        let ([v, waiting], spiked) = Lif::update(lif, [before, waiting], value);
                        (*first, *second) = (v.vectors, waiting.vectors);
                        spiked
                    }
                    EncodingScheme::PoissonRate => {
                        let row = &draws.row(first_draw + index)[lanes.clone()];
                        let draw = Row::new(simd, S::as_simd_f32s(row).0.as_chunks().0[0]);
                        let survival = before - value * hazard * before;
                        let spiked = (one - survival).exceeds(draw);
                        *first = spiked.select(one, survival).vectors;
                        spiked
                    }
                    EncodingScheme::RankOrder => value.reaches(now).and(one.exceeds(value - now)),
                };
                spikes[node] = spiked.select(one, zero).vectors;
            }
        }
    }
}

/// Value of a radial field at a distance d, for a steepness.
#[inline(always)]
fn respond<S: Simd, const W: usize>(
    shape: RadialShape,
    steepness: Row<S, W>,
    d: Row<S, W>,
) -> Row<S, W> {
    let distance = match shape {
        RadialShape::Cone => d.max(-d),
        RadialShape::Bell | RadialShape::Parabola => d * d,
    };
    let fall = steepness * distance;
    match shape {
        RadialShape::Bell => exp(-fall),
        RadialShape::Cone | RadialShape::Parabola => (d.constant(1.0) - fall).at_least(0.0),
    }
}

/// A receptive field with its weights.
fn field(config: &ReceptiveField, weights: &[f64]) -> Field {
    let Some(field) = config.radial() else {
        return match config {
            ReceptiveField::Linear(_) => {
                Field::Linear(weights.iter().map(|&weight| weight as f32).collect())
            }
            _ => Field::Identity,
        };
    };
    let RadialField { shape, steepness, values: [min, max], inverted, .. } = field;
    let (scale, offset) = if inverted { (min - max, max) } else { (max - min, min) };
    Field::Radial {
        shape,
        steepness: steepness as f32,
        centres: (0..field.n_neurons).map(|node| field.centre(node) as f32).collect(),
        scale: scale as f32,
        offset: offset as f32,
    }
}

impl EncoderState {
    /// Before the first substep: LIF neurons at rest, Poisson nodes just after a spike.
    pub fn new(encoders: &Encoders, n_lanes: usize) -> Self {
        let rows = |n: usize| Aligned::new(n * encoders.n_nodes * n_lanes);
        let mut state = Self { values: rows(1), held: rows(N_VARIABLES) };
        let [_, rest, ..] = encoders.lif;
        let mut nodes = state.held.values_mut().chunks_exact_mut(N_VARIABLES * n_lanes);
        for Encoder { scheme, nodes: range, .. } in &encoders.encoders {
            let first = if *scheme == EncodingScheme::Lif { rest } else { 1.0 };
            for node in nodes.by_ref().take(range.len()) {
                node[..n_lanes].fill(first);
            }
        }
        state
    }
}

#[cfg(test)]
mod tests {
    use determinism::simd::{WithSimd, bytemuck};

    use super::*;
    use determinism::Isa;
    use determinism::random::{Purpose, Stream};
    use experiment_file::{GaussianField, SlopedField};

    const N_SUBSTEPS: u32 = 20;

    /// Environment steps of an encoder, all lanes alike.
    struct Steps<'a> {
        encoders: &'a Encoders,
        stimuli: &'a [f32],
        n_steps: usize,
    }

    /// Values of the nodes, and the spikes of each in every substep.
    type Response = (Vec<f32>, Vec<Vec<bool>>);

    impl WithSimd for Steps<'_> {
        type Output = Response;

        fn with_simd<S: Simd>(self, simd: S) -> Response {
            let Self { encoders, stimuli, n_steps } = self;
            let n_lanes = S::F32_LANES;
            let mut lanes = Lanes::new(stimuli.len(), n_lanes);
            for (input, &value) in stimuli.iter().enumerate() {
                lanes.row_mut(input).fill(value);
            }
            let mut stream = Stream::new(0, 0, 0, Purpose::Encoding, 0);
            let mut draws = Lanes::new(encoders.n_drawing * N_SUBSTEPS as usize, n_lanes);
            let mut state = EncoderState::new(encoders, n_lanes);
            let mut spikes = vec![[simd.splat_f32s(0.0)]; encoders.n_nodes];
            let mut trains = Vec::new();
            for _ in 0..n_steps {
                (0..draws.n_rows())
                    .for_each(|draw| draws.row_mut(draw).fill(stream.uniform() as f32));
                encoders.perceive::<S, 1>(simd, &mut state, &lanes, 0..n_lanes);
                for substep in 0..N_SUBSTEPS {
                    let (draws, lanes) = (&draws, 0..n_lanes);
                    encoders.encode::<S, 1>(simd, &mut state, draws, lanes, substep, &mut spikes);
                    let rows: &[f32] = bytemuck::cast_slice(&spikes);
                    trains.push(rows.iter().step_by(n_lanes).map(|&spike| spike > 0.0).collect());
                }
            }
            let values = state.values.values().iter().step_by(n_lanes).copied().collect();
            (values, trains)
        }
    }

    fn respond_to(
        scheme: EncodingScheme,
        field: ReceptiveField,
        weights: &[f64],
        stimuli: &[f32],
        n_steps: usize,
    ) -> Response {
        let n_nodes = field.n_nodes(stimuli.len() as u32) as usize;
        let spec = NeuronModel::Lif.spec();
        let default = |name: &str| spec.parameter(name).unwrap().default();
        let is_drawing = scheme == EncodingScheme::PoissonRate;
        let encoders = Encoders {
            encoders: vec![Encoder {
                scheme,
                inputs: 0..stimuli.len(),
                nodes: 0..n_nodes,
                first_draw: 0,
                field: super::field(&field, weights),
            }],
            n_nodes,
            n_drawing: if is_drawing { n_nodes } else { 0 },
            n_substeps: N_SUBSTEPS,
            lif: Lif::constants(&default, 1.0).map(|constant| constant as f32),
        };
        Isa::best().run(Steps { encoders: &encoders, stimuli, n_steps })
    }

    fn sloped(slope: f64, n_neurons: u32, values: [f64; 2], inverted: bool) -> SlopedField {
        let [min_val, max_val] = values;
        SlopedField { slope, n_neurons, min_stim: -1.0, max_stim: 1.0, min_val, max_val, inverted }
    }

    fn counts(trains: &[Vec<bool>]) -> Vec<usize> {
        let count = |node: usize| trains.iter().filter(|spikes| spikes[node]).count();
        (0..trains[0].len()).map(count).collect()
    }

    #[test]
    fn nodes_have_the_values_of_their_field() {
        let gaussian = GaussianField {
            sigma: 6.0,
            n_neurons: 2,
            min_stim: 0.0,
            max_stim: 1.0,
            min_val: -10.0,
            max_val: 20.0,
            inverted: false,
        };
        let e = |x: f64| (-10.0 + 30.0 * libm::exp(x)) as f32;
        for (field, weights, expected) in [
            (ReceptiveField::Identity {}, &[][..], vec![0.5, 0.75]),
            (
                ReceptiveField::Gaussian(gaussian),
                &[],
                vec![e(-1.5), e(-1.5), e(-6.0 * 0.5625), e(-6.0 * 0.0625)],
            ),
            (
                ReceptiveField::Conic(sloped(0.5, 3, [0.0, 8.0], false)),
                &[],
                vec![2.0, 6.0, 6.0, 1.0, 5.0, 7.0],
            ),
            (
                ReceptiveField::Triangular(sloped(0.5, 3, [0.0, 8.0], true)),
                &[],
                vec![6.0, 2.0, 2.0, 7.0, 3.0, 1.0],
            ),
            (
                ReceptiveField::Parabolic(sloped(1.0, 2, [1.0, 17.0], false)),
                &[],
                vec![1.0, 13.0, 1.0, 16.0],
            ),
            (
                ReceptiveField::Linear(experiment_file::LinearField { n_neurons: 2 }),
                &[2.0, 4.0, -1.0, 0.0],
                vec![4.0, -0.5],
            ),
        ] {
            let (values, _) = respond_to(EncodingScheme::Lif, field, weights, &[0.5, 0.75], 1);
            for (value, expected) in values.iter().zip(&expected) {
                assert!((value - expected).abs() < 1e-4, "{field:?}: {values:?}, {expected}");
            }
            assert_eq!(values.len(), expected.len());
        }
    }

    #[test]
    fn ranks_are_the_substeps_of_single_spikes() {
        let field = ReceptiveField::Conic(sloped(0.5, 3, [1.0, 9.0], true));
        let (_, trains) = respond_to(EncodingScheme::RankOrder, field, &[], &[0.5], 2);
        for (node, rank) in [(0, 7), (1, 3), (2, 3)] {
            let of_node = trains.iter().map(|spikes| spikes[node]);
            let substeps: Vec<usize> =
                of_node.enumerate().filter(|(_, spiked)| *spiked).map(|(i, _)| i + 1).collect();
            assert_eq!(substeps, [rank, rank + 20]);
        }
        let identity = ReceptiveField::Identity {};
        let (_, trains) =
            respond_to(EncodingScheme::RankOrder, identity, &[], &[-3.0, 99.0, 20.0], 1);
        assert!(trains[0][0] && trains[19][1] && trains[19][2], "ranks are clipped");
        assert_eq!(counts(&trains), [1, 1, 1]);
    }

    #[test]
    fn lif_encoders_spike_above_15_as_often_as_the_neuron_does() {
        let identity = ReceptiveField::Identity {};
        let currents = [14.9, 15.5, 30.0, 200.0];
        let (_, trains) = respond_to(EncodingScheme::Lif, identity, &[], &currents, 50);
        let expected = currents.map(|current| {
            let (mut v, mut waiting, mut count) = (-65.0, 0, 0);
            for _ in 0..1000 {
                v += (-65.0 - v + if waiting > 0 { 0.0 } else { f64::from(current) }) / 20.0;
                waiting = i32::max(waiting - 1, 0);
                if v >= -50.0 {
                    (v, waiting, count) = (-65.0, 5, count + 1);
                }
            }
            count
        });
        assert_eq!(counts(&trains), expected);
        assert_eq!(expected[0], 0);
    }

    /// The probability of no spike for k substeps is the product of (1 - x / 10,000)^j for j from 1
    /// to k. The sum of these probabilities is the mean interval.
    #[test]
    fn poisson_nodes_spike_as_often_as_their_survival_predicts() {
        let identity = ReceptiveField::Identity {};
        let rates = [0.0, 20.0, 1_000.0, 10_000.0, 99_999.0, -5.0];
        let n_steps = 20_000;
        let (_, trains) = respond_to(EncodingScheme::PoissonRate, identity, &[], &rates, n_steps);
        let counts = counts(&trains);
        let n_substeps = n_steps as f64 * 20.0;
        for (&rate, &count) in rates.iter().zip(&counts) {
            let left = 1.0 - f64::from(rate.clamp(0.0, 10_000.0)) / 10_000.0;
            let no_spike = |k: i32| libm::pow(left, f64::from(k) * f64::from(k + 1) / 2.0);
            let interval: f64 = if left < 1.0 { (0..5_000).map(no_spike).sum() } else { f64::MAX };
            let expected = n_substeps / interval;
            let deviation = (count as f64 - expected).abs();
            assert!(deviation <= 4.0 * libm::sqrt(expected), "{rate}: {count}, {expected}");
        }
        assert_eq!(counts[3], 400_000, "in every substep");
    }
}
