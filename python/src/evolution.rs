//! The algorithms, as ask and tell.

use evolution::{
    ALGORITHMS, Champion, ChampionSource, Direction, End, Evaluations, EvolutionError, Generation,
    Learnt, Setup, SetupError, completion,
};
use experiment_file::{
    AlgorithmDescription, DefaultValue, Domain, ExperimentConfig, Parameter, ParameterValue, Params,
};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::{
    exceptions::{PyRuntimeError, PyValueError},
    prelude::*,
    types::PyDict,
};
use sim_core::{FINGERPRINT, Simulation, TrialSet};

use crate::{errors::evolution_error, experiment::Experiment, memory, running::Shared};

/// Upper bounds of the number of arrays of a genotype's length: those that an algorithm
/// keeps, and those per individual while a generation is drawn and handed over.
const KEPT_PER_GENE: u128 = 8;
const DRAWN_PER_GENE: u128 = 4;

/// An evolution between two generations.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Evolution(Shared<State>);

/// The answer to fitness without the measures that belong to it.
const NO_MEASURES: &str = "a repertoire or a front also learns from measures: tell the values of its \
                           descriptors or aims as `measures`, or let a fleet compute them: run the \
                           experiment on one (`swarmevo.local_fleet()`), or by `swarmctl run`";

/// The answer to the judgement of a champion alone.
const NO_JUDGE: &str = "a fleet judges all elites; here, evaluate the genotypes of the elites on \
                        trials that evolution has not met";

/// A generation: index, best, mean, min, standard deviation, number of individuals
/// without a finite fitness.
type Summary = (u64, f64, f64, f64, f64, usize);

/// The reason why evolution did not learn from a generation.
enum NotTold {
    Rows(String),
    Evolution(EvolutionError),
}

#[derive(Clone)]
struct State {
    evolution: evolution::Evolution,
    /// The generation that `ask` has drawn since the last `tell`.
    asked: Option<Generation>,
}

#[pymethods]
impl Evolution {
    /// An evolution of one population, for any function of genes in [0, 1]. `minimised`: whether
    /// less of each aim beside fitness is better, for fronts.
    #[new]
    fn new(
        algorithm: &str,
        n_genes: usize,
        population_size: u32,
        seed: u64,
        params: &Bound<'_, PyDict>,
        minimised: Vec<bool>,
    ) -> PyResult<Self> {
        let params = read_params(algorithm, params)?;
        let aim = |minimised| if minimised { Direction::Minimise } else { Direction::Maximise };
        let aims = minimised.into_iter().map(aim).collect();
        let setup = Setup { population_size, seed, params, aims, ..Setup::new(algorithm, n_genes) };
        let refused = |error: SetupError| PyValueError::new_err(error.to_string());
        setup.check().map_err(refused)?;
        let numbers = KEPT_PER_GENE + DRAWN_PER_GENE * u128::from(population_size);
        let bytes = n_genes as u128 * numbers * size_of::<f64>() as u128;
        let what = format!("an evolution of {population_size} genotypes of {n_genes} genes");
        memory::ensure(bytes, &what)?;
        let evolution = setup.start().map_err(refused)?;
        Ok(Self::wrap(evolution))
    }

    /// Restores the output of `to_json`. `n_flat`: the number of latest flat generations, which
    /// the state does not contain.
    #[staticmethod]
    #[pyo3(signature = (text, n_flat=0))]
    fn from_json(text: &str, n_flat: u64) -> PyResult<Self> {
        let evolution: evolution::Evolution = serde_json::from_str(text).map_err(|error| {
            PyValueError::new_err(format!("not the state of an evolution: {error}"))
        })?;
        let n_flat = n_flat.min(evolution.n_generations());
        Ok(Self::wrap(evolution.after_flat(n_flat)))
    }

    /// The number of latest generations in which all individuals had the same fitness.
    #[getter]
    fn n_flat(&self, py: Python<'_>) -> PyResult<u64> {
        self.0.with(py, |state| state.evolution.n_flat())
    }

