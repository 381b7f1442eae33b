//! The language of tasks in experiment files: a subset of
//! [Starlark](https://github.com/bazelbuild/starlark), which is a subset of Python.
//!
//! A script is a pure function of the data that its host shows it. It has no I/O, no clock and no
//! endless loop, and it computes the same bits on every machine. The work and memory of a call
//! are [limited](Limits). No text makes this crate panic, hang or exceed these limits.
//!
//! ```
//! use task_script::{Host, Limits, Meter, Name, Object, Program, Value, Vocabulary};
//! use std::rc::Rc;
//!
//! /// A world with a width in cm.
//! struct World(f64);
//!
//! impl Host for World {
//!     fn get(&mut self, _: Object, _: Name, _: &Rc<Meter>) -> Result<Value, String> {
//!         Ok(Value::Float(self.0))
//!     }
//!     fn set(&mut self, _: Object, _: Name, _: Value) -> Result<(), String> {
//!         Err("it cannot be changed".into())
//!     }
//!     fn call(&mut self, _: Object, _: Name, _: &[Value], _: &Rc<Meter>) -> Result<Value, String> {
//!         Err("it has no methods".into())
//!     }
//! }
//!
//! let text = "def fitness(world):\n    return sum([world.width / n for n in range(1, 3)])";
//! let vocabulary = Vocabulary { names: &["width"] };
//! let program = Program::compile("half.star", text, &vocabulary).unwrap();
//! let limits = Limits { work: 1000, memory: 1 << 16 };
//! let mut script = program.start(limits, &mut World(8.0))?;
//! let world = Value::Object(Object { kind: 0, index: 0 });
//! let fitness = program.function("fitness").unwrap();
//! assert_eq!(script.call(&program, fitness, &[world], &mut World(8.0))?.number(), Some(12.0));
//!
//! let wrong = Program::compile("half.star", &text.replace("width", "widht"), &vocabulary);
//! let message = "half.star:2: no object has a `widht`; did you mean `width`?";
//! assert_eq!(wrong.unwrap_err()[0].to_string(), message);
//! # Ok::<(), task_script::ScriptError>(())
//! ```
//!
//! `lexer` and `parser` turn a text into `code`, in which names are numbers, and `eval` executes
//! the code. `value` has the values, `builtins` their functions and operators, and `meter` counts
//! work and memory.

mod builtins;
mod code;
mod error;
mod eval;
mod key;
mod lexer;
mod meter;
mod parser;
mod sort_keys;
mod value;

use std::rc::Rc;

pub use code::Name;
pub use error::ScriptError;
pub use meter::{Limits, Meter};
pub use value::{Dict, List, Object, Text, Value};

use code::{Function, Stmt};
use eval::Machine;

/// Largest size of a script, bytes.
pub const TEXT_BYTES: usize = experiment_file::limits::SCRIPT_BYTES;

/// The names of the host's objects.
#[derive(Debug, Clone, Copy)]
pub struct Vocabulary {
    /// Attributes and methods. A [`Name`] is an index of this list.
    pub names: &'static [&'static str],
}

/// The objects that a script can read and change.
pub trait Host {
    /// The value of `object.name`.
    fn get(&mut self, object: Object, name: Name, meter: &Rc<Meter>) -> Result<Value, String>;

    /// `object.name = value`.
    fn set(&mut self, object: Object, name: Name, value: Value) -> Result<(), String>;

    /// Whether the script may continue, asked every few milliseconds. If the answer is false, the
    /// call fails. A clock or another thread may decide the answer, so a stopped call has no
    /// result.
    fn goes_on(&mut self) -> bool {
        true
    }

    /// `object.name(arguments)`. A method whose duration grows with the number of objects has to
    /// report its work to the meter.
    fn call(
        &mut self,
        object: Object,
        name: Name,
        arguments: &[Value],
        meter: &Rc<Meter>,
    ) -> Result<Value, String>;
}

/// A compiled script.
#[derive(Debug)]
pub struct Program {
    file: String,
    functions: Vec<Function>,
    /// The statements outside functions.
    start: Vec<Stmt>,
    n_start_locals: usize,
    n_globals: usize,
    /// Literals.
    texts: Vec<String>,
}

/// A function of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FunctionId(usize);

