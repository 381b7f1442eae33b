//! Repeats an experiment's evolution, and proves the claims of its bundle.
//!
//! Evolution is a function of seed and fitness. So the chain of digests, the history, the keyframes
//! and the champion follow from the experiment file and the fitness log. Only the proof of the
//! fitness itself needs simulations, which the caller runs.

use std::{collections::BTreeSet, fmt};

use evolution::{
    ALGORITHMS, Champion, Checkpoint, CheckpointError, Digest, Evaluated, Evolution, Outcome,
    Repeated, Told,
};
use experiment_file::ExperimentConfig;
use sim_core::{FINGERPRINT, Simulation, TrialSet, panic_to_failure};

use super::{Bundle, Sample, champion_json};

/// A verification in progress.
#[derive(Debug)]
pub struct Verification<'a> {
    bundle: &'a Bundle,
    simulation: Simulation,
    n_trials: u32,
    evolution: Evolution,
    /// The generations to simulate again.
    sample: BTreeSet<u64>,
    n_keyframes: usize,
    n_episodes: u64,
    champion: Option<Champion>,
}

/// A claim of a bundle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Claim {
    /// The experiment file is valid, and has the digest of the chain's first link.
    Experiment,
    /// Every link follows from the previous one, the genotypes that evolution draws, and the log.
    Chain,
    /// The fitness in the history follows from the log.
    History,
    /// The keyframes are the states of evolution.
    Keyframes,
    /// The champion and the last link follow from the log.
    Champion,
    /// Simulations give the fitness in the log.
    Simulation,
}

/// A claim of a bundle that does not hold.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{claim}: {what}")]
pub struct Flaw {
    /// The claim.
    pub claim: Claim,
    /// The place, and the difference.
    pub what: String,
}

/// The result of a verification without flaws.
#[derive(Debug)]
pub struct Proof {
    /// Each proven claim, with its statement for people.
    pub proven: Vec<(Claim, String)>,
    /// Statements that a bundle alone cannot prove.
    pub unproven: Vec<String>,
    /// The champion.
    pub champion: Option<Champion>,
}

/// Genotypes to simulate again, all in the same trials.
#[derive(Debug, Clone)]
pub struct Batch {
    /// The trial set.
    pub trial_set: TrialSet,
    /// The genotypes.
    pub genotypes: evolution::Population,
    /// The numbers in the log for each genotype: for each trial, from 0, its fitness and then its
    /// descriptors.
    pub values: Vec<Vec<f64>>,
    /// Numbers per trial: 1 without descriptors.
    pub values_per_trial: usize,
}

impl Proof {
    /// The proof for people, one statement per line. `file`, `sha256`: name and digest of the
    /// bundle.
    pub fn to_text(&self, file: &str, sha256: &str) -> String {
        let proven = self.proven.iter().map(|(claim, what)| format!("proven    {claim}: {what}"));
        let unproven = self.unproven.iter().map(|what| format!("unproven  {what}"));
        let first = format!("{file}, SHA-256 {sha256}");
        std::iter::once(first).chain(proven).chain(unproven).collect::<Vec<_>>().join("\n")
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Experiment => "experiment",
            Self::Chain => "chain",
            Self::History => "history",
            Self::Keyframes => "keyframes",
            Self::Champion => "champion",
            Self::Simulation => "simulation",
        })
    }
}

impl Claim {
    fn flaw(self, what: impl fmt::Display) -> Flaw {
        Flaw { claim: self, what: what.to_string() }
    }
}

impl Batch {
    fn from_evaluated(evaluated: Evaluated<'_>) -> Self {
        let Evaluated { trial_set, genotypes, values, values_per_trial } = evaluated;
        Self { trial_set, genotypes, values: values.into_owned(), values_per_trial }
    }

    /// Number of trials of each genotype.
    pub fn n_trials(&self) -> u32 {
        self.values.first().map_or(0, |values| values.len() / self.values_per_trial) as u32
    }

