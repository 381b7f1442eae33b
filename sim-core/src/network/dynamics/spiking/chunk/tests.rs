//! Two bounds of a current decide only what the current itself would.

use determinism::random::{Purpose, Stream};

use super::super::adex::AdEx;
use super::super::exp_lif::ExpLif;
use super::super::izhikevich::Izhikevich;
use super::super::lif::Lif;
use super::super::morris_lecar::MorrisLecar;
use super::super::tests::{compiled, dynamic};
use super::*;
use crate::network::dynamics::Wiring;
use experiment_file::NeuronModel;

/// Lanes of the longest vector.
const N_LANES: usize = 16;

/// A power of two with this range of exponents, times a number in \[1, 2).
fn magnitude(stream: &mut Stream, exponents: std::ops::Range<i32>) -> f32 {
    let exponent = exponents.start + stream.below(exponents.len()) as i32;
    (libm::exp2(f64::from(exponent)) * (1.0 + stream.uniform())) as f32
}

/// The next states of LIF neurons, from bounds and from exact currents.
struct BothWays<'a> {
    circuit: &'a Circuit,
    /// `[axon][variable][lane]`, for `N_LANES` lanes.
    open: &'a [f32],
    /// Per lane.
    voltages: &'a [f32; N_LANES],
    rate: f32,
    rest: f32,
    threshold: f32,
}

impl WithSimd for BothWays<'_> {
    type Output = [Vec<u32>; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { circuit, open, voltages, rate, rest, threshold } = self;
        let receptors = circuit.receptors.as_ref().unwrap();
        let n_axons = circuit.n_sources();
        let mut held = ReceptorState::new(n_axons, S::F32_LANES, true);
        let rows = held.variables_mut().chunks_exact_mut(S::F32_LANES);
        for (row, open) in rows.zip(open.chunks_exact(N_LANES)) {
            row.copy_from_slice(&open[..S::F32_LANES]);
        }
        let zero = Row::splat(simd, 0.0);
        receptors.open::<S, 1>(simd, &mut held, &vec![zero.vectors; n_axons]);
        assert!(held.is_tiny());
        let constants = [rate, rest, 1.0, threshold, 3.0].map(|x| Row::<S, 1>::splat(simd, x));
        let v = Row::new(simd, vectors::<S, 1>(&voltages[..S::F32_LANES])[0]);
        let mut results = [Vec::new(), Vec::new()];
        let n_neurons = circuit.n_neurons;
        let (voltages, currents) = (vec![v.vectors; n_neurons], vec![zero.vectors; n_neurons]);
        receptors.bound_flows::<S, 1>(simd, &mut held, voltages.iter(), &currents);
        for neuron in 0..n_neurons {
            let state = [v, zero];
            let by_bounds = update_by_bounds::<S, Lif, 5, 2, 1>(
                receptors, &held, neuron, constants, state, zero,
            );
            let sum = receptors.add_flows::<S, 1, false>(simd, &[], &held, (neuron, v), zero);
            let exactly = Lif::update(constants, state, sum);
            for (result, (state, spiked)) in results.iter_mut().zip([by_bounds, exactly]) {
                for row in [state[0], state[1], spiked.as_numbers()] {
                    let lanes: &[u32] = determinism::simd::bytemuck::cast_slice(&row.vectors);
                    result.extend(lanes);
                }
            }
        }
        results
    }
}

/// How the numbers of a case are drawn. In all kinds but the first, all receptors are tiny.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Any receptors, voltages and thresholds.
    Mixed,
    /// Weights of 1 and -1, whose bounds cancel if their order is wrong.
    Cancelling,
    /// Voltages at rest, just below the threshold: a spike does not change them.
    AtThreshold,
    /// Weights so small that a voltage of 0 keeps its value, but not its sign.
    Vanishing,
}

/// A state of a receptor.
fn receptor(stream: &mut Stream, kind: Kind) -> f32 {
    match stream.below(if kind == Kind::Mixed { 5 } else { 3 }) {
        0 => 0.0,
        1 => f32::from_bits(stream.below(200) as u32),
        2 => magnitude(stream, -148..-100),
        3 => magnitude(stream, -104..-96),
        _ => magnitude(stream, -90..-1),
    }
}

