//! Between the wire and the simulation: the only place of a worker that knows
//! the shape of both.

use std::sync::{Arc, OnceLock};

use experiment_file::{ConfigError, ExperimentConfig};
use sim_core::{EVALUATION, Isa, Simulation};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{self, work_request::Message},
};

use crate::{
    WorkerConfig,
    activity::Activity,
    pool::{Evaluator, Item, Outcome},
};

/// Numbers in one message of several results: 4 MiB.
const VALUES_PER_MESSAGE_MAX: usize = 1 << 19;

/// Makes a specification computable. It is compiled by the slot that computes
/// its first item, once; what is wrong with it is the failure of each item.
/// `activity`: where robots' steps are counted.
pub(crate) fn evaluator(config_json: String, isa: Isa, activity: Arc<Activity>) -> Evaluator {
    let compiled = OnceLock::new();
    Arc::new(move |item: &Item, keep_going: &dyn Fn() -> bool| {
        let Computable { experiment, robot_steps }: &Computable =
            compiled.get_or_init(|| compile(&config_json, isa)).as_ref().map_err(String::clone)?;
        let Item { genotype, generation, trials, .. } = item;
        let computed = match *generation {
            EVALUATION => {
                experiment.measure_while(genotype, EVALUATION, trials.clone(), keep_going)
            }
            generation => {
                experiment.evaluate_while(genotype, generation, trials.clone(), keep_going)
            }
        };
        let computed = computed.map_err(|error| error.to_string())?;
        let n_episodes = computed.as_ref().map_or(0, |_| trials.len()) as u64;
        activity.add_robot_steps(n_episodes * robot_steps);
        Ok(computed)
    })
}

/// A compiled specification.
struct Computable {
    experiment: Simulation,
    /// Environment steps of an episode, summed over robots.
    robot_steps: u64,
}

fn compile(config_json: &str, isa: Isa) -> Result<Computable, String> {
    computable(config_json, isa)
        .map_err(|error| format!("the experiment's specification is not valid: {error}"))
}

fn computable(config_json: &str, isa: Isa) -> Result<Computable, ConfigError> {
    let config = ExperimentConfig::from_canonical_json(config_json)?;
    let experiment = Simulation::compile(&config)?.with_isa(isa);
    let n_robots: u64 = config.robots().map(|(_, robot)| u64::from(robot.num_instances)).sum();
    Ok(Computable {
        experiment,
        robot_steps: n_robots * u64::from(config.algorithm.evaluation_steps),
    })
}

/// Reads an item, or fails it: the coordinator is not trusted to be right.
pub(crate) fn item(
    experiment_id: u64,
    generation: u64,
    item: v1::Item,
) -> Result<Item, v1::ItemResult> {
    let v1::Item { item_id, first_trial, trial_count, genotype } = item;
    let Some(end) = first_trial.checked_add(trial_count) else {
        let message = format!("{trial_count} trials from {first_trial} on are too many");
        return Err(failure(item_id, message));
    };
    Ok(Item { id: item_id, experiment_id, generation, trials: first_trial..end, genotype })
}

pub(crate) fn result(outcome: Outcome) -> v1::ItemResult {
    let compute_us = u64::try_from(outcome.duration.as_micros()).unwrap_or(u64::MAX);
    match outcome.fitness {
        Ok(values) => v1::ItemResult {
            item_id: outcome.item_id,
            outcome: Some(match outcome.generation {
                EVALUATION => v1::item_result::Outcome::Measures(v1::TrialMeasures { values }),
                _ => v1::item_result::Outcome::Fitness(v1::TrialFitness { values }),
            }),
            compute_us,
        },
        Err(message) => v1::ItemResult { compute_us, ..failure(outcome.item_id, message) },
    }
}

/// Takes as many of the first results as fit into one message, and at least one.
pub(crate) fn next_message(ready: &mut Vec<v1::ItemResult>) -> v1::WorkRequest {
    let mut n_values = 0;
    let n_fitting = ready.iter().take_while(|result| {
        n_values += match &result.outcome {
            Some(v1::item_result::Outcome::Measures(measures)) => measures.values.len(),
            Some(v1::item_result::Outcome::Fitness(fitness)) => fitness.values.len(),
            _ => 0,
        };
        n_values <= VALUES_PER_MESSAGE_MAX
    });
    let n = n_fitting.count().max(1).min(ready.len());
    results(ready.drain(..n).collect())
}

/// An item that was not computed.
pub(crate) fn failure(item_id: u64, message: String) -> v1::ItemResult {
    let outcome = v1::item_result::Outcome::Failure(v1::ItemFailure { message });
    v1::ItemResult { item_id, outcome: Some(outcome), compute_us: 0 }
}

pub(crate) fn hello(config: &WorkerConfig, process_id: u64) -> v1::WorkRequest {
    request(Message::Hello(v1::Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.into(),
        name: config.name.clone(),
        slots: u32::try_from(config.slots).expect("slots are checked to be at most SLOTS_MAX"),
        version: env!("CARGO_PKG_VERSION").into(),
        process_id,
    }))
}

fn results(results: Vec<v1::ItemResult>) -> v1::WorkRequest {
    request(Message::Results(v1::ItemResults { results }))
}

pub(crate) fn heartbeat() -> v1::WorkRequest {
    request(Message::Heartbeat(v1::Heartbeat {}))
}

pub(crate) fn draining() -> v1::WorkRequest {
    request(Message::Draining(v1::Draining {}))
}

fn request(message: Message) -> v1::WorkRequest {
    v1::WorkRequest { message: Some(message) }
}
