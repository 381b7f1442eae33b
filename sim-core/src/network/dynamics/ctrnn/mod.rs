//! Continuous-time recurrent neural network (sections 2.1 and 3.4 of the thesis;
//! Beer 1995), by synchronous Euler steps:
//!
//! v(t+dt) = v + r * (-v + W_N u + W_I phi), u = F(g * (v + beta)), v(0) = 0,
//! r = dt / tau.
//!
//! The state is stored as the exponent that F needs, y = k * g * (v + beta), where k is F's
//! [`squash::scale`]. Then a step is
//!
//! y(t+dt) = (1 - r) * y + r * k * g * (W_N u + W_I phi + beta), u = F(y),
//!
//! with beta / g in place of beta where the gain does not multiply the bias. A step takes one
//! multiply-add per synapse and one per neuron; W_I phi is constant within an environment step. The
//! state is computed in f32, which `docs/notebook/2026-11-simulation.md` justifies. All constants
//! are computed in f64 and rounded once.
//!
//! All lanes share the weights, and never interact. [`chunk`] computes whole vectors of lanes: many
//! vectors neuron by neuron, few vectors in blocks of neurons that share the loads of presynaptic
//! activities. [`remainder`] computes the remaining lanes, to the same bits. Two neurons share a
//! division; the pairs depend only on the network's structure. [`plastic`] computes networks whose
//! weights change while robots live; in these networks, every lane has its own weights.

mod blueprint;
mod chunk;
mod kernel;
mod plastic;
mod remainder;
mod squash;
mod wiring;

use super::{Dynamics, Inputs};
use crate::lanes::Lanes;
use crate::network::{Network, Phenotype};
pub(super) use blueprint::blueprint;
use chunk::{Chunk, Workspace};
use determinism::Isa;
use kernel::Kernel;
pub(super) use plastic::{PlasticCtrnn, blueprint as plastic_blueprint};
use remainder::{Bundles, Remainder};
pub(super) use wiring::Wiring;

/// A network with its weights, and its state in every lane.
#[derive(Debug)]
pub(crate) struct Ctrnn {
    isa: Isa,
    kernel: Kernel,
    chunks: Vec<Chunk>,
    workspace: Workspace,
    /// The remaining lanes, too few for a vector.
    rest: Option<Rest>,
    /// The kernel's row of each neuron.
    rows: Vec<usize>,
}

/// Lanes outside whole vectors.
#[derive(Debug)]
struct Rest {
    bundles: Bundles,
    remainders: Vec<Remainder>,
}

impl Ctrnn {
    /// A network at rest: v = 0 in every lane.
    pub fn new(
        isa: Isa,
        network: &Network,
        wiring: &Wiring,
        phenotype: &Phenotype,
        n_lanes: usize,
    ) -> Self {
        let kernel = Kernel::compile(network, wiring, phenotype);
        let vector_len = isa.vector_len();
        let (mut n_vectors, mut n_left) = (n_lanes / vector_len, n_lanes % vector_len);
        // A vector of lanes costs one vector operation per row. A lane of a remainder costs one
        // vector operation per `vector_len` rows, and half as much again for its broadcasts.
        let n_vectors_per_lane = kernel.n_rows().div_ceil(2 * vector_len) * 2;
        if 3 * n_left * n_vectors_per_lane > 2 * kernel.n_rows() {
            (n_vectors, n_left) = (n_vectors + 1, 0);
        }
        let n_chunks = n_vectors.div_ceil(chunk::max_width(isa.is_fused()));
        let width = n_vectors.div_ceil(n_chunks.max(1)).max(1);
        let rates = kernel.start_rates(network.initial_rates, isa);
        let chunks = (0..n_vectors).step_by(width).map(|first| {
            let own_width = width.min(n_vectors - first);
            Chunk::new(&kernel, &rates, first * vector_len, own_width, width, isa)
        });
        let chunks = chunks.collect();
        let workspace = Workspace::new(&kernel, width, isa);
        let rest = (n_left > 0).then(|| {
            let bundles = Bundles::new(&kernel, &rates, isa);
            let first = n_vectors * vector_len;
            let remainders = (0..n_left).step_by(remainder::MAX_LANES).map(|lane| {
                let n_lanes = remainder::MAX_LANES.min(n_left - lane);
                Remainder::new(&bundles, first + lane, n_lanes)
            });
            let remainders = remainders.collect();
            Rest { bundles, remainders }
        });
        Self { isa, kernel, chunks, workspace, rest, rows: wiring.rows.clone() }
    }
}

impl Dynamics for Ctrnn {
    fn step(&mut self, Inputs { stimuli, .. }: Inputs<'_>) {
        for chunk in &mut self.chunks {
            chunk.advance(&self.kernel, &mut self.workspace, stimuli, self.isa);
        }
        if let Some(Rest { bundles, remainders }) = &mut self.rest {
            for remainder in remainders {
                remainder.advance(bundles, stimuli, self.isa);
            }
        }
    }

    /// u
    fn write_activity(&self, neurons: &[usize], activity: &mut Lanes) {
        for chunk in &self.chunks {
            chunk.write_activity(&self.rows, neurons, activity);
        }
        if let Some(Rest { bundles, remainders }) = &self.rest {
            for remainder in remainders {
                remainder.write_activity(bundles, &self.rows, neurons, activity);
            }
        }
    }
}

#[cfg(test)]
mod tests;
