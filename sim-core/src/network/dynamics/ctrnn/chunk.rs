//! Computes the network in whole vectors of lanes: it reads a weight once, and applies it to all
//! lanes of some vectors.

use std::mem;

use determinism::simd::{Simd, WithSimd};

use super::super::aligned::Aligned;
use super::kernel::{Blocks, Coupling, Kernel};
use super::squash::squash;
use crate::lanes::Lanes;
use determinism::Isa;

/// Vectors per row of a chunk, at most. Without fused multiply-adds, more would gain at most 6 %,
/// and their code is large.
pub(super) const fn max_width(is_fused: bool) -> usize {
    if is_fused { 6 } else { 4 }
}

/// Vectors per row, at most, for which four neurons at a time are faster than one: one neuron has
/// too few sums to keep the processor busy. Sixteen registers hold four sums of two vectors; with
/// more, a sum lives in memory, and every synapse waits for it. Without fused multiply-adds, a sum
/// alone keeps many instructions busy.
const fn max_narrow(is_fused: bool) -> usize {
    if is_fused { 3 } else { 1 }
}

/// The state of a network in some neighbouring vectors of lanes.
#[derive(Debug)]
pub(super) struct Chunk {
    first_lane: usize,
    /// Vectors per row.
    width: usize,
    /// Lanes per row.
    n_lanes: usize,
    /// y, `[row][lane]`
    state: Aligned,
    /// u, `[row][lane]`
    activity: Aligned,
}

/// What chunks need during a step only, so that they share it: it stays in a cache.
#[derive(Debug)]
pub(super) struct Workspace {
    /// Contribution of bias and inputs to y per substep, `[row][lane]`.
    drive: Aligned,
    /// The next u. It takes turns with that of a chunk.
    activity: Aligned,
}

impl Workspace {
    /// The workspace of chunks with up to `width` vectors per row.
    pub fn new(kernel: &Kernel, width: usize, isa: Isa) -> Self {
        let rows = || Aligned::new(kernel.n_rows() * width * isa.vector_len());
        Self { drive: rows(), activity: rows() }
    }
}

impl Chunk {
    /// A chunk at rest with these `rates`, row by row, for a workspace of chunks with up to
    /// `max_width` vectors per row.
    pub fn new(
        kernel: &Kernel,
        rates: &[f32],
        first_lane: usize,
        width: usize,
        max_width: usize,
        isa: Isa,
    ) -> Self {
        let rows = |width| Aligned::new(kernel.n_rows() * width * isa.vector_len());
        let (mut state, mut activity) = (rows(width), rows(max_width));
        let n_lanes = width * isa.vector_len();
        for (row, y) in state.values_mut().chunks_exact_mut(n_lanes).zip(kernel.starts()) {
            row.fill(y);
        }
        for (row, &u) in activity.values_mut().chunks_exact_mut(n_lanes).zip(rates) {
            row.fill(u);
        }
        Self { first_lane, width, n_lanes, state, activity }
    }

    /// Advances by one environment step with constant `stimuli`, `[input][lane]`.
    pub fn advance(
        &mut self,
        kernel: &Kernel,
        workspace: &mut Workspace,
        stimuli: &Lanes,
        isa: Isa,
    ) {
        match self.width {
            1 => isa.run(Advance::<1> { kernel, chunk: self, workspace, stimuli }),
            2 => isa.run(Advance::<2> { kernel, chunk: self, workspace, stimuli }),
            3 => isa.run(Advance::<3> { kernel, chunk: self, workspace, stimuli }),
            4 => isa.run(Advance::<4> { kernel, chunk: self, workspace, stimuli }),
            5 => isa.run(Advance::<5> { kernel, chunk: self, workspace, stimuli }),
            6 => isa.run(Advance::<6> { kernel, chunk: self, workspace, stimuli }),
            width => unreachable!("{width} vectors are more than max_width"),
        }
    }

