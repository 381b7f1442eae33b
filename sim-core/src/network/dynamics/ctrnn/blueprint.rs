//! Rate neurons as numbers, row by row.

use super::Wiring;
use super::kernel::{Block, Blocks, Coupling, Kernel};
use crate::blueprint::{Link, RateNeurons, RateRow};
use crate::network::{Network, Phenotype};
use experiment_file::InitialRates;

/// The rows of the kernel. A weight of zero adds nothing, so it is left out.
pub(in super::super) fn blueprint(
    network: &Network,
    wiring: &Wiring,
    phenotype: &Phenotype,
) -> RateNeurons {
    let kernel = Kernel::compile(network, wiring, phenotype);
    let mut rows = Vec::with_capacity(kernel.n_rows());
    add(&mut rows, &kernel.quads);
    add(&mut rows, &kernel.pairs);
    let start_active = network.initial_rates == InitialRates::Activation;
    RateNeurons { rows_of: wiring.rows.clone(), rows, start_active }
}

fn add<const N: usize>(rows: &mut Vec<RateRow>, blocks: &Blocks<N>) {
    let Blocks { blocks, recurrent, afferent } = blocks;
    for block in blocks {
        let Block { activation, start, retention, drive, .. } = block;
        rows.extend((0..N).map(|place| {
            let links = |couplings: &[Coupling<N>]| {
                let links = couplings.iter().map(|coupling| Link {
                    other: coupling.pre,
                    weight: coupling.weights[place],
                    synapse: 0,
                });
                links.filter(|link| link.weight != 0.0).collect()
            };
            RateRow {
                activation: *activation,
                start: start[place],
                retention: retention[place],
                drive: drive[place],
                scale: 1.0,
                afferent: links(&afferent[block.afferent.clone()]),
                recurrent: links(&recurrent[block.recurrent.clone()]),
            }
        }));
    }
}
