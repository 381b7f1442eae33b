//! The compiled experiment, which all episodes share.

use std::ops::Range;
use std::sync::Arc;

use crate::descriptors::{self, Descriptor};
use crate::episode::{self, AllMeasures, Described, FitnessOnly, Recorder, Viewer};
use crate::fitness::{self, Definition};
use crate::genotype::Codec;
use crate::intervention::{self, Intervention, InterventionError};
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
#[cfg(doc)]
use crate::record::Measures;
use crate::record::{EpisodeSummary, MeasureName, RoomRecord, StepRecord};
use crate::script::{self, ScriptTask};
use crate::trial::{self, try_places};
use crate::world::World;
use determinism::{Isa, random::TrialSet};
use experiment_file::{ConfigError, ExperimentConfig, FitnessParams, limits};
use task_script::ScriptError;

/// Number of trials whose start positions the compilation tries.
const N_TRIED_TRIALS: u32 = 8;

/// A compiled experiment: (genotype, trial set, trials) -> fitness.
#[derive(Debug, Clone)]
pub struct Simulation {
    pub(crate) isa: Isa,
    pub(crate) seed: u64,
    pub(crate) n_steps: u32,
    n_trials: u32,
    /// `None`: the script computes the fitness.
    pub(crate) fitness: Option<&'static Definition>,
    pub(crate) fitness_params: FitnessParams,
    pub(crate) script: Option<Arc<ScriptTask>>,
    measure_names: Vec<MeasureName>,
    pub(crate) descriptors: Vec<Descriptor>,
    pub(crate) network: Network,
    codec: Codec,
    pub(crate) world: World,
    /// In the order of their steps; none in evolution.
    pub(crate) interventions: Vec<Intervention>,
}

/// Why a genotype could not be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EvaluateError {
    /// The genotype has the wrong length: a bug of the caller.
    #[error("the genotype has {actual} genes, the experiment's have {expected}")]
    GenotypeLength {
        /// Number of genes of the experiment's genotypes.
        expected: usize,
        /// Number of genes of this genotype.
        actual: usize,
    },
    /// A gene outside \[0, 1\] or not finite: a bug of the caller.
    #[error("gene {index} is {value}, outside [0, 1]")]
    GeneOutOfRange {
        /// Index of the gene.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The range of trials is empty or beyond the limit: a bug of the caller.
    #[error("trials {}..{} are not within 0..{}", trials.start, trials.end, limits::TRIALS)]
    Trials {
        /// The requested trials.
        trials: Range<u32>,
    },
    /// An initialiser found no place, because the world is too small for its objects. Every
    /// genotype fails in this trial.
    #[error(
        "world.objects.{object}.initializers.positions: no place for number {index} \
         in {trial_set}, trial {trial}"
    )]
    Unplaceable {
        /// Name of the object.
        object: String,
        /// Index of the instance without a place.
        index: usize,
        /// The trial set.
        trial_set: TrialSet,
        /// The trial.
        trial: u32,
    },
    /// An intervention puts a body where it has no room.
    #[error(
        "{kind} {number} has no room at ({}, {}) in step {step}; put it where nothing else is",
        place[0], place[1]
    )]
    NoRoom {
        /// The kind of the thing.
        kind: &'static str,
        /// Its number.
        number: usize,
        /// The environment step, from 0.
        step: u32,
        /// The place, cm.
        place: [f64; 2],
    },
    /// The script of the experiment's task failed.
    #[error("{error} (in step {step} of {trial_set}, trial {trial})")]
    Script {
        /// The place and the reason.
        error: ScriptError,
        /// The environment step, from 0.
        step: u32,
        /// The trial set.
        trial_set: TrialSet,
        /// The trial.
        trial: u32,
    },
}