impl Program {
    /// Compiles a text of at most [`TEXT_BYTES`] bytes; `file` names it in messages.
    ///
    /// # Errors
    ///
    /// All problems that can be found without execution, never empty.
    pub fn compile(
        file: &str,
        text: &str,
        vocabulary: &Vocabulary,
    ) -> Result<Self, Vec<ScriptError>> {
        if text.len() > TEXT_BYTES {
            let message = format!("the script has {} bytes, the limit is {TEXT_BYTES}", text.len());
            return Err(vec![ScriptError { file: file.into(), line: 1, message }]);
        }
        match parser::parse(text, vocabulary) {
            Ok(program) => Ok(Self { file: file.to_owned(), ..program }),
            Err(faults) => {
                let mut errors: Vec<_> =
                    faults.into_iter().map(|fault| fault.into_error(file)).collect();
                errors.sort_by_key(|error| error.line);
                errors.dedup();
                Err(errors)
            }
        }
    }

    /// The function of this name.
    pub fn function(&self, name: &str) -> Option<FunctionId> {
        self.functions.iter().position(|function| function.name == name).map(FunctionId)
    }

    /// Line of a function, from 1, and its number of parameters.
    pub fn signature(&self, function: FunctionId) -> (u32, usize) {
        let function = &self.functions[function.0];
        (function.line, function.n_parameters)
    }

    /// The keys of the dicts with literal keys that a function returns; `None` if it also returns
    /// other values.
    pub fn returned_keys(&self, function: FunctionId) -> Option<&[String]> {
        self.functions[function.0].returned_keys.as_deref()
    }

    /// A problem of a function whose result the host cannot use.
    pub fn problem(&self, function: FunctionId, message: String) -> ScriptError {
        let Function { name, line, .. } = &self.functions[function.0];
        ScriptError { file: self.file.clone(), line: *line, message: format!("`{name}` {message}") }
    }

    /// Executes the statements outside functions. `limits` hold for every call.
    ///
    /// # Errors
    ///
    /// If a statement fails, exceeds the limits, or is stopped by the host.
    pub fn start(&self, limits: Limits, host: &mut dyn Host) -> Result<Script, ScriptError> {
        let meter = Meter::new(limits);
        let texts = self.texts.iter().map(|text| Value::text(text, &meter));
        let texts = texts.collect::<Result<_, _>>();
        let texts: Vec<Value> =
            texts.map_err(|message| error::Fault::new(1, message).into_error(&self.file))?;
        let globals = vec![None; self.n_globals];
        let mut script = Script { meter, texts, globals, stack: Vec::new() };
        let started = script.machine(self, host).start();
        started.map_err(|fault| fault.into_error(&self.file))?;
        Ok(script)
    }
}

/// A running script: its constants, and the work and memory that it uses.
#[derive(Debug)]
pub struct Script {
    meter: Rc<Meter>,
    texts: Vec<Value>,
    globals: Vec<Option<Value>>,
    stack: Vec<Option<Value>>,
}

impl Script {
    /// The meter of the script, for values that the host makes.
    pub fn meter(&self) -> &Rc<Meter> {
        &self.meter
    }

    /// Calls a function of its program, with fresh limits of work.
    ///
    /// # Errors
    ///
    /// If a statement fails, exceeds the limits, or is stopped by the host.
    pub fn call(
        &mut self,
        program: &Program,
        function: FunctionId,
        arguments: &[Value],
        host: &mut dyn Host,
    ) -> Result<Value, ScriptError> {
        self.meter.refill();
        self.call_again(program, function, arguments, host)
    }

    /// As [`call`](Self::call), but with the work that remains since the last
    /// [`refill`](Self::refill).
    ///
    /// # Errors
    ///
    /// As [`call`](Self::call).
    pub fn call_again(
        &mut self,
        program: &Program,
        function: FunctionId,
        arguments: &[Value],
        host: &mut dyn Host,
    ) -> Result<Value, ScriptError> {
        self.stack.clear();
        let function = &program.functions[function.0];
        let called = self.machine(program, host).begin_with(function, arguments);
        called.map_err(|fault| fault.at(function.line).into_error(&program.file))
    }

    /// Renews the work for a group of [`call_again`](Self::call_again), which share the limit of
    /// one call.
    pub fn refill(&self) {
        self.meter.refill();
    }

    fn machine<'a>(&'a mut self, program: &'a Program, host: &'a mut dyn Host) -> Machine<'a> {
        Machine {
            program,
            meter: &self.meter,
            texts: &self.texts,
            globals: &mut self.globals,
            host,
            stack: &mut self.stack,
            base: 0,
            n_calls: 0,
        }
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        self.meter.take_apart();
    }
}

#[cfg(test)]
mod tests;