    /// Compares the log with simulated numbers of the same shape, bit for bit.
    ///
    /// # Errors
    ///
    /// A flaw at the first difference.
    pub fn compare(&self, simulated: &[Vec<f64>]) -> Result<(), Flaw> {
        let flaw = |what: String| Claim::Simulation.flaw(format!("{}: {what}", self.trial_set));
        if simulated.len() != self.values.len() {
            return Err(flaw("the simulation is incomplete".to_owned()));
        }
        let has = if self.values_per_trial == 1 { "fitness" } else { "fitness and descriptors" };
        for (i, (found, logged)) in simulated.iter().zip(&self.values).enumerate() {
            if !same_bits(found, logged) {
                let what =
                    format!("genotype {i} has the {has} {found:?}, but the log states {logged:?}");
                return Err(flaw(what));
            }
        }
        Ok(())
    }

    fn n_episodes(&self) -> u64 {
        self.values.iter().map(|values| (values.len() / self.values_per_trial) as u64).sum()
    }
}

impl<'a> Verification<'a> {
    /// Checks everything before the first generation. `sample`: the generations that
    /// [`advance`](Self::advance) hands out to simulate again.
    ///
    /// # Errors
    ///
    /// The first flaw.
    pub fn begin(bundle: &'a Bundle, sample: Sample) -> Result<Self, Flaw> {
        let flaw = |what: &dyn fmt::Display| Claim::Experiment.flaw(what);
        let (config, _) = ExperimentConfig::from_json(&bundle.config_json, "", ALGORITHMS)
            .map_err(|error| flaw(&one_line(&error)))?;
        if config.to_canonical_json() != bundle.config_json {
            return Err(flaw(&"the experiment file is not in canonical form"));
        }
        let simulation = Simulation::compile(&config).map_err(|error| flaw(&one_line(&error)))?;
        let own = Digest::of_config(&config, FINGERPRINT);
        if own != bundle.manifest.config_digest {
            let stated = bundle.manifest.config_digest;
            return Err(flaw(&format!("the experiment file has the digest {own}, not {stated}")));
        }
        let (first, n_generations) = (bundle.first_own(), bundle.history.len() as u64);
        if n_generations != first.saturating_add(bundle.log.len() as u64) || bundle.log.is_empty() {
            return Err(Claim::Chain.flaw(format!(
                "the history has {n_generations} generations, but the log has {} from {first} on",
                bundle.log.len()
            )));
        }
        if bundle.keyframes.first().is_none_or(|&(at, _)| at != first) {
            return Err(Claim::Keyframes.flaw("no keyframe precedes the first generation"));
        }
        if bundle.keyframes.last().is_some_and(|&(at, _)| at > n_generations) {
            return Err(Claim::Keyframes.flaw("a keyframe follows the last generation"));
        }
        let is_complete = n_generations == config.algorithm.generations;
        let should_be = bundle.manifest.state == "completed" && bundle.manifest.reason.is_empty();
        if n_generations > config.algorithm.generations || should_be && !is_complete {
            return Err(Claim::Champion.flaw(format!(
                "the run has {n_generations} generations, but the experiment file requests {}",
                config.algorithm.generations
            )));
        }
        let new = Evolution::new(&config, simulation.population_segments(), FINGERPRINT);
        let evolution = match &bundle.manifest.fork {
            None => new,
            Some(_) => fork_start(bundle, own, &new)?,
        };
        let sample = sample.generations(bundle.manifest.digest, first, n_generations);
        Ok(Self {
            bundle,
            n_trials: config.algorithm.num_evaluations,
            simulation,
            evolution,
            sample,
            n_keyframes: 0,
            n_episodes: 0,
            champion: None,
        })
    }

    /// The simulation that computes the batches.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The number of repeated generations, and the number of generations to repeat.
    pub fn progress(&self) -> (u64, u64) {
        let first = self.bundle.first_own();
        (self.evolution.n_generations() - first, self.bundle.log.len() as u64)
    }

