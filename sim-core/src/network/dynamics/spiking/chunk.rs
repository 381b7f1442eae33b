//! Computes the network in some vectors of lanes, substep by substep: synapses, then neurons.

use determinism::simd::{Simd, WithSimd};

use super::super::aligned::Aligned;
use super::super::learning::Memory;
use super::super::{Inputs, SpikeWindow};
use super::circuit::{Circuit, Filter, weight};
use super::encoding::EncoderState;
use super::model::Model;
use super::neurons::Neurons;
use super::receptors::{ReceptorState, Receptors};
use super::row::{Mask, Row, vectors, vectors_mut};
use super::subnormal::{agree, is_tiny, product, risen};
use crate::lanes::Lanes;
use determinism::Isa;

/// Vectors in step, at most: enough to hide the latency of a model's equations.
const MAX_WIDTH: usize = 4;
/// Lanes of a chunk, at most: a neuron that spikes in one of them costs time in all of them.
const MAX_LANES: usize = 32;

/// Vectors per row of a chunk, at most. With plasticity, the weights of each lane take most of its
/// memory, so it has one.
pub(super) fn max_width(isa: Isa, is_plastic: bool) -> usize {
    if is_plastic { 1 } else { max_width_of(isa.vector_len(), isa.is_fused()) }
}

/// The same for an instruction set. Without fused multiply-adds, it is one: the code of wider rows
/// would be a tenth of a program for browsers.
const fn max_width_of(vector_len: usize, is_fused: bool) -> usize {
    let fitting = MAX_LANES / vector_len;
    if !is_fused {
        1
    } else if fitting < MAX_WIDTH {
        fitting
    } else {
        MAX_WIDTH
    }
}

/// A stage of a step in W vectors per row. Instruction sets with narrower rows have no code of it.
struct InRows<Stage, const W: usize>(Stage);

impl<Stage: WithSimd, const W: usize> WithSimd for InRows<Stage, W> {
    type Output = Stage::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        if const { W > max_width_of(S::F32_LANES, S::IS_FUSED) } {
            unreachable!("a chunk has at most max_width vectors per row");
        }
        self.0.with_simd(simd)
    }
}

/// The state of a network in some neighbouring vectors of lanes.
#[derive(Debug)]
pub(super) struct Chunk {
    first_lane: usize,
    /// Vectors per row.
    width: usize,
    /// Lanes per row.
    n_lanes: usize,
    /// State variables of a neuron.
    n_variables: usize,
    /// `[neuron][variable][lane]`
    state: Aligned,
    /// 1 if a neuron spiked in the previous substep, or if a node of an encoder spikes in this
    /// substep, else 0: `[neuron, then node][lane]`.
    spikes: Aligned,
    /// The neurons and nodes with a spike in any lane.
    active: Active,
    /// Contribution of stimuli to the current, `[neuron][lane]`.
    drive: Aligned,
    /// `[neuron][lane]`
    current: Aligned,
    /// Whether decoders' filters take detours around subnormal numbers.
    avoids_subnormals: bool,
    /// The state of dynamic synapses.
    receptors: Option<ReceptorState>,
    encoders: EncoderState,
    /// Plastic weights; `None` if all lanes share the weights.
    memory: Option<Memory>,
    /// Spikes in the environment step, `[neuron, then node][lane]`.
    counts: Aligned,
    /// The substep of the first spike, `[timed neuron][lane]`.
    first: Aligned,
    /// x and a of the filter, `[filtered neuron][variable][lane]`.
    filter: Aligned,
}

/// Spike sources, ascending.
#[derive(Debug)]
struct Active {
    /// The first `n` of these, and scratch.
    sources: Vec<usize>,
    n: usize,
}

impl Active {
    /// No source of `n_sources`.
    fn new(n_sources: usize) -> Self {
        Self { sources: vec![0; n_sources + 1], n: 0 }
    }

    /// Adds a source if it is active. The outcome is unpredictable, so the code has no branch.
    #[inline(always)]
    fn push_if(&mut self, is_active: bool, source: usize) {
        self.sources[self.n] = source;
        self.n += usize::from(is_active);
    }
}