/// Voltages and thresholds are as small as the currents, so that these count.
#[test]
fn bounds_of_currents_decide_only_what_is_certain() {
    use Kind::{AtThreshold, Cancelling, Mixed, Vanishing};
    let mut stream = Stream::new(1, 0_u64, 0, Purpose::Script, 0);
    for case in 0..2_000 {
        let kind = [Mixed, Cancelling, AtThreshold, Vanishing][case % 4];
        let mut config = dynamic(NeuronModel::Lif);
        let params = config.topology.synapse_params.as_mut().unwrap();
        (params.ampa.reversal, params.gaba.reversal) = (None, None);
        // NMDA has a factor that keeps its flow from cancelling that of AMPA and GABA.
        (params.ampa.gain, params.gaba.gain, params.nmda.gain) = (1.0, 1.0, (case / 4 % 2) as f64);
        let (network, mut phenotype) = compiled(&config);
        let Wiring::Spiking(wiring) = network.wiring() else { unreachable!("LIF neurons spike") };
        for weight in &mut phenotype.weights {
            let (signs, scale) = ([1.0, -1.0, 0.5, -0.7], libm::exp2(-49.0));
            *weight = match kind {
                Mixed => signs[stream.below(4)],
                Cancelling | AtThreshold => signs[stream.below(2)],
                Vanishing => signs[stream.below(2)] * scale,
            };
        }
        let circuit = Circuit::compile(&network, wiring, &phenotype);
        let n_open = circuit.n_sources() * 4 * N_LANES;
        let open: Vec<f32> = (0..n_open).map(|_| receptor(&mut stream, kind)).collect();
        let rest = if kind == AtThreshold { magnitude(&mut stream, -105..-95) } else { 0.0 };
        let voltages = std::array::from_fn(|_| match kind {
            AtThreshold => rest,
            Vanishing => 0.0,
            Mixed if stream.below(8) == 0 => 0.0,
            Mixed | Cancelling => magnitude(&mut stream, -130..-60) * [1.0, -1.0][stream.below(2)],
        });
        let rate = if kind == Vanishing { 0.01 } else { 0.1 };
        let threshold = match kind {
            AtThreshold => rest * 1.001,
            _ => magnitude(&mut stream, -125..-80),
        };
        for isa in Isa::available().into_iter().filter(|isa| isa.is_fused()) {
            let (circuit, open, voltages) = (&circuit, &open, &voltages);
            let [by_bounds, exactly] =
                isa.run(BothWays { circuit, open, voltages, rate, rest, threshold });
            assert!(by_bounds == exactly, "{isa}, case {case}");
        }
    }
}

/// The bits of a state after three currents, and of the spikes.
struct After<'a, M, const C: usize, const Z: usize> {
    neurons: &'a Neurons<M, C, Z>,
    neuron: usize,
    state: [f32; Z],
    currents: &'a [f32; 3],
}

impl<M: Model<C, Z>, const C: usize, const Z: usize> WithSimd for After<'_, M, C, Z> {
    type Output = [Vec<u32>; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { neurons, neuron, state, currents } = self;
        let constants = neurons.constants[neuron];
        let row = |x| Row::<S, 1>::splat(simd, x);
        currents.map(|current| {
            let (state, spiked) = M::update(constants.map(row), state.map(row), row(current));
            let bits = |row: Row<S, 1>| {
                let lanes: &[u32] = determinism::simd::bytemuck::cast_slice(&row.vectors);
                lanes[0]
            };
            state.into_iter().chain([spiked.as_numbers()]).map(bits).collect()
        })
    }
}

/// Whether a model keeps its promise: if the first and the last of three ascending currents leave
/// the same voltage and the same spike, so does the second, and all else is the same, too. Returns
/// the number of cases in which these two agree.
fn keeps_promise<M: Model<C, Z>, const C: usize, const Z: usize>(model: NeuronModel) -> u32 {
    let (network, phenotype) = compiled(&dynamic(model));
    let neurons = Neurons::<M, C, Z>::compile(&network, &phenotype);
    let mut stream = Stream::new(2, 0_u64, 0, Purpose::Script, 0);
    let mut n_agree = 0;
    for _ in 0..20_000 {
        let neuron = stream.below(neurons.constants.len());
        let mut state = neurons.starts[neuron];
        state[0] += (60.0 * stream.uniform() - 20.0) as f32;
        let width = magnitude(&mut stream, -40..6);
        let low = (80.0 * stream.uniform() - 40.0) as f32;
        let currents = &[low, low + width * stream.uniform() as f32, low + width];
        let after = After { neurons: &neurons, neuron, state, currents };
        let [first, second, last] = Isa::best().run(after);
        if first[0] == last[0] && first[Z] == last[Z] {
            n_agree += u32::from(currents[0] < currents[2]);
            assert_eq!(first, last);
            assert_eq!(first, second);
        }
    }
    n_agree
}

#[test]
fn models_are_monotone_in_the_current() {
    let n_agree = [
        keeps_promise::<Lif, 5, 2>(NeuronModel::Lif),
        keeps_promise::<ExpLif, 4, 2>(NeuronModel::ExpLif),
        keeps_promise::<AdEx, 9, 3>(NeuronModel::AdEx),
        keeps_promise::<Izhikevich, 5, 2>(NeuronModel::Izhikevich),
        keeps_promise::<MorrisLecar, 12, 2>(NeuronModel::MorrisLecar),
    ];
    assert!(n_agree.iter().all(|n| *n > 1_000), "{n_agree:?}");
}
