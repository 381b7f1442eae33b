//! Reads a robot.

use super::node::Object;
use super::world::{orientations, positions};
use crate::parameters::{self, Given, within};
use crate::semantics::Semantics;
use crate::sensors::UNSUPPORTED;
use crate::{Platform, RobotConfig, RobotController, RobotInitializers, SensorsConfig, limits};

/// Reads a robot. `center`: the centre of the world. `has_bodies`: whether every robot has one.
pub(super) fn robot(
    o: &mut Object<'_>,
    center: [f64; 2],
    has_bodies: bool,
    semantics: Semantics,
) -> RobotConfig {
    let num_instances = o.required("num_instances").u32(1..=limits::ROBOTS);
    let all = &[("affected_robots", num_instances.into())];
    let platform = o.optional("platform").and_then(|node| node.one_of(Platform::NAMES, &[]));
    let platform = platform.and_then(Platform::find).map_or_else(Vec::new, Platform::defaults);
    let body = within(&platform, "body");
    RobotConfig {
        num_instances,
        controller: o
            .required("controller")
            .variant(&["cascade_controller"])
            .unwrap_or(RobotController::NeuralController),
        sensors: sensors(o, semantics, &within(&platform, "sensors")),
        actuators: parameters::inner(o, "actuators", semantics, &within(&platform, "actuators")),
        body: if has_bodies {
            Some(parameters::inner(o, "body", semantics, &body))
        } else {
            parameters::optional(o, "body", semantics, &body)
        },
        initializers: o.required("initializers").object(|o| RobotInitializers {
            positions: positions(o.required("positions"), center),
            orientations: orientations(o.optional("orientations")),
        }),
        perturbations: parameters::inner(o, "perturbations", semantics, all),
        params: parameters::inner(o, "params", semantics, &[]),
    }
}

/// Reads the sensors of a robot. `given`: the defaults of its platform.
fn sensors(o: &mut Object<'_>, semantics: Semantics, given: &Given<'_>) -> SensorsConfig {
    let has_angles = o.has_within(&["sensors", "proximity_sensor", "angles"]);
    let mut sensors: SensorsConfig = o.inner("sensors", |o| {
        o.unsupported(&UNSUPPORTED);
        parameters::read(o, semantics, given)
    });
    // The angles of a platform are those of its own number of rays.
    if let Some(sensor) = &mut sensors.proximity_sensor
        && !has_angles
        && sensor.angles.as_ref().is_some_and(|angles| angles.len() != sensor.n_rays as usize)
    {
        sensor.angles = None;
    }
    sensors
}
