//! A compiled experiment, the core of `swarmevo.Experiment`.

use std::sync::Arc;

use controller_c::{About, Episodes as Recorded, LEN_MAX};
use evolution::{ALGORITHMS, Digest};
use experiment_file::{ExperimentConfig, ScriptConfig};
use numpy::{IntoPyArray as _, PyArray1, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{PyBytes, PyDict},
};
use replay::{Episode, Replay};
use sim_core::{FINGERPRINT, Simulation};
use swarm_web::replay_file;

use crate::{
    errors::{config_error, evaluate_error},
    evolution::Evolution,
    running::{compute, guarded},
    stepping::Episodes,
    trace::Recording,
    trials::Trials,
};

/// An experiment file, read and compiled.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Experiment {
    config: ExperimentConfig,
    simulation: Arc<Simulation>,
    warnings: Vec<String>,
}

/// A file's text without comments and trailing commas, for a parser of JSON; lines stay.
#[pyfunction]
pub fn plain(text: &str) -> String {
    experiment_file::plain(text).into_owned()
}

/// The path of the script that a file's text names; none if it has no script, or contains it.
#[pyfunction]
pub fn script_path(text: &str) -> Option<String> {
    experiment_file::script_path(text).map(|(path, _)| path)
}

/// A file's text, with the script instead of its path.
#[pyfunction]
pub fn inline_script(text: &str, name: String, script: String) -> String {
    match experiment_file::script_path(text) {
        Some((_, place)) => {
            experiment_file::inline_script(text, place, &ScriptConfig { name, text: script })
        }
        None => text.to_owned(),
    }
}

#[pymethods]
impl Experiment {
    #[new]
    fn new(py: Python<'_>, text: &str, default_name: &str, seed: Option<u64>) -> PyResult<Self> {
        let read = guarded(py, || {
            let (mut config, warnings) =
                ExperimentConfig::from_json(text, default_name, ALGORITHMS)?;
            config.seed = seed.unwrap_or(config.seed);
            Ok((Simulation::compile(&config)?, config, warnings))
        })?;
        let (simulation, config, warnings) = read.map_err(|error| config_error(py, &error))?;
        let warnings = warnings.iter().map(ToString::to_string).collect();
        Ok(Self { config, simulation: simulation.into(), warnings })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.config.name
    }

    /// Link -1 of the digest chain: equal links mean the same bits of every generation.
    #[getter]
    fn config_digest(&self) -> String {
        Digest::of_config(&self.config, FINGERPRINT).to_string()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn n_genes(&self) -> usize {
        self.simulation.genotype_len()
    }

    #[getter]
    fn n_steps(&self) -> u32 {
        self.simulation.n_steps()
    }

    #[getter]
    fn measure_names(&self) -> Vec<&str> {
        self.simulation.measure_names().iter().map(|name| &**name).collect()
    }

    /// The file with all defaults, as JSON.
    fn to_json(&self) -> String {
        self.text()
    }

    /// Fitness of P genotypes in T trials, flat: `[P * T]`.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        genotypes: PyReadonlyArray2<'py, f64>,
        trials: Trials,
        n_threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_all(py, &genotypes, &trials, n_threads, |genotype, trials, keep_going| {
            let (set, range) = trials;
            self.simulation.evaluate_while(genotype, set, range, keep_going)
        })
    }

