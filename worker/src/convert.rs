//! Converts between wire and simulation; no other module of a worker knows the types of both.

use std::sync::{Arc, OnceLock};

use evolution::Distribution;
use model::{codec, ids::JobId};
use sim_core::{Isa, Output, SpecifiedSimulation, TrialSet};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{self, work_request::Message},
};

use crate::{
    WorkerConfig,
    assignment::{Assignment, Genotype, ItemResult},
    pool::Evaluator,
    stats::Stats,
};

/// Most results in one message, so that a coordinator accepts the message.
pub(crate) const RESULTS_PER_MESSAGE_MAX: usize = 256;
/// Most numbers in one message of several results: 4 MiB.
const VALUES_PER_MESSAGE_MAX: usize = 1 << 19;

/// Makes a specification computable. The slot with its first assignment compiles it, once. If it
/// does not compile, each of its assignments fails. `stats`: counts robots' steps.
pub(crate) fn evaluator(config_json: String, isa: Isa, stats: Arc<Stats>) -> Evaluator {
    let compiled = OnceLock::new();
    Arc::new(move |assignment: &Assignment, keep_going: &dyn Fn() -> bool| {
        let simulation: &SpecifiedSimulation = compiled
            .get_or_init(|| SpecifiedSimulation::compile(&config_json, isa))
            .as_ref()
            .map_err(String::clone)?;
        let Assignment { genotype, trial_set, trials, output, .. } = assignment;
        let computed = simulation.compute(
            &genotype.genes()?,
            *trial_set,
            trials.clone(),
            *output,
            keep_going,
        )?;
        let n_episodes = computed.as_ref().map_or(0, |_| trials.len()) as u64;
        stats.add_robot_steps(n_episodes * simulation.robot_steps_per_episode());
        Ok(computed)
    })
}

/// The common part of assignments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Common {
    pub(crate) job: JobId,
    trial_set: TrialSet,
    output: Output,
}

/// Reads the common part of assignments, or describes the mistake in it.
pub(crate) fn common(assignments: &v1::Assignments) -> Result<Common, String> {
    let job = codec::read_job(assignments.job).ok_or("the assignment names no job")?;
    let trial_set = codec::read_trial_set(assignments.trial_set)?;
    let output = codec::read_output(assignments.output());
    let output = output.ok_or("the assignment names no output")?;
    Ok(Common { job, trial_set, output })
}

/// Reads an assignment, or returns its failure if it is invalid. `distribution`: the latest of the
/// job.
pub(crate) fn assignment(
    common: &Common,
    distribution: Option<&Arc<Distribution>>,
    assignment: v1::Assignment,
) -> Result<Assignment, v1::ItemResult> {
    let v1::Assignment { assignment_id: id, first_trial, trial_count, genotype, individual } =
        assignment;
    let Some(end) = first_trial.checked_add(trial_count) else {
        let message = format!("{trial_count} trials from {first_trial} on are too many");
        return Err(failure(id, message));
    };
    let &Common { job, trial_set, output } = common;
    let genotype = match (individual, distribution) {
        (None, _) => Genotype::Sent(genotype),
        (Some(individual), Some(of)) if trial_set == TrialSet::Generation(of.generation()) => {
            Genotype::Drawn(Arc::clone(of), individual)
        }
        (Some(_), _) => {
            return Err(failure(
                id,
                format!("the coordinator sent no distribution of {trial_set}"),
            ));
        }
    };
    Ok(Assignment { id, job, trial_set, output, trials: first_trial..end, genotype })
}

pub(crate) fn result(result: ItemResult) -> v1::ItemResult {
    let ItemResult { assignment_id, output, outcome, duration } = result;
    let compute_us = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
    match outcome {
        Ok(values) => v1::ItemResult {
            assignment_id,
            outcome: Some(match output {
                Output::Fitness => v1::item_result::Outcome::Fitness(v1::TrialFitness { values }),
                Output::Measures => {
                    v1::item_result::Outcome::Measures(v1::TrialMeasures { values })
                }
                Output::Descriptors => {
                    v1::item_result::Outcome::Descriptors(v1::TrialDescriptors { values })
                }
            }),
            compute_us,
        },
        Err(message) => v1::ItemResult { compute_us, ..failure(assignment_id, message) },
    }
}

/// Takes as many of the first results as fit into one message, and at least one.
pub(crate) fn next_message(ready: &mut Vec<v1::ItemResult>) -> v1::WorkRequest {
    let mut n_values = 0;
    let n_fitting = ready.iter().take(RESULTS_PER_MESSAGE_MAX).take_while(|result| {
        n_values += match &result.outcome {
            Some(v1::item_result::Outcome::Measures(measures)) => measures.values.len(),
            Some(v1::item_result::Outcome::Fitness(fitness)) => fitness.values.len(),
            Some(v1::item_result::Outcome::Descriptors(described)) => described.values.len(),
            _ => 0,
        };
        n_values <= VALUES_PER_MESSAGE_MAX
    });
    let n = n_fitting.count().max(1).min(ready.len());
    results(ready.drain(..n).collect())
}

/// The result of an assignment that was not computed.
pub(crate) fn failure(assignment_id: u64, message: String) -> v1::ItemResult {
    let outcome = v1::item_result::Outcome::Failure(v1::ItemFailure { message });
    v1::ItemResult { assignment_id, outcome: Some(outcome), compute_us: 0 }
}

pub(crate) fn hello(config: &WorkerConfig, process_id: u64) -> v1::WorkRequest {
    request(Message::Hello(v1::Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.into(),
        name: config.name.clone(),
        slots: u32::try_from(config.slots).expect("slots are checked to be at most SLOTS_MAX"),
        version: env!("CARGO_PKG_VERSION").into(),
        process_id,
        experiments: config.experiments.clone(),
    }))
}

fn results(results: Vec<v1::ItemResult>) -> v1::WorkRequest {
    request(Message::Results(v1::ItemResults { results }))
}

pub(crate) fn heartbeat() -> v1::WorkRequest {
    request(Message::Heartbeat(v1::Heartbeat {}))
}

/// Whether an experiment brings a script; false if the file cannot be read.
pub(crate) fn has_script(config_json: &str) -> bool {
    #[derive(serde::Deserialize)]
    struct Brings {
        task: Option<serde::de::IgnoredAny>,
    }
    serde_json::from_str(config_json).is_ok_and(|Brings { task }| task.is_some())
}

pub(crate) fn draining() -> v1::WorkRequest {
    request(Message::Draining(v1::Draining {}))
}

fn request(message: Message) -> v1::WorkRequest {
    v1::WorkRequest { message: Some(message) }
}
