//! Runs of this process in the database of a data directory.

use std::{path::Path, time::Duration};

use coordinator::local::{Done, LocalRun, LocalRunError};
use evolution::{End, Told};
use model::store::{ExperimentState, StoreError};
use numpy::PyReadonlyArray2;
use pyo3::{
    exceptions::{PyOSError, PyValueError},
    prelude::*,
    types::PyDict,
};

use crate::{
    errors::config_error,
    evolution::{Evolution, champion_dict, rows},
    experiment::Experiment,
    running::{Shared, guarded},
};

/// An experiment in a data directory, which no other program changes meanwhile.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Record(Shared<Option<LocalRun>>);

type Blocks<'py> = Vec<PyReadonlyArray2<'py, f64>>;

#[pymethods]
impl Record {
    /// Finds the experiment, or starts it.
    #[new]
    fn new(py: Python<'_>, directory: &str, experiment: &Experiment) -> PyResult<Self> {
        let text = experiment.text();
        let opened = guarded(py, || LocalRun::open(Path::new(directory), text))?;
        let opened = opened.map_err(|error| record_error(py, &error))?;
        Ok(Self(Shared::new(Some(opened))))
    }

    /// Its number, whether it is complete, and the last link of its digest chain.
    fn state(&self, py: Python<'_>) -> PyResult<(u64, bool, String)> {
        self.ask(py, |run| {
            let record = run.record()?;
            let is_over = record.state == ExperimentState::Completed;
            Ok((record.id.0, is_over, record.digest))
        })
    }

    /// Evolution after the latest generation.
    fn evolution(&self, py: Python<'_>) -> PyResult<Evolution> {
        Ok(Evolution::wrap(self.ask(py, |run| run.evolution())?))
    }

    /// The champion so far.
    fn champion<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let champion = self.ask(py, |run| Ok(run.champion()?))?;
        champion.map(|champion| champion_dict(py, &champion)).transpose()
    }

    /// For every generation: index, best, mean, min, standard deviation, digest, ms.
    #[expect(clippy::type_complexity, reason = "a row")]
    fn history(&self, py: Python<'_>) -> PyResult<Vec<(u64, f64, f64, f64, f64, String, u64)>> {
        let history = self.ask(py, |run| Ok(run.history()?))?;
        let rows = history.into_iter().map(|record| {
            let of = record.statistics;
            let numbers = [of.best, of.mean, of.min, of.standard_deviation];
            let [best, mean, min, deviation] = numbers.map(f64::from);
            (record.generation, best, mean, min, deviation, record.digest, record.duration_ms)
        });
        Ok(rows.collect())
    }

    /// Stores a generation: the evolution after it, its notices, and the fitness of its
    /// individuals, of a scheduled comparison, of a comparison that only the end causes, and
    /// of the judgement.
    #[expect(clippy::too_many_arguments, reason = "they are one generation")]
    fn commit(
        &self,
        py: Python<'_>,
        evolution: &Evolution,
        fitness: PyReadonlyArray2<'_, f64>,
        blocks: Blocks<'_>,
        end_blocks: Blocks<'_>,
        judgement: Option<PyReadonlyArray2<'_, f64>>,
        notices: Vec<String>,
        seconds: f64,
        n_workers: u64,
        completed: Option<String>,
    ) -> PyResult<()> {
        let all = |blocks: &Blocks<'_>| blocks.iter().map(rows).collect::<Vec<_>>();
        let judgement = judgement.map_or_else(Vec::new, |judgement| rows(&judgement).concat());
        let end = End { blocks: all(&end_blocks), judgement, ..End::default() };
        let told = Told { blocks: all(&blocks), end, ..Told::from_fitness(rows(&fitness)) };
        let duration = Duration::try_from_secs_f64(seconds);
        let duration = duration.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let evolution = evolution.state(py)?;
        if told.trial_fitness.iter().any(Vec::is_empty)
            || !evolution::has_finite_fitness(&told.trial_fitness)
        {
            return Err(PyValueError::new_err("no individual has a finite fitness"));
        }
        self.ask(py, move |run| {
            let completed = completed.as_deref();
            let (evolution, told, notices) = (&evolution, &told, &notices[..]);
            let done = Done { evolution, told, notices, duration, n_workers, completed };
            run.commit(&done).map(|_| ())
        })
    }

    /// Marks the experiment as failed.
    fn fail(&self, py: Python<'_>, reason: String) -> PyResult<()> {
        self.ask(py, move |run| Ok(run.fail(&reason)?))
    }

    /// Releases the directory for other programs.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.0.with(py, |run| *run = None)
    }
}

impl Record {
    fn ask<T: Send>(
        &self,
        py: Python<'_>,
        what: impl FnOnce(&mut LocalRun) -> Result<T, LocalRunError> + Send,
    ) -> PyResult<T> {
        let answer = self.0.with(py, |run| run.as_mut().map(what))?;
        let answer = answer.ok_or_else(|| PyValueError::new_err("the run is closed"))?;
        answer.map_err(|error| record_error(py, &error))
    }
}

fn record_error(py: Python<'_>, error: &LocalRunError) -> PyErr {
    match error {
        LocalRunError::Config(error) => config_error(py, error),
        LocalRunError::Store(
            error @ (StoreError::Locked { .. } | StoreError::Directory { .. }),
        ) => PyOSError::new_err(error.to_string()),
        error => PyValueError::new_err(error.to_string()),
    }
}
