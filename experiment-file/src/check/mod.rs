//! Checks what holds between the parts of an experiment: names that resolve,
//! sizes that agree, bounds of what it costs.
//!
//! Each check names every place it relies on, so that it stays silent where one
//! of them could not be read.

mod budget;
mod coverage;
mod genotype;
mod network;
mod task;
mod world;

use super::ExperimentConfig;
use super::report::Report;

/// Reports everything that does not fit together.
pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    network::check(&config.topology, report);
    genotype::check(config, report);
    world::check(config, report);
    task::check(config, report);
    budget::check(config, report);
}
