//! Answers the requests of pages, as for clients.

use swarm_proto::v1::{Experiment, ExplainExperimentResponse, SubmitExperimentRequest, Worker};
use swarm_web::{Action, Control as WebControl};
use tonic::{Request, Status, async_trait};

use engine::TimelineEntry;

use crate::{clock, ids::ExperimentId, runs};

use super::{Experiments, convert, explain};

#[async_trait]
impl WebControl for Experiments {
    async fn workers(&self) -> Result<Vec<Worker>, Status> {
        let workers = self.control.workers().await?;
        let now_ms = clock::unix_ms();
        Ok(workers.into_iter().map(|worker| convert::worker(worker, now_ms)).collect())
    }

    async fn timeline(&self) -> Result<Vec<TimelineEntry>, Status> {
        Ok(self.control.timeline().await?)
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
                let request = runs::Request::SetPriority(convert::priority(weight)?);
                self.control.change(id, request).await
            }
            Action::Archive(is_archived) => {
                self.control.archive(id, is_archived).await.map(|(experiment, _)| experiment)
            }
            Action::Label(set, remove) => self.control.label(id, set, remove).await,
        };
        Ok(changed?.into())
    }

    async fn submit(&self, request: SubmitExperimentRequest) -> Result<Experiment, Status> {
        let response = Self::submit_experiment(self, Request::new(request)).await?.into_inner();
        response.experiment.ok_or_else(|| Status::internal("there is no experiment"))
    }
}
