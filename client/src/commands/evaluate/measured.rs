//! The measures of all trials of one condition, requested from a coordinator.

use std::time::Duration;

use swarm_proto::v1::{EvaluateRequest, MeasuredTask, MeasuredTrial, evaluate_response::Message};
use tokio::time::{Instant, sleep};
use tonic::Status;

use crate::{
    connection::{Connection, backoff},
    error::{Error, is_transient},
};

/// An attempt of at least this duration counts as contact with the coordinator.
const LASTING: Duration = Duration::from_secs(10);

/// All trials of a condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Names of the measures.
    pub metrics: Vec<String>,
    /// Steps per trial.
    pub n_steps: usize,
    pub trials: Vec<Trial>,
}

/// One episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Fitness of the trial.
    pub fitness: f64,
    /// Per step and measure; NaN where a measure has no value.
    values: Vec<f64>,
}

impl Measured {
    /// The values of a measure in one trial, step by step.
    pub fn course(&self, trial: usize, metric: usize) -> impl Iterator<Item = f64> {
        self.trials[trial].values.iter().skip(metric).step_by(self.metrics.len()).copied()
    }

    /// The values of a measure in one step, trial by trial, without missing ones.
    pub fn at_step(&self, step: usize, metric: usize) -> Vec<f64> {
        let place = step * self.metrics.len() + metric;
        let values = self.trials.iter().map(|trial| trial.values[place]);
        values.filter(|value| !value.is_nan()).collect()
    }

    #[cfg(test)]
    pub fn new(metrics: &[&str], trials: Vec<(f64, Vec<f64>)>) -> Self {
        let n_steps = trials[0].1.len() / metrics.len();
        let metrics = metrics.iter().map(ToString::to_string).collect();
        let trials = trials.into_iter().map(|(fitness, values)| Trial { fitness, values });
        Self { metrics, n_steps, trials: trials.collect() }
    }
}

/// Sends the request until the coordinator answers. A restarted coordinator has forgotten
/// the request; a repeated request gives the same answer.
pub async fn ask(connection: &Connection, request: EvaluateRequest) -> Result<Measured, Error> {
    let mut backoff = backoff();
    let mut unreachable_since = None;
    loop {
        let asked = Instant::now();
        let status = match once(connection, &request).await {
            Ok(measured) => return measured,
            Err(status) => status,
        };
        let now = Instant::now();
        // Patience limits the time without contact, not the time of computing.
        if now - asked > LASTING {
            backoff.reset();
            unreachable_since = None;
        }
        let since = *unreachable_since.get_or_insert(now);
        if !is_transient(&status) || now - since >= connection.patience() {
            return Err(connection.error(&status));
        }
        sleep(backoff.next_delay(rand::random())).await;
    }
}

async fn once(
    connection: &Connection,
    request: &EvaluateRequest,
) -> Result<Result<Measured, Error>, Status> {
    let mut answers = connection.evaluate(request.clone()).await?;
    let mut task = None;
    let mut trials = Vec::new();
    while let Some(answer) = answers.message().await? {
        match answer.message {
            Some(Message::Task(sent)) => task = Some(sent),
            Some(Message::Trial(trial)) => trials.push(trial),
            None => {}
        }
    }
    Ok(checked(task, trials, request.trial_count))
}

/// Checks that the answer has all trials with all values.
fn checked(
    task: Option<MeasuredTask>,
    trials: Vec<MeasuredTrial>,
    n_trials: u32,
) -> Result<Measured, Error> {
    let MeasuredTask { metrics, steps } = task.unwrap_or_default();
    let n_values = metrics.len() * steps as usize;
    let is_whole = |(number, trial): (u32, &MeasuredTrial)| {
        trial.trial == number && trial.values.len() == n_values
    };
    // The task of a script may have no measures, but every task has steps.
    if trials.len() != n_trials as usize || steps == 0 || !(0..).zip(&trials).all(is_whole) {
        return Err(Error::Internal("the coordinator's answer is incomplete".into()));
    }
    let trials =
        trials.into_iter().map(|MeasuredTrial { fitness, values, .. }| Trial { fitness, values });
    Ok(Measured { metrics, n_steps: steps as usize, trials: trials.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_may_lack_measures_but_not_the_task() {
        let trial = |trial| MeasuredTrial { trial, fitness: 0.5, ..MeasuredTrial::default() };
        let task = || MeasuredTask { steps: 3, ..MeasuredTask::default() };
        let measured = checked(Some(task()), vec![trial(0), trial(1)], 2).unwrap();
        assert_eq!((measured.n_steps, measured.trials.len()), (3, 2));
        assert!(checked(Some(task()), vec![trial(0)], 2).is_err());
        assert!(checked(None, vec![trial(0), trial(1)], 2).is_err());
    }
}