    /// Like `evaluate`, with all measures of all steps: `[P * T * (1 + S * K)]`.
    fn measure<'py>(
        &self,
        py: Python<'py>,
        genotypes: PyReadonlyArray2<'py, f64>,
        trials: Trials,
        n_threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_all(py, &genotypes, &trials, n_threads, |genotype, trials, keep_going| {
            let (set, range) = trials;
            self.simulation.measure_while(genotype, set, range, keep_going)
        })
    }

    /// All recorded values of a genotype in T trials: arrays by name.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        genotype: PyReadonlyArray1<'py, f64>,
        trials: Trials,
        n_threads: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let genotype = genotype.to_vec()?;
        let (set, range) = (trials.set()?, trials.range());
        let recordings = compute(py, range.len(), n_threads, |index, _| {
            let mut recording = Recording::default();
            let trial = range.start + index as u32;
            let mut observe = |step: &_| recording.add(step, &self.simulation);
            let summary = self.simulation.simulate(&genotype, set, trial, &mut observe)?;
            recording.end(&summary);
            Ok(Some(recording))
        })?;
        Recording::to_arrays(py, recordings, self.simulation.n_steps() as usize)
    }

    /// The network of a genotype, as JSON.
    fn network_json(&self, genotype: PyReadonlyArray1<'_, f64>) -> PyResult<String> {
        let network = self.simulation.network_json(&genotype.to_vec()?);
        network.map(|network| network.to_string()).map_err(|error| evaluate_error(&error))
    }

    /// The files of the controller of a genotype in C, with the episodes of the trials: names and
    /// contents.
    fn controller_c<'py>(
        &self,
        py: Python<'py>,
        genotype: PyReadonlyArray1<'py, f64>,
        trials: Trials,
    ) -> PyResult<Vec<(&'static str, Bound<'py, PyBytes>)>> {
        let (genotype, trial_set, about) = (genotype.to_vec()?, trials.set()?, self.about());
        let simulation = &self.simulation;
        let controller = guarded(py, || {
            let (trials, keep_going) = (trials.range(), &|| true);
            let episodes = Recorded { trial_set, trials, len_max: LEN_MAX, keep_going };
            controller_c::export(simulation, &genotype, episodes, &about)
        })?;
        let controller = controller.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let files = controller.files.iter();
        Ok(files.map(|(name, content)| (*name, PyBytes::new(py, content))).collect())
    }

    /// The controller of a genotype as a graph of ONNX.
    fn controller_onnx<'py>(
        &self,
        py: Python<'py>,
        genotype: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (genotype, about, simulation) = (genotype.to_vec()?, self.about(), &self.simulation);
        let graph = guarded(py, || controller_onnx::export(simulation, &genotype, &about))?;
        let graph = graph.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(PyBytes::new(py, &graph))
    }

    /// The player with an episode, as an HTML file.
    fn replay_html(
        &self,
        py: Python<'_>,
        genotype: PyReadonlyArray1<'_, f64>,
        trials: Trials,
        name: &str,
    ) -> PyResult<String> {
        let (genotype, trial_set, trial) =
            (genotype.to_vec()?, trials.set()?, trials.range().start);
        let html = guarded(py, || {
            let (config, simulation) = (&self.config, &self.simulation);
            let genotype = &genotype;
            let episode = Episode { config, simulation, genotype, name, trial_set, trial };
            let generation = trial_set.generation().unwrap_or_default();
            Replay::simulate(&episode).map(|replay| replay_file(&episode, generation, &replay))
        })?;
        html.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Trials side by side, step by step.
    fn episodes(&self, py: Python<'_>, trials: Trials) -> PyResult<Episodes> {
        Episodes::start(py, Arc::clone(&self.simulation), trials.set()?, trials.range())
    }

    /// The experiment's evolution before its first generation.
    fn evolution(&self) -> Evolution {
        Evolution::of_experiment(&self.config, &self.simulation)
    }
}

impl Experiment {
    /// Where a controller of Python comes from.
    fn about(&self) -> About {
        About {
            experiment: self.config.name.clone(),
            genotype: "a genotype of Python".into(),
            config_digest: self.config_digest(),
        }
    }

    pub fn config(&self) -> &ExperimentConfig {
        &self.config
    }

    /// The file with all defaults, as JSON.
    pub fn text(&self) -> String {
        self.config.to_canonical_json()
    }

    /// Computes P genotypes, in enough items to occupy all threads.
    fn of_all<'py>(
        &self,
        py: Python<'py>,
        genotypes: &PyReadonlyArray2<'py, f64>,
        trials: &Trials,
        n_threads: usize,
        work: impl Fn(
            &[f64],
            (sim_core::TrialSet, std::ops::Range<u32>),
            &dyn Fn() -> bool,
        ) -> Result<Option<Vec<f64>>, sim_core::EvaluateError>
        + Sync,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (n_genotypes, n_genes) = genotypes.as_array().dim();
        // A copy, because Python code may write to the original while the lock is
        // released.
        let genes = genotypes.to_vec()?;
        let (set, range) = (trials.set()?, trials.range());
        // Trials of a genotype are fastest side by side; they are split only if there are
        // fewer genotypes than threads.
        let n_parts = n_threads.div_ceil(n_genotypes.max(1)).clamp(1, range.len().max(1));
        let part_len = range.len().div_ceil(n_parts).max(1);
        let n_parts = range.len().div_ceil(part_len).max(1);
        let results = compute(py, n_genotypes * n_parts, n_threads, |item, keep_going| {
            let genotype = &genes[item / n_parts * n_genes..][..n_genes];
            let first = range.start + (item % n_parts * part_len) as u32;
            let part = first..range.end.min(first.saturating_add(part_len as u32));
            work(genotype, (set, part), keep_going)
        })?;
        Ok(results.concat().into_pyarray(py))
    }
}
