//! What pages ask, answered as clients are.

use std::{num::NonZeroU64, path::Path, time::Duration};

use swarm_proto::v1::{
    Experiment, ExplainExperimentResponse, GetChampionResponse, GetExperimentResponse,
    ListDynamicsResponse, ListEventsRequest, ListEventsResponse, ListGenerationsRequest,
    ListGenerationsResponse, SubmitExperimentRequest, Worker,
    experiment_service_server::ExperimentService as _,
};
use swarm_web::{Action, Archive, Assignment, Control as WebControl, Families};
use tokio::{
    sync::{Semaphore, watch},
    task,
};
use tonic::{Request, Status, async_trait};

use crate::{
    clock,
    control::ControlError,
    engine::{Fate, TimelineEntry},
    ids::ExperimentId,
    limits::RECONSTRUCTIONS_OF_PAGES_MAX,
    queries::{self, QueryError, Several, StoredDynamics, StoredFamilies, StoredIndividuals},
    shared_store::SharedStore,
    store::{Filter, Store, StoreError},
};

use super::{Experiments, convert, explain, status};

/// How often a data directory is looked at that somebody else may write to.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// A database that pages read by a connection of their own, which writes nothing.
#[derive(Debug)]
pub struct PagesArchive {
    store: SharedStore,
    reconstructions: Semaphore,
    news: watch::Receiver<u64>,
}

impl PagesArchive {
    /// The database in `directory`; `news` changes when something has been written.
    pub fn open(directory: &Path, news: watch::Receiver<u64>) -> Result<Self, StoreError> {
        let store = SharedStore::new(Store::open_read_only(directory)?);
        Ok(Self { store, reconstructions: Semaphore::new(RECONSTRUCTIONS_OF_PAGES_MAX), news })
    }

    /// The database in `directory`, to which a coordinator may write that is not here.
    pub fn open_alone(directory: &Path) -> Result<Self, StoreError> {
        let store = SharedStore::new(Store::open_read_only(directory)?);
        store.look_every(LOOK_EVERY);
        let news = store.news();
        Ok(Self { store, reconstructions: Semaphore::new(RECONSTRUCTIONS_OF_PAGES_MAX), news })
    }
}

#[async_trait]
impl Archive for PagesArchive {
    async fn experiments(&self) -> Result<Vec<Experiment>, Status> {
        let experiments = self.store.read(|store| store.experiments(&Filter::default())).await?;
        Ok(experiments.into_iter().map(convert::experiment).collect())
    }

    async fn experiment(&self, id: u64) -> Result<GetExperimentResponse, Status> {
        let read = move |store: &Store| queries::experiment(store, ExperimentId(id));
        Ok(convert::stored_experiment(self.store.read(read).await?))
    }

    async fn generations(
        &self,
        request: ListGenerationsRequest,
    ) -> Result<ListGenerationsResponse, Status> {
        let ListGenerationsRequest { experiment_id, from_generation, page_size } = request;
        let id = ExperimentId(experiment_id);
        let read = move |store: &Store| queries::generations(store, id, from_generation, page_size);
        Ok(convert::generations(self.store.read(read).await?))
    }

    async fn events(&self, request: ListEventsRequest) -> Result<ListEventsResponse, Status> {
        let ListEventsRequest { experiment_id, from_sequence, page_size } = request;
        let id = ExperimentId(experiment_id);
        let read = move |store: &Store| queries::events(store, id, from_sequence, page_size);
        Ok(convert::events(self.store.read(read).await?))
    }

    async fn fitness(&self, id: u64, from: u64, n: u32) -> Result<(u64, Vec<Vec<f32>>), Status> {
        let read = move |store: &Store| queries::fitness(store, ExperimentId(id), from, n);
        Ok(self.store.read(read).await?)
    }

    async fn dynamics(&self, id: u64, from: u64) -> Result<ListDynamicsResponse, Status> {
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let read = move |store: &Store| StoredDynamics::read(store, ExperimentId(id), from);
        let stored = self.store.read(read).await?;
        let found = task::spawn_blocking(move || stored.replay())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        Ok(convert::dynamics(found))
    }

    async fn families(&self, id: u64, from: u64, every: NonZeroU64) -> Result<Families, Status> {
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let read =
            move |store: &Store| StoredFamilies::read(store, ExperimentId(id), from, every.get());
        let stored = self.store.read(read).await?;
        let (populations, generations, next) = task::spawn_blocking(move || stored.replay())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        Ok(Families { populations, generations, next })
    }

    async fn individual(&self, address: &str) -> Result<GetChampionResponse, Status> {
        let _permit = self.reconstructions.acquire().await.map_err(|_| status::shutting_down())?;
        let address = convert::address(address)?;
        let read = move |store: &Store| StoredIndividuals::read(store, address, Several::default());
        let stored = self.store.read(read).await?;
        let found = task::spawn_blocking(move || stored.reconstruct())
            .await
            .map_err(|_| ControlError::Panicked("evolution"))??;
        let individual = convert::individuals(found).individuals.pop();
        individual.ok_or_else(|| QueryError::NoChampion(address.experiment).into())
    }

    fn news(&self) -> watch::Receiver<u64> {
        self.news.clone()
    }
}

#[async_trait]
impl WebControl for Experiments {
    async fn workers(&self) -> Result<Vec<Worker>, Status> {
        let workers = self.control.workers().await?;
        let now_ms = clock::unix_ms();
        Ok(workers.into_iter().map(|worker| convert::worker(worker, now_ms)).collect())
    }

    async fn timeline(&self) -> Result<Vec<Assignment>, Status> {
        let entries = self.control.timeline().await?;
        Ok(entries.into_iter().map(assignment).collect())
    }

    async fn explain(&self, id: u64) -> Result<ExplainExperimentResponse, Status> {
        Ok(explain::explanation(self.control.explain(ExperimentId(id)).await?))
    }

    async fn steer(&self, id: u64, action: Action) -> Result<Experiment, Status> {
        let id = ExperimentId(id);
        let changed = match action {
            Action::Pause => self.control.pause(id, "").await,
            Action::Resume => self.control.resume(id).await,
            Action::Cancel => self.control.cancel(id).await,
            Action::Priority(weight) => {
                self.control.set_priority(id, convert::priority(weight)?).await
            }
            Action::Archive(is_archived) => {
                self.control.archive(id, is_archived).await.map(|(experiment, _)| experiment)
            }
            Action::Label(set, remove) => self.control.label(id, set, remove).await,
        };
        Ok(convert::experiment(changed?))
    }

    async fn submit(&self, request: SubmitExperimentRequest) -> Result<Experiment, Status> {
        let response = self.submit_experiment(Request::new(request)).await?.into_inner();
        response.experiment.ok_or_else(|| Status::internal("there is no experiment"))
    }
}

/// An assignment for pages.
fn assignment(entry: TimelineEntry) -> Assignment {
    Assignment {
        worker_id: entry.worker.0,
        batch: entry.batch(),
        worker_name: entry.name.to_string(),
        experiment: entry.job.experiment().map(|id| id.0),
        individual: entry.individual,
        trials: entry.trials,
        assigned_for: entry.assigned_for,
        ended_for: entry.ended_for,
        busy: entry.busy,
        fate: match entry.fate {
            Fate::Unanswered => swarm_web::Fate::Unanswered,
            Fate::Computed => swarm_web::Fate::Computed,
            Fate::TakenBack => swarm_web::Fate::TakenBack,
            Fate::Failed => swarm_web::Fate::Failed,
            Fate::Lost => swarm_web::Fate::Lost,
        },
    }
}
