//! The referee: a child process of the coordinator that evaluates single items.
//!
//! The simulation is deterministic, and the coordinator has it, too: what an item
//! really comes to, be it numbers or a failure, needs no worker's word. It is a process
//! of its own because an item may take the process that computes it down; the
//! coordinator then learns of it as [`Verdict::Died`].
//!
//! - [`Referee`] starts the process when there is an item, asks it one item at a time,
//!   starts it again after a death, and ends it after a time without items;
//! - [`serve_stdio`] is the process itself: `coordinator referee` and
//!   `swarmctl referee`, which nobody types;
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

use crate::engine::SharedGenotype;

/// The program that a referee process runs: [`serve_stdio`] has to be behind it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefereeProgram {
    /// The executable file; a name without a slash is looked up in `PATH`.
    pub path: PathBuf,
    /// Its arguments.
    pub args: Vec<OsString>,
}

impl RefereeProgram {
    /// The program of this process, with the argument `referee`: right in `coordinator`
    /// and in `swarmctl`, not in other programs that use this library.
    pub fn this_program() -> Self {
        // Opens the file that runs here, even if an upgrade has replaced it on disk.
        Self { path: "/proc/self/exe".into(), args: vec!["referee".into()] }
    }
}

/// An item to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub struct RefereeRequest {
    /// The experiment in its canonical form, the text that workers get. The last few texts are
    /// compiled once, as long as the process lives.
    pub specification: Arc<str>,
    /// Genes; reach the simulation bit by bit as they are here.
    pub genotype: SharedGenotype,
    /// Which worlds and noise.
    pub trial_set: TrialSet,
    /// Which trials of the set.
    pub trials: Range<u32>,
    /// What to compute of each trial.
    pub output: Output,
}

/// What has become of an item.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It can be computed, and comes to this: a number per trial, or the measures of
    /// each trial one after the other, as the request's `output` says.
    Values(Vec<f64>),
    /// It cannot be computed, in the words in which every worker says so. A
    /// specification that does not compile is such a failure, and so is a panic.
    Failed(String),
    /// It took the process down; the text has the signal or the exit code. Whoever kills
    /// the process from outside while it computes (the system that is out of memory, or
    /// a person) causes the same.
    Died(String),
    /// Nothing is known about the item, and it is not to blame; the text says why and
    /// what to do. Either the process cannot be started, or does not behave like a
    /// referee, or was told to stop (SIGTERM, SIGINT or SIGHUP, as when the machine shuts
    /// down).
    Unavailable(String),
}

impl Verdict {
    /// The same with another text, if it has one.
    pub fn map_text(self, change: impl FnOnce(String) -> String) -> Self {
        match self {
            Self::Values(values) => Self::Values(values),
            Self::Failed(text) => Self::Failed(change(text)),
            Self::Died(text) => Self::Died(change(text)),
            Self::Unavailable(text) => Self::Unavailable(change(text)),
        }
    }
}

/// What a referee has done since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefereeStats {
    /// Time in which an item was with the process, including the time to start it.
    pub busy: Duration,
    /// Verdicts that were [`Verdict::Values`].
    pub n_values: u64,
    /// Verdicts that were [`Verdict::Failed`].
    pub n_failed: u64,
    /// Verdicts that were [`Verdict::Died`].
    pub n_died: u64,
    /// Verdicts that were [`Verdict::Unavailable`].
    pub n_unavailable: u64,
}
