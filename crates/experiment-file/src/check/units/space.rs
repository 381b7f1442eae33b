//! Lengths, angles and speeds.

use std::f64::consts::TAU;

use super::{Doubts, step};
use crate::report::Path;
use crate::{
    BodyConfig, FitnessParams, Initializer, LightController, MovableConfig, ObjectConfig,
    ObstacleConfig, OrbitConfig, RobotConfig,
};

/// Range of plausible sides of a world for robots of some centimetres, cm.
const SIDE_MIN: f64 = 20.0;
const SIDE_MAX: f64 = 10_000.0;
/// Largest angle that counts as a full turn, with room for rounding.
const TURN: f64 = TAU + 0.1;
/// Speeds of wheels, cm/s: an e-puck has 13, a Khepera IV 81.
const SPEED_MIN: f64 = 0.2;
const SPEED_MAX: f64 = 100.0;
/// Distances between the wheels, cm: an e-puck has 5.3, a Pioneer 38.
const AXLE_MIN: f64 = 0.5;
const AXLE_MAX: f64 = 50.0;
/// Radii of robots, cm: a Kilobot has 1.65, a Pioneer 22.
const RADIUS_MIN: f64 = 0.5;
const RADIUS_MAX: f64 = 50.0;
/// Largest plausible mass of such robots and of what they push, kg.
const MASS_MAX: f64 = 50.0;
/// Largest plausible force of such robots, N.
const FORCE_MAX: f64 = 200.0;
/// Largest plausible angle of a light's orbit per step; with more, the light jumps.
const ORBIT_MAX: f64 = 0.5;
/// Largest plausible decay per cm: with more, nothing reaches the next robot.
const DECAY_MAX: f64 = 2.0;
/// Distance below which robots are on top of each other, cm.
const APART: f64 = 1.0;

const SMALLER: &str = "mm instead of cm";
const LARGER: &str = "m instead of cm";
const DEGREES: &str = "degrees instead of radians";

pub(super) fn check(doubts: &Doubts<'_>) {
    let world = &doubts.config.world;
    for (key, side) in [("width", world.width), ("height", world.height)] {
        let path = Path::from(["world", key]);
        if side < SIDE_MIN {
            doubts.add(&path, format!("{side} cm is hardly more than a robot"), LARGER);
        } else if side > SIDE_MAX {
            doubts.add(&path, format!("{side} cm is {} m", side / 100.0), SMALLER);
        }
    }
    for (name, object) in &world.objects {
        let path = Path::from(["world", "objects", name]);
        let positions = path.key("initializers").key("positions").key("params");
        let orientations = path.key("initializers").key("orientations").key("params");
        match object {
            ObjectConfig::Robot(robot) => {
                at(&robot.initializers.positions, &positions, doubts);
                crowd(robot, &positions, doubts);
                headings(&robot.initializers.orientations, &orientations, doubts);
                self::robot(robot, &path, doubts);
            }
            ObjectConfig::LightSource(light) => {
                at(&light.initializers.positions, &positions, doubts);
                reach(light.params.range, 0.0, &path.key("params").key("range"), doubts);
                motion(&light.controller, &path.key("controller").key("params"), doubts);
            }
            ObjectConfig::GroundArea(area) => {
                at(&area.initializers.positions, &positions, doubts);
                let step = doubts.longest_step();
                reach(area.params.range, step, &path.key("params").key("range"), doubts);
            }
            ObjectConfig::Obstacle(ObstacleConfig { initializers, .. }) => {
                at(&initializers.positions, &positions, doubts);
                headings(&initializers.orientations, &orientations, doubts);
            }
            ObjectConfig::Movable(MovableConfig { initializers, params, .. }) => {
                at(&initializers.positions, &positions, doubts);
                headings(&initializers.orientations, &orientations, doubts);
                heavy(params.mass, &path.key("params").key("mass"), doubts);
            }
            ObjectConfig::Wall(_) => {}
        }
    }
    let params = &doubts.config.algorithm.fitness_params;
    if params.near != FitnessParams::default().near {
        let path = Path::from(["algorithm", "fitness_params", "near"]);
        reach(params.near, doubts.longest_step(), &path, doubts);
    }
}

/// Checks a distance in the world. `step`: distance that a robot drives in a step.
fn reach(range: f64, step: f64, path: &Path, doubts: &Doubts<'_>) {
    let (width, height) = (doubts.config.world.width, doubts.config.world.height);
    if range > doubts.longer_side() {
        let what = format!("{range} cm is more than the world, which is {width} by {height} cm");
        doubts.add(path, what, SMALLER);
    } else if range < step {
        let what = format!("{range} cm is less than a robot drives in a step, {step} cm");
        doubts.add(path, what, LARGER);
    } else if range < APART {
        doubts.add(path, format!("{range} cm is less than a robot"), LARGER);
    }
}

