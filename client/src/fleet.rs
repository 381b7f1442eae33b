//! A coordinator and workers inside this process, talking over loopback as any
//! fleet does.

use std::{net::Ipv4Addr, path::Path};

use coordinator::{Coordinator, CoordinatorConfig};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use worker::{WorkerConfig, WorkerError};

use crate::error::Error;

/// A running fleet; [`Fleet::shutdown`] ends it in order.
pub struct Fleet {
    coordinator: Coordinator,
    workers: JoinSet<Result<(), WorkerError>>,
    shutdown: CancellationToken,
}

impl Fleet {
    /// Starts a coordinator on a free port and workers of one slot each.
    pub async fn start(data_dir: &Path, n_workers: usize) -> Result<Self, Error> {
        let listen = (Ipv4Addr::LOCALHOST, 0).into();
        let config = CoordinatorConfig::new(listen, data_dir.into());
        let coordinator = Coordinator::start(config).await?;
        let mut fleet =
            Self { coordinator, workers: JoinSet::new(), shutdown: CancellationToken::new() };
        for i in 1..=n_workers {
            let config = WorkerConfig::new(fleet.address(), format!("local-{i}"), 1);
            fleet.workers.spawn(worker::run(config, fleet.shutdown.clone()));
        }
        Ok(fleet)
    }

    /// The coordinator's address.
    pub fn address(&self) -> String {
        format!("http://{}", self.coordinator.local_addr())
    }

    /// Waits for a worker to end, which none should.
    pub async fn failure(&mut self) -> Error {
        let reason = match self.workers.join_next().await {
            Some(Ok(Err(error))) => error.to_string(),
            Some(Err(error)) => error.to_string(),
            Some(Ok(Ok(()))) | None => "nobody asked it to".into(),
        };
        Error::Internal(format!("a worker ended: {reason}"))
    }

    /// Lets the workers finish what they are computing, then closes the store.
    pub async fn shutdown(self) {
        let Self { coordinator, mut workers, shutdown } = self;
        shutdown.cancel();
        while workers.join_next().await.is_some() {}
        coordinator.shutdown().await;
    }
}
