//! The runtime of a program, sized to the threads that the system allows.
//!
//! The runtime starts all its threads at the beginning and keeps them, so that a limit reached
//! later stops nothing. If the system still refuses a thread, the program ends with one line.

use std::{
    fs, io, panic,
    sync::{Arc, Barrier, RwLock},
    thread,
    time::Duration,
};

use tokio::runtime::{Builder, Runtime};

use crate::{
    allocator::{give_back, keep_little},
    text::report,
};

/// Exit code of a program that cannot start or continue because the system gives too few threads
/// or file descriptors, or too little memory.
pub const EXIT_STARVED: u8 = 71;
/// Most threads for blocking work: database, checks, reconstructions. Further work waits.
const BLOCKING_MAX: usize = 32;
/// Number of these threads that always exist.
const BLOCKING_KEPT: usize = 2;
/// Number of pairs of file descriptors that a program needs for the database, signals, connections
/// and files, in addition to those at its start.
const PIPES_MIN: usize = 12;
/// Further pairs for each of up to [`PROCESSORS_MAX`] processors, because `run` has a worker on
/// each.
const PIPES_PER_PROCESSOR: usize = 2;
const PROCESSORS_MAX: usize = 32;
/// Memory that a program needs in addition to the stacks of threads, bytes.
const MEMORY_MIN: usize = 64 << 20;
/// Memory that must be free before a thread is tried, bytes: its stack of 2 MiB, and a margin for
/// the blocks that threads allocate as they begin. Without the margin, the standard library or libc
/// may end the program within a thread that the system has granted.
const MEMORY_OF_THREAD: usize = 6 << 20;
/// Time for ended threads to disappear, ms.
const GONE_TIME_MS: usize = 1000;
/// A time longer than any program runs.
const FOR_EVER: Duration = Duration::from_secs(1 << 32);

/// The system gives the program too little to start.
#[derive(Debug, thiserror::Error)]
#[error(
    "the system gives this program too few threads or file descriptors, or too little memory, to \
     start ({0}); raise the limits of processes, memory or open files (ulimit -u, -v, -n; of a \
     container, --pids-limit), or end other programs"
)]
pub struct Starved(io::Error);

impl Starved {
    /// The error for this reason.
    pub fn new(reason: io::Error) -> Self {
        Self(reason)
    }
}

/// Runs a program's future to its end. The program does not wait for remaining work on other
/// threads.
pub fn block_on<T>(runtime: Runtime, program: impl Future<Output = T>) -> T {
    let ended = runtime.block_on(program);
    runtime.shutdown_background();
    ended
}

/// Numbers of threads by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sizes {
    /// Number of workers; 0: the thread that starts the runtime does all work.
    workers: usize,
    blocking: usize,
}

/// Divides `granted` threads if the system does not give `wanted`; `None` if they are too few.
fn sizes(wanted: Sizes, granted: usize) -> Option<Sizes> {
    if granted >= wanted.workers + wanted.blocking {
        return Some(wanted);
    }
    match granted {
        0 => None,
        1 | 2 => Some(Sizes { workers: 0, blocking: granted }),
        // The rest is for threads that the program starts later.
        _ => Some(Sizes {
            workers: wanted.workers.min(granted / 4).max(1),
            blocking: wanted.blocking.min(granted / 2),
        }),
    }
}

/// A runtime with as many threads as the program can use, or as the system allows. `n_others`:
/// number of other threads that the program needs. From here on, a panic because of a refused
/// thread becomes one line and [`EXIT_STARVED`].
pub fn runtime(n_others: usize) -> Result<Runtime, Starved> {
    keep_little();
    report_refused_threads();
    let n_cores = thread::available_parallelism().map_or(1, Into::into);
    let wanted = Sizes { workers: n_cores, blocking: BLOCKING_MAX };
    find_files(PIPES_MIN + PIPES_PER_PROCESSOR * n_cores.min(PROCESSORS_MAX)).map_err(Starved)?;
    // Reserves memory while threads are tried, so that their stacks do not take all of it.
    let memory = find_memory(MEMORY_MIN).map_err(Starved)?;
    let n_before = n_threads();
    let (n_granted, refusal) = granted(n_cores + BLOCKING_MAX + n_others);
    drop(memory);
    if refusal.is_some() {
        wait_for_ended_threads(n_before);
    }
    let starved = || Starved(refusal.unwrap_or_else(|| io::ErrorKind::OutOfMemory.into()));
    let sizes = sizes(wanted, n_granted.saturating_sub(n_others)).ok_or_else(starved)?;
    let mut builder = match sizes.workers {
        0 => Builder::new_current_thread(),
        n => {
            let mut builder = Builder::new_multi_thread();
            builder.worker_threads(n);
            builder
        }
    };
    builder.enable_all().max_blocking_threads(sizes.blocking).thread_keep_alive(FOR_EVER);
    let runtime = builder.build().map_err(Starved)?;
    let n_kept = if sizes == wanted { BLOCKING_KEPT } else { sizes.blocking };
    keep(&runtime, n_kept);
    runtime.spawn(give_back());
    Ok(runtime)
}

