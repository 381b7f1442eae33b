//! Computes the network in the last lanes, which do not fill a vector: here a vector holds
//! neurons instead of lanes. The values have the same bits as in [`Chunk`](super::chunk::Chunk),
//! because a neuron adds up the same products in the same order; a missing synapse adds zero.

use std::mem;

use determinism::simd::{Simd, WithSimd};

use super::super::aligned::Aligned;
use super::kernel::{Blocks, Coupling, Kernel};
use super::squash::squash;
use crate::lanes::Lanes;
use determinism::Isa;
use experiment_file::Activation;

/// Lanes of a remainder, at most.
pub(super) const MAX_LANES: usize = 4;

/// A kernel in vectors of neurons. A bundle has as many pairs of neurons as a vector has lanes. It
/// consists of two vectors: the first and the second neurons of its pairs.
#[derive(Debug)]
pub(super) struct Bundles {
    n_substeps: u32,
    /// F of each bundle.
    activations: Vec<Activation>,
    /// Index of each row of the kernel among the values of a lane.
    places: Vec<usize>,
    /// Vectors of u at the start.
    rates: Aligned,
    /// Vectors of start, retention and drive of each bundle, as in
    /// [`Block`](super::kernel::Block).
    start: Aligned,
    retention: Aligned,
    drive: Aligned,
    /// Weights of synapses, `[bundle][row][vector]`.
    recurrent: Aligned,
    /// `[bundle][input][vector]`
    afferent: Aligned,
}

impl Bundles {
    /// Arranges a kernel in bundles, with u of each row at the start.
    pub fn new(kernel: &Kernel, rates: &[f32], isa: Isa) -> Self {
        let n = isa.vector_len();
        // All pairs of a bundle have the same activation function.
        let mut activations: Vec<Activation> = Vec::new();
        let mut places = Vec::new();
        let mut free = Vec::new();
        for activation in kernel.pair_activations() {
            let known = (0..activations.len())
                .find(|&bundle| activations[bundle] == activation && free[bundle] > 0);
            let bundle = known.unwrap_or_else(|| {
                activations.push(activation);
                free.push(n);
                activations.len() - 1
            });
            let first = bundle * 2 * n + n - free[bundle];
            free[bundle] -= 1;
            places.extend([first, first + n]);
        }
        let len = activations.len() * 2 * n;
        let (n_rows, n_inputs) = (kernel.n_rows(), kernel.n_inputs());
        let values = || Aligned::new(len);
        let mut bundles = Self {
            n_substeps: kernel.n_substeps,
            activations,
            places,
            rates: values(),
            start: values(),
            retention: values(),
            drive: values(),
            recurrent: Aligned::new(len * n_rows),
            afferent: Aligned::new(len * n_inputs),
        };
        for (&place, &u) in bundles.places.iter().zip(rates) {
            bundles.rates.values_mut()[place] = u;
        }
        bundles.fill(&kernel.quads, 0, n_rows, n_inputs, 2 * n);
        bundles.fill(&kernel.pairs, 4 * kernel.quads.blocks.len(), n_rows, n_inputs, 2 * n);
        bundles
    }

    fn fill<const N: usize>(
        &mut self,
        Blocks { blocks, recurrent, afferent }: &Blocks<N>,
        first_row: usize,
        n_rows: usize,
        n_inputs: usize,
        bundle_len: usize,
    ) {
        for (block, rows) in blocks.iter().zip(self.places[first_row..].as_chunks::<N>().0) {
            for (index, &place) in rows.iter().enumerate() {
                self.start.values_mut()[place] = block.start[index];
                self.retention.values_mut()[place] = block.retention[index];
                self.drive.values_mut()[place] = block.drive[index];
                let (bundle, within) = (place / bundle_len, place % bundle_len);
                let set = |weights: &mut Aligned, n_pre, couplings: &[Coupling<N>]| {
                    for coupling in couplings {
                        let vectors = bundle * n_pre + coupling.pre;
                        weights.values_mut()[vectors * bundle_len + within] =
                            coupling.weights[index];
                    }
                };
                set(&mut self.recurrent, n_rows, &recurrent[block.recurrent.clone()]);
                set(&mut self.afferent, n_inputs, &afferent[block.afferent.clone()]);
            }
        }
    }

    /// Number of values per lane.
    fn len(&self) -> usize {
        self.start.values().len()
    }
}

/// The state of a network in some lanes.
#[derive(Debug)]
pub(super) struct Remainder {
    first_lane: usize,
    n_lanes: usize,
    /// y, `[lane][neuron]`
    state: Aligned,
    /// u, `[lane][neuron]`
    activity: Aligned,
    /// Contribution of bias and inputs to y per substep, `[lane][neuron]`.
    drive: Aligned,
    scratch: Aligned,
}

impl Remainder {
    /// A remainder at rest, with 1 to [`MAX_LANES`] lanes.
    pub fn new(bundles: &Bundles, first_lane: usize, n_lanes: usize) -> Self {
        let values = || Aligned::new(bundles.len() * n_lanes);
        let (mut state, mut activity) = (values(), values());
        for (values, start) in [(&mut state, &bundles.start), (&mut activity, &bundles.rates)] {
            for lane in values.values_mut().chunks_exact_mut(bundles.len()) {
                lane.copy_from_slice(start.values());
            }
        }
        Self { first_lane, n_lanes, state, activity, drive: values(), scratch: values() }
    }

