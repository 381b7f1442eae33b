//! The referee: a child process of the coordinator that evaluates single items.
//!
//! The simulation is deterministic, and the coordinator contains it, so it can compute the true
//! result of an item itself, be it numbers or a failure. The referee is a process of its own
//! because an item may take its process down; the coordinator sees that as [`Verdict::Died`].
//!
//! - [`Referee`] starts the process for an item, sends it one item at a time, restarts it after a
//!   death, and ends it after a time without items;
//! - [`serve_stdio`] is the process itself: `coordinator referee` and `swarmctl referee`, which
//!   only programs start;
//! - the two speak the workers' protocol through its standard input and output (`stream`);
//!   `process` is one process as its supervisor sees it.
//!
//! The process reads nothing but its standard input, writes nothing but its standard
//! output and error, and ends when its standard input does. What it writes to standard
//! error goes to the coordinator's log.

mod child;
mod process;
mod stream;
mod supervisor;

use std::{ffi::OsString, ops::Range, path::PathBuf, sync::Arc, time::Duration};

pub use child::serve_stdio;
use sim_core::{Output, TrialSet};
pub use supervisor::Referee;

use crate::shared_genotype::SharedGenotype;

/// The program of a referee process, which must call [`serve_stdio`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefereeProgram {
    /// The executable file; a name without a slash is looked up in `PATH`.
    pub path: PathBuf,
    /// Its arguments.
    pub args: Vec<OsString>,
}

impl RefereeProgram {
    /// The program of this process, with the argument `referee`. Correct in `coordinator` and
    /// `swarmctl`, but not in other programs that use this library.
    pub fn this_program() -> Self {
        // Opens the file that runs here, even if an upgrade has replaced it on disk.
        Self { path: "/proc/self/exe".into(), args: vec!["referee".into()] }
    }
}

/// An item to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub struct RefereeRequest {
    /// The experiment in its canonical form, the text that workers get. The process keeps the
    /// last few texts compiled.
    pub specification: Arc<str>,
    /// Genes, which reach the simulation without any change of bits.
    pub genotype: SharedGenotype,
    /// The trial set.
    pub trial_set: TrialSet,
    /// The trials of the set.
    pub trials: Range<u32>,
    /// The kind of result for each trial.
    pub output: Output,
}

/// The outcome of an item.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The item's numbers: one per trial, or the measures of each trial one after the other, as
    /// the request's `output` says.
    Values(Vec<f64>),
    /// The item cannot be computed; the text is the message that every worker reports. A
    /// specification that does not compile is such a failure, and so is a panic.
    Failed(String),
    /// The process died during the item; the text has the signal or the exit code. A kill from
    /// outside (by a system without memory, or by a person) looks the same.
    Died(String),
    /// The referee could not answer, and the item is not to blame; the text says why and what to
    /// do. The process cannot be started, does not behave like a referee, or was told to stop
    /// (SIGTERM, SIGINT or SIGHUP, as at a shutdown of the machine).
    Unavailable(String),
}

impl Verdict {
    /// The same verdict with another text, if it has one.
    pub fn map_text(self, change: impl FnOnce(String) -> String) -> Self {
        match self {
            Self::Values(values) => Self::Values(values),
            Self::Failed(text) => Self::Failed(change(text)),
            Self::Died(text) => Self::Died(change(text)),
            Self::Unavailable(text) => Self::Unavailable(change(text)),
        }
    }
}

/// Statistics of a referee since its creation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefereeStats {
    /// Time spent on items, including starts of the process.
    pub busy: Duration,
    /// Number of verdicts [`Verdict::Values`].
    pub n_values: u64,
    /// Number of verdicts [`Verdict::Failed`].
    pub n_failed: u64,
    /// Number of verdicts [`Verdict::Died`].
    pub n_died: u64,
    /// Number of verdicts [`Verdict::Unavailable`].
    pub n_unavailable: u64,
}