impl Simulation {
    /// Compiles a configuration that the reader of experiment files accepts.
    ///
    /// # Errors
    ///
    /// All problems that only compilation finds, such as an initialiser that finds no place for
    /// its objects.
    pub fn compile(config: &ExperimentConfig) -> Result<Self, ConfigError> {
        let mut problems = Problems::default();
        let algorithm = &config.algorithm;
        let network = Network::compile(&config.topology, &mut problems);
        let codec = Codec::compile(config, &network, &mut problems);
        let world = World::compile(&config.world, algorithm, &network, &mut problems);
        let fitness = fitness::definition(algorithm.fitness_function);
        let script = config.task.as_ref();
        let script = script.and_then(|task| ScriptTask::compile(&task.script, &mut problems));
        if let (None, Some(script)) = (fitness, &script)
            && !script.has_fitness()
        {
            problems.add(
                script::PATH,
                "has no function `fitness` or `final`, but `algorithm.fitness_function` names no built-in function",
            );
        }
        if let (Some(task), Some(script), Some(world)) = (&config.task, &script, &world) {
            script.check(&task.script.name, world, &mut problems);
        }
        let measure_names = measure_names(fitness, script.as_ref());
        // The measures of a script that does not compile are unknown.
        let is_known = config.task.is_none() || script.is_some();
        let wanted = if is_known { algorithm.learnt_measures().collect() } else { Vec::new() };
        let descriptors = descriptors::compile(wanted, &measure_names, &mut problems);
        problems.check()?;
        let simulation = Self {
            isa: Isa::best(),
            seed: config.seed,
            n_steps: algorithm.evaluation_steps,
            n_trials: algorithm.num_evaluations,
            fitness,
            fitness_params: algorithm.fitness_params,
            script: script.map(Arc::new),
            measure_names,
            descriptors,
            network,
            codec,
            world: world.expect("a world without problems compiles"),
            interventions: Vec::new(),
        };
        let mut problems = Problems::default();
        for trial in 0..simulation.n_trials.min(N_TRIED_TRIALS) {
            if let Err(EvaluateError::Unplaceable { object, index, .. }) =
                try_places(&simulation, TrialSet::Generation(0), trial)
            {
                let path = format!("world.objects.{object}.initializers.positions");
                problems.add(path, format!("no place for number {index} in trial {trial}"));
                break;
            }
        }
        problems.check()?;
        Ok(simulation)
    }

