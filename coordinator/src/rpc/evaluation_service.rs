//! `EvaluationService`: evaluates genotypes in many trials, and measures every step.

use std::pin::Pin;

use sim_core::TrialSet;
use swarm_proto::v1::{
    ComparisonTrials, EvaluateFitnessRequest, EvaluateFitnessResponse, EvaluateRequest,
    EvaluateResponse, EvolutionTrials, FitnessOfTrials, MeasuredTask, MeasuredTrial,
    evaluate_response::Message, evaluation_service_server::EvaluationService,
    evolution_trials::Trials,
};
use tokio::{sync::mpsc, time::timeout};
use tokio_stream::{Stream, wrappers::ReceiverStream};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status};

use crate::{
    control::{CheckedEvaluation, Control, EvaluationOrder, FitnessOrder},
    limits::WATCH_PATIENCE,
    priority::Priority,
};

use super::{client, convert, shutting_down};

/// The service.
#[derive(Debug)]
pub struct Evaluations {
    /// The handle to the coordinator.
    pub control: Control,
    /// Ends all streams.
    pub shutdown: CancellationToken,
}

type Outbox = mpsc::Sender<Result<EvaluateResponse, Status>>;

#[tonic::async_trait]
impl EvaluationService for Evaluations {
    type EvaluateStream = Pin<Box<dyn Stream<Item = Result<EvaluateResponse, Status>> + Send>>;

    async fn evaluate(
        &self,
        request: Request<EvaluateRequest>,
    ) -> Result<Response<Self::EvaluateStream>, Status> {
        let control = self.control.for_client(client(&request));
        let EvaluateRequest { config_json, genotype, trial_count, priority } = request.into_inner();
        let priority = priority.map_or(Ok(Priority::default()), convert::priority)?;
        let order = EvaluationOrder { config_json, genotype, n_trials: trial_count, priority };
        let checked = control.check_evaluation(order).await?;
        // Reserved, so that there is always room for the first message, and for the error that
        // ends the stream.
        let (outbox, inbox) = mpsc::channel(2);
        let final_slot = outbox.clone().try_reserve_owned().expect("a new channel has room");
        let (control, shutdown) = (self.control.clone(), self.shutdown.clone());
        tokio::spawn(async move {
            let status = tokio::select! {
                () = shutdown.cancelled() => shutting_down(),
                // Dropping the rest tells the driver that the client has gone.
                () = outbox.closed() => return,
                result = evaluate(&control, checked, &outbox) => match result {
                    Ok(()) => return,
                    Err(status) => status,
                },
            };
            final_slot.send(Err(status));
        });
        Ok(Response::new(Box::pin(ReceiverStream::new(inbox))))
    }

    async fn evaluate_fitness(
        &self,
        request: Request<EvaluateFitnessRequest>,
    ) -> Result<Response<EvaluateFitnessResponse>, Status> {
        let control = self.control.for_client(client(&request));
        let request = request.into_inner();
        let order = FitnessOrder {
            config_json: request.config_json,
            genotypes: request.genotypes.into_iter().map(|genes| genes.values).collect(),
            trial_set: trial_set(request.trials)?,
            n_trials: request.trial_count,
            with_descriptors: request.descriptors,
            priority: request.priority.map_or(Ok(Priority::default()), convert::priority)?,
        };
        let fitness = tokio::select! {
            () = self.shutdown.cancelled() => return Err(shutting_down()),
            fitness = control.fitness(order) => fitness?,
        };
        let fitness = fitness.into_iter().map(|values| FitnessOfTrials { values }).collect();
        Ok(Response::new(EvaluateFitnessResponse { fitness }))
    }
}

/// The trials that a client names, or the mistake in them.
fn trial_set(trials: Option<EvolutionTrials>) -> Result<TrialSet, Status> {
    match trials.and_then(|message| message.trials) {
        Some(Trials::Generation(generation)) => Ok(TrialSet::Generation(generation)),
        Some(Trials::Judgement(generation)) => Ok(TrialSet::Judgement(generation)),
        Some(Trials::Comparison(ComparisonTrials { generation, block })) => {
            let block = u8::try_from(block)
                .map_err(|_| Status::invalid_argument("a block is a number up to 255"))?;
            Ok(TrialSet::HeldOut { generation, block })
        }
        None => Err(Status::invalid_argument("trials are missing")),
    }
}

async fn evaluate(
    control: &Control,
    checked: CheckedEvaluation,
    outbox: &Outbox,
) -> Result<(), Status> {
    let task = MeasuredTask { metrics: checked.measures.clone(), steps: checked.n_steps };
    send(outbox, Message::Task(task)).await?;
    let evaluated = control.evaluate(checked).await?;
    for (trial, (fitness, values)) in (0..).zip(evaluated.trials()) {
        let values = values.to_vec();
        send(outbox, Message::Trial(MeasuredTrial { trial, fitness, values })).await?;
    }
    Ok(())
}

/// Waits for a client to read, for a limited time, because the client holds memory meanwhile.
async fn send(outbox: &Outbox, message: Message) -> Result<(), Status> {
    let response = EvaluateResponse { message: Some(message) };
    let sent = timeout(WATCH_PATIENCE, outbox.send(Ok(response))).await;
    sent.map_err(|_| Status::aborted("the client does not read; ask again"))?
        // The client has gone, so the caller stops, too.
        .map_err(|_| Status::cancelled("the client has gone"))
}
