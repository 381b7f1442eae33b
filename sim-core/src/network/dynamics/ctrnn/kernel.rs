//! The inner loops: a network in some vectors of lanes.

use std::mem;
use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::squash;
use crate::lanes::Lanes;
use experiment_file::Activation;
use numeric::Isa;

/// Vectors are aligned to this many bytes: a cache line.
const ALIGNMENT: usize = 64;

/// A network with its weights. Its rows are those of its pairs of neurons, two by
/// two.
#[derive(Debug)]
pub(super) struct Kernel {
    n_substeps: u32,
    /// Neurons.
    pub pairs: Vec<Pair>,
    /// Synapses between neurons, pair by pair.
    pub recurrent: Vec<Coupling>,
    /// Synapses from inputs, pair by pair.
    pub afferent: Vec<Coupling>,
}

/// Two neurons of one activation function.
#[derive(Debug, Clone, Default)]
pub(super) struct Pair {
    /// F
    pub activation: Activation,
    /// y at the start.
    pub start: [f32; 2],
    /// Factor of y in a substep, 1 - r.
    pub retention: [f32; 2],
    /// What the bias adds to y in a substep.
    pub drive: [f32; 2],
    /// Its synapses in `Kernel::recurrent`.
    pub recurrent: Range<usize>,
    /// Its synapses in `Kernel::afferent`.
    pub afferent: Range<usize>,
}

/// Synapses of one row with the two neurons of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling {
    /// Row of the presynaptic neuron or input.
    pub pre: usize,
    /// What its activity adds to y in a substep, per unit; 0 without a synapse.
    pub weights: [f32; 2],
}

impl Kernel {
    /// Without neurons.
    pub fn new(n_substeps: u32) -> Self {
        Self { n_substeps, pairs: Vec::new(), recurrent: Vec::new(), afferent: Vec::new() }
    }
}

/// The state of a network in some neighbouring vectors of lanes.
#[derive(Debug)]
pub(super) struct Chunk {
    first_lane: usize,
    /// Vectors per row.
    width: usize,
    /// y
    state: Rows,
    /// u
    activity: Rows,
    /// What bias and inputs add to y in a substep.
    drive: Rows,
    scratch: Rows,
}

impl Chunk {
    /// At rest.
    pub fn new(kernel: &Kernel, first_lane: usize, width: usize, isa: Isa) -> Self {
        let n_lanes = width * isa.vector_len();
        let rows = || Rows::new(2 * kernel.pairs.len(), n_lanes);
        let (state, activity, drive, scratch) = (rows(), rows(), rows(), rows());
        let mut chunk = Self { first_lane, width, state, activity, drive, scratch };
        let start = kernel.pairs.iter().flat_map(|pair| pair.start);
        for (row, y) in chunk.state.values_mut().chunks_exact_mut(n_lanes).zip(start) {
            row.fill(y);
        }
        chunk.dispatch(isa, kernel, Task::Activate);
        chunk
    }

    /// Number of the first lane.
    pub fn first_lane(&self) -> usize {
        self.first_lane
    }

    /// u of one row, in all lanes of the chunk.
    pub fn activity(&self, row: usize) -> &[f32] {
        self.activity.row(row)
    }

    /// Advances by one environment step, `stimuli` being held: `[input][lane]`.
    pub fn advance(&mut self, kernel: &Kernel, stimuli: &Lanes, isa: Isa) {
        self.dispatch(isa, kernel, Task::Advance(stimuli));
    }

    fn dispatch(&mut self, isa: Isa, kernel: &Kernel, task: Task<'_>) {
        match self.width {
            1 => isa.run(Work::<1> { kernel, chunk: self, task }),
            2 => isa.run(Work::<2> { kernel, chunk: self, task }),
            3 => isa.run(Work::<3> { kernel, chunk: self, task }),
            4 => isa.run(Work::<4> { kernel, chunk: self, task }),
            width => unreachable!("{width} vectors are more than MAX_CHUNK_WIDTH"),
        }
    }
}

/// What there is to do.
enum Task<'a> {
    /// u = F(y).
    Activate,
    /// An environment step with these stimuli.
    Advance(&'a Lanes),
}

/// A task for a chunk of W vectors per row.
struct Work<'a, const W: usize> {
    kernel: &'a Kernel,
    chunk: &'a mut Chunk,
    task: Task<'a>,
}

impl<const W: usize> WithSimd for Work<'_, W> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        match self.task {
            Task::Activate => self.activate(simd),
            Task::Advance(stimuli) => {
                self.perceive(simd, stimuli);
                for _ in 0..self.kernel.n_substeps {
                    self.integrate(simd);
                    mem::swap(&mut self.chunk.activity, &mut self.chunk.scratch);
                }
            }
        }
    }
}

