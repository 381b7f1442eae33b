//! The referee: a child process of the coordinator that evaluates single items.
//!
//! The simulation is deterministic, and the coordinator contains it, so it can compute the true
//! result of an item itself, be it numbers or a failure. The referee is a process of its own
//! because an item may take its process down; the coordinator sees that as
//! [`engine::Verdict::Died`].
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

use std::{ffi::OsString, path::PathBuf, time::Duration};

pub use child::serve_stdio;
pub use supervisor::Referee;

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

/// Statistics of a referee since its creation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefereeStats {
    /// Time spent on items, including starts of the process.
    pub busy: Duration,
    /// Number of verdicts [`engine::Verdict::Values`].
    pub n_values: u64,
    /// Number of verdicts [`engine::Verdict::Failed`].
    pub n_failed: u64,
    /// Number of verdicts [`engine::Verdict::Died`].
    pub n_died: u64,
    /// Number of verdicts [`engine::Verdict::Unavailable`].
    pub n_unavailable: u64,
}
