//! Dynamic synapses (section 4.2 of the thesis): a spike arrives after the delay of its
//! axon, opens receptors of the axon, and these drive a current into every postsynaptic
//! neuron.
//!
//! For each axon: s_ampa = 1 when a spike arrives, else s_ampa -= dt s_ampa / tau, and s_gaba by
//! the same rule; x = 1 when a spike arrives, else x -= dt x / tau_rise, and then s_nmda += dt (0.5
//! x (1 - s_nmda) - s_nmda / tau_decay).
//!
//! For each neuron: I = sum over receptors of gain * (W s) * (E - v), where the term of NMDA is
//! divided by 1 + Mg2 exp(-0.062 v) / 3.57. Without E, the last factor is 1, and -1 for GABA.

use determinism::simd::Simd;

use super::super::aligned::Aligned;
use super::blueprint::links;
use super::circuit::{Weighted, weight};
use super::functions::exp;
use super::row::{Row, vectors, vectors_mut};
use super::subnormal::{bounds, is_tiny, product, risen};
use super::wiring::Wiring;
use crate::blueprint;
use crate::network::Phenotype;
use experiment_file::{SynapseParams, limits};

/// Variables of an axon: s_ampa, s_gaba, x, s_nmda.
const N_VARIABLES: usize = 4;
/// Substeps from one check to the next of whether detours around subnormal numbers save time.
const SUBSTEPS_PER_CHECK: usize = 8;
/// Number of substeps for which spikes are stored: the longest delay.
const N_SLOTS: usize = *limits::DELAYS.end() as usize;

/// Dynamic synapses with the values of a genotype.
#[derive(Debug)]
pub(super) struct Receptors {
    /// Delay per axon, substeps: axons of neurons, then of nodes of encoders.
    delays: Vec<usize>,
    /// Synapses by postsynaptic neuron, one group for each receptor.
    incoming: [Weighted; 3],
    /// Gain and reversal potential of each receptor.
    drives: [(f32, Option<f32>); 3],
    /// Factors of s_ampa, s_gaba and x per substep.
    retention: [f32; 3],
    /// The rise of s_nmda per substep.
    rise: f32,
    decay: f32,
    /// Mg2 / 3.57
    magnesium: f32,
}

/// The state of axons and receptors in a chunk.
#[derive(Debug)]
pub(super) struct ReceptorState {
    /// Number of substeps so far.
    clock: usize,
    /// Spikes of the last substeps, `[slot][axon][lane]`.
    history: Aligned,
    /// `[axon][variable][lane]`
    open: Aligned,
    avoids_subnormals: bool,
    /// Whether any variable was tiny at the last check. A wrong answer costs time, but no bit.
    is_tiny: bool,
    /// Bounds of the variables, up to date while `is_tiny`: `[axon][variable][bound][lane]`.
    enclosed: Aligned,
    /// Bounds of the neurons' currents, up to date while `is_tiny`: `[neuron][bound][lane]`.
    bounds: Aligned,
}

impl Receptors {
    /// The synapses of a genotype; `dt`: ms.
    pub fn new(params: SynapseParams, wiring: &Wiring, phenotype: &Phenotype, dt: f64) -> Self {
        let SynapseParams { ampa, gaba, nmda } = params;
        let drive = |gain: f64, reversal: Option<f64>| (gain as f32, reversal.map(|e| e as f32));
        let left = |tau: f64| (1.0 - dt / tau) as f32;
        // Without a reversal potential, GABA inhibits by a negative gain.
        let gaba_gain = if gaba.reversal.is_some() { gaba.gain } else { -gaba.gain };
        Self {
            delays: phenotype.delays.iter().map(|&delay| delay as usize).collect(),
            incoming: wiring
                .receptive
                .each_ref()
                .map(|synapses| Weighted::new(synapses, phenotype)),
            drives: [
                drive(ampa.gain, ampa.reversal),
                drive(gaba_gain, gaba.reversal),
                drive(nmda.gain, nmda.reversal),
            ],
            retention: [left(ampa.tau), left(gaba.tau), left(nmda.tau_rise)],
            rise: (0.5 * dt) as f32,
            decay: (dt / nmda.tau_decay) as f32,
            magnesium: (nmda.magnesium / 3.57) as f32,
        }
    }

