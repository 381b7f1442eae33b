//! The task that an experiment brings as a script: compiled once, executed in every trial.
//! `names` has the names for scripts, `view` and `bodies` read the world for them, `change` makes
//! their changes, and `sensing` computes their readings.

mod bodies;
mod change;
mod names;
mod sensing;
mod view;

pub(crate) use change::May;
use change::Plan;
pub(crate) use view::View;

use determinism::random::{Purpose, Stream};
use experiment_file::{RobotController, ScriptConfig};
use task_script::{FunctionId, Limits, Object, Program, Script, ScriptError, Value};

use crate::objects::{Site, StaticObjects};
use crate::problems::Problems;
use crate::record::{MeasureName, Measures};
use crate::torus::Vec2;
use crate::world::{RobotGroup, World};
use sensing::Sensing;
use view::{Kept, Kind};

/// Largest absolute value that a function may return, so that sums and squares are finite.
const LARGEST: f64 = 1e100;
/// Limit of work per call, in statements: less than a second for any script.
const WORK: u64 = 3_000_000;
/// Limit of memory per trial, bytes, in addition to [`MEMORY_PER_ROBOT`].
const MEMORY: usize = 256 << 10;
const MEMORY_PER_ROBOT: usize = 4 << 10;

/// The functions of a script, with their numbers of arguments. If robots have a `script_sensor`,
/// there is also `sense`.
const FUNCTIONS: [(&str, usize); 6] =
    [("fitness", 1), ("final", 1), ("measures", 1), ("control", 1), ("move", 1), ("react", 1)];

/// The part of a script that all trials share.
#[derive(Debug)]
pub(crate) struct ScriptTask {
    program: Program,
    fitness: Option<FunctionId>,
    /// The function for the fitness of the whole episode.
    last: Option<FunctionId>,
    measures: Option<FunctionId>,
    /// The function for the actions of a robot.
    control: Option<FunctionId>,
    /// The function for the motion of a light or ground area.
    move_: Option<FunctionId>,
    /// The function for events of robots, lights and areas.
    react: Option<FunctionId>,
    /// The names of the measures.
    measure_names: Vec<MeasureName>,
}

impl ScriptTask {
    /// Compiles a script; reports problems and returns `None` if there are any.
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
            let takes = function(name).and_then(|function| takes(&program, function, n_arguments));
            takes.into_iter().for_each(|error| wrong(error.to_string()));
        }
        let measures = function("measures");
        let measure_names = measures.map(|measures| program.returned_keys(measures));
        if let (Some(measures), Some(None)) = (measures, measure_names) {
            let message = "returns other values than dicts with literal keys, such as \
                           `return {\"distance\": d}`; the keys are the names of the measures";
            wrong(program.problem(measures, message.into()).to_string());
        }
        let measure_names = measure_names.flatten().unwrap_or_default();
        let measure_names = measure_names.iter().map(|name| name.clone().into()).collect();
        let (fitness, last) = (function("fitness"), function("final"));
        let known = FUNCTIONS.map(|(name, _)| name).into_iter().chain(["sense"]);
        if !known.clone().any(|name| function(name).is_some()) {
            let known = known.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            wrong(format!("{}: has none of the functions {known}", config.name));
        }
        let [control, move_, react] = ["control", "move", "react"].map(function);
        is_right.then_some(Self {
            fitness,
            last,
            measures,
            control,
            move_,
            react,
            measure_names,
            program,
        })
    }

    /// Reports objects that need a function that the script lacks.
    pub fn check(&self, file: &str, world: &World, problems: &mut Problems) {
        let mut needs = |function: Option<FunctionId>, name: &str, site: &Site| {
            if function.is_none() {
                let object = &site.name;
                let message = format!(
                    "{file}: has no function `{name}`, but `world.objects.{object}.controller` \
                     leaves the actions of `{object}` to it"
                );
                problems.add(PATH, message);
            }
        };
        let robots = world.groups.iter();
        let scripted = |group: &&RobotGroup| group.controller == RobotController::ScriptController;
        robots.filter(scripted).for_each(|group| needs(self.control, "control", &group.site));
        let things = world.lights.iter().chain(&world.areas).filter(|things| things.by_script);
        things.for_each(|things| needs(self.move_, "move", &things.site));
        self.check_sensors(file, world, problems);
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

/// The problem of a function with a wrong number of parameters.
fn takes(program: &Program, function: FunctionId, n_arguments: usize) -> Option<ScriptError> {
    let (_, n_found) = program.signature(function);
    let message = || format!("takes {n_arguments} argument, not {n_found}");
    (n_found != n_arguments).then(|| program.problem(function, message()))
}

/// The path of problems of scripts.
pub(crate) const PATH: &str = "task.script";

/// A script in one trial.
#[derive(Debug)]
pub(crate) struct ScriptRun<'a> {
    task: &'a ScriptTask,
    script: Script,
    kept: Kept,
    /// Robots for which the script decides, by their numbers.
    actors: Vec<Actor>,
    /// Lights, and then ground areas, that the script moves.
    movers: Vec<Mover>,
    /// Robots for which the script computes readings, by their numbers.
    sensing: Vec<Sensing>,
}

/// A robot whose actions the script decides.
#[derive(Debug)]
struct Actor {
    robot: usize,
    plan: Plan,
    stream: Stream,
}

/// A light or ground area that the script moves.
#[derive(Debug)]
struct Mover {
    thing: Object,
    stream: Stream,
    /// Its new place.
    target: Option<Vec2>,
}

