//! `ExperimentService`: submit, look, watch, steer.

use std::pin::Pin;

use experiment_file::{ConfigError, ExperimentConfig};
use swarm_proto::v1::{
    CancelExperimentRequest, CancelExperimentResponse, ExplainExperimentRequest,
    ExplainExperimentResponse, GetChampionRequest, GetChampionResponse, GetExperimentRequest,
    GetExperimentResponse, ListEventsRequest, ListEventsResponse, ListExperimentsRequest,
    ListExperimentsResponse, ListGenerationsRequest, ListGenerationsResponse,
    PauseExperimentRequest, PauseExperimentResponse, ResumeExperimentRequest,
    ResumeExperimentResponse, SetPriorityRequest, SetPriorityResponse, SubmitExperimentRequest,
    SubmitExperimentResponse, WatchExperimentRequest, WatchExperimentResponse,
    experiment_service_server::ExperimentService,
};
use tokio::{
    sync::{
        mpsc::{self, error::SendTimeoutError},
        oneshot,
    },
    task,
};
use tokio_stream::{Stream, wrappers::ReceiverStream};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status};
use tracing::info;

use crate::{
    clock,
    driver::{self, Event, EventSender},
    failpoint,
    ids::ExperimentId,
    limits::{
        CHANGE_TIMEOUT, EVENT_PAGE_LEN, KEY_LEN_MAX, PROBLEMS_LEN_MAX, TEXT_LEN_MAX,
        UNFINISHED_MAX, WATCH_PATIENCE, WATCH_QUEUE_LEN,
    },
    priority::Priority,
    shared_store::SharedStore,
    store::{self, ExperimentState, NewExperiment, Store, StoreError},
    submission::{Checked, Runnable, Submission},
};
use evolution::{ALGORITHMS, ChampionSource, Evolution};

use super::{convert, explain, history, shutting_down, store_status};

/// Why an experiment is paused that a client paused.
const PAUSED: &str = "paused by a client";

/// The service.
#[derive(Debug)]
pub struct Experiments {
    /// To the driver.
    pub events: EventSender,
    /// For everything that is only read.
    pub store: SharedStore,
    /// Ends all streams.
    pub shutdown: CancellationToken,
}

#[tonic::async_trait]
impl ExperimentService for Experiments {
    type WatchExperimentStream =
        Pin<Box<dyn Stream<Item = Result<WatchExperimentResponse, Status>> + Send>>;