    /// Advances by one environment step with constant `stimuli`, `[input][lane]`.
    pub fn advance(&mut self, bundles: &Bundles, stimuli: &Lanes, isa: Isa) {
        match self.n_lanes {
            1 => isa.run(Advance::<1> { bundles, remainder: self, stimuli }),
            2 => isa.run(Advance::<2> { bundles, remainder: self, stimuli }),
            3 => isa.run(Advance::<3> { bundles, remainder: self, stimuli }),
            4 => isa.run(Advance::<4> { bundles, remainder: self, stimuli }),
            n => unreachable!("{n} lanes are more than MAX_LANES"),
        }
    }

    /// Writes the activities of these neurons, `[neuron][lane]`. `rows`: the kernel's row of each
    /// neuron.
    pub fn write_activity(
        &self,
        bundles: &Bundles,
        rows: &[usize],
        neurons: &[usize],
        activity: &mut Lanes,
    ) {
        let lanes = self.activity.values().chunks_exact(bundles.len());
        for (lane, values) in (self.first_lane..).zip(lanes) {
            for &neuron in neurons {
                activity.set(neuron, lane, values[bundles.places[rows[neuron]]]);
            }
        }
    }
}

/// An environment step of a remainder of L lanes.
struct Advance<'a, const L: usize> {
    bundles: &'a Bundles,
    remainder: &'a mut Remainder,
    stimuli: &'a Lanes,
}

impl<const L: usize> WithSimd for Advance<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if const { L >= S::F32_LANES } {
            unreachable!("lanes of a remainder do not fill a vector");
        }
        let Self { bundles, remainder, stimuli } = self;
        perceive::<S, L>(simd, bundles, remainder, stimuli);
        for _ in 0..bundles.n_substeps {
            integrate::<S, L>(simd, bundles, remainder);
            mem::swap(&mut remainder.activity, &mut remainder.scratch);
        }
    }
}

// All vector code is inlined into `with_simd`, which is compiled for the instruction set.
// Closures would not be inlined, hence the plain loops.

/// Drive of this environment step.
#[inline(always)]
fn perceive<S: Simd, const L: usize>(
    simd: S,
    bundles: &Bundles,
    remainder: &mut Remainder,
    stimuli: &Lanes,
) {
    let n_bundles = bundles.activations.len();
    let biases = pairs::<S>(bundles.drive.values());
    let weights = pairs::<S>(bundles.afferent.values());
    let n_inputs = weights.len() / n_bundles.max(1);
    let drives = pairs_mut::<S>(remainder.drive.values_mut());
    for bundle in 0..n_bundles {
        for lane in 0..L {
            let mut sums = biases[bundle];
            for (input, weights) in weights[bundle * n_inputs..][..n_inputs].iter().enumerate() {
                let stimulus = stimuli.get(input, remainder.first_lane + lane);
                accumulate(simd, &mut sums, weights, stimulus);
            }
            drives[lane * n_bundles + bundle] = sums;
        }
    }
}

/// One Euler step, from `activity` to `scratch`.
#[inline(always)]
fn integrate<S: Simd, const L: usize>(simd: S, bundles: &Bundles, remainder: &mut Remainder) {
    let n_bundles = bundles.activations.len();
    let n_rows = bundles.places.len();
    let retentions = pairs::<S>(bundles.retention.values());
    let weights = pairs::<S>(bundles.recurrent.values());
    let drives = pairs::<S>(remainder.drive.values());
    let states = pairs_mut::<S>(remainder.state.values_mut());
    let before = remainder.activity.values();
    let after = pairs_mut::<S>(remainder.scratch.values_mut());
    for (bundle, (&activation, retention)) in bundles.activations.iter().zip(retentions).enumerate()
    {
        let mut sums = [[simd.splat_f32s(0.0); L]; 2];
        for lane in 0..L {
            let drive = drives[lane * n_bundles + bundle];
            [sums[0][lane], sums[1][lane]] = drive;
        }
        let weights = &weights[bundle * n_rows..][..n_rows];
        for (weights, &place) in weights.iter().zip(&bundles.places) {
            for lane in 0..L {
                let u = simd.splat_f32s(before[lane * bundles.len() + place]);
                for half in 0..2 {
                    sums[half][lane] = simd.mul_add_f32s(weights[half], u, sums[half][lane]);
                }
            }
        }
        for lane in 0..L {
            let y = &mut states[lane * n_bundles + bundle];
            for half in 0..2 {
                y[half] = simd.mul_add_f32s(retention[half], y[half], sums[half][lane]);
                sums[half][lane] = y[half];
            }
        }
        let mut activity = sums;
        squash(simd, activation, &sums, &mut activity);
        for lane in 0..L {
            after[lane * n_bundles + bundle] = [activity[0][lane], activity[1][lane]];
        }
    }
}

/// Adds the contribution of one neuron or input to a bundle.
#[inline(always)]
fn accumulate<S: Simd>(simd: S, sums: &mut [S::f32s; 2], weights: &[S::f32s; 2], activity: f32) {
    let activity = simd.splat_f32s(activity);
    for (sum, weight) in sums.iter_mut().zip(weights) {
        *sum = simd.mul_add_f32s(*weight, activity, *sum);
    }
}

/// Values as the two vectors of bundles.
#[inline(always)]
fn pairs<S: Simd>(values: &[f32]) -> &[[S::f32s; 2]] {
    S::as_simd_f32s(values).0.as_chunks().0
}

/// Values as the two vectors of bundles.
#[inline(always)]
fn pairs_mut<S: Simd>(values: &mut [f32]) -> &mut [[S::f32s; 2]] {
    S::as_mut_simd_f32s(values).0.as_chunks_mut().0
}
