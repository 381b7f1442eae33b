//! The values of each robot that the player shows: one row of the table per column.

use sim_core::{Mode, ReceivedFrame, RobotRecord};

use super::{column::Form, scene::Scene};

/// A column of robots.
pub struct RobotColumn {
    pub name: &'static str,
    pub form: Form,
    /// Values per robot.
    pub n_components: fn(&Scene) -> usize,
    /// Appends a robot's values.
    pub read: fn(&RobotRecord, &mut Vec<f64>),
}

/// The form of values in \[-1, 1\].
const SHARE: Form = Form::Byte(0.01);
const NUMBER: Form = Form::Byte(1.0);
const ROBOT: Form = Form::Short(1.0);
/// The form of angles, in radians.
pub const ANGLE: Form = Form::Short(0.001);

/// A column of one value per robot.
const fn one(name: &'static str, form: Form, read: fn(&RobotRecord, &mut Vec<f64>)) -> RobotColumn {
    RobotColumn { name, form, n_components: |_| 1, read }
}

/// All columns of robots.
pub const ROBOT_COLUMNS: &[RobotColumn] = &[
    one("x", Form::Position, |robot, out| out.push(robot.position.x)),
    one("y", Form::Position, |robot, out| out.push(robot.position.y)),
    one("heading", ANGLE, |robot, out| out.push(robot.heading)),
    RobotColumn {
        name: "wheels",
        form: SHARE,
        n_components: |_| 2,
        read: |robot, out| out.extend(robot.wheels),
    },
    one("led", NUMBER, |robot, out| out.push(robot.led.into())),
    one("relays", NUMBER, |robot, out| out.push((robot.mode == Mode::Relay).into())),
    RobotColumn {
        name: "message",
        form: SHARE,
        n_components: |scene| scene.message_len,
        read: |robot, out| out.extend(&robot.message),
    },
    one("emitter", ROBOT, |robot, out| out.push(heard(robot, |frame| frame.emitter as f64))),
    one("originator", ROBOT, |robot, out| out.push(heard(robot, |frame| frame.originator as f64))),
    one("hops", NUMBER, |robot, out| out.push(heard(robot, |frame| frame.hops.into()))),
    one("sector", NUMBER, |robot, out| out.push(heard(robot, |frame| frame.sector as f64))),
    one("signal", Form::Short(1e-4), |robot, out| out.push(heard(robot, |frame| frame.signal))),
    RobotColumn {
        name: "heard",
        form: SHARE,
        n_components: |scene| scene.message_len,
        read: |robot, out| out.extend(&robot.received_message),
    },
    one("carries", NUMBER, |robot, out| out.push(robot.carries.into())),
    one("failed", NUMBER, |robot, out| out.push(robot.failed.into())),
    one("target", NUMBER, |robot, out| out.push(robot.target.map_or(-1.0, f64::from))),
    RobotColumn {
        name: "stimuli",
        form: Form::Reading,
        n_components: |scene| scene.n_inputs,
        read: |robot, out| out.extend(&robot.stimuli),
    },
    RobotColumn {
        name: "neurons",
        form: Form::Reading,
        n_components: |scene| scene.n_neurons,
        read: |robot, out| out.extend(&robot.activity),
    },
];

/// A property of the frame that a robot received; -1 without one.
fn heard(robot: &RobotRecord, property: impl Fn(ReceivedFrame) -> f64) -> f64 {
    robot.received.map_or(-1.0, property)
}
