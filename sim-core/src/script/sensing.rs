//! Readings of `script_sensor`, which the script's function `sense` computes.

use determinism::random::{Purpose, Stream};
use experiment_file::SensorQuery;
use task_script::{FunctionId, ScriptError, Value};

use super::change::May;
use super::view::{self, Kind, View};
use super::{FUNCTIONS, PATH, ScriptRun, ScriptTask, about, takes};
use crate::problems::Problems;
use crate::world::{RobotGroup, World};

/// The groups of robots that have a `script_sensor`.
fn groups(world: &World) -> impl Iterator<Item = &RobotGroup> {
    world.groups.iter().filter(|group| group.has_sensor(SensorQuery::Script))
}

/// A robot that has a `script_sensor`, in one trial.
#[derive(Debug)]
pub(super) struct Sensing {
    robot: usize,
    stream: Stream,
    /// Its reading in this step.
    reading: Vec<f64>,
}

/// All robots that have a `script_sensor`; `stream` returns their random streams.
pub(super) fn start(world: &World, stream: impl Fn(Purpose, usize) -> Stream) -> Vec<Sensing> {
    let n_values = |group: &RobotGroup| {
        let readings = group.readings.iter();
        readings.filter(|(query, _)| *query == SensorQuery::Script).map(|(_, n)| *n).sum()
    };
    let robots = groups(world)
        .flat_map(|group| group.robots.clone().map(move |robot| (robot, n_values(group))));
    let sensing = |(robot, n_values)| Sensing {
        robot,
        stream: stream(Purpose::Sensing, robot),
        reading: vec![0.0; n_values],
    };
    robots.map(sensing).collect()
}

impl ScriptTask {
    /// The function `sense`. If no robot has the sensor, a function of this name is an ordinary
    /// helper.
    pub(super) fn sense(&self) -> Option<FunctionId> {
        self.program.function("sense")
    }

    /// Reports a `script_sensor` without the function `sense`, and a script that has only this
    /// function while no robot has the sensor.
    pub(super) fn check_sensors(&self, file: &str, world: &World, problems: &mut Problems) {
        let mut sensing = groups(world).peekable();
        let Some(function) = self.sense() else {
            for group in sensing {
                let object = &group.site.name;
                let message = format!(
                    "{file}: has no function `sense`, but `world.objects.{object}.sensors.script_sensor` \
                     leaves a reading of `{object}` to it"
                );
                problems.add(PATH, message);
            }
            return;
        };
        if sensing.peek().is_some() {
            if let Some(error) = takes(&self.program, function, 1) {
                problems.add(PATH, error.to_string());
            }
        } else if FUNCTIONS.iter().all(|(name, _)| self.program.function(name).is_none()) {
            let message =
                "is the only function, but no robot has a `script_sensor` that would use it";
            problems.add(PATH, self.program.problem(function, message.into()).to_string());
        }
    }
}

impl ScriptRun<'_> {
    /// Computes the readings of robots with a `script_sensor` in this step. All calls see the
    /// readings of the previous step, and share the work of one call.
    pub fn sense(&mut self, mut view: View<'_>) -> Result<(), ScriptError> {
        let Self { task, script, kept, sensing, .. } = self;
        let (false, Some(function)) = (sensing.is_empty(), task.sense()) else { return Ok(()) };
        script.refill();
        for Sensing { robot, stream, reading } in sensing {
            let mut view = view.again(May::Sense { robot: *robot, stream });
            view.kept = Some(kept);
            let argument = [view::thing(Kind::Robot, *robot)];
            let called = script.call_again(&task.program, function, &argument, &mut view);
            let taken = called.and_then(|value| {
                take(&value, reading).map_err(|message| task.program.problem(function, message))
            });
            taken.map_err(|error| about(error, &format!("robot {robot}")))?;
        }
        Ok(())
    }

    /// Robots with a `script_sensor`, each with its reading in this step.
    pub fn sensed(&self) -> impl Iterator<Item = (usize, &[f64])> {
        self.sensing.iter().map(|sensor| (sensor.robot, sensor.reading.as_slice()))
    }
}

/// Converts the result of the function to a reading.
fn take(value: &Value, reading: &mut [f64]) -> Result<(), String> {
    let n = reading.len();
    let expected = || format!("a `script_sensor` with `n` {n} needs a list of {n} numbers");
    let Value::List(list) = value else {
        return Err(format!("returns {}; {}", value.kind_with_article(), expected()));
    };
    if list.len() != n {
        return Err(format!(
            "returns {} of {}; {}",
            value.kind_with_article(),
            list.len(),
            expected()
        ));
    }
    for (place, number) in reading.iter_mut().enumerate() {
        *number = match list.get(place) {
            Some(Value::Bool(value)) => f64::from(u8::from(value)),
            value => match value.as_ref().and_then(Value::number) {
                Some(value) if value.is_finite() => value,
                Some(value) => {
                    return Err(format!(
                        "returns {value} as element {place}; {} that are finite",
                        expected()
                    ));
                }
                None => {
                    let kind = value.as_ref().map_or("nothing", Value::kind_with_article);
                    return Err(format!("returns {kind} as element {place}; {}", expected()));
                }
            },
        };
    }
    Ok(())
}
