//! Checks the relations between the parts of an experiment: names resolve, sizes agree, costs are
//! within their limits.
//!
//! Each check names every place on which it relies, so that it stays silent if one of them could
//! not be read.

mod aims;
mod bodies;
mod budget;
mod coverage;
mod descriptors;
mod encoding;
mod genotype;
mod learning;
mod network;
mod task;
mod units;
mod world;

use super::report::Report;
use super::{AlgorithmDescription, ExperimentConfig};

/// Reports everything that does not fit together. `algorithm`: the description of the file's
/// algorithm; `None` if the file names none, or if the algorithm is not checked.
pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    network::check(&config.topology, report);
    genotype::check(config, algorithm, report);
    descriptors::check(config, algorithm, report);
    aims::check(config, algorithm, report);
    world::check(config, report);
    bodies::check(config, report);
    task::check(config, report);
    units::check(config, report);
    budget::check(config, algorithm, report);
}
