//! Answers the requests of pages, as for clients.

use swarm_proto::v1::{Experiment, ExplainExperimentResponse, SubmitExperimentRequest, Worker};
use swarm_web::{Action, Assignment, Control as WebControl};
use tonic::{Request, Status, async_trait};

use crate::{
    clock,
    engine::{Fate, TimelineEntry},
    ids::ExperimentId,
    runs,
};

use super::{Experiments, convert, explain};

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
