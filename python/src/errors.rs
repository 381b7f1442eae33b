//! Errors of Rust as exceptions; their classes are in `swarmevo/errors.py`.

use evolution::EvolutionError;
use experiment_file::ConfigError;
use pyo3::{call::PyCallArgs, exceptions::PyValueError, prelude::*};
use sim_core::EvaluateError;
use tonic::Status;

/// The exception `name` of `swarmevo.errors` with these arguments, or the error of creating
/// it.
fn exception<'py>(py: Python<'py>, name: &str, args: impl PyCallArgs<'py>) -> PyErr {
    let made = || {
        let class = py.import("swarmevo.errors")?.getattr(name)?;
        class.call1(args)
    };
    made().map_or_else(|error| error, PyErr::from_value)
}

/// An experiment with problems: `ExperimentError`.
pub fn config_error(py: Python<'_>, error: &ConfigError) -> PyErr {
    let problems = error.problems.iter();
    let problems =
        problems.map(|problem| (problem.path.as_str(), problem.line, problem.message.as_str()));
    exception(py, "ExperimentError", (problems.collect::<Vec<_>>(),))
}

/// A generation from which evolution cannot learn: `EvolutionError`.
pub fn evolution_error(py: Python<'_>, error: &EvolutionError) -> PyErr {
    exception(py, "EvolutionError", (error.to_string(),))
}

/// A refused request: `FleetError`, or one of its subclasses, with the name of the status.
pub fn refused(py: Python<'_>, status: &Status) -> PyErr {
    let mut code = String::new();
    for (i, letter) in format!("{:?}", status.code()).chars().enumerate() {
        if i > 0 && letter.is_uppercase() {
            code.push('_');
        }
        code.push(letter.to_ascii_uppercase());
    }
    exception(py, "refused", (code, status.message()))
}

/// A request that cannot be simulated.
pub fn evaluate_error(error: &EvaluateError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A panic: `InternalError`.
pub fn panic_error(py: Python<'_>, message: &str) -> PyErr {
    exception(py, "InternalError", (message,))
}

/// An operation that fails in a forked process: `ForkError`.
pub fn fork_error(py: Python<'_>, message: &str) -> PyErr {
    exception(py, "ForkError", (message,))
}
