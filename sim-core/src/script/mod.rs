//! The task that an experiment brings as a script: compiled once, executed in every trial.
//! `names` is what scripts can name, `view` what they see and change.

mod names;
mod view;

pub(crate) use view::View;

use experiment_file::ScriptConfig;
use numeric::random::Stream;
use task_script::{FunctionId, Limits, Program, Script, ScriptError, Value};

use crate::problems::Problems;
use crate::record::{MeasureName, Measures};
use view::Kept;

/// Largest absolute value that a function may return: sums and squares of it are finite.
const LARGEST: f64 = 1e100;
/// Units of work in a call.
const WORK: u64 = 2_000_000;
/// Memory that a trial may keep, bytes, beside [`MEMORY_PER_ROBOT`].
const MEMORY: usize = 256 << 10;
const MEMORY_PER_ROBOT: usize = 4 << 10;

/// The functions that a script may have, with their arguments.
const FUNCTIONS: [(&str, usize); 3] = [("fitness", 1), ("final", 1), ("measures", 1)];

/// A script as far as it is the same for all trials.
#[derive(Debug)]
pub(crate) struct ScriptTask {
    program: Program,
    fitness: Option<FunctionId>,
    /// Fitness of the whole episode.
    last: Option<FunctionId>,
    measures: Option<FunctionId>,
    /// The names that `measures` gives.
    measure_names: Vec<MeasureName>,
}

impl ScriptTask {
    /// Compiles a script; none if something is wrong, which is reported.
    pub fn compile(config: &ScriptConfig, problems: &mut Problems) -> Option<Self> {
        let program = match Program::compile(&config.name, &config.text, &names::VOCABULARY) {
            Ok(program) => program,
            Err(errors) => {
                errors.iter().for_each(|error| problems.add(PATH, error.to_string()));
                return None;
            }
        };
        let mut is_right = true;
        let mut wrong = |error: String| {
            problems.add(PATH, error);
            is_right = false;
        };
        let function = |name: &str| program.function(name);
        for (name, n_arguments) in FUNCTIONS {
            let Some(function) = function(name) else { continue };
            let (_, n_found) = program.signature(function);
            if n_found != n_arguments {
                let message = format!("takes {n_arguments} argument, not {n_found}");
                wrong(program.problem(function, message).to_string());
            }
        }
        let measures = function("measures");
        let measure_names = measures.map(|measures| program.returned_keys(measures));
        if let (Some(measures), Some(None)) = (measures, measure_names) {
            let message = "returns something else than dicts with literal keys, such as \
                           `return {\"distance\": d}`; the keys are the names of the measures";
            wrong(program.problem(measures, message.into()).to_string());
        }
        let measure_names = measure_names.flatten().unwrap_or_default();
        let measure_names = measure_names.iter().map(|name| name.clone().into()).collect();
        let (fitness, last) = (function("fitness"), function("final"));
        if !FUNCTIONS.iter().any(|(name, _)| function(name).is_some()) {
            let known = FUNCTIONS.map(|(name, _)| format!("`{name}`")).join(", ");
            wrong(format!("{}: has none of the functions {known}", config.name));
        }
        is_right.then_some(Self { fitness, last, measures, measure_names, program })
    }

    /// Whether the script computes fitness.
    pub fn has_fitness(&self) -> bool {
        self.fitness.is_some() || self.last.is_some()
    }

    /// Names of the measures that it computes.
    pub fn measure_names(&self) -> &[MeasureName] {
        &self.measure_names
    }
}

/// Where problems of scripts are reported.
pub(crate) const PATH: &str = "task.script";

/// A script in one trial.
#[derive(Debug)]
pub(crate) struct ScriptRun<'a> {
    task: &'a ScriptTask,
    script: Script,
    kept: Kept,
}

impl<'a> ScriptRun<'a> {
    /// At the start of a trial; `stream` is what the script draws from.
    pub fn start(
        task: &'a ScriptTask,
        stream: Stream,
        n_robots: usize,
    ) -> Result<Self, ScriptError> {
        let limits = Limits { work: WORK, memory: MEMORY + MEMORY_PER_ROBOT * n_robots };
        let script = task.program.start(limits, &mut view::Nothing)?;
        Ok(Self { task, script, kept: Kept::new(stream) })
    }

    fn call<'s>(
        &'s mut self,
        function: FunctionId,
        argument: impl FnOnce(&mut View<'_>, &Script) -> Result<Value, String>,
        mut view: View<'s>,
    ) -> Result<Value, ScriptError> {
        let program = &self.task.program;
        view.kept = Some(&mut self.kept);
        let argument = argument(&mut view, &self.script);
        let argument = argument.map_err(|message| program.problem(function, message))?;
        self.script.call(program, function, &[argument], &mut view)
    }

    /// Fitness of a step; none if it does not count.
    pub fn fitness(&mut self, view: View<'_>) -> Result<Option<f64>, ScriptError> {
        let Some(function) = self.task.fitness else { return Ok(None) };
        match self.call(function, |_, _| Ok(view::WORLD), view)? {
            Value::Nothing => Ok(None),
            value => self.finite(function, &value).map(Some),
        }
    }

    /// Fitness of the whole episode; none if the script leaves it to the steps.
    pub fn last(&mut self, view: View<'_>) -> Result<Option<f64>, ScriptError> {
        let Some(function) = self.task.last else { return Ok(None) };
        let state = |view: &mut View<'_>, script: &Script| view.world_state(script.meter());
        let value = self.call(function, state, view)?;
        self.finite(function, &value).map(Some)
    }

    /// Adds the measures of a step.
    pub fn measure(&mut self, view: View<'_>, measures: &mut Measures) -> Result<(), ScriptError> {
        let Some(function) = self.task.measures else { return Ok(()) };
        let task = self.task;
        let value = self.call(function, |_, _| Ok(view::WORLD), view)?;
        let Value::Dict(values) = &value else {
            let message = format!("returns a {}, not a dict of numbers", value.kind());
            return Err(task.program.problem(function, message));
        };
        for name in &task.measure_names {
            match values.get_text(name) {
                None | Some(Value::Nothing) => {}
                Some(Value::Bool(value)) => {
                    measures.insert(name.clone(), f64::from(u8::from(value)));
                }
                Some(value) => {
                    let value = self.finite(function, &value)?;
                    measures.insert(name.clone(), value);
                }
            }
        }
        Ok(())
    }

    /// The number that a function has to return.
    fn finite(&self, function: FunctionId, value: &Value) -> Result<f64, ScriptError> {
        let problem = |message| self.task.program.problem(function, message);
        match value.number() {
            Some(number) if number.abs() <= LARGEST => Ok(number),
            Some(number) => Err(problem(format!(
                "returns {number:e}; numbers are finite and at most {LARGEST:e}"
            ))),
            None => Err(problem(format!("returns a {}, not a number", value.kind()))),
        }
    }
}

#[cfg(test)]
mod tests;