    /// Writes the activities of these neurons, `[neuron][lane]`. `rows`: the row of each neuron.
    pub fn write_activity(&self, rows: &[usize], neurons: &[usize], activity: &mut Lanes) {
        for &neuron in neurons {
            let lanes = &self.activity.values()[rows[neuron] * self.n_lanes..][..self.n_lanes];
            activity.row_mut(neuron)[self.first_lane..][..self.n_lanes].copy_from_slice(lanes);
        }
    }
}

/// An environment step of a chunk of W vectors per row.
struct Advance<'a, const W: usize> {
    kernel: &'a Kernel,
    chunk: &'a mut Chunk,
    workspace: &'a mut Workspace,
    stimuli: &'a Lanes,
}

impl<const W: usize> WithSimd for Advance<'_, W> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if const { W > max_width(S::IS_FUSED) } {
            unreachable!("a chunk has at most max_width vectors per row");
        }
        let Self { kernel, chunk, workspace, stimuli } = self;
        perceive::<S, W>(simd, kernel, workspace, stimuli, chunk.first_lane);
        for _ in 0..kernel.n_substeps {
            if W > max_narrow(S::IS_FUSED) {
                integrate_wide::<S, W>(simd, kernel, chunk, workspace);
            } else {
                integrate::<S, W>(simd, kernel, chunk, workspace);
            }
            mem::swap(&mut chunk.activity, &mut workspace.activity);
        }
    }
}

// All vector code is inlined into `with_simd`, which is compiled for the instruction set.
// Closures would not be inlined, hence the plain loops.

/// Drive of this environment step.
#[inline(always)]
fn perceive<S: Simd, const W: usize>(
    simd: S,
    kernel: &Kernel,
    workspace: &mut Workspace,
    stimuli: &Lanes,
    first_lane: usize,
) {
    let (quads, pairs) = split_mut(kernel, rows_mut::<S, W>(workspace.drive.values_mut()));
    perceive_blocks(simd, &kernel.quads, quads, stimuli, first_lane);
    perceive_blocks(simd, &kernel.pairs, pairs, stimuli, first_lane);
}

#[inline(always)]
fn perceive_blocks<S: Simd, const W: usize, const N: usize>(
    simd: S,
    Blocks { blocks, afferent, .. }: &Blocks<N>,
    drives: &mut [[[S::f32s; W]; N]],
    stimuli: &Lanes,
    first_lane: usize,
) {
    for (block, drive) in blocks.iter().zip(drives) {
        let mut sums = [[simd.splat_f32s(0.0); W]; N];
        for (sums, drive) in sums.iter_mut().zip(block.drive) {
            *sums = [simd.splat_f32s(drive); W];
        }
        for coupling in &afferent[block.afferent.clone()] {
            let stimulus = &stimuli.row(coupling.pre)[first_lane..][..W * S::F32_LANES];
            accumulate(simd, &mut sums, coupling, &rows::<S, W>(stimulus)[0]);
        }
        *drive = sums;
    }
}

/// One Euler step, from the chunk's activity to that of the workspace. All of y follows from the
/// previous u.
#[inline(always)]
fn integrate<S: Simd, const W: usize>(
    simd: S,
    kernel: &Kernel,
    chunk: &mut Chunk,
    workspace: &mut Workspace,
) {
    let before = rows::<S, W>(chunk.activity.values());
    let (quads_u, pairs_u) = split_mut(kernel, rows_mut::<S, W>(workspace.activity.values_mut()));
    let (quads_y, pairs_y) = split_mut(kernel, rows_mut::<S, W>(chunk.state.values_mut()));
    let (quads, pairs) = split(kernel, rows::<S, W>(workspace.drive.values()));
    integrate_blocks(simd, &kernel.quads, before, quads, quads_y, quads_u);
    integrate_blocks(simd, &kernel.pairs, before, pairs, pairs_y, pairs_u);
}

