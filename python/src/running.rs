//! Long computations without the interpreter's lock: on threads, stopped by Ctrl-C, and a
//! panic is an exception.

use std::{
    io,
    panic::{AssertUnwindSafe, catch_unwind},
    process,
    sync::{
        Mutex, MutexGuard, TryLockError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use pyo3::prelude::*;
use sim_core::{EvaluateError, panic_message};

use crate::errors::{evaluate_error, fork_error, panic_error};

/// How often the computation checks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Whether to continue; a computation checks it from time to time.
pub type KeepGoing<'a> = &'a dyn Fn() -> bool;

/// The reason why there is no result.
enum Failure {
    Evaluate(EvaluateError),
    Panic(String),
    Signal(PyErr),
    NoThread(io::Error),
}

/// Computes `work` of 0..`n_items` on `n_threads` threads and returns the results in order.
/// `work` returns none only after it was told to stop.
pub fn compute<T: Send>(
    py: Python<'_>,
    n_items: usize,
    n_threads: usize,
    work: impl Fn(usize, KeepGoing<'_>) -> Result<Option<T>, EvaluateError> + Sync,
) -> PyResult<Vec<T>> {
    let (next, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let keep_going = || !stopped.load(Ordering::Relaxed);
    // A thread: computes remaining items until none are left.
    let work_off = || {
        let mut done = Vec::new();
        while keep_going() {
            let item = next.fetch_add(1, Ordering::Relaxed);
            if item >= n_items {
                break;
            }
            match work(item, &keep_going) {
                Ok(Some(result)) => done.push((item, result)),
                Ok(None) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(done)
    };
    let computed = py.detach(|| {
        thread::scope(|scope| {
            let (outbox, inbox) = mpsc::channel();
            let mut failure = None;
            for number in 0..n_threads.min(n_items) {
                let outbox = outbox.clone();
                let work_off = &work_off;
                let started = thread::Builder::new().spawn_scoped(scope, move || {
                    let outcome = catch_unwind(AssertUnwindSafe(work_off));
                    // The receiver reads until all senders are gone.
                    let _ = outbox.send(outcome);
                });
                // Fewer threads than requested give the same bits.
                if let Err(error) = started {
                    failure = (number == 0).then_some(Failure::NoThread(error));
                    break;
                }
            }
            drop(outbox);
            let mut results = Vec::new();
            loop {
                let failed = match inbox.recv_timeout(SIGNAL_INTERVAL) {
                    Ok(Ok(Ok(done))) => {
                        results.extend(done);
                        continue;
                    }
                    Ok(Ok(Err(error))) => Failure::Evaluate(error),
                    Ok(Err(panic)) => Failure::Panic(panic_message(&*panic).to_owned()),
                    Err(RecvTimeoutError::Timeout) => {
                        match Python::attach(|py| py.check_signals()) {
                            Ok(()) => continue,
                            Err(error) => Failure::Signal(error),
                        }
                    }
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                stopped.store(true, Ordering::Relaxed);
                failure.get_or_insert(failed);
            }
            failure.map_or(Ok(results), Err)
        })
    });
    match computed {
        Ok(mut results) => {
            results.sort_unstable_by_key(|&(item, _)| item);
            Ok(results.into_iter().map(|(_, result)| result).collect())
        }
        Err(Failure::Evaluate(error)) => Err(evaluate_error(&error)),
        Err(Failure::Panic(message)) => Err(panic_error(py, &message)),
        Err(Failure::Signal(error)) => Err(error),
        Err(Failure::NoThread(error)) => Err(error.into()),
    }
}

/// Runs a short computation without the interpreter's lock.
pub fn guarded<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| {
        catch_unwind(AssertUnwindSafe(work)).map_err(|panic| panic_message(&*panic).to_owned())
    })
    .map_err(|message| panic_error(py, &message))
}

/// The process in which an object was made. A forked process lacks the threads of
/// that process, and the locks that they held stay locked.
#[derive(Clone, Copy)]
pub struct Home(u32);

impl Home {
    /// This process.
    pub fn here() -> Self {
        Self(process::id())
    }

    /// Whether this is a different process.
    pub fn is_left(self) -> bool {
        self.0 != process::id()
    }
}

/// A value that threads share. A forked process never waits for a thread that does not exist
/// there.
pub struct Shared<T> {
    value: Mutex<T>,
    home: Home,
}

impl<T: Send> Shared<T> {
    /// Wraps a value, owned by this process.
    pub fn new(value: T) -> Self {
        Self { value: Mutex::new(value), home: Home::here() }
    }

    /// Runs a short function on the value, without the interpreter's lock.
    pub fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut T) -> R + Send,
    ) -> PyResult<R> {
        let done = guarded(py, || self.lock().map(|mut value| work(&mut value)))?;
        done.ok_or_else(|| fork_error(py, "another thread used this when the process was forked"))
    }

    /// None if a thread of the parent process held the lock at the fork. After a panic, the
    /// value is still readable.
    fn lock(&self) -> Option<MutexGuard<'_, T>> {
        if !self.home.is_left() {
            return Some(self.value.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
        }
        match self.value.try_lock() {
            Ok(value) => Some(value),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}
