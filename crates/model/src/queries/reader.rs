//! Answers the reading calls of clients from a database.

use std::{io, path::Path, sync::Arc, time::Duration};

use prost::Message;
use swarm_proto::v1;
use tokio::{
    runtime::{Builder, Runtime},
    sync::{Semaphore, watch},
    task,
};
use tonic::Status;

use crate::{
    ids::ExperimentId,
    limits::RECONSTRUCTIONS_OF_PAGES_MAX,
    shared_store::SharedStore,
    store::{Store, StoreError},
};

use super::{QueryError, fitness};

/// Interval between looks at a data directory that another program may write to.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// Answers the reading calls of `ExperimentService`.
#[derive(Debug)]
pub struct Reader {
    store: SharedStore,
    /// One permit for each generation that is recomputed.
    reconstructions: Arc<Semaphore>,
    news: watch::Receiver<u64>,
}

impl Reader {
    /// A reader of a store. `n_reconstructions`: number of generations that are recomputed at the
    /// same time.
    pub fn new(store: SharedStore, n_reconstructions: usize) -> Self {
        let news = store.news();
        Self { store, reconstructions: Arc::new(Semaphore::new(n_reconstructions)), news }
    }

    /// A reader with its own read-only connection to the database in `directory`; `news` changes
    /// after each write.
    pub fn open(directory: &Path, news: watch::Receiver<u64>) -> Result<Self, StoreError> {
        Ok(Self { news, ..Self::beside(directory)? })
    }

    /// A reader of the database in `directory`, to which another program may write; it regularly
    /// looks for news.
    pub fn open_alone(directory: &Path) -> Result<Self, StoreError> {
        let this = Self::beside(directory)?;
        this.store.look_every(LOOK_EVERY);
        Ok(this)
    }

    fn beside(directory: &Path) -> Result<Self, StoreError> {
        let store = SharedStore::new(Store::open_read_only(directory)?);
        Ok(Self::new(store, RECONSTRUCTIONS_OF_PAGES_MAX))
    }

    /// Changes when the database may have changed.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.clone()
    }

    /// Mean fitness over the trials, shape `[generation][individual]`, of at most `n` generations;
    /// and the number of the first one: `from`, or the start of the fitness log if that is later.
    pub async fn fitness(
        &self,
        id: u64,
        from: u64,
        n: u32,
    ) -> Result<(u64, Vec<Vec<f32>>), Status> {
        self.read(move |store| fitness(store, ExperimentId(id), from, n)).await
    }

    /// Reads.
    pub(super) async fn read<T: Send + 'static>(
        &self,
        query: impl FnOnce(&Store) -> Result<T, QueryError> + Send + 'static,
    ) -> Result<T, Status> {
        Ok(self.store.read(query).await?)
    }

    /// Reads, and then recomputes from the data; CPU-bound, so few of these calls run at the same
    /// time.
    pub(super) async fn reconstruct<S: Send + 'static, T: Send + 'static>(
        &self,
        query: impl FnOnce(&Store) -> Result<S, QueryError> + Send + 'static,
        compute: impl FnOnce(S) -> Result<T, QueryError> + Send + 'static,
    ) -> Result<T, Status> {
        let permit = Arc::clone(&self.reconstructions).acquire_owned().await;
        let permit = permit.expect("nobody closes the semaphore");
        let stored = self.store.read(query).await?;
        // A client that leaves does not end the computation, which keeps its permit.
        let computed = task::spawn_blocking(move || {
            let _permit = permit;
            compute(stored)
        })
        .await;
        let panicked = |_| Status::internal("evolution panicked; please report this");
        Ok(computed.map_err(panicked)??)
    }
}

macro_rules! calls {
    (reads { $($name:ident($request:ident) -> $response:ident;)* }) => {
        impl Reader {
            /// Makes a call by its name; request and response are encoded messages.
            pub async fn call(&self, name: &str, request: &[u8]) -> Result<Vec<u8>, Status> {
                $(
                    if stringify!($request).strip_suffix("Request") == Some(name) {
                        let request = v1::$request::decode(request)
                            .map_err(|error| Status::invalid_argument(error.to_string()))?;
                        return Ok(self.$name(request).await?.encode_to_vec());
                    }
                )*
                Err(Status::unimplemented(format!("there is no reading call `{name}`")))
            }
        }
    };
}

crate::reading_calls!(calls);

/// A reader for synchronous code.
#[derive(Debug)]
pub struct BlockingReader {
    /// Dropped before the runtime of its tasks.
    reader: Reader,
    runtime: Runtime,
}

impl BlockingReader {
    /// Opens the database in a directory; another program may write to it.
    pub fn open(directory: &Path) -> io::Result<Self> {
        let runtime = Builder::new_current_thread().enable_time().build()?;
        let reader = Reader::beside(directory).map_err(io::Error::other)?;
        Ok(Self { reader, runtime })
    }

    /// Makes a reading call by its name; request and response are encoded messages.
    pub fn call(&self, name: &str, request: &[u8]) -> Result<Vec<u8>, Status> {
        self.runtime.block_on(self.reader.call(name, request))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[tokio::test]
    async fn a_computation_keeps_its_permit_when_its_client_leaves() {
        let directory = tempfile::tempdir().unwrap();
        let reader = Reader::new(SharedStore::new(Store::open(directory.path()).unwrap()), 1);
        let (started, mut is_started) = tokio::sync::mpsc::channel(1);
        let (end, is_over) = mpsc::channel::<()>();
        let compute = move |()| {
            started.blocking_send(()).unwrap();
            is_over.recv().unwrap();
            Ok(())
        };
        tokio::select! {
            _ = reader.reconstruct(|_| Ok(()), compute) => panic!("it waits"),
            _ = is_started.recv() => {}
        }
        assert_eq!(reader.reconstructions.available_permits(), 0);
        end.send(()).unwrap();
        drop(reader.reconstructions.acquire().await.unwrap());
    }
}
