//! Checks what holds between the parts of an experiment: names that resolve,
//! sizes that agree, bounds of what it costs.
//!
//! Each check names every place it relies on, so that it stays silent where one
//! of them could not be read.

mod budget;
mod coverage;
mod encoding;
mod genotype;
mod learning;
mod network;
mod task;
mod units;
mod world;

use super::report::Report;
use super::{AlgorithmDescription, ExperimentConfig};

/// Reports everything that does not fit together. `algorithm`: the description of
/// the algorithm that the file names; none if it names none, or if it is not to be
/// checked.
pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    network::check(&config.topology, report);
    genotype::check(config, algorithm, report);
    world::check(config, report);
    task::check(config, report);
    units::check(config, report);
    budget::check(config, algorithm, report);
}
