//! Judges many experiments at once, each with one genotype: those of candidate scripts.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::{Duration, Instant},
};

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use numpy::{PyArrayMethods as _, PyReadonlyArray1};
use pyo3::prelude::*;
use sim_core::{Simulation, panic_message};

use crate::{
    running::{KeepGoing, compute},
    trials::Trials,
};

/// The fitness of each trial, and the mean over time of each measure in each trial; or why there
/// are none.
type Verdict = (Vec<f64>, Vec<(String, Vec<f64>)>, Option<String>);

/// Judges the experiment file of every candidate, each within its own time. `genotype`: that of
/// all of them; without one, all genes are 0.5. A bad candidate has an error and no fitness, and
/// the others go on.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "values from Python")]
pub fn judge(
    py: Python<'_>,
    texts: Vec<String>,
    genotype: Option<PyReadonlyArray1<'_, f64>>,
    trials: Trials,
    n_threads: usize,
    seconds: f64,
) -> PyResult<Vec<Verdict>> {
    let genotype = genotype.map(|genotype| genotype.to_vec()).transpose()?;
    let set = trials.set()?;
    compute(py, texts.len(), n_threads, |index, keep_going| {
        // The clock gives up on a candidate. It changes no bit of a result.
        #[expect(clippy::disallowed_methods, reason = "a candidate has its own time")]
        let started = Instant::now();
        // A time that overflows is no limit.
        let limit = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
        let is_in_time = || keep_going() && started.elapsed() < limit;
        let judged = catch_unwind(AssertUnwindSafe(|| {
            of_one(&texts[index], genotype.as_deref(), (set, trials.range()), &is_in_time)
        }));
        let judged = judged.unwrap_or_else(|panic| {
            Err(format!("the simulator has panicked, which is a bug: {}", panic_message(&*panic)))
        });
        Ok(match judged {
            Ok(Some((fitness, measures))) => Some((fitness, measures, None)),
            Ok(None) if !keep_going() => None,
            Ok(None) => Some((vec![], vec![], Some(format!("it took longer than {seconds} s")))),
            Err(error) => Some((vec![], vec![], Some(error))),
        })
    })
}

type Judged = (Vec<f64>, Vec<(String, Vec<f64>)>);

/// Judges one experiment file; none if it was told to stop.
fn of_one(
    text: &str,
    genotype: Option<&[f64]>,
    (set, range): (sim_core::TrialSet, std::ops::Range<u32>),
    keep_going: KeepGoing<'_>,
) -> Result<Option<Judged>, String> {
    let read = ExperimentConfig::from_json(text, "", ALGORITHMS);
    let (config, _) = read.map_err(|error| error.to_string())?;
    let simulation = Simulation::compile(&config).map_err(|error| error.to_string())?;
    let any = vec![0.5; simulation.genotype_len()];
    let values = simulation.measure_while(genotype.unwrap_or(&any), set, range.clone(), keep_going);
    let Some(values) = values.map_err(|error| error.to_string())? else { return Ok(None) };
    let names = simulation.measure_names();
    let per_trial = 1 + simulation.n_steps() as usize * names.len();
    let fitness = values.chunks(per_trial).map(|trial| trial[0]).collect();
    let measures = names.iter().enumerate().map(|(measure, name)| {
        let of_trial = |trial: &[f64]| mean(trial[1..].iter().skip(measure).step_by(names.len()));
        (name.to_string(), values.chunks(per_trial).map(of_trial).collect())
    });
    Ok(Some((fitness, measures.collect())))
}

/// The mean of the values that there are; NaN if there are none.
fn mean<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, n) = values
        .filter(|value| !value.is_nan())
        .fold((0.0, 0_u32), |(sum, n), value| (sum + value, n + 1));
    sum / f64::from(n)
}