impl Chunk {
    /// A chunk at rest.
    pub fn new<M: Model<C, Z>, const C: usize, const Z: usize>(
        circuit: &Circuit,
        neurons: &Neurons<M, C, Z>,
        first_lane: usize,
        width: usize,
        isa: Isa,
    ) -> Self {
        let n_lanes = width * isa.vector_len();
        let rows = |n: usize| Aligned::new(n * n_lanes);
        let (n_neurons, n_sources) = (circuit.n_neurons, circuit.n_sources());
        // Plastic weights have no detours: the sign of such a weight differs between lanes.
        let has_detours = isa.avoids_subnormals() && circuit.rule.is_none();
        let mut chunk = Self {
            first_lane,
            width,
            n_lanes,
            n_variables: Z,
            state: rows(n_neurons * Z),
            spikes: rows(n_sources),
            active: Active::new(n_sources),
            drive: rows(n_neurons),
            current: rows(n_neurons),
            avoids_subnormals: isa.avoids_subnormals(),
            receptors: circuit
                .receptors
                .as_ref()
                .map(|_| ReceptorState::new(n_sources, n_lanes, has_detours)),
            encoders: EncoderState::new(&circuit.encoders, n_lanes),
            memory: circuit.rule.as_ref().map(|rule| Memory::new(rule, n_lanes)),
            counts: rows(n_sources),
            first: rows(circuit.timed.len()),
            filter: rows(circuit.filtered.len() * 2),
        };
        let starts = neurons.starts.iter().flatten();
        for (row, &start) in chunk.state.values_mut().chunks_exact_mut(n_lanes).zip(starts) {
            row.fill(start);
        }
        chunk.first.values_mut().fill(circuit.n_substeps as f32);
        chunk
    }

    /// Advances by one environment step.
    pub fn advance<M: Model<C, Z>, const C: usize, const Z: usize>(
        &mut self,
        circuit: &Circuit,
        neurons: &Neurons<M, C, Z>,
        inputs: Inputs<'_>,
        isa: Isa,
    ) {
        match self.width {
            1 if circuit.rule.is_some() => {
                self.step::<M, C, Z, 1, true>(circuit, neurons, inputs, isa);
            }
            1 => self.step::<M, C, Z, 1, false>(circuit, neurons, inputs, isa),
            2 => self.step::<M, C, Z, 2, false>(circuit, neurons, inputs, isa),
            3 => self.step::<M, C, Z, 3, false>(circuit, neurons, inputs, isa),
            4 => self.step::<M, C, Z, 4, false>(circuit, neurons, inputs, isa),
            width => unreachable!("{width} vectors are more than MAX_WIDTH"),
        }
    }

    /// One environment step with W vectors per row; with PLASTIC, weights change.
    fn step<M: Model<C, Z>, const C: usize, const Z: usize, const W: usize, const PLASTIC: bool>(
        &mut self,
        circuit: &Circuit,
        neurons: &Neurons<M, C, Z>,
        inputs: Inputs<'_>,
        isa: Isa,
    ) {
        isa.run(InRows::<_, W>(Perceive::<W, PLASTIC> { circuit, chunk: self, inputs }));
        for substep in 0..circuit.n_substeps {
            let draws = inputs.draws;
            let propagate = Propagate::<W, PLASTIC> { circuit, chunk: self, draws, substep };
            isa.run(InRows::<_, W>(propagate));
            let is_tiny = self.receptors.as_ref().is_some_and(ReceptorState::is_tiny);
            if is_tiny && isa.is_fused() {
                let integrate = Integrate::<_, C, Z, W, true> { circuit, neurons, chunk: self };
                isa.run(InRows::<_, W>(integrate));
            } else {
                let integrate = Integrate::<_, C, Z, W, false> { circuit, neurons, chunk: self };
                isa.run(InRows::<_, W>(integrate));
            }
            isa.run(InRows::<_, W>(Listen::<W> { circuit, chunk: self, substep }));
        }
        if PLASTIC && let (Some(rule), Some(memory)) = (&circuit.rule, &mut self.memory) {
            let share = 1.0 / circuit.n_substeps as f32;
            rule.remember(memory, self.counts.values(), share, inputs.stimuli, self.first_lane);
        }
    }