    /// The state as JSON.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        let text = self.0.with(py, |state| serde_json::to_string(&state.evolution))?;
        text.map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }

    /// The next generation, `[P, d]`.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let genotypes = self.0.with(py, |state| {
            let asked = state.asked.take().unwrap_or_else(|| state.evolution.ask());
            let genotypes = asked.genotypes.to_vec();
            state.asked = Some(asked);
            genotypes
        })?;
        Ok(PyArray2::from_vec2(py, &genotypes)?)
    }

    /// Learns from the fitness `[P, T]` of the generation that `ask` returned; an error leaves
    /// it unchanged. `experiment`: the experiment of this run. `measures`: `[P, T M]`, for each
    /// trial the values of the descriptors or aims. Returns the index of the
    /// generation, best, mean, min, standard deviation, the number of individuals without a
    /// finite fitness, the notices, and the reason if the generation is the last one of the run.
    #[pyo3(signature = (fitness, experiment=None, measures=None))]
    fn tell(
        &self,
        py: Python<'_>,
        fitness: PyReadonlyArray2<'_, f64>,
        experiment: Option<&Experiment>,
        measures: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<(Summary, Vec<String>, Option<String>)> {
        let fitness = rows(&fitness);
        let descriptors = measures.map(|measures| rows(&measures));
        let learnt = self.0.with(py, |state| {
            let descriptors =
                check_measures(&fitness, descriptors, state.evolution.n_descriptors())
                    .map_err(NotTold::Rows)?;
            let asked = state.asked.get_or_insert_with(|| state.evolution.ask());
            check_rows(&fitness, asked.genotypes.len()).map_err(NotTold::Rows)?;
            let mut after = state.evolution.clone();
            let completion =
                |summary: &_| experiment.and_then(|run| completion(run.config(), summary));
            let told = Evaluations { fitness: &fitness, descriptors: &descriptors };
            let learnt = after.learn(asked.clone(), told, completion);
            let learnt = learnt.map_err(NotTold::Evolution)?;
            *state = State { evolution: after, asked: None };
            Ok(learnt)
        })?;
        let Learnt { summary, notices, completed } = learnt.map_err(|error| match error {
            NotTold::Rows(problem) => PyValueError::new_err(problem),
            NotTold::Evolution(error) => evolution_error(py, &error),
        })?;
        let of = &summary.statistics;
        let numbers = [of.best, of.mean, of.min, of.standard_deviation];
        let [best, mean, min, deviation] = numbers.map(f64::from);
        let row = (summary.generation, best, mean, min, deviation, summary.n_non_finite);
        Ok((row, notices, completed))
    }

    #[getter]
    fn n_generations(&self, py: Python<'_>) -> PyResult<u64> {
        self.0.with(py, |state| state.evolution.n_generations())
    }

    /// The link of the digest chain of generations.
    #[getter]
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        self.0.with(py, |state| state.evolution.digest().to_string())
    }

    /// The link of the digest chain of re-evaluations.
    #[getter]
    fn champion_digest(&self, py: Python<'_>) -> PyResult<String> {
        self.0.with(py, |state| state.evolution.champion_digest().to_string())
    }

    /// The champion so far.
    #[getter]
    fn champion<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let champion = self.0.with(py, |state| state.evolution.champion().cloned())?;
        champion.map(|champion| champion_dict(py, &champion)).transpose()
    }

    /// The mean of the distribution, if there is one.
    #[getter]
    fn mean<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let mean = self.0.with(py, |state| state.evolution.mean())?;
        Ok(mean.map(|mean| PyArray1::from_vec(py, mean)))
    }

    /// The elites of the front: genotypes `[N, d]`, fitness and then aims `[N, 1 + M]`, generation
    /// and index of each birth; none without a front.
    fn front<'py>(&self, py: Python<'py>) -> PyResult<Option<Elites<'py>>> {
        let found = self.0.with(py, |state| {
            let end = End::default();
            let elites = state.evolution.front(&end)?.elites.into_iter();
            Some(
                elites
                    .map(|elite| {
                        let values = [&[elite.fitness], &elite.descriptors[..]].concat();
                        (elite.genotype.to_vec(), values, (elite.generation, elite.individual))
                    })
                    .collect::<Vec<_>>(),
            )
        })?;
        let Some(elites) = found else { return Ok(None) };
        let genotypes: Vec<Vec<f64>> = elites.iter().map(|(genes, ..)| genes.clone()).collect();
        let values: Vec<Vec<f64>> = elites.iter().map(|(_, values, _)| values.clone()).collect();
        let born = elites.iter().map(|(.., born)| *born).collect();
        // Without elites, arrays still have their columns.
        let (d, n_aims) = self
            .0
            .with(py, |state| (state.evolution.n_genes(), state.evolution.n_descriptors()))?;
        let array = |rows: &[Vec<f64>], n_columns| match rows {
            [] => Ok(PyArray2::zeros(py, [0, n_columns], false)),
            rows => PyArray2::from_vec2(py, rows),
        };
        Ok(Some((array(&genotypes, d)?, array(&values, 1 + n_aims)?, born)))
    }

    /// A copy in the same state.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        Ok(Self(Shared::new(self.0.with(py, |state| state.clone())?)))
    }

    /// Whether there is a new individual since the last comparison of candidates.
    #[getter]
    fn has_challenger(&self, py: Python<'_>) -> PyResult<bool> {
        let is_new = |champion: &Champion| {
            champion.held_out.is_none() && matches!(champion.source, ChampionSource::Individual(_))
        };
        self.0.with(py, |state| {
            let candidates = state.evolution.reevaluation();
            candidates.is_some_and(|all| all.candidates().iter().any(is_new))
        })
    }

    /// The comparison of candidates for the champion; none before the first generation.
    fn reevaluation(&self, py: Python<'_>) -> PyResult<Option<Reevaluation>> {
        let reevaluation = self.0.with(py, |state| state.evolution.reevaluation())?;
        Ok(reevaluation.map(|reevaluation| Reevaluation(Shared::new(reevaluation))))
    }

    /// Makes the winner of a finished comparison the champion.
    fn set_champion(&self, py: Python<'_>, reevaluation: &Reevaluation) -> PyResult<()> {
        let reevaluation = reevaluation.0.with(py, |reevaluation| reevaluation.clone())?;
        if !reevaluation.is_over() {
            return Err(PyValueError::new_err(
                "the comparison is not over; tell it the next block",
            ));
        }
        self.0.with(py, |state| state.evolution.set_champion(&reevaluation))
    }

    /// Judges the champion: its genotype and trials; none before the first generation.
    fn judgement<'py>(&self, py: Python<'py>) -> PyResult<Option<AskedTrials<'py>>> {
        let judgement = self.0.with(py, |state| state.evolution.judgement())?;
        judgement
            .map(|judgement| asked_trials(py, &judgement.genotypes(), judgement.trial_set()))
            .transpose()
    }

    /// The judged champion, and the last link of the digest chain of re-evaluations.
    fn judge<'py>(
        &self,
        py: Python<'py>,
        fitness: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyDict>, String)> {
        let fitness = rows(&fitness);
        let judged = self.0.with(py, |state| {
            if state.evolution.n_descriptors() > 0 {
                return Err(NO_JUDGE.to_owned());
            }
            let judgement = state.evolution.judgement();
            let judgement = judgement.ok_or("there is no champion before the first generation")?;
            check_rows(&fitness, 1)?;
            Ok::<_, String>(judgement.decide(&fitness))
        })?;
        let (champion, digest) = judged.map_err(PyValueError::new_err)?;
        Ok((champion_dict(py, &champion)?, digest.to_string()))
    }
}

