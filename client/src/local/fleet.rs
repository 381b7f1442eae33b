//! A coordinator and workers inside this process, connected over loopback as in any
//! fleet.

use std::{
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
};

use coordinator::{Access, Coordinator, CoordinatorConfig, RunError, Tokens};
use sim_core::Isa;
use swarm_telemetry::Starved;
use swarm_transport::{Credentials, Token};
use tokio::{task::JoinSet, time::timeout};
use tokio_util::sync::CancellationToken;
use worker::{FINISHING_TIME, WorkerConfig, WorkerError};

use crate::{
    connection::Connection,
    error::Error,
    pages::{login_address, random_token},
    progress::Progress,
};

/// A running fleet; [`Fleet::shutdown`] ends it in order.
pub struct Fleet {
    data_dir: PathBuf,
    coordinator: Coordinator,
    client_token: Token,
    workers: JoinSet<Result<(), WorkerError>>,
    shutdown: CancellationToken,
    /// Ends the items that workers still compute after `shutdown`.
    give_up: CancellationToken,
}

impl Fleet {
    /// Starts a coordinator on a free port and workers of one slot each. Random tokens
    /// exclude the machine's other users. `web_listen`: the address of the pages, if any.
    pub async fn start(
        data_dir: &Path,
        n_workers: usize,
        isa: Isa,
        web_listen: Option<SocketAddr>,
    ) -> Result<Self, Error> {
        let listen = (Ipv4Addr::LOCALHOST, 0).into();
        let (client_token, worker_token) = (random_token(), random_token());
        let tokens =
            Tokens::new(client_token.clone(), worker_token.clone()).expect("random tokens differ");
        let config = CoordinatorConfig {
            access: Access { tokens: Some(tokens), ..Access::default() },
            // No other program has a token for this coordinator.
            is_announced: false,
            // The user has started one experiment here, not the other unfinished ones.
            takes_up_unfinished: false,
            // The user who submits here also owns the machine.
            memory_budget: u64::MAX,
            web_listen,
            ..CoordinatorConfig::new(listen, data_dir.into())
        };
        let coordinator = Coordinator::start(config).await?;
        let mut fleet = Self {
            data_dir: data_dir.into(),
            coordinator,
            client_token,
            workers: JoinSet::new(),
            shutdown: CancellationToken::new(),
            give_up: CancellationToken::new(),
        };
        for i in 1..=n_workers {
            let config = WorkerConfig {
                credentials: credentials(&worker_token),
                isa,
                give_up: fleet.give_up.clone(),
                ..WorkerConfig::new(fleet.address(), format!("local-{i}"), 1)
            };
            fleet.workers.spawn(worker::run(config, fleet.shutdown.clone()));
        }
        Ok(fleet)
    }

    /// A client's connection to the coordinator.
    pub fn connection(&self) -> Connection {
        Connection::computing(&self.data_dir, self.coordinator.door().clone())
    }

    /// The address of its pages, with the token, if it serves any.
    pub fn pages(&self) -> Option<String> {
        let address = self.coordinator.web_addr()?;
        Some(login_address(address, &self.client_token))
    }

    fn address(&self) -> String {
        format!("http://{}", self.coordinator.local_addr())
    }

    /// Waits for the coordinator or a worker to end unexpectedly.
    pub async fn failure(&mut self) -> Error {
        let ended = tokio::select! {
            error = self.coordinator.failure() => return match error {
                RunError::TakenOver(why) | RunError::Damaged(why) => Error::Input(why),
                error => Error::Internal(error.to_string()),
            },
            ended = self.workers.join_next() => ended,
        };
        let reason = match ended {
            Some(Ok(Err(WorkerError::Threads(error)))) if self.workers.is_empty() => {
                return Error::Starved(Starved::new(error));
            }
            // Fewer workers compute the same results.
            Some(Ok(Err(WorkerError::Threads(_)))) => return Box::pin(self.failure()).await,
            Some(Ok(Err(error))) => error.to_string(),
            Some(Err(error)) => error.to_string(),
            Some(Ok(Ok(()))) | None => "it ended by itself".into(),
        };
        Error::Internal(format!("a worker ended: {reason}"))
    }

    /// Like [`Self::shutdown`]; after an interrupt, prints why it waits.
    pub async fn stop(self, result: &Result<(), Error>, progress: &Progress) {
        if matches!(result, Err(Error::Interrupted(_))) {
            progress.remark("stopping after the running items; interrupt again to stop at once");
        }
        self.shutdown().await;
    }

    /// Lets the workers finish their items, those of scripts within [`FINISHING_TIME`], then
    /// closes the store.
    pub async fn shutdown(self) {
        let Self { coordinator, mut workers, shutdown, give_up, .. } = self;
        shutdown.cancel();
        let finished = async { while workers.join_next().await.is_some() {} };
        if timeout(FINISHING_TIME, finished).await.is_err() {
            give_up.cancel();
            while workers.join_next().await.is_some() {}
        }
        coordinator.shutdown().await;
    }
}

fn credentials(token: &Token) -> Credentials {
    Credentials { token: Some(token.clone()), ..Credentials::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn other_users_of_the_machine_are_kept_out() {
        let directory = tempfile::tempdir().unwrap();
        let fleet = Fleet::start(directory.path(), 1, Isa::best(), None).await.unwrap();
        let stranger = Connection::new(&fleet.address(), &Credentials::default()).unwrap();
        assert_eq!(stranger.experiments().await.unwrap_err().exit_code(), 7);
        assert!(fleet.connection().experiments().await.unwrap().is_empty());
        fleet.shutdown().await;
    }
}