    /// Opens the receptors of axons on which a spike arrives, and closes the others a bit. `spikes`:
    /// of neurons in the previous substep, and of nodes of encoders in this substep.
    #[inline(always)]
    pub fn open<S: Simd, const W: usize>(
        &self,
        simd: S,
        held: &mut ReceptorState,
        spikes: &[[S::f32s; W]],
    ) {
        if held.avoids_subnormals && held.clock.is_multiple_of(SUBSTEPS_PER_CHECK) {
            held.is_tiny = false;
            for &variable in vectors::<S, W>(held.open.values()) {
                held.is_tiny |= is_tiny(Row::new(simd, variable)).is_any();
            }
        }
        if S::IS_FUSED && held.is_tiny {
            self.open_by::<S, W, true>(simd, held, spikes);
        } else {
            self.open_by::<S, W, false>(simd, held, spikes);
        }
        held.clock += 1;
    }

    /// [`open`](Self::open), with detours around subnormal numbers or without.
    #[inline(always)]
    fn open_by<S: Simd, const W: usize, const DETOUR: bool>(
        &self,
        simd: S,
        held: &mut ReceptorState,
        spikes: &[[S::f32s; W]],
    ) {
        let n_axons = spikes.len();
        let history = vectors_mut::<S, W>(held.history.values_mut());
        let slot = |age: usize| (held.clock + N_SLOTS - age) % N_SLOTS * n_axons;
        history[slot(0)..][..n_axons].copy_from_slice(spikes);
        let open = vectors_mut::<S, W>(held.open.values_mut()).as_chunks_mut::<N_VARIABLES>().0;
        let enclosed = vectors_mut::<S, W>(held.enclosed.values_mut());
        let enclosed = enclosed.as_chunks_mut::<2>().0.as_chunks_mut::<N_VARIABLES>().0;
        let one = Row::splat(simd, 1.0);
        let [left_ampa, left_gaba, left_x] = self.retention;
        let rates = [Row::splat(simd, self.rise), Row::splat(simd, self.decay)];
        for (axon, variables) in open.iter_mut().enumerate() {
            // A delay of 1 equals the delay of a static synapse.
            let arrived = Row::new(simd, history[slot(self.delays[axon] - 1) + axon]);
            let spiked = arrived.equals(one);
            let [ampa, gaba, x, nmda] = variables;
            for (variable, left) in [(ampa, left_ampa), (gaba, left_gaba), (&mut *x, left_x)] {
                let (before, left) = (Row::new(simd, *variable), Row::splat(simd, left));
                let closed = product::<S, W, DETOUR>(before, left);
                *variable = spiked.select(one, closed).vectors;
            }
            let (x, s) = (Row::new(simd, *x), Row::new(simd, *nmda));
            *nmda = risen::<S, W, DETOUR>(s, x, rates).vectors;
            if DETOUR {
                for (bounded, &mut variable) in enclosed[axon].iter_mut().zip(variables) {
                    let [low, high] = bounds(Row::new(simd, variable));
                    *bounded = [low.vectors, high.vectors];
                }
            }
        }
    }

    /// Adds the flows through all receptors of a neuron with voltage v to its current. `weights`:
    /// those of plastic synapses, by their number.
    #[inline(always)]
    pub fn add_flows<S: Simd, const W: usize, const PLASTIC: bool>(
        &self,
        simd: S,
        weights: &[[S::f32s; W]],
        held: &ReceptorState,
        at: (usize, Row<S, W>),
        current: Row<S, W>,
    ) -> Row<S, W> {
        let open = vectors::<S, W>(held.open.values()).as_chunks().0.as_chunks().0;
        self.add_flows_of::<S, W, 1, PLASTIC>(simd, weights, open, at, [current])[0]
    }