impl Evolution {
    /// An evolution as an object of Python.
    pub fn wrap(evolution: evolution::Evolution) -> Self {
        Self(Shared::new(State { evolution, asked: None }))
    }

    /// A copy of its present state.
    pub fn state(&self, py: Python<'_>) -> PyResult<evolution::Evolution> {
        self.0.with(py, |state| state.evolution.clone())
    }

    /// The evolution that a coordinator starts for the same file.
    pub fn of_experiment(config: &ExperimentConfig, simulation: &Simulation) -> Self {
        let segments = simulation.population_segments();
        Self::wrap(evolution::Evolution::new(config, segments, FINGERPRINT))
    }
}

/// Candidates for the champion, compared block by block on held-out trials.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Reevaluation(Shared<evolution::Reevaluation>);

#[pymethods]
impl Reevaluation {
    /// The genotypes and trials of the next block; none if the comparison is over.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Option<AskedTrials<'py>>> {
        let next = self.0.with(py, |reevaluation| {
            (!reevaluation.is_over()).then(|| (reevaluation.genotypes(), reevaluation.trial_set()))
        })?;
        next.map(|(genotypes, trials)| asked_trials(py, &genotypes, trials)).transpose()
    }

    /// Records the fitness of a block.
    fn tell(&self, py: Python<'_>, fitness: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        let fitness = rows(&fitness);
        let told = self.0.with(py, |reevaluation| {
            if reevaluation.is_over() {
                return Err("the comparison is over".to_owned());
            }
            check_rows(&fitness, reevaluation.genotypes().len())?;
            reevaluation.learn(&fitness);
            Ok(())
        })?;
        told.map_err(PyValueError::new_err)
    }
}

/// Checks that there is a row for each genotype, with a number for each trial.
fn check_rows(fitness: &[Vec<f64>], n_genotypes: usize) -> Result<(), String> {
    if fitness.len() == n_genotypes && !fitness.iter().any(Vec::is_empty) {
        return Ok(());
    }
    Err(format!(
        "there are {n_genotypes} genotypes; their fitness must be an array of {n_genotypes} \
         numbers, or of {n_genotypes} rows with a number for each trial"
    ))
}