    /// Repeats the next generation. Returns its batches to simulate again, or `None` if no
    /// generation is left.
    ///
    /// # Errors
    ///
    /// The first flaw.
    pub fn advance(&mut self) -> Result<Option<Vec<Batch>>, Flaw> {
        let generation = self.evolution.n_generations();
        let place = (generation - self.bundle.first_own()) as usize;
        let Some(entry) = self.bundle.log.get(place) else { return Ok(None) };
        // A forged state of a fork may make an algorithm panic.
        let step = panic_to_failure(|| Ok(self.step(generation, entry)));
        let flaw = |what: String| Claim::Chain.flaw(format!("generation {generation}: {what}"));
        step.unwrap_or_else(|what| Err(flaw(what))).map(Some)
    }

    fn step(&mut self, generation: u64, entry: &[u8]) -> Result<Vec<Batch>, Flaw> {
        let at = |what: &dyn fmt::Display| format!("generation {generation}: {what}");
        let misfit = |error: CheckpointError| Claim::Chain.flaw(at(&error));
        self.compare_keyframe()?;
        let told = Told::from_bytes(entry).map_err(misfit)?;
        if told.to_bytes() != entry {
            return Err(Claim::Chain.flaw(at(&"its log entry is not in the only valid encoding")));
        }
        let row = &self.bundle.history[generation as usize];
        let Repeated { summary, evaluated } = self.evolution.repeat(&told).map_err(misfit)?;
        if summary.digest != row.digest {
            let found = summary.digest;
            let what =
                format!("the log gives the digest {found}, but the history states {}", row.digest);
            return Err(Claim::Chain.flaw(at(&what)));
        }
        let n_episodes: u64 = told.trial_fitness.iter().map(|trials| trials.len() as u64).sum();
        let [found, stated] = [summary.statistics, row.statistics()]
            // Databases do not keep the sign of zero.
            .map(|statistics| {
                [statistics.best, statistics.mean, statistics.min, statistics.standard_deviation]
                    .map(|number| number.get() + 0.0)
            });
        let found = [0, 1, 2, 3].map(|i| as_stated(found[i], stated[i]));
        if !same_bits(&found, &stated) || row.episodes != n_episodes {
            return Err(Claim::History.flaw(at(&format!(
                "its fitness is {found:?} of {n_episodes} episodes, not {stated:?} of {}",
                row.episodes
            ))));
        }
        let mut batches = Vec::new();
        if self.sample.contains(&generation) {
            batches.extend(evaluated.into_iter().map(Batch::from_evaluated));
            let n_trials = self.n_trials as usize;
            if told.trial_fitness.iter().any(|trials| trials.len() != n_trials) {
                return Err(
                    Claim::Simulation.flaw(at(&format!("it does not have {n_trials} trials")))
                );
            }
        }
        let has_end = !told.end.blocks.is_empty() || !told.end.judgement.is_empty();
        if generation + 1 < self.bundle.history.len() as u64 {
            if has_end {
                return Err(Claim::Chain.flaw(at(&"its log entry contains an end of the run")));
            }
        } else {
            self.compare_keyframe()?;
            batches.extend(self.conclude(&told)?);
        }
        self.n_episodes += batches.iter().map(Batch::n_episodes).sum::<u64>();
        Ok(batches)
    }

    /// Checks the end of the run; returns its evaluations.
    fn conclude(&mut self, told: &Told) -> Result<Vec<Batch>, Flaw> {
        let outcome = self.evolution.outcome(told);
        let outcome = outcome.map_err(|error| Claim::Champion.flaw(error))?;
        let Outcome { champion, digest, evaluated } = outcome;
        let stated = self.bundle.manifest.digest;
        if digest != stated {
            let what = format!("the last link is {digest}, not {stated}");
            return Err(Claim::Champion.flaw(what));
        }
        let text = champion.as_ref().map(champion_json).unwrap_or_default();
        if text != self.bundle.champion_json {
            return Err(Claim::Champion.flaw("the log gives another champion"));
        }
        self.champion = champion;
        Ok(evaluated.into_iter().map(Batch::from_evaluated).collect())
    }