    async fn submit_experiment(
        &self,
        request: Request<SubmitExperimentRequest>,
    ) -> Result<Response<SubmitExperimentResponse>, Status> {
        let request = request.into_inner();
        for (key, value) in
            [("request_id", &request.request_id), ("default_name", &request.default_name)]
        {
            if value.len() > KEY_LEN_MAX {
                let message = format!("{key} is longer than {KEY_LEN_MAX} bytes");
                return Err(Status::invalid_argument(message));
            }
        }
        let resume_unfinished = request.resume_unfinished;
        let priority = match request.priority {
            Some(weight) => read_priority(weight)?,
            None => Priority::default(),
        };
        let submission = Submission {
            request_id: Some(request.request_id).filter(|id| !id.is_empty()),
            config_json: request.config_json,
            default_name: request.default_name,
            seed: request.seed,
            generations: request.generations,
            priority,
        };
        // Compiling is work for a CPU, not for the I/O threads.
        let Checked { new, evolution, warnings } = task::spawn_blocking(move || submission.check())
            .await
            .map_err(|_| {
                Status::internal("checking the configuration panicked; please report this")
            })?
            .map_err(|error| Status::invalid_argument(problems(&error)))?;

        // In a task of its own: what is stored must reach the driver even if the
        // client goes away meanwhile.
        let (store, events) = (self.store.clone(), self.events.clone());
        let placing = tokio::spawn(async move {
            let placement = store
                .try_write(move |store| place(store, new, evolution, resume_unfinished))
                .await
                .map_err(store_status)?;
            match placement {
                Placement::Runs(runnable) => {
                    failpoint::reached("experiment stored");
                    let id = runnable.id;
                    info!(experiment = %id, name = runnable.config.name, "experiment submitted");
                    let ready = Event::ExperimentReady(runnable);
                    events.send(ready).await.map_err(|_| shutting_down())?;
                    Ok(id)
                }
                Placement::RunsAlready(id) => Ok(id),
                Placement::TooMany => Err(Status::resource_exhausted(format!(
                    "{UNFINISHED_MAX} experiments are unfinished already; wait, or cancel some"
                ))),
            }
        });
        let id = placing.await.map_err(|_| {
            Status::internal("storing the experiment panicked; please report this")
        })??;
        let experiment = self.find(id.0).await?;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(SubmitExperimentResponse { experiment, warnings }))
    }

    async fn get_experiment(
        &self,
        request: Request<GetExperimentRequest>,
    ) -> Result<Response<GetExperimentResponse>, Status> {
        let experiment = self.find(request.into_inner().experiment_id).await?;
        let config_json = experiment.config_json.clone();
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(GetExperimentResponse { experiment, config_json }))
    }

    async fn list_experiments(
        &self,
        _request: Request<ListExperimentsRequest>,
    ) -> Result<Response<ListExperimentsResponse>, Status> {
        let experiments =
            self.store.read(|store| store.experiments()).await.map_err(store_status)?;
        let experiments = experiments.into_iter().map(convert::experiment).collect();
        Ok(Response::new(ListExperimentsResponse { experiments }))
    }

    async fn watch_experiment(
        &self,
        request: Request<WatchExperimentRequest>,
    ) -> Result<Response<Self::WatchExperimentStream>, Status> {
        let request = request.into_inner();
        let id = self.find(request.experiment_id).await?.id;
        let (outbox, inbox) = mpsc::channel(WATCH_QUEUE_LEN + 1);
        // There is always room to say how it ends.
        let farewell = outbox.clone().try_reserve_owned().expect("a new channel has room");
        let (store, shutdown) = (self.store.clone(), self.shutdown.clone());
        tokio::spawn(async move {
            let watching = watch(id, request.from_sequence.max(1), store, &outbox);
            let status = tokio::select! {
                () = shutdown.cancelled() => shutting_down(),
                () = outbox.closed() => return,
                result = watching => match result {
                    Ok(()) => return,
                    Err(status) => status,
                },
            };
            farewell.send(Err(status));
        });
        Ok(Response::new(Box::pin(ReceiverStream::new(inbox))))
    }

    async fn cancel_experiment(
        &self,
        request: Request<CancelExperimentRequest>,
    ) -> Result<Response<CancelExperimentResponse>, Status> {
        let id = ExperimentId(request.into_inner().experiment_id);
        let mut experiment = self.find(id.0).await?;
        if experiment.state.is_unfinished() {
            experiment = self.request(id, driver::Request::Cancel).await?;
        }
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(CancelExperimentResponse { experiment }))
    }

    async fn pause_experiment(
        &self,
        request: Request<PauseExperimentRequest>,
    ) -> Result<Response<PauseExperimentResponse>, Status> {
        let PauseExperimentRequest { experiment_id, reason } = request.into_inner();
        if reason.len() > TEXT_LEN_MAX {
            let message = format!("reason is longer than {TEXT_LEN_MAX} bytes");
            return Err(Status::invalid_argument(message));
        }
        let reason = match convert::printable(&reason) {
            empty if empty.is_empty() => PAUSED.to_owned(),
            reason => format!("{PAUSED}: {reason}"),
        };
        let experiment = self.change(experiment_id, driver::Request::Pause(reason)).await?;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(PauseExperimentResponse { experiment }))
    }

    async fn resume_experiment(
        &self,
        request: Request<ResumeExperimentRequest>,
    ) -> Result<Response<ResumeExperimentResponse>, Status> {
        let id = request.into_inner().experiment_id;
        let experiment = self.change(id, driver::Request::Resume).await?;
        let experiment = Some(convert::experiment(experiment));
        Ok(Response::new(ResumeExperimentResponse { experiment }))
    }

    async fn set_priority(
        &self,
        request: Request<SetPriorityRequest>,
    ) -> Result<Response<SetPriorityResponse>, Status> {
        let SetPriorityRequest { experiment_id, priority } = request.into_inner();
        let priority = read_priority(priority)?;
        let request = driver::Request::SetPriority(priority);
        let experiment = Some(convert::experiment(self.change(experiment_id, request).await?));
        Ok(Response::new(SetPriorityResponse { experiment }))
    }

    async fn get_champion(
        &self,
        request: Request<GetChampionRequest>,
    ) -> Result<Response<GetChampionResponse>, Status> {
        let experiment = self.find(request.into_inner().experiment_id).await?;
        let id = experiment.id;
        let champion =
            self.store.read(move |store| store.champion(id)).await.map_err(store_status)?;
        let Some(champion) = champion else {
            return Err(Status::failed_precondition(format!(
                "experiment {id} has no champion yet: its first generation is not complete"
            )));
        };
        if experiment.fingerprint != sim_core::FINGERPRINT {
            return Err(Status::failed_precondition(format!(
                "experiment {id} was computed with \"{}\", this is \"{}\"; \
                 its network can be decoded with that release only",
                experiment.fingerprint,
                sim_core::FINGERPRINT
            )));
        }
        let genotype = champion.genotype.clone();
        let network =
            task::spawn_blocking(move || network_json(&experiment.config_json, &genotype))
                .await
                .map_err(|_| {
                    Status::internal("decoding the champion panicked; please report this")
                })?
                .map_err(Status::data_loss)?;
        Ok(Response::new(GetChampionResponse {
            experiment_id: id.0,
            generation: champion.generation,
            individual: match champion.source {
                ChampionSource::Individual(individual) => Some(individual),
                ChampionSource::Mean => None,
            },
            fitness: champion.fitness(),
            held_out: champion.held_out.map(convert::held_out),
            trial_fitness: champion.trial_fitness,
            genotype: champion.genotype,
            network_json: network,
        }))
    }

    async fn explain_experiment(
        &self,
        request: Request<ExplainExperimentRequest>,
    ) -> Result<Response<ExplainExperimentResponse>, Status> {
        let experiment = self.find(request.into_inner().experiment_id).await?;
        explain::explain(&self.events, &self.store, experiment).await.map(Response::new)
    }

    async fn list_generations(
        &self,
        request: Request<ListGenerationsRequest>,
    ) -> Result<Response<ListGenerationsResponse>, Status> {
        let request = request.into_inner();
        let id = self.find(request.experiment_id).await?.id;
        history::list_generations(&self.store, id, request).await.map(Response::new)
    }

    async fn list_events(
        &self,
        request: Request<ListEventsRequest>,
    ) -> Result<Response<ListEventsResponse>, Status> {
        let request = request.into_inner();
        let id = self.find(request.experiment_id).await?.id;
        history::list_events(&self.store, id, request).await.map(Response::new)
    }
}