fn robot(robot: &RobotConfig, path: &Path, doubts: &Doubts<'_>) {
    let (sensors, actuators) = (&robot.sensors, &robot.actuators);
    let light = sensors.light_sensor.as_ref().map(|sensor| (sensor.range, sensor.decay_rho));
    let distance = sensors.distance_sensor.as_ref().map(|sensor| (sensor.range, sensor.decay_rho));
    let receiver =
        sensors.wireless_receiver.as_ref().map(|receiver| (receiver.range, receiver.decay_rho));
    let mounted =
        [("light_sensor", light), ("distance_sensor", distance), ("wireless_receiver", receiver)];
    for (key, sensor) in mounted {
        let Some((range, decay)) = sensor else { continue };
        let path = path.key("sensors").key(key);
        reach(range, step(robot), &path.key("range"), doubts);
        if decay > DECAY_MAX {
            let what = format!("{decay} per cm leaves nothing at a distance of some cm");
            doubts.add(&path.key("decay_rho"), what, "per m instead of per cm");
        }
    }
    if let Some(sensor) = &sensors.proximity_sensor {
        let path = path.key("sensors").key("proximity_sensor");
        // Rays may well reach across the whole world.
        if sensor.range < APART {
            let what = format!("{} cm is less than a robot", sensor.range);
            doubts.add(&path.key("range"), what, LARGER);
        }
        angles(sensor.angles.iter().flatten(), &path.key("angles"), doubts);
    }
    if let Some(body) = &robot.body {
        self::body(body, &path.key("body"), doubts);
    }
    if let Some(rotation) = &robot.perturbations.uncontrollable_rotation {
        let path = path.key("perturbations").key("uncontrollable_rotation").key("targets");
        angles(rotation.targets.iter(), &path, doubts);
    }
    let path = path.key("actuators");
    if let Some(transmitter) = &actuators.wireless_transmitter {
        let path = path.key("wireless_transmitter").key("range");
        reach(transmitter.range, step(robot), &path, doubts);
    }
    let Some(wheels) = &actuators.wheel_actuator else { return };
    let path = path.key("wheel_actuator");
    let (speed, axle) = (wheels.max_speed, wheels.axle_length);
    if speed > SPEED_MAX {
        let what = format!("{speed} cm/s is faster than such robots drive");
        doubts.add(&path.key("max_speed"), what, "mm/s instead of cm/s");
    } else if speed < SPEED_MIN {
        let what = format!("{speed} cm/s is slower than such robots drive");
        doubts.add(&path.key("max_speed"), what, "m/s instead of cm/s");
    }
    if axle > AXLE_MAX {
        doubts.add(&path.key("axle_length"), format!("{axle} cm between two wheels"), SMALLER);
    } else if axle < AXLE_MIN {
        doubts.add(&path.key("axle_length"), format!("{axle} cm between two wheels"), LARGER);
    }
}

fn body(body: &BodyConfig, path: &Path, doubts: &Doubts<'_>) {
    let &BodyConfig { radius, mass, push_force } = body;
    if radius > RADIUS_MAX {
        doubts.add(
            &path.key("radius"),
            format!("{radius} cm is more than such robots have"),
            SMALLER,
        );
    } else if radius < RADIUS_MIN {
        doubts.add(
            &path.key("radius"),
            format!("{radius} cm is less than such robots have"),
            LARGER,
        );
    }
    heavy(mass, &path.key("mass"), doubts);
    if push_force > FORCE_MAX {
        let what = format!("{push_force} N is more than such robots push with");
        doubts.add(&path.key("push_force"), what, "mN instead of N");
    }
}

fn heavy(mass: f64, path: &Path, doubts: &Doubts<'_>) {
    if mass > MASS_MAX {
        doubts.add(path, format!("{mass} kg"), "g instead of kg");
    }
}

