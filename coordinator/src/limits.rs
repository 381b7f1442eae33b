//! Every bound on what the network can make the coordinator hold or wait for.
//!
//! What is over a bound waits in the peer, or is refused with a status that says
//! so; nothing grows. Bounds on what an experiment file may ask for are
//! `sim_core`'s; `docs/security.md` lists both.

use std::time::Duration;

pub use model::limits::*;
use swarm_transport::listening::{Known, ListenerLimits, Room};

/// Bundles that are sent or received at the same time; more wait. Each takes at most four
/// times [`bundle::UNPACKED_LEN_MAX`] of memory and 160 MiB, beside the evolution that is gone
/// through, which takes what the experiment takes when it runs.
pub const BUNDLES_MAX: usize = 1;
/// Generations that are computed again at the same time.
pub const RECONSTRUCTIONS_MAX: usize = 4;

/// Connections. Of those who have made a call that was let in: every worker and every call
/// of a client on one of its own.
pub const CONNECTIONS: ListenerLimits = ListenerLimits {
    strangers: Room {
        n_places: 512,
        silent_grace: Duration::from_millis(100),
        heard_grace: Duration::from_millis(500),
    },
    admission_time: Duration::from_secs(30),
    known: Known::Refused { n_places: WORKERS_MAX + CLIENT_CALLS_MAX },
    // A peer that does not read does not answer pings either.
    stall_time: Duration::from_secs(40),
};
/// Workers at the same time. Each holds a stream, some buffers and a file
/// descriptor.
pub const WORKERS_MAX: usize = 4096;
/// Calls of clients, watches included, at the same time.
pub const CLIENT_CALLS_MAX: usize = 1024;
/// Calls on one connection at the same time: a worker has one, a client few.
pub const CALLS_PER_CONNECTION_MAX: u32 = 128;
/// Bytes of a call's headers: a token has up to 1,024 characters.
pub const HEADERS_LEN_MAX: u32 = 16 << 10;

/// A peer is asked for a sign of life so often, and gone after as long without
/// one: a machine that vanishes closes nothing.
pub const KEEPALIVE: Duration = Duration::from_secs(20);
/// Time for which the referee's process is kept when it is not asked anything.
pub const REFEREE_IDLE_TIME: Duration = Duration::from_secs(30);
/// Time for the referee to compute an item.
pub const REFEREE_TIMEOUT: Duration = Duration::from_secs(1800);
/// Time for open streams to end at shutdown.
pub const SHUTDOWN_GRACE: Duration = Duration::from_secs(5);

/// Time for a new worker's stream to say `Hello`.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(10);
/// Bytes of a message or an answer that is not counted: there are as many as calls.
pub const SHORT_LEN: usize = 64 << 10;
/// Bytes of long messages that are on their way in, and of what they become; more wait. Each
/// takes three times its length until it is decoded.
pub const INTAKE_LEN_MAX: usize = 128 << 20;
/// Time for a long message to arrive once there is room for it.
pub const MESSAGE_TIME: Duration = Duration::from_secs(60);
/// Bytes of long answers that wait for their readers; one more is refused. A list of all
/// experiments may have 64 MiB.
pub const OUTFLOW_LEN_MAX: usize = 512 << 20;
/// Bytes of long messages to workers that wait to be read; more wait. Each takes three times
/// its length while it is encoded.
pub const WORKER_OUTFLOW_LEN_MAX: usize = 256 << 20;
/// Bytes of a call, and of a connection, that the peer may send before they are read.
pub const WINDOW_LEN: u32 = 256 << 10;
/// Results in one message; ours sends fewer. On the wire an empty result takes two bytes,
/// in memory fifty.
pub const RESULTS_PER_MESSAGE_MAX: usize = 1 << 16;
/// Messages, beyond one per credit, that may wait for a worker to read them; one
/// that lets more wait is dropped.
pub const WORKER_OUTBOX_SLACK: usize = 64;

/// Bytes of the problems of a configuration: they travel in a header, whose size
/// clients limit.
pub const PROBLEMS_LEN_MAX: usize = 4096;
/// MiB of memory that all unfinished experiments together may take, as estimated, unless
/// whoever starts the coordinator chooses another number. It does not depend on the
/// machine: what one accepts, all accept.
pub const MEMORY_BUDGET_MIB: u32 = 4096;
/// Time for what a client changes to be stored before the client is told that it
/// is not yet.
pub const CHANGE_TIMEOUT: Duration = Duration::from_secs(5);
/// Evaluations that are computed at the same time; more wait, as calls.
pub const EVALUATIONS_MAX: usize = 16;
/// Bytes of experiment files and genotypes from clients that are being checked, wait, or
/// are evaluated: some thirty of the largest evaluations, or thousands of usual ones.
pub const REQUESTS_LEN_MAX: usize = 256 << 20;
/// Experiment files that are checked at the same time; more wait. A check compiles the
/// experiment, for which a large one takes a processor and tens of megabytes.
pub const CHECKS_MAX: usize = 4;
/// Numbers that an evaluation gives, 16 MiB: trials x steps x measures of the task.
pub const EVALUATION_VALUES_MAX: usize = 1 << 21;
/// Numbers of one of its trials, 2 MiB: a trial travels in one message.
pub const TRIAL_VALUES_MAX: usize = 1 << 18;
/// Pause between two messages that there is news.
pub const NEWS_PAUSE: Duration = Duration::from_millis(200);
/// Longest time after which a watcher of explanations is told what time alone has changed.
pub const SITUATION_INTERVAL: Duration = Duration::from_secs(5);
/// Events read from the store at once.
pub const EVENT_PAGE_LEN: u32 = 256;
/// Time for a watcher to make room for the next event; one that takes longer is
/// told where to resume.
pub const WATCH_PATIENCE: Duration = Duration::from_secs(30);
/// Events that may wait for a watcher to read them.
pub const WATCH_QUEUE_LEN: usize = 16;