    fn compare_keyframe(&mut self) -> Result<(), Flaw> {
        let now = self.evolution.n_generations();
        let Some((at, state)) = self.bundle.keyframes.get(self.n_keyframes) else { return Ok(()) };
        if *at > now {
            return Ok(());
        }
        self.n_keyframes += 1;
        if *at < now || *state != self.evolution.keyframe() {
            let what = format!("the keyframe before generation {at} is not the state of evolution");
            return Err(Claim::Keyframes.flaw(what));
        }
        Ok(())
    }

    /// The proof. Call it after the last generation, if all batches agree with their simulation.
    pub fn finish(self) -> Proof {
        let Self { bundle, evolution, sample, n_keyframes, n_episodes, champion, .. } = self;
        let (first, end) = (bundle.first_own(), evolution.n_generations());
        let last = end - 1;
        let chosen = match sample.len() as u64 {
            0 => "no generation".to_owned(),
            n if n == end - first => format!("all generations from {first} to {last}"),
            _ => {
                let drawn: Vec<String> = sample.iter().map(ToString::to_string).collect();
                format!("generations {}, drawn by the last link,", drawn.join(", "))
            }
        };
        let proven = vec![
            (
                Claim::Experiment,
                format!("the experiment file has the digest {}", bundle.manifest.config_digest),
            ),
            (
                Claim::Chain,
                format!(
                    "every gene and the link of generations {first} to {last} follow from the log"
                ),
            ),
            (
                Claim::History,
                format!("fitness of generations {first} to {last} follows from the log"),
            ),
            (Claim::Keyframes, format!("{n_keyframes} of {n_keyframes} are states of evolution")),
            (
                Claim::Champion,
                format!(
                    "the champion and the last link, {}, follow from the log",
                    bundle.manifest.digest
                ),
            ),
            (
                Claim::Simulation,
                format!(
                    "{chosen} and the end of the run, simulated again: {n_episodes} episodes have \
                     the same fitness, bit for bit"
                ),
            ),
        ];
        let mut unproven = vec!["times, numbers of workers and idle shares".to_owned()];
        if let Some(fork) = &bundle.manifest.fork {
            unproven.push(format!(
                "generations 0 to {} and the state after them, which the fork shares with its \
                 parent: verify the parent's bundle, whose generation {} has the link {}",
                fork.generation, fork.generation, bundle.history[fork.generation as usize].digest
            ));
        }
        Proof { proven, unproven, champion }
    }
}

/// The first state of a fork. `own`: link -1 of its configuration; `new`: an evolution of the
/// same shape.
fn fork_start(bundle: &Bundle, own: Digest, new: &Evolution) -> Result<Evolution, Flaw> {
    let flaw =
        |what: &dyn fmt::Display| Claim::Chain.flaw(format!("at the start of the fork: {what}"));
    let Some(fork) = &bundle.manifest.fork else {
        return Err(flaw(&"the manifest names no origin"));
    };
    let parent = bundle.history.get(fork.generation as usize);
    let parent =
        parent.ok_or_else(|| flaw(&"the history lacks the last shared generation"))?.digest;
    if fork.link != parent && fork.link != parent.forked(own) {
        return Err(flaw(&format!("the link {} does not follow from {parent}", fork.link)));
    }
    let keyframe = bundle.keyframes[0].1.clone();
    let state = Evolution::restore(&Checkpoint { keyframe, ..Checkpoint::default() });
    let state = state.map_err(|error| Claim::Keyframes.flaw(error))?;
    if !state.has_shape_of(new)
        || state.n_generations() != bundle.first_own()
        || state.digest() != fork.link
    {
        return Err(Claim::Keyframes
            .flaw("the first keyframe is not the state from which the fork continues"));
    }
    Ok(state)
}

/// Returns `stated` if it is infinite because sums overflowed in the version that wrote it,
/// otherwise `found`.
fn as_stated(found: f64, stated: f64) -> f64 {
    let overflowed = stated.is_infinite() && found.abs() > f64::MAX.sqrt() / 1e9;
    if overflowed { stated } else { found }
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

fn one_line(text: &dyn fmt::Display) -> String {
    text.to_string().replace('\n', "; ")
}
