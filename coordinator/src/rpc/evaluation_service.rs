//! `EvaluationService`: one genotype, many trials, every step measured.

use std::{pin::Pin, sync::Arc};

use experiment_file::{ExperimentConfig, limits};
use sim_core::Simulation;
use swarm_proto::v1::{
    EvaluateRequest, EvaluateResponse, MeasuredTask, MeasuredTrial, evaluate_response::Message,
    evaluation_service_server::EvaluationService,
};
use tokio::{
    sync::{Semaphore, mpsc, oneshot},
    task,
    time::timeout,
};
use tokio_stream::{Stream, wrappers::ReceiverStream};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status};

use crate::{
    driver::{Evaluation, Event, EventSender},
    limits::{EVALUATION_VALUES_MAX, EVALUATIONS_MAX, TRIAL_VALUES_MAX, WATCH_PATIENCE},
    priority::Priority,
};

use super::{
    experiment_service::{problems, read_priority},
    shutting_down,
};

/// The service.
#[derive(Debug)]
pub struct Evaluations {
    /// To the driver.
    events: EventSender,
    /// Ends all streams.
    shutdown: CancellationToken,
    /// One for each that is computed.
    permits: Arc<Semaphore>,
}

impl Evaluations {
    /// A service that computes nothing yet.
    pub fn new(events: EventSender, shutdown: CancellationToken) -> Self {
        Self { events, shutdown, permits: Arc::new(Semaphore::new(EVALUATIONS_MAX)) }
    }
}

type Outbox = mpsc::Sender<Result<EvaluateResponse, Status>>;

#[tonic::async_trait]
impl EvaluationService for Evaluations {
    type EvaluateStream = Pin<Box<dyn Stream<Item = Result<EvaluateResponse, Status>> + Send>>;

    async fn evaluate(
        &self,
        request: Request<EvaluateRequest>,
    ) -> Result<Response<Self::EvaluateStream>, Status> {
        let request = request.into_inner();
        // Compiling is work for a CPU, not for the I/O threads.
        let checked =
            task::spawn_blocking(move || Checked::new(request)).await.map_err(|_| {
                Status::internal("checking the configuration panicked; please report this")
            })??;
        // There is always room for what is measured, and to say how it ends.
        let (outbox, inbox) = mpsc::channel(2);
        let farewell = outbox.clone().try_reserve_owned().expect("a new channel has room");
        let (events, permits) = (self.events.clone(), Arc::clone(&self.permits));
        let shutdown = self.shutdown.clone();
        tokio::spawn(async move {
            let status = tokio::select! {
                () = shutdown.cancelled() => shutting_down(),
                // Dropping the rest tells the driver.
                () = outbox.closed() => return,
                result = evaluate(checked, &events, &permits, &outbox) => match result {
                    Ok(()) => return,
                    Err(status) => status,
                },
            };
            farewell.send(Err(status));
        });
        Ok(Response::new(Box::pin(ReceiverStream::new(inbox))))
    }
}

/// A request that can be computed.
struct Checked {
    spec: Arc<str>,
    genotype: Vec<f64>,
    n_trials: u32,
    n_values: usize,
    priority: Priority,
    task: MeasuredTask,
}

impl Checked {
    fn new(request: EvaluateRequest) -> Result<Self, Status> {
        let EvaluateRequest { config_json, genotype, trial_count, priority } = request;
        let priority = priority.map_or(Ok(Priority::default()), read_priority)?;
        if trial_count == 0 || trial_count > limits::TRIALS {
            let message =
                format!("trial_count is {trial_count}, not within 1..={}", limits::TRIALS);
            return Err(Status::invalid_argument(message));
        }
        let config = ExperimentConfig::from_json(&config_json, "", evolution::ALGORITHMS);
        let compiled = config.and_then(|(config, _)| {
            let experiment = Simulation::compile(&config)?;
            Ok((config, experiment))
        });
        let (config, experiment) =
            compiled.map_err(|error| Status::invalid_argument(problems(&error)))?;
        experiment
            .check_genotype(&genotype)
            .map_err(|error| Status::invalid_argument(error.to_string()))?;
        let n_values = experiment.values_per_trial();
        let n_all = n_values * trial_count as usize;
        if n_values > TRIAL_VALUES_MAX || n_all > EVALUATION_VALUES_MAX {
            return Err(Status::invalid_argument(format!(
                "{n_values} numbers per trial and {n_all} together are more than the limits of \
                 {TRIAL_VALUES_MAX} and {EVALUATION_VALUES_MAX}; take fewer steps or trials"
            )));
        }
        let metrics = experiment.measure_names().iter().map(ToString::to_string).collect();
        Ok(Self {
            spec: config.to_canonical_json().into(),
            genotype,
            n_trials: trial_count,
            n_values,
            priority,
            task: MeasuredTask { metrics, steps: experiment.n_steps() },
        })
    }
}

async fn evaluate(
    checked: Checked,
    events: &EventSender,
    permits: &Semaphore,
    outbox: &Outbox,
) -> Result<(), Status> {
    let Checked { spec, genotype, n_trials, n_values, priority, task } = checked;
    send(outbox, Message::Task(task)).await?;
    let _permit = permits.acquire().await.expect("nobody closes the semaphore");
    let (reply, result) = oneshot::channel();
    let evaluation = Box::new(Evaluation { spec, genotype, n_trials, n_values, priority, reply });
    let request = Event::EvaluationRequested(evaluation);
    events.send(request).await.map_err(|_| shutting_down())?;
    let values = result.await.map_err(|_| shutting_down())?.map_err(Status::internal)?;
    for (trial, values) in (0..).zip(values.chunks_exact(n_values)) {
        let (fitness, values) = (values[0], values[1..].to_vec());
        send(outbox, Message::Trial(MeasuredTrial { trial, fitness, values })).await?;
    }
    Ok(())
}

/// Waits for a client to read, but not for ever: it holds memory meanwhile.
async fn send(outbox: &Outbox, message: Message) -> Result<(), Status> {
    let response = EvaluateResponse { message: Some(message) };
    let sent = timeout(WATCH_PATIENCE, outbox.send(Ok(response))).await;
    sent.map_err(|_| Status::aborted("the client does not read; ask again"))?
        // It has gone, and so does whoever calls this.
        .map_err(|_| Status::cancelled("the client has gone"))
}
