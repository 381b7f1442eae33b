//! Workers on threads of this process.

use std::{
    sync::{Mutex, PoisonError},
    thread::{self, JoinHandle},
};

use pyo3::{
    exceptions::{PyRuntimeError, PyValueError},
    prelude::*,
};
use swarm_transport::{CredentialArgs, Credentials, Token};
use tokio_util::sync::CancellationToken;
use worker::{WorkerConfig, WorkerError};

use crate::{errors::fork_error, running::Home};

/// A worker that computes until it is stopped.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Worker {
    stop: CancellationToken,
    /// The process of the thread.
    home: Home,
    thread: Mutex<Option<JoinHandle<Result<(), WorkerError>>>>,
}

#[pymethods]
impl Worker {
    /// Starts a worker. `slots`: number of simultaneous items, each on its own thread.
    #[new]
    fn new(
        coordinator: &str,
        name: &str,
        slots: usize,
        token: Option<&str>,
        tls: Tls,
    ) -> PyResult<Self> {
        let mut config = WorkerConfig::new(coordinator, name, slots);
        config.credentials = credentials(token, tls)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let stop = CancellationToken::new();
        let stopped = stop.clone();
        let thread = thread::Builder::new()
            .name("swarmevo-worker".into())
            .spawn(move || runtime.block_on(worker::run(config, stopped)))?;
        Ok(Self { stop, home: Home::here(), thread: Mutex::new(Some(thread)) })
    }

    /// Whether the worker still runs. It ends by itself only if the coordinator refuses it.
    fn is_alive(&self) -> bool {
        if self.home.is_left() {
            return false;
        }
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Tells the worker to finish its items and to leave.
    fn stop(&self) {
        if self.home.is_left() {
            return;
        }
        self.stop.cancel();
    }

    /// Waits for the end of the worker. Raises the reason if it ended without being told to.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        if self.home.is_left() {
            return Err(fork_error(py, "the thread of this worker is in another process"));
        }
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(thread) = thread else { return Ok(()) };
        match py.detach(move || thread.join()) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(PyRuntimeError::new_err(error.to_string())),
            Err(_) => Err(PyRuntimeError::new_err("the worker has panicked")),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        if self.home.is_left() {
            return;
        }
        self.stop.cancel();
    }
}

/// Files of authorities, certificate and key; name in the coordinator's certificate; whether the
/// token may be sent unencrypted.
type Tls = (Option<String>, Option<String>, Option<String>, Option<String>, bool);

fn credentials(token: Option<&str>, tls: Tls) -> PyResult<Credentials> {
    let (tls_ca, tls_cert, tls_key, tls_domain, plaintext) = tls;
    let args = CredentialArgs {
        tls_ca: tls_ca.map(Into::into),
        tls_cert: tls_cert.map(Into::into),
        tls_key: tls_key.map(Into::into),
        tls_domain,
        plaintext,
    };
    let token = token.map(Token::parse).transpose();
    let token = token.map_err(|problem| PyValueError::new_err(format!("the token {problem}")))?;
    // The variable is read in the process that requests the workers, not where they run.
    let read = args.load(None, "SWARM_NO_TOKEN");
    let read = read.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(Credentials { token, ..read })
}
