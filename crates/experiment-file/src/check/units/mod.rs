//! Warns of allowed values that look as if they were in another unit, and names the likely unit.
//! The file is accepted unchanged.

mod space;
mod time;

use crate::report::{Path, Report};
use crate::{ExperimentConfig, RobotConfig};

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    let doubts = Doubts { config, report };
    space::check(&doubts);
    time::check(&doubts);
}

/// The receiver of warnings, and the scales for comparison.
struct Doubts<'a> {
    config: &'a ExperimentConfig,
    report: &'a Report<'a>,
}

impl Doubts<'_> {
    /// Warns of a value. `likely`: the author's probable mistake.
    fn add(&self, path: &Path, what: String, likely: &str) {
        self.report.warning(path, || format!("{what}; {likely}?"));
    }

    /// The longer side of the world, cm.
    fn longer_side(&self) -> f64 {
        self.config.world.width.max(self.config.world.height)
    }

    /// The shorter side of the world, cm.
    fn shorter_side(&self) -> f64 {
        self.config.world.width.min(self.config.world.height)
    }

    /// Distance that the fastest robot drives in a step, cm; 0 if none has wheels.
    fn longest_step(&self) -> f64 {
        self.config.robots().map(|(_, robot)| step(robot)).fold(0.0, f64::max)
    }
}

/// Largest distance that a robot drives in a step, cm; 0 without wheels.
fn step(robot: &RobotConfig) -> f64 {
    let wheels = robot.actuators.wheel_actuator.as_ref();
    wheels.map_or(0.0, |wheels| wheels.max_speed * wheels.step_duration)
}
