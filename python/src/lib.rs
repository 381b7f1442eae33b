//! The extension behind the Python package `swarmevo`: the simulator and the algorithms.
//! `swarmevo/*.py` is its public interface.

mod database;
mod errors;
mod evolution;
mod experiment;
mod fitness_log;
mod genes;
mod judging;
mod memory;
mod record;
mod running;
mod stepping;
mod trace;
mod trials;
mod workers;

use pyo3::prelude::*;

/// The private half of the package.
#[pymodule(gil_used = true)]
mod _core {
    #[pymodule_export]
    use crate::{
        database::Database,
        evolution::{Evolution, Reevaluation, advice, algorithms},
        experiment::{Experiment, inline_script, plain, script_path},
        fitness_log::fitness_log,
        genes::encode_genes,
        judging::judge,
        memory::ensure_memory,
        record::Record,
        stepping::Episodes,
        workers::Worker,
    };

    /// The name of the function that the simulator computes: equal names mean equal bits.
    #[pymodule_export]
    const FINGERPRINT: &str = sim_core::FINGERPRINT;

    /// Version of the project.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");

    /// A first experiment file.
    #[pymodule_export]
    // This file is a link, because the sdist has no folder configs/.
    const QUICKSTART: &str = include_str!("quickstart.json");

    /// The gRPC protocol, as a set of file descriptors.
    #[pymodule_export]
    const PROTOCOL: &[u8] = include_bytes!("../../proto/swarm.v1.binpb");
}
