//! Starts real fleets, kills parts of them, and reads their output.
//!
//! Nothing here sleeps: tests wait for lines of the processes' logs, with a
//! deadline that only a broken program meets.

mod answers;
mod binaries;
mod experiment;
mod fleet;
mod hand_worker;
mod metrics;
mod mount;
mod process;
mod prometheus;
mod proxy;
mod python;
mod skip;
mod terminal;

pub use binaries::binary;
pub use experiment::{Experiment, workspace_file};
pub use fleet::{CoordinatorProcess, Finished, Watch, WorkerProcess, run_coordinator, undisturbed};
pub use hand_worker::{HandWorker, experiment_of, hello, trial_set_of};
pub use metrics::{Samples, http_get, metrics_address};
pub use mount::SmallDisk;
pub use process::{LogLine, LoggingProcess, Outcome, swarmctl, swarmctl_process};
pub use prometheus::{Prometheus, promtool_check_config, promtool_check_metrics};
pub use proxy::{Direction, Proxy, Traffic};
pub use python::{PythonClient, RunningPythonClient, python_with};
pub use skip::{skipped, skipped_for_want_of};
pub use terminal::Terminal;