// All that touches vectors is inlined into `with_simd`, which is compiled for the
// vectors' instruction set; closures would not be, hence the plain loops.
impl<const W: usize> Work<'_, W> {
    /// u = F(y).
    #[inline(always)]
    fn activate<S: Simd>(self, simd: S) {
        let states = self.chunk.state.pairs::<S, W>();
        let activities = self.chunk.activity.pairs_mut::<S, W>();
        for ((pair, y), u) in self.kernel.pairs.iter().zip(states).zip(activities) {
            squash(simd, pair.activation, y, u);
        }
    }

    /// Drive of this environment step.
    #[inline(always)]
    fn perceive<S: Simd>(&mut self, simd: S, stimuli: &Lanes) {
        let first_lane = self.chunk.first_lane;
        let drives = self.chunk.drive.pairs_mut::<S, W>();
        for (pair, drive) in self.kernel.pairs.iter().zip(drives) {
            let mut sums = [[simd.splat_f32s(0.0); W]; 2];
            for (sums, drive) in sums.iter_mut().zip(pair.drive) {
                *sums = [simd.splat_f32s(drive); W];
            }
            for coupling in &self.kernel.afferent[pair.afferent.clone()] {
                let stimulus = &stimuli.row(coupling.pre)[first_lane..][..W * S::F32_LANES];
                accumulate(simd, &mut sums, coupling, &vectors::<S, W>(stimulus)[0]);
            }
            *drive = sums;
        }
    }

    /// One Euler step, from `activity` to `scratch`. All of y is computed from the
    /// u before it.
    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S) {
        let before = vectors::<S, W>(self.chunk.activity.values());
        let after = self.chunk.scratch.pairs_mut::<S, W>();
        let states = self.chunk.state.pairs_mut::<S, W>();
        let drives = self.chunk.drive.pairs::<S, W>();
        for (((pair, y), drive), u) in self.kernel.pairs.iter().zip(states).zip(drives).zip(after) {
            let mut sums = *drive;
            for coupling in &self.kernel.recurrent[pair.recurrent.clone()] {
                accumulate(simd, &mut sums, coupling, &before[coupling.pre]);
            }
            for half in 0..2 {
                let retention = simd.splat_f32s(pair.retention[half]);
                for vector in 0..W {
                    y[half][vector] =
                        simd.mul_add_f32s(retention, y[half][vector], sums[half][vector]);
                }
            }
            squash(simd, pair.activation, y, u);
        }
    }
}

/// Adds what one row does to a pair.
#[inline(always)]
fn accumulate<S: Simd, const W: usize>(
    simd: S,
    sums: &mut [[S::f32s; W]; 2],
    coupling: &Coupling,
    activity: &[S::f32s; W],
) {
    for (sums, weight) in sums.iter_mut().zip(coupling.weights) {
        let weight = simd.splat_f32s(weight);
        for (sum, u) in sums.iter_mut().zip(activity) {
            *sum = simd.mul_add_f32s(weight, *u, *sum);
        }
    }
}

/// u = F(y) of a pair.
#[inline(always)]
fn squash<S: Simd, const W: usize>(
    simd: S,
    activation: Activation,
    y: &[[S::f32s; W]; 2],
    u: &mut [[S::f32s; W]; 2],
) {
    match activation {
        Activation::Sigmoid => {
            for vector in 0..W {
                [u[0][vector], u[1][vector]] = squash::sigmoid(simd, y[0][vector], y[1][vector]);
            }
        }
        Activation::Tanh => {
            for vector in 0..W {
                [u[0][vector], u[1][vector]] = squash::tanh(simd, y[0][vector], y[1][vector]);
            }
        }
    }
}

/// As groups of W vectors.
#[inline(always)]
fn vectors<S: Simd, const W: usize>(values: &[f32]) -> &[[S::f32s; W]] {
    S::as_simd_f32s(values).0.as_chunks::<W>().0
}

/// A matrix `[row][lane]` of whole, aligned vectors.
#[derive(Debug)]
struct Rows {
    n_lanes: usize,
    /// Where the matrix starts in `memory`.
    start: usize,
    len: usize,
    memory: Vec<f32>,
}

impl Rows {
    /// All zero.
    fn new(n_rows: usize, n_lanes: usize) -> Self {
        let len = n_rows * n_lanes;
        let memory = vec![0.0; len + ALIGNMENT / size_of::<f32>()];
        let start = memory.as_ptr().align_offset(ALIGNMENT).min(memory.len() - len);
        Self { n_lanes, start, len, memory }
    }

    fn row(&self, row: usize) -> &[f32] {
        &self.values()[row * self.n_lanes..][..self.n_lanes]
    }

    #[inline(always)]
    fn values(&self) -> &[f32] {
        &self.memory[self.start..][..self.len]
    }

    #[inline(always)]
    fn values_mut(&mut self) -> &mut [f32] {
        &mut self.memory[self.start..][..self.len]
    }

    /// Pairs of rows of W vectors.
    #[inline(always)]
    fn pairs<S: Simd, const W: usize>(&self) -> &[[[S::f32s; W]; 2]] {
        vectors::<S, W>(self.values()).as_chunks().0
    }

    /// Pairs of rows of W vectors.
    #[inline(always)]
    fn pairs_mut<S: Simd, const W: usize>(&mut self) -> &mut [[[S::f32s; W]; 2]] {
        let vectors = S::as_mut_simd_f32s(self.values_mut()).0;
        vectors.as_chunks_mut::<W>().0.as_chunks_mut().0
    }
}