/// Fails unless this many pairs of file descriptors are available. Without this check, the
/// program would later blame the disk or the network.
fn find_files(n_pipes: usize) -> io::Result<()> {
    (0..n_pipes).map(|_| io::pipe()).collect::<io::Result<Vec<_>>>().map(drop)
}

/// Reserves this many bytes until the result is dropped, without writing to them.
fn find_memory(len: usize) -> io::Result<Vec<u8>> {
    let mut room = Vec::new();
    room.try_reserve_exact(len).map_err(|_| io::ErrorKind::OutOfMemory)?;
    Ok(room)
}

/// Starts this many threads for blocking work. They wait for each other, so that none runs two of
/// these tasks.
fn keep(runtime: &Runtime, n_kept: usize) {
    let together = Arc::new(Barrier::new(n_kept));
    for _ in 0..n_kept {
        let together = Arc::clone(&together);
        runtime.spawn_blocking(move || {
            together.wait();
        });
    }
}

/// The number of threads, up to `n_max`, that the system starts at the same time, and why it starts
/// no more.
fn granted(n_max: usize) -> (usize, Option<io::Error>) {
    let hold = RwLock::new(());
    let held = hold.write();
    thread::scope(|scope| {
        let mut n_granted = 0;
        let mut refusal = None;
        while n_granted < n_max && refusal.is_none() {
            let start = || thread::Builder::new().spawn_scoped(scope, || drop(hold.read()));
            match find_memory(MEMORY_OF_THREAD).map(drop).and_then(|()| start()) {
                Ok(_) => n_granted += 1,
                Err(error) => refusal = Some(error),
            }
        }
        drop(held);
        (n_granted, refusal)
    })
}

/// The system's count of this program's threads; `None` if it is not known.
fn n_threads() -> Option<usize> {
    fs::read_dir("/proc/self/task").ok().map(Iterator::count)
}

/// Waits for ended threads: the system counts a thread for a moment after it has been joined.
fn wait_for_ended_threads(n_before: Option<usize>) {
    for _ in 0..GONE_TIME_MS {
        if n_threads() <= n_before {
            return;
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Turns panics about refused threads into one line and the end of the program, because libraries
/// do not return this as an error.
fn report_refused_threads() {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let text = info.payload_as_str().unwrap_or_default();
        if !is_refused_thread(text) {
            return usual(info);
        }
        // The standard library quotes the system's error.
        let why = text.split('"').nth(1).or_else(|| text.rsplit(": ").next()).unwrap_or(text);
        report(&format!("error: {}", Starved(io::Error::other(why.to_owned()))));
        std::process::exit(EXIT_STARVED.into());
    }));
}

/// Recognises the texts of tokio and of the standard library.
fn is_refused_thread(text: &str) -> bool {
    text.starts_with("OS can't spawn worker thread") || text.starts_with("failed to spawn thread")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_shared_out_and_one_is_enough() {
        let wanted = Sizes { workers: 8, blocking: 32 };
        let shares = |granted| sizes(wanted, granted).map(|sizes| (sizes.workers, sizes.blocking));
        assert_eq!(shares(0), None);
        assert_eq!(shares(1), Some((0, 1)));
        assert_eq!(shares(2), Some((0, 2)));
        assert_eq!(shares(3), Some((1, 1)));
        assert_eq!(shares(39), Some((8, 19)));
        assert_eq!(shares(40), Some((8, 32)));
        assert_eq!(shares(4000), Some((8, 32)));
        for granted in 1..40 {
            let (workers, blocking) = shares(granted).unwrap();
            assert!(blocking > 0 && workers + blocking <= granted, "{granted}");
        }
    }

    #[test]
    fn available_resources_are_found_and_missing_ones_are_refused() {
        find_files(3).unwrap();
        assert_eq!(find_memory(1000).unwrap().len(), 0);
        assert_eq!(find_memory(usize::MAX).unwrap_err().kind(), io::ErrorKind::OutOfMemory);
    }

    #[test]
    fn every_thread_is_counted() {
        let (n_granted, refusal) = granted(5);
        assert_eq!((n_granted, refusal.map(|refusal| refusal.to_string())), (5, None));
    }

    #[test]
    fn panics_about_threads_are_known_by_the_texts_of_the_libraries() {
        assert!(is_refused_thread(
            "OS can't spawn worker thread: Resource temporarily unavailable"
        ));
        assert!(is_refused_thread("failed to spawn thread: Os { code: 11 }"));
        assert!(!is_refused_thread("index out of bounds"));
    }
}