    /// Writes the share of substeps in which these neurons spiked, `[neuron][lane]`.
    pub fn write_activity(&self, circuit: &Circuit, neurons: &[usize], activity: &mut Lanes) {
        let n_substeps = circuit.n_substeps as f32;
        for &neuron in neurons {
            let counts = &self.counts.values()[neuron * self.n_lanes..][..self.n_lanes];
            let row = &mut activity.row_mut(neuron)[self.first_lane..][..self.n_lanes];
            for (share, count) in row.iter_mut().zip(counts) {
                *share = count / n_substeps;
            }
        }
    }

    /// Writes the data of motor neurons for decoders.
    pub fn write_window(&self, circuit: &Circuit, window: &mut SpikeWindow) {
        let n_lanes = self.n_lanes;
        let write = |lanes: &mut Lanes, neuron: usize, values: &[f32]| {
            lanes.row_mut(neuron)[self.first_lane..][..n_lanes].copy_from_slice(values);
        };
        let first = self.first.values().chunks_exact(n_lanes);
        for (&neuron, first) in circuit.timed.iter().zip(first) {
            let counts = &self.counts.values()[neuron * n_lanes..][..n_lanes];
            write(&mut window.counts, neuron, counts);
            write(&mut window.first, neuron, first);
        }
        let filter = self.filter.values().chunks_exact(2 * n_lanes);
        for (&neuron, variables) in circuit.filtered.iter().zip(filter) {
            write(&mut window.filtered, neuron, &variables[n_lanes..]);
        }
    }

    /// Writes the voltage of each neuron, mV, `[neuron][lane]`.
    pub fn write_voltages(&self, voltages: &mut Lanes) {
        let neurons = self.state.values().chunks_exact(self.n_variables * self.n_lanes);
        for (neuron, state) in neurons.enumerate() {
            let row = &mut voltages.row_mut(neuron)[self.first_lane..][..self.n_lanes];
            row.copy_from_slice(&state[..self.n_lanes]);
        }
    }
}

// The stages of a step are compiled separately for each instruction set: neurons for each model,
// everything else once. All vector code is inlined into `with_simd`, which is compiled for the
// instruction set. Closures would not be inlined, hence the plain loops.

/// The start of an environment step, in W vectors per row: computes the contribution of stimuli
/// to currents. With PLASTIC, weights learn from the previous step. Resets the spikes.
struct Perceive<'a, const W: usize, const PLASTIC: bool> {
    circuit: &'a Circuit,
    chunk: &'a mut Chunk,
    inputs: Inputs<'a>,
}

impl<const W: usize, const PLASTIC: bool> WithSimd for Perceive<'_, W, PLASTIC> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { circuit, chunk, inputs: Inputs { stimuli, rewards, .. } } = self;
        let n_lanes = W * S::F32_LANES;
        if PLASTIC && let (Some(rule), Some(memory)) = (&circuit.rule, &mut chunk.memory) {
            let rewards = &rewards.row(0)[chunk.first_lane..][..n_lanes];
            rule.learn::<S, W>(simd, memory, rewards);
        }
        let drives = vectors_mut::<S, W>(chunk.drive.values_mut());
        let plastic = chunk.memory.as_ref().map_or(&[][..], Memory::weights);
        let plastic = vectors::<S, W>(plastic);
        for (neuron, drive) in drives.iter_mut().enumerate() {
            let mut sum = Row::splat(simd, 0.0);
            let numbers = circuit.afferent.numbers_of(neuron);
            for (&(input, shared), &number) in
                circuit.afferent.synapses_of(neuron).iter().zip(numbers)
            {
                let weight = weight::<S, W, PLASTIC>(simd, shared, number, plastic);
                let stimulus = &stimuli.row(input as usize)[chunk.first_lane..][..n_lanes];
                sum = weight.mul_add(Row::new(simd, vectors::<S, W>(stimulus)[0]), sum);
            }
            *drive = sum.vectors;
        }
        let lanes = chunk.first_lane..chunk.first_lane + n_lanes;
        circuit.encoders.perceive::<S, W>(simd, &mut chunk.encoders, stimuli, lanes);
        chunk.counts.values_mut().fill(0.0);
        chunk.first.values_mut().fill(circuit.n_substeps as f32);
    }
}

/// Computes the spikes of encoders' nodes in a substep, and the current of every neuron from
/// these and from the neurons' spikes in the previous substep. It only bounds currents through tiny
/// receptors.
struct Propagate<'a, const W: usize, const PLASTIC: bool> {
    circuit: &'a Circuit,
    chunk: &'a mut Chunk,
    draws: &'a Lanes,
    substep: u32,
}

