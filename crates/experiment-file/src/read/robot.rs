//! Reads a robot.

use super::node::Object;
use super::world::{orientations, positions};
use crate::semantics::Semantics;
use crate::{
    BodyConfig, RobotConfig, RobotController, RobotInitializers, limits, parameters, sensors,
};

/// Reads a robot. `center`: the centre of the world. `has_bodies`: whether every robot has one.
pub(super) fn robot(
    o: &mut Object<'_>,
    center: [f64; 2],
    has_bodies: bool,
    semantics: Semantics,
) -> RobotConfig {
    const UNSUPPORTED: [&str; 1] = ["cascade_controller"];
    let num_instances = o.required("num_instances").u32(1..=limits::ROBOTS);
    let all = &[("affected_robots", num_instances.into())];
    RobotConfig {
        num_instances,
        controller: o
            .required("controller")
            .variant(&UNSUPPORTED)
            .unwrap_or(RobotController::NeuralController),
        sensors: o.inner("sensors", |o| {
            o.unsupported(&sensors::UNSUPPORTED);
            parameters::read(o, semantics, &[])
        }),
        actuators: parameters::inner(o, "actuators", semantics, &[]),
        body: parameters::optional(o, "body", semantics, &[])
            .or_else(|| has_bodies.then(BodyConfig::default)),
        initializers: o.required("initializers").object(|o| RobotInitializers {
            positions: positions(o.required("positions"), center),
            orientations: orientations(o.optional("orientations")),
        }),
        perturbations: parameters::inner(o, "perturbations", semantics, all),
        params: parameters::inner(o, "params", semantics, &[]),
    }
}