/// Checks that there are measures for repertoires and fronts, and only for them: for each trial as
/// many as expected. Returns them.
fn check_measures(
    fitness: &[Vec<f64>],
    measures: Option<Vec<Vec<f64>>>,
    n_measures: usize,
) -> Result<Vec<Vec<f64>>, String> {
    match (measures, n_measures) {
        (None, 0) => Ok(Vec::new()),
        (None, _) => Err(NO_MEASURES.to_owned()),
        (Some(_), 0) => {
            Err("this algorithm learns from fitness alone, without measures".to_owned())
        }
        (Some(measures), n) => {
            let is_right = |(fitness, row): (&Vec<f64>, &Vec<f64>)| row.len() == n * fitness.len();
            let fits =
                measures.len() == fitness.len() && fitness.iter().zip(&measures).all(is_right);
            let expected = "measures is an array [P, T, M]: for each trial of each genotype";
            fits.then_some(measures).ok_or(format!("{expected} {n} values"))
        }
    }
}

/// Genotypes, values and births of elites.
type Elites<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Vec<(u64, u32)>);

/// Genotypes `[P, d]`; kind, generation and block of their trials.
type AskedTrials<'py> = (Bound<'py, PyArray2<f64>>, (&'static str, u64, u8));

fn asked_trials<'py>(
    py: Python<'py>,
    genotypes: &[Vec<f64>],
    trial_set: TrialSet,
) -> PyResult<AskedTrials<'py>> {
    let trials = match trial_set {
        TrialSet::Generation(generation) => ("generation", generation, 0),
        TrialSet::HeldOut { generation, block } => ("held_out", generation, block),
        TrialSet::Judgement(generation) => ("judgement", generation, 0),
        TrialSet::Evaluation => ("evaluation", 0, 0),
    };
    Ok((PyArray2::from_vec2(py, genotypes)?, trials))
}

pub fn champion_dict<'py>(py: Python<'py>, champion: &Champion) -> PyResult<Bound<'py, PyDict>> {
    let Champion { generation, source, genotype, trial_fitness, held_out, judged } = champion;
    let dict = PyDict::new(py);
    dict.set_item("generation", generation)?;
    let individual = match source {
        ChampionSource::Individual(index) => Some(index),
        ChampionSource::Mean => None,
    };
    dict.set_item("individual", individual)?;
    dict.set_item("genotype", PyArray1::from_slice(py, genotype))?;
    dict.set_item("trial_fitness", PyArray1::from_slice(py, trial_fitness))?;
    dict.set_item(
        "selection",
        held_out.map(|selection| (selection.mean.get(), selection.n_trials)),
    )?;
    dict.set_item(
        "judged",
        judged.map(|judgement| {
            (judgement.mean.get(), judgement.low.get(), judgement.high.get(), judgement.n_trials)
        }),
    )?;
    Ok(dict)
}

pub fn rows(array: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}

/// Parameters from Python. A number takes the type of its parameter, if it fits;
/// otherwise the error of `Setup` states the valid values.
fn read_params(algorithm: &str, given: &Bound<'_, PyDict>) -> PyResult<Params> {
    let mut params = Params::default();
    let described = AlgorithmDescription::find(ALGORITHMS, algorithm);
    let parameters = described.map_or(&[][..], |described| described.parameters);
    for (key, value) in given {
        let key: String = key.extract()?;
        let is_whole = parameters.iter().any(|parameter| {
            parameter.key == key
                && matches!(parameter.domain, Domain::Whole(..) | Domain::BelowPopulationSize)
        });
        let value = if is_whole && let Ok(whole) = value.extract::<u32>() {
            ParameterValue::Whole(whole)
        } else if let Ok(number) = value.extract::<f64>() {
            ParameterValue::Number(number)
        } else {
            ParameterValue::Name(value.extract()?)
        };
        params.set(&key, value);
    }
    Ok(params)
}

/// The warning about a population of this size, if any.
#[pyfunction]
pub fn advice(algorithm: &str, population_size: u32) -> Option<String> {
    AlgorithmDescription::find(ALGORITHMS, algorithm)?.advice(population_size)
}

/// The algorithms: name, title, and for each parameter its key, valid values, default and
/// meaning.
#[pyfunction]
pub fn algorithms() -> Vec<(&'static str, &'static str, Vec<[String; 4]>)> {
    let parameter = |parameter: &Parameter| {
        let default = match parameter.default {
            DefaultValue::Formula(formula) => formula.to_owned(),
            value => value.value().map_or_else(String::new, |value| value.to_string()),
        };
        [
            parameter.key.to_owned(),
            parameter.domain.to_string(),
            default,
            parameter.meaning.to_owned(),
        ]
    };
    let described = ALGORITHMS.iter();
    described
        .map(|algorithm| {
            (algorithm.name, algorithm.title, algorithm.parameters.iter().map(parameter).collect())
        })
        .collect()
}
