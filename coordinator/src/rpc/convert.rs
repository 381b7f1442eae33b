//! Wire types to core types and back.

use std::time::Duration;

use sim_core::Output;
use swarm_proto::v1::{
    self, WorkResponse, event::Kind, item_result::Outcome, work_response::Message,
};
use tonic::Status;

use crate::{
    codec,
    engine::{
        Assignment, Assignments, BatchActivity, EvaluationActivity, ItemResult, ToWorker,
        WorkerStatus,
    },
    ids::AssignmentId,
    priority::Priority,
    queries::{Address, DynamicsPage, Individuals, Lineage, Page},
    store::{
        Event, EventKind, ExperimentRecord, ExperimentState, Filter, GenerationRecord,
        StoredExperiment,
    },
    text::printable,
};
use evolution::{Ancestor, Champion, ChampionSource, Dynamics, HeldOut, Judged, Operator};

/// What a worker is told about time.
#[derive(Debug, Clone, Copy)]
pub struct WelcomeTimes {
    /// Between heartbeats.
    pub heartbeat_interval: Duration,
    /// Silence after which a worker loses its items.
    pub lease: Duration,
}

/// What a worker is told, as a message, or as the status that ends its stream.
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
        _ => Output::Fitness,
    };
    ItemResult {
        id: AssignmentId(result.assignment_id),
        output,
        outcome: match result.outcome {
            Some(Outcome::Fitness(fitness)) => Ok(fitness.values),
            Some(Outcome::Measures(measures)) => Ok(measures.values),
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

/// An experiment for clients.
pub fn experiment(experiment: ExperimentRecord) -> v1::Experiment {
    let summary = experiment.summary;
    let (group, variant) = experiment
        .membership
        .map_or_else(Default::default, |membership| (membership.group, membership.variant));
    v1::Experiment {
        id: experiment.id.0,
        name: experiment.name,
        state: state(experiment.state).into(),
        reason: experiment.reason,
        generations_done: experiment.latest.as_ref().map_or(0, |latest| latest.generation + 1),
        generations: summary.generations,
        seed: summary.seed,
        algorithm: summary.algorithm,
        population_size: summary.population_size.try_into().unwrap_or(u32::MAX),
        genotype_len: experiment.genotype_len as u32,
        submitted_at_ms: experiment.submitted_at_ms,
        latest: experiment.latest.map(generation),
        champion_fitness: experiment.judged_fitness,
        champion_selection_fitness: experiment.held_out_fitness,
        config_digest: experiment.config_digest,
        digest: experiment.digest,
        priority: experiment.priority.weight(),
        last_sequence: experiment.last_sequence,
        simulation: experiment.fingerprint,
        group,
        variant,
        forked_from: experiment.fork.map(|fork| v1::ForkOrigin {
            experiment_id: fork.parent.0,
            generation: fork.generation,
            changes: fork.changes,
        }),
        labels: experiment.labels,
        archived: experiment.is_archived,
        recent_generation_ms: experiment.recent_generation_ms,
    }
}

/// Which experiments a client wants; INVALID_ARGUMENT for a state that there is not.
pub fn filter(request: v1::ListExperimentsRequest) -> Result<Filter, Status> {
    let states = request.states().map(stored_state).collect::<Result<_, _>>()?;
    let v1::ListExperimentsRequest {
        named,
        labels,
        without_archived,
        config_digest,
        after,
        page_size,
        ..
    } = request;
    let some = |text: String| (!text.is_empty()).then_some(text);
    let label = |label: String| match label.split_once('=') {
        Some((key, value)) => (key.to_owned(), Some(value.to_owned())),
        None => (label, None),
    };
    Ok(Filter {
        named: some(named),
        states,
        labels: labels.into_iter().map(label).collect(),
        without_archived,
        config_digest: some(config_digest),
        after,
        limit: (page_size > 0).then_some(page_size),
    })
}

/// A priority from a client; INVALID_ARGUMENT beyond its range.
pub fn priority(weight: u32) -> Result<Priority, Status> {
    Priority::new(weight).ok_or_else(|| {
        Status::invalid_argument(format!("priority is {weight}, not within 1..={}", Priority::MAX))
    })
}

/// An experiment and its file for clients.
pub fn stored_experiment(stored: StoredExperiment) -> v1::GetExperimentResponse {
    let StoredExperiment { record, config_json } = stored;
    v1::GetExperimentResponse { experiment: Some(experiment(record)), config_json }
}

/// An address from a client; INVALID_ARGUMENT if it is none.
pub fn address(text: &str) -> Result<Address, Status> {
    text.parse()
        .map_err(|error: crate::queries::NotAnAddress| Status::invalid_argument(error.to_string()))
}

/// Genotypes for clients.
pub fn individuals(found: Individuals) -> v1::GetIndividualsResponse {
    let Individuals { experiment, individuals, network_json, next } = found;
    let network_json = network_json.unwrap_or_default();
    let individual = |champion| individual(experiment.id.0, champion, network_json.clone());
    v1::GetIndividualsResponse {
        individuals: individuals.into_iter().map(individual).collect(),
        next_individual: next,
    }
}

/// How evolution moved, for clients.
pub fn dynamics((generations, next_generation): DynamicsPage) -> v1::ListDynamicsResponse {
    let generation = |(generation, of): (u64, Dynamics)| v1::GenerationDynamics {
        generation,
        mean_step: of.mean_step,
        deviations: of.deviations.map_or_else(Vec::new, |deviations| deviations.to_vec()),
        rank_correlation: of.rank_correlation,
    };
    let generations = generations.into_iter().map(generation).collect();
    v1::ListDynamicsResponse { generations, next_generation }
}

/// A lineage for clients.
pub fn lineage(Lineage(populations): Lineage) -> v1::GetLineageResponse {
    let ancestor = |ancestor: Ancestor| v1::Ancestor {
        generation: ancestor.generation,
        individual: ancestor.individual,
        fitness: ancestor.fitness,
        operator: match ancestor.birth.as_ref().map(|birth| birth.operator) {
            None => v1::BirthOperator::Unspecified,
            Some(Operator::First) => v1::BirthOperator::First,
            Some(Operator::Elite) => v1::BirthOperator::Elite,
            Some(Operator::Copy) => v1::BirthOperator::Copy,
            Some(Operator::Crossover) => v1::BirthOperator::Crossover,
        }
        .into(),
        genes: ancestor.n_surviving as u32,
        new_genes: ancestor.birth.as_ref().map_or(0, |birth| birth.n_new as u32),
        parents: ancestor
            .birth
            .into_iter()
            .flat_map(|birth| birth.parents)
            .map(|(individual, genes)| v1::GenesOfParent { individual, genes: genes as u32 })
            .collect(),
    };
    let population = |(population, ancestors): (String, Vec<Ancestor>)| v1::PopulationLineage {
        population,
        ancestors: ancestors.into_iter().map(ancestor).collect(),
    };
    v1::GetLineageResponse { populations: populations.into_iter().map(population).collect() }
}

/// A genotype for clients; `network_json`: empty if it is not decoded.
pub fn individual(
    experiment_id: u64,
    individual: Champion,
    network_json: String,
) -> v1::GetChampionResponse {
    v1::GetChampionResponse {
        experiment_id,
        generation: individual.generation,
        individual: match individual.source {
            ChampionSource::Individual(index) => Some(index),
            ChampionSource::Mean => None,
        },
        fitness: individual.fitness(),
        held_out: individual.held_out.map(held_out),
        judged: individual.judged.map(judged),
        trial_fitness: individual.trial_fitness,
        genotype: individual.genotype,
        network_json,
    }
}

fn held_out(held_out: HeldOut) -> v1::HeldOutFitness {
    v1::HeldOutFitness {
        mean: held_out.mean.get(),
        ci95: held_out.ci95.get(),
        trials: u32::try_from(held_out.n_trials).unwrap_or(u32::MAX),
        generation: held_out.generation,
    }
}

fn judged(judged: Judged) -> v1::JudgedFitness {
    let Judged { mean, low, high, n_trials, generation } = judged;
    let [mean, low, high] = [mean, low, high].map(f64::from);
    v1::JudgedFitness { mean, low, high, trials: n_trials, generation }
}

/// An event for clients.
pub fn event(event: Event) -> v1::Event {
    let kind = match event.kind {
        EventKind::Generation(completed) => Kind::GenerationCompleted(generation(completed)),
        EventKind::State { state: new, reason } => {
            Kind::StateChanged(v1::StateChange { state: state(new).into(), reason })
        }
        EventKind::Notice(message) => Kind::Notice(v1::Notice { message }),
    };
    v1::Event { sequence: event.sequence, at_ms: event.at_ms, kind: Some(kind) }
}

/// A page of generations for clients.
pub fn generations(page: Page<(u64, GenerationRecord)>) -> v1::ListGenerationsResponse {
    v1::ListGenerationsResponse {
        generations: page.items.into_iter().map(completed_generation).collect(),
        next_generation: page.next.map(|(_, generation)| generation.generation),
    }
}

/// A page of events for clients.
pub fn events(page: Page<Event>) -> v1::ListEventsResponse {
    v1::ListEventsResponse {
        events: page.items.into_iter().map(event).collect(),
        next_sequence: page.next.map(|event| event.sequence),
    }
}

/// A completed generation for clients.
fn completed_generation(
    (completed_at_ms, completed): (u64, GenerationRecord),
) -> v1::CompletedGeneration {
    v1::CompletedGeneration { summary: Some(generation(completed)), completed_at_ms }
}

fn generation(generation: GenerationRecord) -> v1::GenerationSummary {
    v1::GenerationSummary {
        generation: generation.generation,
        best: generation.statistics.best.get(),
        mean: generation.statistics.mean.get(),
        min: generation.statistics.min.get(),
        standard_deviation: generation.statistics.standard_deviation.get(),
        digest: generation.digest,
        duration_ms: generation.duration_ms,
        episodes: generation.episodes,
        workers: generation.workers as u32,
        idle_share: generation.idle_share,
    }
}

fn stored_state(state: v1::ExperimentState) -> Result<ExperimentState, Status> {
    Ok(match state {
        v1::ExperimentState::Running => ExperimentState::Running,
        v1::ExperimentState::Paused => ExperimentState::Paused,
        v1::ExperimentState::Completed => ExperimentState::Completed,
        v1::ExperimentState::Failed => ExperimentState::Failed,
        v1::ExperimentState::Cancelled => ExperimentState::Cancelled,
        v1::ExperimentState::Unspecified => {
            return Err(Status::invalid_argument("no experiment is in the unspecified state"));
        }
    })
}

fn state(state: ExperimentState) -> v1::ExperimentState {
    match state {
        ExperimentState::Running => v1::ExperimentState::Running,
        ExperimentState::Paused => v1::ExperimentState::Paused,
        ExperimentState::Completed => v1::ExperimentState::Completed,
        ExperimentState::Failed => v1::ExperimentState::Failed,
        ExperimentState::Cancelled => v1::ExperimentState::Cancelled,
    }
}