    /// The same experiment with other vector instructions than the processor's best. They change no
    /// bit of any result.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Self {
        Self { isa, ..self }
    }

    /// The same experiment, in each of whose episodes somebody intervenes.
    ///
    /// # Errors
    ///
    /// All interventions that do not fit the world or the length of the episodes.
    pub fn with_interventions(
        self,
        interventions: Vec<Intervention>,
    ) -> Result<Self, InterventionError> {
        let interventions = intervention::in_order(interventions, &self.world, self.n_steps)?;
        Ok(Self { interventions, ..self })
    }

    /// Number d of genes of a genotype.
    pub fn genotype_len(&self) -> usize {
        self.codec.genotype_len()
    }

    /// Range of genes of each population, in the order of `algorithm.populations`.
    pub fn population_segments(&self) -> &[Range<usize>] {
        self.codec.segments()
    }

    /// Parameters that no query of the genotype covers and that keep their
    /// defaults, one line each, for a warning.
    pub fn uncovered_parameters(&self) -> &[String] {
        self.codec.uncovered()
    }

    /// Simulates one episode per trial, and returns the fitness of each, in order.
    ///
    /// `genotype`: d genes in \[0, 1\]. `trial_set`: determines worlds and noise; a number stands
    /// for that generation. `trials`: a non-empty part of 0..[`limits::TRIALS`]. The fitness of a
    /// trial does not depend on the other trials of the call.
    ///
    /// # Errors
    ///
    /// If an argument is out of range, if an object finds no place in a trial, or if the script
    /// fails.
    pub fn evaluate(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trials: Range<u32>,
    ) -> Result<Vec<f64>, EvaluateError> {
        let fitness = self.evaluate_while(genotype, trial_set, trials, &|| true)?;
        Ok(fitness.expect("nothing stopped the simulation"))
    }

    /// As [`evaluate`](Self::evaluate), but calls `keep_going` before every environment step, and
    /// every few milliseconds of a script. Returns `None` once `keep_going` has returned false. So
    /// a clock or another thread can stop an evaluation, but cannot change a bit of a result.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn evaluate_while(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trials: Range<u32>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<f64>>, EvaluateError> {
        let mut recorder = FitnessOnly::default();
        let done = self.run(genotype, trial_set.into(), trials, keep_going, &mut recorder)?;
        Ok(done.then_some(recorder.fitness))
    }

    /// Names of the measures of the task, in their order; see [`Measures`].
    pub fn measure_names(&self) -> &[MeasureName] {
        &self.measure_names
    }

    /// Number of environment steps of an episode.
    pub fn n_steps(&self) -> u32 {
        self.n_steps
    }

    /// Number of values per trial in [`measure_while`](Self::measure_while).
    pub fn values_per_trial(&self) -> usize {
        1 + self.n_steps as usize * self.measure_names().len()
    }

    /// As [`evaluate_while`](Self::evaluate_while), but also measures every step. Returns
    /// [`values_per_trial`](Self::values_per_trial) numbers for each trial, one trial after the
    /// other. The first number is the fitness, bit for bit. The others are, step by step, the
    /// values of the measures in [`measure_names`](Self::measure_names), NaN where a measure has
    /// none.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn measure_while(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trials: Range<u32>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<f64>>, EvaluateError> {
        let mut recorder = AllMeasures::new(self, trials.len());
        let done = self.run(genotype, trial_set.into(), trials, keep_going, &mut recorder)?;
        Ok(done.then_some(recorder.values))
    }

    /// Number of descriptors of a trial.
    pub fn n_descriptors(&self) -> usize {
        self.descriptors.len()
    }

    /// As [`evaluate_while`](Self::evaluate_while), but also describes the behaviour. Returns for
    /// each trial its fitness, bit for bit, and then the value of every descriptor of the file, in
    /// their order; NaN if the trial has no such value.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn describe_while(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trials: Range<u32>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<f64>>, EvaluateError> {
        let mut recorder = Described::new(self, trials.len());
        let done = self.run(genotype, trial_set.into(), trials, keep_going, &mut recorder)?;
        Ok(done.then_some(recorder.values))
    }

    /// Simulates the episode of one trial, and shows each step to `observe`, in a record that the
    /// next step overwrites. Watching changes nothing: the fitness has the same bits as in
    /// [`evaluate`](Self::evaluate).
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn simulate(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trial: u32,
        observe: &mut dyn FnMut(&StepRecord),
    ) -> Result<EpisodeSummary, EvaluateError> {
        let summary = self.simulate_while(genotype, trial_set, trial, &|| true, observe)?;
        Ok(summary.expect("nothing stopped the simulation"))
    }

    /// As [`simulate`](Self::simulate), but stops as [`evaluate_while`](Self::evaluate_while) does,
    /// and then returns `None`.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn simulate_while(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trial: u32,
        keep_going: &dyn Fn() -> bool,
        observe: &mut dyn FnMut(&StepRecord),
    ) -> Result<Option<EpisodeSummary>, EvaluateError> {
        let trials = trial..trial.saturating_add(1);
        let mut recorder = Viewer::new(observe);
        let done = self.run(genotype, trial_set.into(), trials, keep_going, &mut recorder)?;
        Ok(done.then(|| recorder.summary()))
    }

    /// Simulates trials, and shows them to a recorder. Returns false if `keep_going` stopped it.
    fn run<R: Recorder>(
        &self,
        genotype: &[f64],
        trial_set: TrialSet,
        trials: Range<u32>,
        keep_going: &dyn Fn() -> bool,
        recorder: &mut R,
    ) -> Result<bool, EvaluateError> {
        let phenotype = self.phenotype(genotype)?;
        self.check_trials(&trials)?;
        episode::run(self, &phenotype, trial_set, trials, keep_going, recorder)
    }

    /// The room of a trial: boundary, walls, obstacles, and the outlines of movables and robots;
    /// `None` in a world without bodies.
    ///
    /// # Errors
    ///
    /// If an object finds no place in the trial.
    pub fn room(
        &self,
        trial_set: impl Into<TrialSet>,
        trial: u32,
    ) -> Result<Option<RoomRecord>, EvaluateError> {
        trial::room(self, trial_set.into(), trial)
    }

    /// The network that a genotype encodes, as JSON: stimuli, neurons with `tau`, `bias`, `gain`
    /// and activation, synapses with weights.
    ///
    /// # Errors
    ///
    /// If the genotype has the wrong length, or a gene outside \[0, 1\].
    pub fn network_json(&self, genotype: &[f64]) -> Result<serde_json::Value, EvaluateError> {
        Ok(self.network.to_json(&self.phenotype(genotype)?))
    }

    /// Decodes a genotype.
    pub(crate) fn phenotype(&self, genotype: &[f64]) -> Result<Phenotype, EvaluateError> {
        self.check_genotype(genotype)?;
        Ok(self.codec.decode(genotype))
    }

    pub(crate) fn check_trials(&self, trials: &Range<u32>) -> Result<(), EvaluateError> {
        if trials.is_empty() || trials.end > limits::TRIALS {
            return Err(EvaluateError::Trials { trials: trials.clone() });
        }
        Ok(())
    }

    /// Checks that a genotype has d genes in \[0, 1\].
    ///
    /// # Errors
    ///
    /// If a gene is outside \[0, 1\], or if their number is not d.
    pub fn check_genotype(&self, genotype: &[f64]) -> Result<(), EvaluateError> {
        let (expected, actual) = (self.genotype_len(), genotype.len());
        if actual != expected {
            return Err(EvaluateError::GenotypeLength { expected, actual });
        }
        match genotype.iter().position(|gene| !(0.0..=1.0).contains(gene)) {
            Some(index) => Err(EvaluateError::GeneOutOfRange { index, value: genotype[index] }),
            None => Ok(()),
        }
    }
}

/// The measures of the function, and then the measures of the script that have other names.
fn measure_names(
    fitness: Option<&'static Definition>,
    script: Option<&ScriptTask>,
) -> Vec<MeasureName> {
    let of_function = fitness.map_or(&[][..], |definition| definition.measures);
    let mut names: Vec<MeasureName> = of_function.iter().map(|&name| name.into()).collect();
    for name in script.map_or(&[][..], ScriptTask::measure_names) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

#[cfg(test)]
mod tests;