impl Experiments {
    async fn find(&self, id: u64) -> Result<store::Experiment, Status> {
        let experiment = self.store.read(move |store| store.experiment(ExperimentId(id))).await;
        experiment.map_err(store_status)?.ok_or_else(|| {
            Status::not_found(format!("there is no experiment {id}; `swarmctl list` shows all"))
        })
    }
}

impl Experiments {
    /// Has the driver change an experiment that has not ended, and reads it again.
    async fn change(&self, id: u64, request: driver::Request) -> Result<store::Experiment, Status> {
        let experiment = self.find(id).await?;
        if !experiment.state.is_unfinished() {
            return Err(store_status(StoreError::Ended(experiment.id)));
        }
        let experiment = self.request(experiment.id, request).await?;
        if !experiment.state.is_unfinished() {
            return Err(store_status(StoreError::Ended(experiment.id)));
        }
        Ok(experiment)
    }

    /// Has the driver change an experiment, and reads it again.
    async fn request(
        &self,
        id: ExperimentId,
        request: driver::Request,
    ) -> Result<store::Experiment, Status> {
        let (reply, stored) = oneshot::channel();
        let event = Event::Requested { experiment: id, request, reply };
        self.events.send(event).await.map_err(|_| shutting_down())?;
        let stored = tokio::time::timeout(CHANGE_TIMEOUT, stored).await.map_err(|_| {
            Status::resource_exhausted(format!(
                "the database does not take it that experiment {id} is changed; \
                 the coordinator tries again, and its log says why"
            ))
        })?;
        let experiment = self.find(id.0).await?;
        // Not stored: it has ended in another way meanwhile, or the coordinator is
        // about to.
        if stored.is_err() && experiment.state.is_unfinished() {
            return Err(shutting_down());
        }
        Ok(experiment)
    }
}

pub(super) fn read_priority(weight: u32) -> Result<Priority, Status> {
    Priority::new(weight).ok_or_else(|| {
        Status::invalid_argument(format!("priority is {weight}, not within 1..={}", Priority::MAX))
    })
}

/// Where a submission ends up.
enum Placement {
    /// The driver has to run it.
    Runs(Box<Runnable>),
    /// The driver knows it, or it has ended.
    RunsAlready(ExperimentId),
    TooMany,
}

fn place(
    store: &mut Store,
    new: NewExperiment,
    evolution: Evolution,
    resume_unfinished: bool,
) -> Result<Placement, StoreError> {
    if let Some(request_id) = &new.request_id
        && let Some(id) = store.experiment_of_request(request_id)?
    {
        return Ok(Placement::RunsAlready(id));
    }
    let experiments = store.experiments()?;
    if resume_unfinished && let Some(placement) = resume(store, &experiments, &new)? {
        return Ok(placement);
    }
    let is_unfinished = |e: &&store::Experiment| e.state.is_unfinished();
    if experiments.iter().filter(is_unfinished).count() >= UNFINISHED_MAX {
        return Ok(Placement::TooMany);
    }
    let (id, is_new) = store.create(&new, clock::unix_ms())?;
    Ok(if is_new {
        Placement::Runs(Box::new(Runnable::new(id, new.config, evolution, new.priority)))
    } else {
        Placement::RunsAlready(id)
    })
}

