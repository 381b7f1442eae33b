//! The requests of a page, and their answers.

use std::time::Duration;

use bundle::Sample;
use serde::{Deserialize, Serialize};
use sim_core::{Simulation, TrialSet};

use crate::{
    fleet::{Health, Report, TwoFleets},
    message::{self, bytes_of, numbers_of},
    proving::Proving,
    replaying::Played,
    simulating::compile,
};

/// Generations that a call repeats at most, so that a page can show progress and cancel.
const GENERATIONS_PER_CALL: u32 = 10;

/// What a module remembers between two calls: a bundle, a compiled experiment, or fleets.
#[derive(Default)]
pub struct Session {
    fleets: Option<TwoFleets>,
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
    /// Simulates an episode of the genotype that follows, with changes. Its packed form follows the
    /// answer.
    Replay { played: Played, what_if: String },
    /// Simulates the genotype that follows. Its numbers, trial by trial, follow the answer.
    Evaluate { trials: TrialSet, n_trials: u32, values_per_trial: usize },
    /// Begins a run on two fleets.
    BeginFleets {
        /// The share of the individuals that two workers compute.
        audits: f64,
    },
    /// Lets this time pass, ms.
    Advance { ms: f64 },
    /// Changes the state of a worker's machine in the disturbed fleet.
    Treat { worker: usize, health: Health },
}

#[derive(Serialize)]
#[serde(untagged)]
enum Answer {
    Opened { config: &'static str, generations: u64 },
    Repeated { done: u64, generations: u64, is_over: bool, batch: Option<BatchAnswer> },
    Done {},
    Proof { proof: String },
    Compiled { genes: usize },
    Begun { workers: Vec<String>, generations: u64, report: Box<Report> },
    Reported(Box<Report>),
    Failed { error: String },
}

#[derive(Serialize)]
struct BatchAnswer {
    /// The name for people.
    name: String,
    trials: TrialSet,
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
                        trials: batch.trial_set,
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
            Request::Replay { played, what_if } => {
                following = played.simulate(&what_if, &numbers_of(bytes)?)?;
                Answer::Done {}
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
            Request::BeginFleets { audits } => {
                let fleets = self.fleets.insert(TwoFleets::new(audits)?);
                let workers = fleets.names().into_iter().map(str::to_owned).collect();
                let report = Box::new(fleets.report());
                Answer::Begun { workers, generations: fleets.n_generations(), report }
            }
            Request::Advance { ms } => {
                let time = Duration::try_from_secs_f64(ms / 1000.0);
                let time = time.map_err(|error| format!("{ms} ms: {error}"))?;
                let fleets = self.fleets()?;
                fleets.advance(time)?;
                Answer::Reported(Box::new(fleets.report()))
            }
            Request::Treat { worker, health } => {
                let fleets = self.fleets()?;
                fleets.treat(worker, health)?;
                Answer::Reported(Box::new(fleets.report()))
            }
        };
        Ok((answer, following))
    }

    fn fleets(&mut self) -> Result<&mut TwoFleets, String> {
        self.fleets.as_mut().ok_or_else(|| "no fleet has begun".to_owned())
    }

    fn proving(&mut self) -> Result<&mut Proving, String> {
        self.proving.as_mut().ok_or_else(|| NO_BUNDLE.to_owned())
    }
}

const NO_BUNDLE: &str = "no bundle is open";