impl<'a> ScriptRun<'a> {
    /// A script at the start of a trial; `stream` returns random streams.
    pub fn start(
        task: &'a ScriptTask,
        world: &World,
        goes_on: &dyn Fn() -> bool,
        stream: impl Fn(Purpose, usize) -> Stream,
    ) -> Result<Self, ScriptError> {
        let memory = MEMORY + MEMORY_PER_ROBOT * world.n_robots();
        let script =
            task.program.start(Limits { work: WORK, memory }, &mut view::Nothing(goes_on))?;
        let actor = |robot| Actor {
            robot,
            plan: Plan::new(world.message_len),
            stream: stream(Purpose::Control, robot),
        };
        let movers = |objects: &[StaticObjects], kind: Kind, purpose: Purpose| {
            let objects = objects.iter().filter(|objects| objects.by_script);
            let members = objects.flat_map(|objects| objects.members.clone());
            let mover = |number| Mover {
                thing: Object { kind: kind as u8, index: number as u32 },
                stream: stream(purpose, number),
                target: None,
            };
            members.map(mover).collect::<Vec<_>>()
        };
        let mut moved = movers(&world.lights, Kind::Light, Purpose::LightMovement);
        moved.extend(movers(&world.areas, Kind::Area, Purpose::AreaMovement));
        let actors = world.scripted_robots().map(actor).collect();
        Ok(Self {
            kept: Kept::new(stream(Purpose::Script, 0)),
            task,
            script,
            actors,
            movers: moved,
            sensing: sensing::start(world, stream),
        })
    }

    /// The plan of a robot in this step; `None` if the script does not decide for it.
    pub fn plan(&self, robot: usize) -> Option<&Plan> {
        let found = self.actors.binary_search_by_key(&robot, |actor| actor.robot);
        found.ok().map(|place| &self.actors[place].plan)
    }

    /// Decides the actions of robots in this step. All calls see the actions of the previous
    /// step, and share the work of one call.
    pub fn control(&mut self, mut view: View<'_>) -> Result<(), ScriptError> {
        let Self { task, script, kept, actors, .. } = self;
        let Some(function) = task.control else { return Ok(()) };
        script.refill();
        for Actor { robot, plan, stream } in actors {
            plan.reset();
            let mut view = view.again(May::Act { robot: *robot, plan, stream });
            view.kept = Some(kept);
            let argument = [view::thing(Kind::Robot, *robot)];
            let called = script.call_again(&task.program, function, &argument, &mut view);
            let returned = called.and_then(|value| match value {
                Value::Nothing => Ok(()),
                value => Err(task.program.problem(
                    function,
                    format!(
                        "returns {}; assign a robot's actions instead, such as `robot.left = 0.5`",
                        value.kind_with_article()
                    ),
                )),
            });
            returned.map_err(|error| about(error, &format!("robot {robot}")))?;
        }
        Ok(())
    }

    /// Moves lights and ground areas. All calls see the places before the motion, and share the
    /// work of one call.
    pub fn move_things(&mut self, mut view: View<'_>) -> Result<(), ScriptError> {
        let Self { task, script, kept, movers, .. } = self;
        let Some(function) = task.move_ else { return Ok(()) };
        script.refill();
        for Mover { thing, stream, target } in movers.iter_mut() {
            let mut view = view.again(May::Move { thing: *thing, stream });
            view.kept = Some(kept);
            let argument = [Value::Object(*thing)];
            let called = script.call_again(&task.program, function, &argument, &mut view);
            let moved = called.and_then(|value| match value {
                Value::Nothing => Ok(None),
                value => view.point(&value).map(Some).map_err(|message| {
                    let message = format!("returns neither a place nor None: {message}");
                    task.program.problem(function, message)
                }),
            });
            let what = if Kind::of_object(*thing) == Kind::Light { "light" } else { "area" };
            *target = moved.map_err(|error| about(error, &format!("{what} {}", thing.index)))?;
        }
        for Mover { thing, target, .. } in movers {
            let things = match Kind::of_object(*thing) {
                Kind::Light => &mut *view.lights,
                _ => &mut *view.areas,
            };
            things[thing.index as usize] = target.take().unwrap_or(things[thing.index as usize]);
        }
        Ok(())
    }

    /// Lets the script react after the actions of robots.
    pub fn react(&mut self, mut view: View<'_>) -> Result<(), ScriptError> {
        let Some(function) = self.task.react else { return Ok(()) };
        let view = view.again(May::React);
        match self.call(function, |_, _| Ok(view::WORLD), view)? {
            Value::Nothing => Ok(()),
            value => {
                let message =
                    format!("returns {}; let it change things instead", value.kind_with_article());
                Err(self.task.program.problem(function, message))
            }
        }
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

    /// Fitness of a step; `None` if it does not count.
    pub fn fitness(&mut self, view: View<'_>) -> Result<Option<f64>, ScriptError> {
        let Some(function) = self.task.fitness else { return Ok(None) };
        match self.call(function, |_, _| Ok(view::WORLD), view)? {
            Value::Nothing => Ok(None),
            value => self.finite(function, &value).map(Some),
        }
    }

    /// Fitness of the whole episode; `None` for the mean over the steps.
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
            let message = format!("returns {}, not a dict of numbers", value.kind_with_article());
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

    /// Checks the number that a function has returned.
    fn finite(&self, function: FunctionId, value: &Value) -> Result<f64, ScriptError> {
        let problem = |message| self.task.program.problem(function, message);
        match value.number() {
            Some(number) if number.abs() <= LARGEST => Ok(number),
            Some(number) => Err(problem(format!(
                "returns {number:e}; numbers are finite and at most {LARGEST:e}"
            ))),
            None => Err(problem(format!("returns {}, not a number", value.kind_with_article()))),
        }
    }
}

/// Adds the purpose of the call to an error.
fn about(mut error: ScriptError, what: &str) -> ScriptError {
    error.message = format!("{}, for {what}", error.message);
    error
}

#[cfg(test)]
mod tests;
