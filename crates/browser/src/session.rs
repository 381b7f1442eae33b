//! The requests of a page, and their answers.

use bundle::Sample;
use serde::{Deserialize, Serialize};
use sim_core::Simulation;

use crate::{
    message::{self, bytes_of, numbers_of},
    proving::Proving,
    simulating::{Trials, compile},
};

/// Generations that a call repeats at most, so that a page can show progress and cancel.
const GENERATIONS_PER_CALL: u32 = 10;

/// What a module remembers between two calls: a bundle, or a compiled experiment.
#[derive(Default)]
pub struct Session {
    proving: Option<Proving>,
    simulation: Option<Simulation>,
}

#[derive(Deserialize)]
#[serde(tag = "call", rename_all = "kebab-case", deny_unknown_fields)]
enum Request {
    /// Reads the bundle that follows.
    Open {
        file: String,
        /// Number of generations to simulate again; none means all.
        generations: Option<u64>,
    },
    /// Repeats generations until one has to be simulated. Genotypes follow the answer.
    Repeat,
    /// Compares the batch with its simulated numbers, which follow.
    Compare,
    /// Ends the proof.
    Finish,
    /// Compiles an experiment file.
    Compile { config: String },
    /// Simulates the genotype that follows. Its numbers, trial by trial, follow the answer.
    Evaluate { trials: Trials, n_trials: u32, values_per_trial: usize },
}

#[derive(Serialize)]
#[serde(untagged)]
enum Answer {
    Opened { config: &'static str, generations: u64 },
    Repeated { done: u64, generations: u64, is_over: bool, batch: Option<BatchAnswer> },
    Done {},
    Proof { proof: String },
    Compiled { genes: usize },
    Failed { error: String },
}

#[derive(Serialize)]
struct BatchAnswer {
    /// The name for people.
    name: String,
    trials: Trials,
    n_genotypes: usize,
    n_trials: u32,
    /// The fitness, and the descriptors if the experiment has some.
    values_per_trial: usize,
}

impl Session {
    /// Answers a request.
    pub fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        let (answer, bytes) =
            self.execute(request).unwrap_or_else(|error| (Answer::Failed { error }, Vec::new()));
        message::write(&answer, &bytes)
    }

    fn execute(&mut self, request: &[u8]) -> Result<(Answer, Vec<u8>), String> {
        let (request, bytes) = message::read(request)?;
        let mut following = Vec::new();
        let answer = match request {
            Request::Open { file, generations } => {
                let sample = generations.map_or(Sample::All, Sample::Drawn);
                let proving = self.proving.insert(Proving::begin(file, bytes, sample)?);
                let (_, generations) = proving.progress();
                Answer::Opened { config: proving.config_json(), generations }
            }
            Request::Repeat => {
                let proving = self.proving()?;
                let batch = proving.next(GENERATIONS_PER_CALL)?.map(|batch| {
                    following =
                        bytes_of(batch.genotypes.iter().flat_map(|genes| &**genes).copied());
                    BatchAnswer {
                        name: batch.trial_set.to_string(),
                        trials: batch.trial_set.into(),
                        n_genotypes: batch.genotypes.len(),
                        n_trials: batch.n_trials(),
                        values_per_trial: batch.values_per_trial,
                    }
                });
                let (done, generations) = proving.progress();
                Answer::Repeated { done, generations, is_over: proving.is_over(), batch }
            }
            Request::Compare => {
                self.proving()?.compare(&numbers_of(bytes)?)?;
                Answer::Done {}
            }
            Request::Finish => {
                let proving = self.proving.take().ok_or(NO_BUNDLE)?;
                Answer::Proof { proof: proving.finish()? }
            }
            Request::Compile { config } => {
                let simulation = self.simulation.insert(compile(&config)?);
                Answer::Compiled { genes: simulation.genotype_len() }
            }
            Request::Evaluate { trials, n_trials, values_per_trial } => {
                let simulation = self.simulation.as_ref().ok_or("no experiment is compiled")?;
                let genotype = numbers_of(bytes)?;
                let values = match values_per_trial {
                    1 => simulation.evaluate_while(&genotype, trials, 0..n_trials, &|| true),
                    _ => simulation.describe_while(&genotype, trials, 0..n_trials, &|| true),
                };
                let values = values.map_err(|error| error.to_string())?;
                following = bytes_of(values.unwrap_or_default());
                Answer::Done {}
            }
        };
        Ok((answer, following))
    }

    fn proving(&mut self) -> Result<&mut Proving, String> {
        self.proving.as_mut().ok_or_else(|| NO_BUNDLE.to_owned())
    }
}

const NO_BUNDLE: &str = "no bundle is open";