impl<const W: usize, const PLASTIC: bool> WithSimd for Propagate<'_, W, PLASTIC> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { circuit, chunk, draws, substep } = self;
        if circuit.encoders.n_nodes() > 0 {
            encode::<S, W>(simd, circuit, chunk, draws, substep);
        }
        chunk.current.values_mut().copy_from_slice(chunk.drive.values());
        let currents = vectors_mut::<S, W>(chunk.current.values_mut());
        let spikes = vectors::<S, W>(chunk.spikes.values());
        let plastic = chunk.memory.as_ref().map_or(&[][..], Memory::weights);
        let plastic = vectors::<S, W>(plastic);
        for &pre in &chunk.active.sources[..chunk.active.n] {
            let numbers = circuit.outgoing.numbers_of(pre);
            for (&(post, shared), &number) in circuit.outgoing.synapses_of(pre).iter().zip(numbers)
            {
                let weight = weight::<S, W, PLASTIC>(simd, shared, number, plastic);
                let current = &mut currents[post as usize];
                let spikes = Row::new(simd, spikes[pre]);
                *current = weight.mul_add(spikes, Row::new(simd, *current)).vectors;
            }
        }
        if let (Some(receptors), Some(held)) = (&circuit.receptors, &mut chunk.receptors) {
            receptors.open::<S, W>(simd, held, spikes);
            let states = vectors::<S, W>(chunk.state.values());
            if S::IS_FUSED && !PLASTIC && held.is_tiny() {
                let voltages = states.iter().step_by(chunk.n_variables);
                receptors.bound_flows::<S, W>(simd, held, voltages, currents);
                return;
            }
            for (neuron, current) in currents.iter_mut().enumerate() {
                let at = (neuron, Row::new(simd, states[neuron * chunk.n_variables]));
                let before = Row::new(simd, *current);
                let after = receptors.add_flows::<S, W, PLASTIC>(simd, plastic, held, at, before);
                *current = after.vectors;
            }
        }
    }
}

#[inline(always)]
fn encode<S: Simd, const W: usize>(
    simd: S,
    circuit: &Circuit,
    chunk: &mut Chunk,
    draws: &Lanes,
    substep: u32,
) {
    let lanes = chunk.first_lane..chunk.first_lane + W * S::F32_LANES;
    let n_neurons = circuit.n_neurons;
    let spikes = &mut vectors_mut::<S, W>(chunk.spikes.values_mut())[n_neurons..];
    circuit.encoders.encode::<S, W>(simd, &mut chunk.encoders, draws, lanes, substep, spikes);
    let none = Row::splat(simd, 0.5);
    let counts = &mut vectors_mut::<S, W>(chunk.counts.values_mut())[n_neurons..];
    for ((node, spikes), counts) in spikes.iter().enumerate().zip(counts) {
        let spikes = Row::new(simd, *spikes);
        *counts = (Row::new(simd, *counts) + spikes).vectors;
        chunk.active.push_if(spikes.exceeds(none).is_any(), n_neurons + node);
    }
}

/// One Euler step of every neuron. If TINY, their currents lack those through receptors, which may
/// be subnormal.
struct Integrate<'a, M, const C: usize, const Z: usize, const W: usize, const TINY: bool> {
    circuit: &'a Circuit,
    neurons: &'a Neurons<M, C, Z>,
    chunk: &'a mut Chunk,
}

