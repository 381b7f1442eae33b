//! Starts real fleets, kills parts of them, and reads what they say.
//!
//! Nothing here sleeps: tests wait for lines of the processes' logs, with a
//! deadline that only a broken program meets.

mod binaries;
mod experiment;
mod fleet;
mod process;

pub use binaries::binary;
pub use experiment::{Experiment, workspace_file};
pub use fleet::{CoordinatorProcess, Watch, WorkerProcess};
pub use process::{LogLine, LoggingProcess, Outcome, swarmctl, swarmctl_process};