/// Start positions are within the world.
fn at(positions: &Initializer, path: &Path, doubts: &Doubts<'_>) {
    let world = &doubts.config.world;
    let is_in =
        |x: f64, y: f64| (0.0..=world.width).contains(&x) && (0.0..=world.height).contains(&y);
    let outside = |what: String, path: &Path| {
        let (width, height) = (world.width, world.height);
        let what = format!("{what} is outside the world, which is {width} by {height} cm");
        doubts.add(path, what, SMALLER);
    };
    match positions {
        Initializer::Fixed { values } => {
            let outsider = |(index, value): (usize, &Vec<f64>)| match value[..] {
                [x, y] if !is_in(x, y) => Some((index, format!("[{x}, {y}]"))),
                _ => None,
            };
            if let Some((index, what)) = values.iter().enumerate().find_map(outsider) {
                outside(what, &path.key("values").index(index));
            }
        }
        Initializer::RandomUniform { low, high, .. } => {
            if *low < 0.0 {
                outside(low.to_string(), &path.key("low"));
            }
            if *high > doubts.longer_side() {
                outside(high.to_string(), &path.key("high"));
            }
        }
        Initializer::RandomCircumference { radius, center } => {
            if !is_in(center[0], center[1]) {
                outside(format!("[{}, {}]", center[0], center[1]), &path.key("center"));
            }
            if *radius > doubts.longer_side() / 2.0 {
                outside(format!("a circle of {radius} cm around a place"), &path.key("radius"));
            }
        }
        Initializer::RandomGraph { max_rad, initial_pos } => {
            if !is_in(initial_pos[0], initial_pos[1]) {
                let what = format!("[{}, {}]", initial_pos[0], initial_pos[1]);
                outside(what, &path.key("initial_pos"));
            }
            reach(*max_rad, 0.0, &path.key("max_rad"), doubts);
        }
    }
}

/// Robots do not start on top of each other.
fn crowd(robot: &RobotConfig, path: &Path, doubts: &Doubts<'_>) {
    let n = robot.num_instances;
    if n < 2 {
        return;
    }
    let (area, path) = match &robot.initializers.positions {
        Initializer::Fixed { values } => {
            let extent = |axis: usize| {
                let of_axis = values.iter().filter_map(|value| value.get(axis).copied());
                of_axis.clone().fold(f64::MIN, f64::max) - of_axis.fold(f64::MAX, f64::min)
            };
            let extent = extent(0).max(extent(1));
            (extent * extent, path.key("values"))
        }
        Initializer::RandomUniform { low, high, .. } => {
            ((high - low) * (high - low), path.key("high"))
        }
        Initializer::RandomCircumference { radius, .. } => (radius * radius, path.key("radius")),
        // The random graph keeps robots apart.
        Initializer::RandomGraph { .. } => return,
    };
    if area < f64::from(n) * APART * APART {
        let what = format!("{n} robots start within {area} square cm, on top of each other");
        doubts.add(&path, what, LARGER);
    }
}

fn headings(orientations: &Initializer, path: &Path, doubts: &Doubts<'_>) {
    match orientations {
        Initializer::Fixed { values } => {
            angles(values.iter().flatten(), &path.key("values"), doubts);
        }
        Initializer::RandomUniform { low, high, .. } => {
            for (key, bound) in [("low", *low), ("high", *high)] {
                if bound.abs() > TURN {
                    degrees(bound, &path.key(key), doubts);
                }
            }
        }
        _ => {}
    }
}

/// Warns of the first angle that is more than a full turn.
fn angles<'a>(angles: impl Iterator<Item = &'a f64>, path: &Path, doubts: &Doubts<'_>) {
    let found = angles.enumerate().find(|(_, angle)| angle.abs() > TURN);
    if let Some((index, angle)) = found {
        degrees(*angle, &path.index(index), doubts);
    }
}

fn degrees(angle: f64, path: &Path, doubts: &Doubts<'_>) {
    doubts.add(path, format!("{angle} is more than a full turn, 6.2832"), DEGREES);
}

/// How a light moves.
fn motion(controller: &LightController, path: &Path, doubts: &Doubts<'_>) {
    match controller {
        LightController::LightOrbitController(OrbitConfig { angle_step, radius_step, radius }) => {
            if *angle_step > ORBIT_MAX {
                let what = format!("the light goes around by {angle_step} radians in a step");
                doubts.add(&path.key("angle_step"), what, DEGREES);
            }
            for (key, length) in [("radius", Some(*radius)), ("radius_step", *radius_step)] {
                if let Some(length) = length.filter(|length| *length > doubts.longer_side() / 2.0) {
                    let what = format!("{length} cm leads around the world");
                    doubts.add(&path.key(key), what, SMALLER);
                }
            }
        }
        LightController::LightRndPosController(targets) => {
            let square = targets.square;
            if square > doubts.longer_side() {
                let what = format!("a square of {square} cm is more than the world");
                doubts.add(&path.key("square"), what, SMALLER);
            }
            if let Some(speed) = targets.speed
                && speed > doubts.shorter_side() / 2.0
            {
                let what = format!("{speed} cm in a step leads around the world");
                doubts.add(&path.key("speed"), what, SMALLER);
            }
        }
        _ => {}
    }
}