/// Looks for an experiment of the same bits that can go on: one that is
/// unfinished, or one that was asked for fewer generations.
fn resume(
    store: &mut Store,
    experiments: &[store::Experiment],
    new: &NewExperiment,
) -> Result<Option<Placement>, StoreError> {
    let config_json = new.config.to_canonical_json();
    // The digest tells versions of the simulation apart.
    let config_digest = new.config_digest.to_string();
    let same_bits = experiments.iter().rev().filter(|e| e.config_digest == config_digest);
    let is_unfinished = |e: &&store::Experiment| e.state.is_unfinished();
    let mut unfinished = same_bits.clone().filter(is_unfinished);
    if let Some(same) = unfinished.find(|e| e.config_json == config_json) {
        return Ok(Some(Placement::RunsAlready(same.id)));
    }
    for experiment in same_bits {
        let n_done = experiment.latest.as_ref().map_or(0, |latest| latest.generation + 1);
        let can_go_on = experiment.state == ExperimentState::Completed
            && experiment.reason.is_empty()
            && n_done < new.config.algorithm.generations
            && differs_in_generations_only(&experiment.config_json, &new.config);
        if can_go_on && let Some(checkpoint) = store.checkpoint(experiment.id)? {
            let reopened =
                store::Experiment { config_json: config_json.clone(), ..experiment.clone() };
            let runnable = Runnable::restore(&reopened, &checkpoint)?;
            store.reopen(experiment.id, &config_json, clock::unix_ms())?;
            return Ok(Some(Placement::Runs(Box::new(runnable))));
        }
    }
    Ok(None)
}

fn differs_in_generations_only(config_json: &str, config: &ExperimentConfig) -> bool {
    ExperimentConfig::from_json(config_json, "", ALGORITHMS).is_ok_and(|(mut other, _)| {
        other.algorithm.generations = config.algorithm.generations;
        other == *config
    })
}

/// Sends events until the experiment is over.
async fn watch(
    id: ExperimentId,
    mut next_sequence: u64,
    store: SharedStore,
    outbox: &mpsc::Sender<Result<WatchExperimentResponse, Status>>,
) -> Result<(), Status> {
    let mut news = store.news();
    loop {
        news.mark_unchanged();
        let (page, is_over) = store
            .read(move |store| {
                let experiment = store.experiment(id)?;
                let is_over = experiment.is_none_or(|e| !e.state.is_unfinished());
                Ok((store.events(id, next_sequence, EVENT_PAGE_LEN)?, is_over))
            })
            .await
            .map_err(store_status)?;
        let is_full = page.len() == EVENT_PAGE_LEN as usize;
        for event in page {
            let sequence = event.sequence;
            let response = WatchExperimentResponse { event: Some(convert::event(event)) };
            match outbox.send_timeout(Ok(response), WATCH_PATIENCE).await {
                Ok(()) => next_sequence = sequence + 1,
                Err(SendTimeoutError::Closed(_)) => return Ok(()),
                Err(SendTimeoutError::Timeout(_)) => {
                    info!(experiment = %id, sequence, "a watcher is too slow and dropped");
                    return Err(Status::aborted(format!(
                        "events were not read for {} s; resume from sequence {sequence}",
                        WATCH_PATIENCE.as_secs()
                    )));
                }
            }
        }
        if !is_full && is_over {
            return Ok(());
        }
        if !is_full && news.changed().await.is_err() {
            return Err(shutting_down());
        }
    }
}

/// All problems, one per line, as far as there is room.
pub(super) fn problems(error: &ConfigError) -> String {
    let mut text = String::new();
    for (i, problem) in error.problems.iter().enumerate() {
        let line = problem.to_string();
        if i > 0 && text.len() + line.len() > PROBLEMS_LEN_MAX {
            text += &format!("\n... and {} more", error.problems.len() - i);
            break;
        }
        if i > 0 {
            text.push('\n');
        }
        text += &line[..line.floor_char_boundary(PROBLEMS_LEN_MAX)];
    }
    text
}

fn network_json(config_json: &str, genotype: &[f64]) -> Result<String, String> {
    let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .map_err(|error| error.to_string())?;
    let experiment = sim_core::Simulation::compile(&config).map_err(|error| error.to_string())?;
    let network = experiment.network_json(genotype).map_err(|error| error.to_string())?;
    Ok(network.to_string())
}

#[cfg(test)]
mod tests;
