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
use super::row::Row;
use super::wiring::Wiring;
use crate::blueprint;
use crate::network::Phenotype;
use experiment_file::{SynapseParams, limits};

/// Variables of an axon: s_ampa, s_gaba, x, s_nmda.
const N_VARIABLES: usize = 4;
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

    /// Adds the synaptic currents of a substep. `spikes`: of neurons in the previous substep, and
    /// of nodes of encoders in this substep. `states`: the variables of the neurons, `n_variables`
    /// each, v first. `weights`: those of plastic synapses, by their number.
    #[inline(always)]
    pub fn propagate<S: Simd, const W: usize, const PLASTIC: bool>(
        &self,
        simd: S,
        weights: &[[S::f32s; W]],
        held: &mut ReceptorState,
        spikes: &[[S::f32s; W]],
        (states, n_variables): (&[[S::f32s; W]], usize),
        currents: &mut [[S::f32s; W]],
    ) {
        let n_axons = spikes.len();
        let history: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(held.history.values_mut()).0.as_chunks_mut().0;
        let slot = |age: usize| (held.clock + N_SLOTS - age) % N_SLOTS * n_axons;
        history[slot(0)..][..n_axons].copy_from_slice(spikes);
        let open: &mut [[S::f32s; W]] =
            S::as_mut_simd_f32s(held.open.values_mut()).0.as_chunks_mut().0;
        let open = open.as_chunks_mut::<N_VARIABLES>().0;
        let one = Row::splat(simd, 1.0);
        let [left_ampa, left_gaba, left_x] = self.retention;
        let (rise, decay) = (Row::splat(simd, self.rise), Row::splat(simd, self.decay));
        for (axon, [ampa, gaba, x, nmda]) in open.iter_mut().enumerate() {
            // A delay of 1 equals the delay of a static synapse.
            let arrived = Row::new(simd, history[slot(self.delays[axon] - 1) + axon]);
            let spiked = arrived.equals(one);
            for (variable, left) in [(ampa, left_ampa), (gaba, left_gaba), (&mut *x, left_x)] {
                let closed = Row::new(simd, *variable) * Row::splat(simd, left);
                *variable = spiked.select(one, closed).vectors;
            }
            let (x, s) = (Row::new(simd, *x), Row::new(simd, *nmda));
            *nmda = (s + (rise * x * (one - s) - decay * s)).vectors;
        }
        held.clock += 1;
        for (neuron, current) in currents.iter_mut().enumerate() {
            for (receptor, (incoming, (gain, reversal))) in
                self.incoming.iter().zip(self.drives).enumerate()
            {
                let synapses = incoming.synapses_of(neuron);
                if synapses.is_empty() {
                    continue;
                }
                // s_ampa, s_gaba, s_nmda: x is between the last two.
                let variable = receptor + usize::from(receptor == 2);
                let mut sum = Row::splat(simd, 0.0);
                for (&(pre, shared), &number) in synapses.iter().zip(incoming.numbers_of(neuron)) {
                    let weight = weight::<S, W, PLASTIC>(simd, shared, number, weights);
                    sum = weight.mul_add(Row::new(simd, open[pre as usize][variable]), sum);
                }
                let v = Row::new(simd, states[neuron * n_variables]);
                let mut flow = Row::splat(simd, gain) * sum;
                if let Some(reversal) = reversal {
                    flow = flow * (Row::splat(simd, reversal) - v);
                }
                if receptor == 2 {
                    let block = exp(Row::splat(simd, -0.062) * v);
                    let block = Row::splat(simd, self.magnesium) * block;
                    flow = flow / (one + block);
                }
                *current = (Row::new(simd, *current) + flow).vectors;
            }
        }
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
    pub fn new(n_axons: usize, n_lanes: usize) -> Self {
        let rows = |n: usize| Aligned::new(n * n_axons * n_lanes);
        Self { clock: 0, history: rows(N_SLOTS), open: rows(N_VARIABLES) }
    }
}
