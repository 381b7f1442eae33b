//! Episodes step by step. A separate thread holds them, because they borrow the experiment.

use std::{
    any::Any,
    ops::Range,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Sender},
    },
    thread,
};

use numpy::{IntoPyArray as _, PyArray1, PyArrayMethods as _, PyReadonlyArray1};
use pyo3::{exceptions::PyValueError, prelude::*};
use sim_core::{Actions, EvaluateError, Policy, Simulation, Stepper, TrialSet};

use crate::{
    errors::{evaluate_error, fork_error, panic_error},
    running::Home,
};

/// Trials side by side, whose agents take their actions from the caller.
#[pyclass(frozen, module = "swarmevo._core")]
pub struct Episodes {
    /// The channel to the thread, which ends when this is dropped.
    work: Mutex<Sender<Work>>,
    /// The process of the thread.
    home: Home,
    agents: Vec<usize>,
    n_inputs: usize,
    message_len: usize,
}

/// A job for the thread.
type Work = Box<dyn for<'a> FnOnce(&mut Stage<'a>) + Send>;

/// The state of the thread.
struct Stage<'a> {
    stepper: Stepper<'a>,
    policy: Option<Policy<'a>>,
}

type Array<'py, T> = Bound<'py, PyArray1<T>>;

#[pymethods]
impl Episodes {
    /// The numbers of the agents among all robots.
    #[getter]
    fn agents(&self) -> Vec<usize> {
        self.agents.clone()
    }

    #[getter]
    fn n_inputs(&self) -> usize {
        self.n_inputs
    }

    #[getter]
    fn message_len(&self) -> usize {
        self.message_len
    }

    /// Whether this is a forked process, which lacks the thread.
    #[getter]
    fn is_left(&self) -> bool {
        self.home.is_left()
    }

    /// The inputs of the agents, flat: `[T * A * I]`.
    fn stimuli<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f32>> {
        Ok(self.ask(py, |stage| stage.stepper.stimuli())?.into_pyarray(py))
    }

    /// Replaces the inputs of the agents in this step, flat.
    fn set_stimuli(&self, py: Python<'_>, stimuli: PyReadonlyArray1<'_, f32>) -> PyResult<()> {
        let stimuli = stimuli.to_vec()?;
        let set = self.ask(py, move |stage| stage.stepper.set_stimuli(&stimuli))?;
        set.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Silences agents in this step, flat.
    fn silence(&self, py: Python<'_>, silent: PyReadonlyArray1<'_, bool>) -> PyResult<()> {
        let silent = silent.to_vec()?;
        let silenced = self.ask(py, move |stage| stage.stepper.silence(&silent))?;
        silenced.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Whether agents sent their own message in the previous step, flat: `[T * A]`.
    fn sent<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, bool>> {
        Ok(self.ask(py, |stage| stage.stepper.sent())?.into_pyarray(py))
    }

    /// Takes one step with these actions, flat. Returns its fitness in each trial, NaN if the
    /// step does not count.
    fn step<'py>(
        &self,
        py: Python<'py>,
        wheels: PyReadonlyArray1<'py, f64>,
        leds: PyReadonlyArray1<'py, u32>,
        sends: PyReadonlyArray1<'py, bool>,
        messages: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        let wheels = wheels.to_vec()?;
        let actions = Actions {
            wheels: wheels.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(),
            leds: leds.to_vec()?,
            sends: sends.to_vec()?,
            messages: messages.to_vec()?,
        };
        let fitness = self.ask(py, move |stage| stage.stepper.step(&actions))?;
        let fitness = fitness.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let fitness = fitness.into_iter().map(|fitness| fitness.unwrap_or(f64::NAN));
        Ok(fitness.collect::<Vec<_>>().into_pyarray(py))
    }

    /// Loads the network of a genotype, at rest.
    fn load(&self, py: Python<'_>, genotype: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let genotype = genotype.to_vec()?;
        let loaded = self.ask(py, move |stage| {
            stage.policy = Some(stage.stepper.policy(&genotype)?);
            Ok(())
        })?;
        loaded.map_err(|error: EvaluateError| evaluate_error(&error))
    }

    /// The actions that the network decides: wheels, LEDs, whether to send, messages, flat.
    #[expect(clippy::type_complexity, reason = "four arrays")]
    fn decide<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, u32>, Array<'py, bool>, Array<'py, f64>)> {
        let actions = self.ask(py, |stage| {
            let Stage { stepper, policy } = stage;
            policy.as_mut().map(|policy| stepper.decide(policy))
        })?;
        let missing = || PyValueError::new_err("no network is loaded");
        let Actions { wheels, leds, sends, messages } = actions.ok_or_else(missing)?;
        let (leds, sends) = (leds.into_pyarray(py), sends.into_pyarray(py));
        Ok((wheels.concat().into_pyarray(py), leds, sends, messages.into_pyarray(py)))
    }

    /// Fitness of each trial so far.
    fn fitness<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        Ok(self.ask(py, |stage| stage.stepper.fitness())?.into_pyarray(py))
    }
}

impl Episodes {
    /// Starts the trials, before their first step.
    pub fn start(
        py: Python<'_>,
        simulation: Arc<Simulation>,
        trial_set: TrialSet,
        trials: Range<u32>,
    ) -> PyResult<Self> {
        let (work, inbox) = mpsc::channel::<Work>();
        let (started, outbox) = mpsc::channel();
        thread::Builder::new().name("swarmevo-episodes".into()).spawn(
            move || match Stepper::new(&simulation, trial_set, trials) {
                Ok(stepper) => {
                    let of_all = (stepper.agents(), stepper.n_inputs(), stepper.message_len());
                    let _ = started.send(Ok(of_all));
                    let mut stage = Stage { stepper, policy: None };
                    inbox.into_iter().for_each(|work| work(&mut stage));
                }
                Err(error) => {
                    let _ = started.send(Err(error));
                }
            },
        )?;
        let started = py.detach(move || outbox.recv()).map_err(|_| has_panicked(py))?;
        let (agents, n_inputs, message_len) = started.map_err(|error| evaluate_error(&error))?;
        Ok(Self { work: Mutex::new(work), home: Home::here(), agents, n_inputs, message_len })
    }

    /// Runs a job on the thread, and waits for it.
    fn ask<T: Any + Send>(
        &self,
        py: Python<'_>,
        work: impl for<'a> FnOnce(&mut Stage<'a>) -> T + Send + 'static,
    ) -> PyResult<T> {
        if self.home.is_left() {
            return Err(fork_error(py, "the thread of these episodes is in another process"));
        }
        let (answer, answered) = mpsc::channel();
        let work: Work = Box::new(move |stage| {
            // The caller waits for the answer.
            let _ = answer.send(work(stage));
        });
        let sent = self.work.lock().unwrap_or_else(PoisonError::into_inner).send(work);
        let answer = sent.ok().and_then(|()| py.detach(move || answered.recv()).ok());
        answer.ok_or_else(|| has_panicked(py))
    }
}

/// The error of a thread that has ended, which only a panic causes.
fn has_panicked(py: Python<'_>) -> PyErr {
    panic_error(py, "the simulation of these episodes has panicked")
}
