//! All bounds on the memory and time that the network can make the coordinator spend.
//!
//! A request over a bound waits at the peer, or gets a status that names the bound; nothing
//! grows. `experiment_file::limits` bounds the contents of experiment files; `docs/security.md`
//! lists the bounds that an honest user can meet.

use std::time::Duration;

pub use model::limits::*;
use swarm_transport::listening::{Known, ListenerLimits, Room};

/// Number of bundles that are sent or received at the same time; more wait. Each takes at most
/// four times [`bundle::UNPACKED_LEN_MAX`] of memory and 160 MiB, and as much memory for its
/// repeated evolution as the running experiment took.
pub const BUNDLES_MAX: usize = 1;
/// Number of generations that are recomputed at the same time.
pub const RECONSTRUCTIONS_MAX: usize = 4;

/// Numbers of connections. Peers with an accepted call may have one for every worker, and one for
/// every call of a client.
pub const CONNECTIONS: ListenerLimits = ListenerLimits {
    strangers: Room {
        n_places: 512,
        silent_grace: Duration::from_millis(100),
        heard_grace: Duration::from_millis(500),
    },
    admission_time: Duration::from_secs(30),
    known: Known::Refused { n_places: WORKERS_MAX + CLIENT_CALLS_MAX },
    // A peer that does not read does not answer pings, either.
    stall_time: Duration::from_secs(40),
};
/// Number of workers at the same time. Each holds a stream, some buffers and a file descriptor.
pub const WORKERS_MAX: usize = 4096;
/// Number of client calls at the same time, including watches.
pub const CLIENT_CALLS_MAX: usize = 1024;
/// Number of calls on one connection at the same time: a worker has one, a client few.
pub const CALLS_PER_CONNECTION_MAX: u32 = 128;
/// Bytes of a call's headers: a token has up to 1,024 characters.
pub const HEADERS_LEN_MAX: u32 = 16 << 10;

/// Interval between pings to a peer, and time to answer one. A machine that vanishes closes no
/// connection.
pub const KEEPALIVE: Duration = Duration::from_secs(20);
/// Time for which the referee's process is kept without questions.
pub const REFEREE_IDLE_TIME: Duration = Duration::from_secs(30);
/// Time for the referee to compute an item.
pub const REFEREE_TIMEOUT: Duration = Duration::from_secs(1800);
/// Time for open streams to end at shutdown.
pub const SHUTDOWN_GRACE: Duration = Duration::from_secs(5);

/// Time for a new worker's stream to say `Hello`.
pub const HELLO_TIMEOUT: Duration = Duration::from_secs(10);
/// Messages and answers up to this number of bytes are not counted: the number of calls bounds
/// them.
pub const SHORT_LEN: usize = 64 << 10;
/// Bytes of long messages that arrive, including their decoded form; more wait. Each takes three
/// times its length until it is decoded.
pub const INTAKE_LEN_MAX: usize = 128 << 20;
/// Time for a long message to arrive once there is room for it.
pub const MESSAGE_TIME: Duration = Duration::from_secs(60);
/// Bytes of long answers that wait for their readers; further ones are refused. A list of all
/// experiments may have 64 MiB.
pub const OUTFLOW_LEN_MAX: usize = 512 << 20;
/// Bytes of long messages that wait for workers to read them; further ones wait before encoding.
/// Each takes three times its length while it is encoded.
pub const WORKER_OUTFLOW_LEN_MAX: usize = 256 << 20;
/// Bytes of a call, and of a connection, that the peer may send before the coordinator reads
/// them.
pub const WINDOW_LEN: u32 = 256 << 10;
/// Number of results in one message; our worker sends fewer. On the wire an empty result takes
/// two bytes, in memory fifty.
pub const RESULTS_PER_MESSAGE_MAX: usize = 1 << 16;
/// Number of messages, in addition to one per credit, that may wait for a worker to read them. If
/// there are more, the coordinator drops the worker.
pub const WORKER_OUTBOX_SLACK: usize = 64;

/// Bytes of a configuration's list of problems. The list travels in a header, and clients limit
/// headers.
pub const PROBLEMS_LEN_MAX: usize = 4096;
/// Default of the estimated memory that all unfinished experiments together may take, MiB. It
/// does not depend on the machine, so that all machines accept the same experiments.
pub const MEMORY_BUDGET_MIB: u32 = 4096;
/// Time for a client's change to be stored; after it, the client hears that the change is not
/// stored yet.
pub const CHANGE_TIMEOUT: Duration = Duration::from_secs(5);
/// Number of evaluations in progress at the same time; further calls wait.
pub const EVALUATIONS_MAX: usize = 16;
/// Bytes of experiment files and genotypes of clients' requests in progress: some thirty of the
/// largest evaluations, or thousands of usual ones.
pub const REQUESTS_LEN_MAX: usize = 256 << 20;
/// Number of experiment files in checks at the same time; more wait. A check compiles the
/// experiment; a large one takes a processor and tens of megabytes. So does the generation after
/// which a fork continues, which is read only for the check.
pub const CHECKS_MAX: usize = 4;
/// Most numbers of one trial, 2 MiB, because a trial travels in one message.
pub const TRIAL_VALUES_MAX: usize = 1 << 18;
/// Pause between two messages of news.
pub const NEWS_PAUSE: Duration = Duration::from_millis(200);
/// Longest time until a watcher of explanations hears of a change that no event announces, such as
/// a barrier.
pub const SITUATION_INTERVAL: Duration = Duration::from_secs(5);
/// Events read from the store at once.
pub const EVENT_PAGE_LEN: u32 = 256;
/// Time for a watcher to make room for the next event. The stream of a slower watcher ends with
/// the sequence number to resume from.
pub const WATCH_PATIENCE: Duration = Duration::from_secs(30);
/// Number of events that may wait for a watcher to read them.
pub const WATCH_QUEUE_LEN: usize = 16;