#[inline(always)]
fn integrate_blocks<S: Simd, const W: usize, const N: usize>(
    simd: S,
    Blocks { blocks, recurrent, .. }: &Blocks<N>,
    before: &[[S::f32s; W]],
    drives: &[[[S::f32s; W]; N]],
    states: &mut [[[S::f32s; W]; N]],
    after: &mut [[[S::f32s; W]; N]],
) {
    for (((block, y), drive), u) in blocks.iter().zip(states).zip(drives).zip(after) {
        let mut sums = *drive;
        for coupling in &recurrent[block.recurrent.clone()] {
            accumulate(simd, &mut sums, coupling, &before[coupling.pre]);
        }
        for neuron in 0..N {
            let retention = simd.splat_f32s(block.retention[neuron]);
            for vector in 0..W {
                y[neuron][vector] =
                    simd.mul_add_f32s(retention, y[neuron][vector], sums[neuron][vector]);
            }
        }
        squash(simd, block.activation, y, u);
    }
}

/// [`integrate`] for wide rows, neuron by neuron. It multiplies no zeros, and needs few registers:
/// the activities are operands in memory.
#[inline(always)]
fn integrate_wide<S: Simd, const W: usize>(
    simd: S,
    kernel: &Kernel,
    chunk: &mut Chunk,
    workspace: &mut Workspace,
) {
    let before = rows::<S, W>(chunk.activity.values());
    let after = rows_mut::<S, W>(workspace.activity.values_mut()).as_chunks_mut::<2>().0;
    let states = rows_mut::<S, W>(chunk.state.values_mut()).as_chunks_mut::<2>().0;
    let drives = rows::<S, W>(workspace.drive.values()).as_chunks::<2>().0;
    let pairs = kernel.rows.as_chunks::<2>().0.iter();
    for (((pair, y), u), drive) in pairs.zip(states).zip(after).zip(drives) {
        for (row, (y, drive)) in pair.iter().zip(y.iter_mut().zip(drive)) {
            let mut sums = *drive;
            for synapse in &kernel.synapses[row.synapses.clone()] {
                let weight = simd.splat_f32s(synapse.weight);
                for (sum, u) in sums.iter_mut().zip(&before[synapse.pre as usize]) {
                    *sum = simd.mul_add_f32s(weight, *u, *sum);
                }
            }
            let retention = simd.splat_f32s(row.retention);
            for (y, sum) in y.iter_mut().zip(sums) {
                *y = simd.mul_add_f32s(retention, *y, sum);
            }
        }
        squash(simd, pair[0].activation, y, u);
    }
}

/// Adds the contribution of one row to a block.
#[inline(always)]
fn accumulate<S: Simd, const W: usize, const N: usize>(
    simd: S,
    sums: &mut [[S::f32s; W]; N],
    coupling: &Coupling<N>,
    activity: &[S::f32s; W],
) {
    for (sums, weight) in sums.iter_mut().zip(coupling.weights) {
        let weight = simd.splat_f32s(weight);
        for (sum, u) in sums.iter_mut().zip(activity) {
            *sum = simd.mul_add_f32s(weight, *u, *sum);
        }
    }
}

/// Values as rows of W vectors.
#[inline(always)]
fn rows<S: Simd, const W: usize>(values: &[f32]) -> &[[S::f32s; W]] {
    S::as_simd_f32s(values).0.as_chunks().0
}

/// Values as rows of W vectors.
#[inline(always)]
fn rows_mut<S: Simd, const W: usize>(values: &mut [f32]) -> &mut [[S::f32s; W]] {
    S::as_mut_simd_f32s(values).0.as_chunks_mut().0
}

/// The rows of the blocks of four and of two.
#[inline(always)]
fn split<'a, T>(kernel: &Kernel, rows: &'a [T]) -> (&'a [[T; 4]], &'a [[T; 2]]) {
    let (quads, pairs) = rows.split_at(4 * kernel.quads.blocks.len());
    (quads.as_chunks().0, pairs.as_chunks().0)
}

/// The rows of the blocks of four and of two.
#[inline(always)]
fn split_mut<'a, T>(kernel: &Kernel, rows: &'a mut [T]) -> (&'a mut [[T; 4]], &'a mut [[T; 2]]) {
    let (quads, pairs) = rows.split_at_mut(4 * kernel.quads.blocks.len());
    (quads.as_chunks_mut().0, pairs.as_chunks_mut().0)
}
