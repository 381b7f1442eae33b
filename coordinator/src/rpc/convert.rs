//! Converts wire types to core types and back.

use std::time::Duration;

use sim_core::Output;
use swarm_proto::v1::{self, WorkResponse, item_result::Outcome, work_response::Message};
use tonic::Status;

use engine::{
    Assignment, Assignments, BatchActivity, EvaluationActivity, ItemResult, ToWorker, WorkerStatus,
};

use crate::{codec, control::ControlError, ids::AssignmentId, priority::Priority, text::printable};

/// The durations in `Welcome`.
#[derive(Debug, Clone, Copy)]
pub struct WelcomeTimes {
    /// Between heartbeats.
    pub heartbeat_interval: Duration,
    /// Time of silence after which a worker loses its items.
    pub lease: Duration,
}

/// A message to a worker, or the status that ends its stream.
pub fn to_wire(message: ToWorker, times: WelcomeTimes) -> Result<WorkResponse, Status> {
    let message = match message {
        ToWorker::Welcome(id) => Message::Welcome(v1::Welcome {
            worker_id: id.0,
            heartbeat_interval_ms: times.heartbeat_interval.as_millis() as u32,
            lease_ms: times.lease.as_millis() as u32,
        }),
        ToWorker::Spec(id, config_json) => Message::Spec(v1::JobSpec {
            job: Some(codec::job(id)),
            config_json: config_json.to_string(),
        }),
        ToWorker::Distribution(id, distribution) => Message::Distribution(v1::Distribution {
            job: Some(codec::job(id)),
            distribution: distribution.to_vec(),
        }),
        ToWorker::Assignments(Assignments { job: id, trial_set: set, output: wanted, items }) => {
            Message::Assignments(v1::Assignments {
                job: Some(codec::job(id)),
                trial_set: Some(codec::trial_set(set)),
                output: codec::output(wanted).into(),
                assignments: items.iter().map(assignment).collect(),
            })
        }
        ToWorker::End(id) => Message::EndJob(v1::EndJob { job: Some(codec::job(id)) }),
        ToWorker::Drop(assignments) => {
            let assignment_ids = assignments.iter().map(|id| id.0).collect();
            Message::DropAssignments(v1::DropAssignments { assignment_ids })
        }
        ToWorker::Dropped(reason) => {
            return Err(Status::aborted(format!("the coordinator drops this worker: {reason}")));
        }
    };
    Ok(WorkResponse { message: Some(message) })
}

fn assignment(assignment: &Assignment) -> v1::Assignment {
    v1::Assignment {
        assignment_id: assignment.id.0,
        first_trial: assignment.trials.start,
        trial_count: assignment.trials.end - assignment.trials.start,
        genotype: if assignment.is_drawn { Vec::new() } else { assignment.genotype.to_vec() },
        individual: assignment.is_drawn.then_some(assignment.genotype.individual),
    }
}

/// A worker's result.
pub fn item_result(result: v1::ItemResult) -> ItemResult {
    let output = match result.outcome {
        Some(Outcome::Measures(_)) => Output::Measures,
        Some(Outcome::Descriptors(_)) => Output::Descriptors,
        _ => Output::Fitness,
    };
    ItemResult {
        id: AssignmentId(result.assignment_id),
        output,
        outcome: match result.outcome {
            Some(Outcome::Fitness(fitness)) => Ok(fitness.values),
            Some(Outcome::Measures(measures)) => Ok(measures.values),
            Some(Outcome::Descriptors(descriptors)) => Ok(descriptors.values),
            Some(Outcome::Failure(failure)) => Err(printable(&failure.message)),
            None => Err("no outcome".to_owned()),
        },
        compute_time: Duration::from_micros(result.compute_us),
    }
}

/// A worker for clients; `now_ms`: now, since 1970 UTC.
pub fn worker(worker: WorkerStatus, now_ms: u64) -> v1::Worker {
    let ago = |duration: Duration| now_ms.saturating_sub(duration.as_millis() as u64);
    v1::Worker {
        id: worker.id.0,
        connected_at_ms: ago(worker.connected_for),
        last_heard_at_ms: ago(worker.silent_for),
        name: worker.name,
        version: worker.version,
        slots: worker.n_slots as u32,
        items_in_flight: worker.n_in_flight as u32,
        results_per_second: worker.results_per_s,
        idle_share: worker.idle_share,
        draining: worker.is_draining,
        distrusted: worker.quarantined.unwrap_or_default(),
        waits: worker.waits.unwrap_or_default(),
        experiments: worker.experiments.to_string(),
    }
}

/// An evaluation for clients.
pub fn evaluation(evaluation: EvaluationActivity) -> v1::RunningEvaluation {
    let EvaluationActivity { name, activity } = evaluation;
    let batch = activity.batch.as_ref();
    let of_batch = |count: fn(&BatchActivity) -> usize| batch.map_or(0, count);
    v1::RunningEvaluation {
        name: name.to_string(),
        episodes: of_batch(|batch| batch.n_episodes) as u64,
        episodes_left: of_batch(|batch| batch.n_episodes_left) as u64,
        items_queued: of_batch(|batch| batch.n_items_queued) as u32,
        workers_available: activity.n_workers_available as u32,
        running_ms: batch.map_or(0, |batch| batch.running_for.as_millis() as u64),
    }
}

/// A priority from a client, which is refused beyond its range.
pub fn priority(weight: u32) -> Result<Priority, ControlError> {
    Priority::new(weight).ok_or_else(|| {
        ControlError::Invalid(format!("priority is {weight}, not within 1..={}", Priority::MAX))
    })
}