impl<M: Model<C, Z>, const C: usize, const Z: usize, const W: usize, const TINY: bool> WithSimd
    for Integrate<'_, M, C, Z, W, TINY>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if const { TINY && !S::IS_FUSED } {
            unreachable!("without fused multiply-adds, there are no detours");
        }
        let Self { circuit, neurons, chunk } = self;
        let (zero, one) = (Row::splat(simd, 0.0), Row::splat(simd, 1.0));
        let states = vectors_mut::<S, W>(chunk.state.values_mut()).as_chunks_mut::<Z>().0;
        let currents = vectors::<S, W>(chunk.current.values());
        let spikes = vectors_mut::<S, W>(chunk.spikes.values_mut());
        let counts = vectors_mut::<S, W>(chunk.counts.values_mut());
        chunk.active.n = 0;
        for (neuron, constants) in neurons.constants.iter().enumerate() {
            let mut splat = [zero; C];
            for (splat, &constant) in splat.iter_mut().zip(constants) {
                *splat = Row::splat(simd, constant);
            }
            let mut state = [zero; Z];
            for (value, &vectors) in state.iter_mut().zip(&states[neuron]) {
                *value = Row::new(simd, vectors);
            }
            let current = Row::new(simd, currents[neuron]);
            let (state, spiked) = if TINY
                && let (Some(receptors), Some(held)) = (&circuit.receptors, &chunk.receptors)
            {
                update_by_bounds::<S, M, C, Z, W>(receptors, held, neuron, splat, state, current)
            } else {
                M::update(splat, state, current)
            };
            for (vectors, value) in states[neuron].iter_mut().zip(state) {
                *vectors = value.vectors;
            }
            let spike = spiked.select(one, zero);
            spikes[neuron] = spike.vectors;
            counts[neuron] = (Row::new(simd, counts[neuron]) + spike).vectors;
            chunk.active.push_if(spiked.is_any(), neuron);
        }
    }
}

/// One Euler step of a neuron with a current and flows through its receptors. Computes the step
/// from two bounds of their sum, and only if these disagree about any lane, from the sum itself.
#[inline(always)]
fn update_by_bounds<S: Simd, M: Model<C, Z>, const C: usize, const Z: usize, const W: usize>(
    receptors: &Receptors,
    held: &ReceptorState,
    neuron: usize,
    constants: [Row<S, W>; C],
    state: [Row<S, W>; Z],
    current: Row<S, W>,
) -> ([Row<S, W>; Z], Mask<S, W>) {
    let (simd, at) = (current.simd, (neuron, state[0]));
    let [low, high] = held.bounds_of_current(simd, neuron);
    let (mut currents, mut is_exact) = ([low, high], false);
    // The sum takes the place of its bounds: a third copy of the model's equations would only take
    // a compiler's time.
    loop {
        let (from_low, low_spiked) = M::update(constants, state, currents[0]);
        let (from_high, high_spiked) = M::update(constants, state, currents[1]);
        let is_decided = agree([from_low[0], from_high[0]]).and(low_spiked.equals(high_spiked));
        if is_exact || is_decided.is_all() {
            return (from_low, low_spiked);
        }
        currents = [receptors.add_flows::<S, W, false>(simd, &[], held, at, current); 2];
        is_exact = true;
    }
}

/// Updates the decoders' data of motor neurons.
struct Listen<'a, const W: usize> {
    circuit: &'a Circuit,
    chunk: &'a mut Chunk,
    substep: u32,
}

impl<const W: usize> WithSimd for Listen<'_, W> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { circuit, chunk, substep } = self;
        let one = Row::splat(simd, 1.0);
        let retention = Row::splat(simd, circuit.filter.retention);
        let Filter { rise, decay, .. } = circuit.filter;
        let rates = [Row::splat(simd, rise), Row::splat(simd, decay)];
        let now = Row::splat(simd, substep as f32);
        let spikes = vectors::<S, W>(chunk.spikes.values());
        let first = vectors_mut::<S, W>(chunk.first.values_mut());
        for (&neuron, first) in circuit.timed.iter().zip(first) {
            let spiked = Row::new(simd, spikes[neuron]).equals(one);
            let before = Row::new(simd, *first);
            *first = spiked.select(before.min(now), before).vectors;
        }
        let filter = vectors_mut::<S, W>(chunk.filter.values_mut()).as_chunks_mut::<2>().0;
        for (&neuron, filtered) in circuit.filtered.iter().zip(filter) {
            let spiked = Row::new(simd, spikes[neuron]).equals(one);
            let (x, a) = (Row::new(simd, filtered[0]), Row::new(simd, filtered[1]));
            let [x, a] = if S::IS_FUSED && chunk.avoids_subnormals && is_tiny(x.min(a)).is_any() {
                let x = spiked.select(one, product::<S, W, true>(x, retention));
                [x, risen::<S, W, true>(a, x, rates)]
            } else {
                let x = spiked.select(one, product::<S, W, false>(x, retention));
                [x, risen::<S, W, false>(a, x, rates)]
            };
            *filtered = [x.vectors, a.vectors];
        }
    }
}

#[cfg(test)]
mod tests;