    /// Bounds the sum of each neuron's current and the flows through its receptors, without
    /// subnormal numbers. [`ReceptorState::bounds_of_current`] gives these bounds.
    #[inline(always)]
    pub fn bound_flows<'a, S: Simd, const W: usize>(
        &self,
        simd: S,
        held: &mut ReceptorState,
        voltages: impl Iterator<Item = &'a [S::f32s; W]>,
        currents: &[[S::f32s; W]],
    ) {
        let open = vectors::<S, W>(held.enclosed.values()).as_chunks().0.as_chunks().0;
        let bounds = vectors_mut::<S, W>(held.bounds.values_mut()).as_chunks_mut::<2>().0;
        for (neuron, ((&v, &current), bounds)) in voltages.zip(currents).zip(bounds).enumerate() {
            let (at, current) = ((neuron, Row::new(simd, v)), Row::new(simd, current));
            let [low, high] =
                self.add_flows_of::<S, W, 2, false>(simd, &[], open, at, [current; 2]);
            *bounds = [low.vectors, high.vectors];
        }
    }

    /// Adds flows. `open`: N values of each variable of each axon, either the exact one or a lower
    /// and an upper bound; likewise `currents`.
    #[inline(always)]
    fn add_flows_of<S: Simd, const W: usize, const N: usize, const PLASTIC: bool>(
        &self,
        simd: S,
        weights: &[[S::f32s; W]],
        open: &[[[[S::f32s; W]; N]; N_VARIABLES]],
        (neuron, v): (usize, Row<S, W>),
        mut currents: [Row<S, W>; N],
    ) -> [Row<S, W>; N] {
        for (receptor, (incoming, (gain, reversal))) in
            self.incoming.iter().zip(self.drives).enumerate()
        {
            let synapses = incoming.synapses_of(neuron);
            if synapses.is_empty() {
                continue;
            }
            // s_ampa, s_gaba, s_nmda: x is between the last two.
            let variable = receptor + usize::from(receptor == 2);
            let mut flows = [Row::splat(simd, 0.0); N];
            for (&(pre, shared), &number) in synapses.iter().zip(incoming.numbers_of(neuron)) {
                let weight = weight::<S, W, PLASTIC>(simd, shared, number, weights);
                let open = &open[pre as usize][variable];
                for (bound, sum) in flows.iter_mut().enumerate() {
                    // A negative weight makes the lower bound from the upper one.
                    let bound = if shared < 0.0 { N - 1 - bound } else { bound };
                    *sum = weight.mul_add(Row::new(simd, open[bound]), *sum);
                }
            }
            for flow in &mut flows {
                *flow = Row::splat(simd, gain) * *flow;
                if let Some(reversal) = reversal {
                    *flow = *flow * (Row::splat(simd, reversal) - v);
                }
                if receptor == 2 {
                    let block = exp(Row::splat(simd, -0.062) * v);
                    let block = Row::splat(simd, self.magnesium) * block;
                    *flow = *flow / (Row::splat(simd, 1.0) + block);
                }
            }
            if N == 2 {
                let [one, other] = [flows[0], flows[N - 1]];
                (flows[0], flows[N - 1]) = (one.min(other), one.max(other));
            }
            for (current, flow) in currents.iter_mut().zip(flows) {
                *current = *current + flow;
            }
        }
        currents
    }
}

impl Receptors {
    /// The synapses as numbers, for postsynaptic neurons up to `n_neurons`.
    pub fn blueprint(self, n_neurons: usize) -> blueprint::Receptors {
        let Self { delays, incoming, drives, retention, rise, decay, magnesium } = self;
        let incoming = incoming.map(|synapses| links(&synapses, n_neurons));
        blueprint::Receptors { delays, incoming, drives, retention, rise, decay, magnesium }
    }
}

impl ReceptorState {
    /// The state with all receptors closed, and no spikes on their way.
    pub fn new(n_axons: usize, n_lanes: usize, avoids_subnormals: bool) -> Self {
        let rows = |n: usize| Aligned::new(n * n_axons * n_lanes);
        let n_bounds = if avoids_subnormals { 2 * N_VARIABLES } else { 0 };
        Self {
            clock: 0,
            history: rows(N_SLOTS),
            open: rows(N_VARIABLES),
            avoids_subnormals,
            is_tiny: false,
            enclosed: rows(n_bounds),
            bounds: rows(if avoids_subnormals { 2 } else { 0 }),
        }
    }

    /// `[axon][variable][lane]`
    #[cfg(test)]
    pub fn variables_mut(&mut self) -> &mut [f32] {
        self.open.values_mut()
    }

    /// A lower and an upper bound of a neuron's current.
    #[inline(always)]
    pub fn bounds_of_current<S: Simd, const W: usize>(
        &self,
        simd: S,
        neuron: usize,
    ) -> [Row<S, W>; 2] {
        let [low, high] = vectors::<S, W>(self.bounds.values()).as_chunks::<2>().0[neuron];
        [Row::new(simd, low), Row::new(simd, high)]
    }

    /// Whether receptors may be subnormal, so that bounds are faster than the flows through them.
    pub fn is_tiny(&self) -> bool {
        self.is_tiny
    }
}
