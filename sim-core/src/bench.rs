//! Runs networks without robots, for benchmarks and figures. Not part of the public interface.

use std::hint::black_box;
use std::ops::Range;

use determinism::simd::{Simd, WithSimd, bytemuck};

use crate::lanes::Lanes;
use crate::network::dynamics::NetworkState;
use crate::simulation::{EvaluateError, Simulation};
use determinism::Isa;
use determinism::random::{Purpose, Stream};

/// The network of a genotype, which runs without robots.
#[derive(Debug)]
pub struct NetworkLoad {
    state: NetworkState,
    stimuli: Lanes,
}

impl NetworkLoad {
    /// The network in `n_lanes` lanes with different stimuli.
    pub fn new(
        simulation: &Simulation,
        genotype: &[f64],
        n_lanes: usize,
    ) -> Result<Self, EvaluateError> {
        let phenotype = simulation.phenotype(genotype)?;
        let network = &simulation.network;
        let n_inputs = network.stimuli.values().last().map_or(0, |stimulus| stimulus.inputs.end);
        let mut stimuli = Lanes::new(n_inputs, n_lanes);
        for input in 0..n_inputs {
            for lane in 0..n_lanes {
                stimuli.set(input, lane, ((lane + 3 * input) % 11) as f32 / 11.0);
            }
        }
        let stream = |lane: usize| Stream::new(0, 0, 0, Purpose::Encoding, lane as u64);
        let streams = if network.n_drawing() > 0 { n_lanes } else { 0 };
        let state = NetworkState::new(simulation.isa, network, &phenotype, n_lanes)
            .drawing_from((0..streams).map(stream).collect());
        Ok(Self { state, stimuli })
    }

    /// One environment step.
    pub fn step(&mut self) {
        self.state.step(black_box(&self.stimuli));
    }

    /// Sets an input of a lane.
    pub fn set_stimulus(&mut self, input: usize, lane: usize, value: f64) {
        self.stimuli.set(input, lane, value as f32);
    }

    /// The activity of a neuron in a lane; for a spiking neuron, the share of substeps with a
    /// spike.
    pub fn activity(&self, neuron: usize, lane: usize) -> f64 {
        self.state.activity().get(neuron, lane).into()
    }

    /// The voltage of a neuron in a lane, mV; `None` for rate neurons.
    pub fn voltage(&self, neuron: usize, lane: usize) -> Option<f64> {
        self.state.voltages().map(|voltages| voltages.get(neuron, lane).into())
    }
}

/// Number of synapses between neurons, and of substeps per environment step.
pub fn network_size(simulation: &Simulation) -> (usize, u32) {
    let network = &simulation.network;
    let is_recurrent = |synapse: &&crate::network::connections::Synapse| {
        matches!(synapse.pre, crate::network::connections::Source::Neuron(_))
    };
    (network.synapses.iter().filter(is_recurrent).count(), network.n_substeps)
}

/// Runs 12 multiply-adds of f32 vectors, `rounds` times, at full speed. Returns the number of
/// scalar multiply-adds.
pub fn multiply_adds(isa: Isa, rounds: usize) -> usize {
    struct MultiplyAdds(Range<usize>);
    impl WithSimd for MultiplyAdds {
        type Output = f32;
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f32 {
            let factor = simd.splat_f32s(black_box(0.999));
            let term = simd.splat_f32s(black_box(0.001));
            // Enough independent chains to hide the latency.
            let mut chains = [simd.splat_f32s(1.0); N_CHAINS];
            for _ in self.0 {
                for chain in &mut chains {
                    *chain = simd.mul_add_f32s(*chain, factor, term);
                }
            }
            let mut sum = chains[0];
            for chain in chains {
                sum = simd.add_f32s(sum, chain);
            }
            bytemuck::cast_slice::<_, f32>(&[sum]).iter().sum()
        }
    }
    const N_CHAINS: usize = 12;
    black_box(isa.run(MultiplyAdds(0..rounds)));
    rounds * N_CHAINS * isa.vector_len()
}
