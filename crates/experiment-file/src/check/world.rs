//! Checks the world's objects: devices and perturbations of robots, start positions.

use crate::report::{Path, Report};
use crate::{
    ActuatorQuery, ExperimentConfig, InhibitedStimulus, Initializer, LightController,
    MovableConfig, ObjectConfig, ObstacleConfig, RobotConfig, RobotController, ScriptSensorConfig,
    SensorQuery, TopologyConfig, WirelessTransmitterConfig, limits,
};

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    for (name, object) in &config.world.objects {
        let path = Path::from(["world", "objects", name]);
        let positions = path.key("initializers").key("positions");
        let orientations = path.key("initializers").key("orientations");
        let n = object.num_instances();
        match object {
            ObjectConfig::Robot(robot) => {
                initializer(&robot.initializers.positions, n, &positions, report);
                initializer(&robot.initializers.orientations, n, &orientations, report);
                match robot.controller {
                    RobotController::NeuralController => {
                        network_ports(&config.topology, robot, name, &path, report);
                    }
                    RobotController::BraitenbergLightFollower => {
                        braitenberg_ports(robot, &path, report);
                    }
                    RobotController::ScriptController => {
                        script(config, "control", &path.key("controller"), report);
                    }
                }
                script_sensor(config, robot, &path, report);
                perturbations(robot, &path, report);
            }
            ObjectConfig::LightSource(light) => {
                if light.controller == (LightController::ScriptController {}) {
                    script(config, "move", &path.key("controller"), report);
                }
                initializer(&light.initializers.positions, n, &positions, report);
            }
            ObjectConfig::GroundArea(area) => {
                if area.controller.is_some() {
                    script(config, "move", &path.key("controller"), report);
                }
                initializer(&area.initializers.positions, n, &positions, report);
            }
            ObjectConfig::Obstacle(ObstacleConfig { initializers, .. })
            | ObjectConfig::Movable(MovableConfig { initializers, .. }) => {
                initializer(&initializers.positions, n, &positions, report);
                initializer(&initializers.orientations, n, &orientations, report);
            }
            ObjectConfig::Wall(_) => {}
        }
    }
    messages(config, report);
}

fn initializer(initializer: &Initializer, num_instances: u32, path: &Path, report: &Report<'_>) {
    let path = path.key("params");
    match initializer {
        Initializer::Fixed { values } => {
            let n = values.len();
            if n != 1 && n != num_instances as usize {
                report.conflict(&path.key("values"), &[&path], || {
                    format!("has {n} values for {num_instances} objects; give one each, or one")
                });
            }
        }
        Initializer::RandomUniform { low, high, .. } if low > high => {
            let others = [&path.key("low")];
            report.conflict(&path.key("high"), &others, || format!("{high} is below `low` {low}"));
        }
        _ => {}
    }
}

/// The network's inputs and outputs exist on the robot, with the same sizes.
fn network_ports(
    topology: &TopologyConfig,
    robot: &RobotConfig,
    name: &str,
    path: &Path,
    report: &Report<'_>,
) {
    let controller_path = path.key("controller");
    let sensors_path = path.key("sensors");
    for (stimulus, config) in &topology.stimuli {
        let path = Path::from(["topology", "stimuli", stimulus]);
        let (n, sensor) = (config.n, config.sensor);
        match robot.sensors.reading_len(sensor) {
            None => {
                report.conflict(&path.key("sensor"), &[&controller_path, &sensors_path], || {
                    format!("robot `{name}` has no such sensor")
                });
            }
            Some(len) if len != n => {
                let sensor_path = sensors_path.key(sensor.sensor_key());
                let others = [&controller_path, &sensor_path, &path.key("sensor")];
                report.conflict(&path.key("n"), &others, || {
                    format!("is {n}, but the reading of robot `{name}` has length {len}")
                });
            }
            Some(_) => {}
        }
    }
    let actuators_path = path.key("actuators");
    for (output, config) in &topology.outputs {
        let path = Path::from(["topology", "outputs", output]);
        if !robot.actuators.has(config.actuator) {
            let others = [&controller_path, &actuators_path];
            report.conflict(&path.key("actuator"), &others, || {
                format!("robot `{name}` has no such actuator")
            });
        } else if config.actuator == ActuatorQuery::Message
            && let Some(ensemble) = topology.ensembles.get(&config.ensemble)
            && let Some(decoding) = topology.decoding.get(output)
            && let Some(transmitter) = &robot.actuators.wireless_transmitter
            && decoding.n_values(ensemble.n) != transmitter.msg_length
        {
            let ensemble_path = Path::from(["topology", "ensembles", &config.ensemble, "n"]);
            let decoding_path = Path::from(["topology", "decoding", output]);
            let transmitter_path = actuators_path.key("wireless_transmitter");
            let (n, msg_length) = (decoding.n_values(ensemble.n), transmitter.msg_length);
            let others = [&controller_path, &transmitter_path, &path, &decoding_path];
            if decoding.n_weights(ensemble.n) > 0 {
                report.conflict(&decoding_path, &others, || {
                    format!(
                        "has {n} outputs, but messages of robot `{name}` have `msg_length` \
                         {msg_length}"
                    )
                });
            } else {
                report.conflict(&ensemble_path, &others, || {
                    format!("is {n}, but messages of robot `{name}` have `msg_length` {msg_length}")
                });
            }
        }
    }
}

/// A Braitenberg vehicle turns light into motion without a network.
fn braitenberg_ports(robot: &RobotConfig, path: &Path, report: &Report<'_>) {
    let path = |key| (path.key("controller"), path.key(key));
    if robot.sensors.light_sensor.is_none() {
        let (path, sensors) = path("sensors");
        report.conflict(&path, &[&sensors], "needs a `light_sensor`");
    }
    if robot.actuators.wheel_actuator.is_none() {
        let (path, actuators) = path("actuators");
        report.conflict(&path, &[&actuators], "needs a `wheel_actuator`");
    }
}

/// The readings of a script sensor have a range.
fn script_sensor(config: &ExperimentConfig, robot: &RobotConfig, path: &Path, report: &Report<'_>) {
    let Some(ScriptSensorConfig { low, high, .. }) = &robot.sensors.script_sensor else { return };
    let path = path.key("sensors").key("script_sensor");
    script(config, "sense", &path, report);
    if low >= high {
        report.conflict(&path, &[], || format!("`low` {low} is not below `high` {high}"));
    }
}

/// The task's script has the function that `path` needs.
fn script(config: &ExperimentConfig, function: &str, path: &Path, report: &Report<'_>) {
    if config.task.is_none() {
        report.conflict(path, &[&Path::from(["task"])], || {
            format!("needs a `task` whose `script` has a function `{function}`")
        });
    }
}

/// All robots share one ether, so all messages have the same length.
fn messages(config: &ExperimentConfig, report: &Report<'_>) {
    let mut first: Option<(u32, Path)> = None;
    for (name, robot) in config.robots() {
        let path = Path::from(["world", "objects", name]);
        let receiver = robot.sensors.wireless_receiver.as_ref();
        let transmitter = robot.actuators.wireless_transmitter.as_ref();
        let ports = [
            (receiver.map(|port| port.msg_length), ["sensors", "wireless_receiver"]),
            (transmitter.map(|port| port.msg_length), ["actuators", "wireless_transmitter"]),
        ];
        for (msg_length, [kind, port]) in ports {
            let Some(msg_length) = msg_length else {
                continue;
            };
            let path = path.key(kind).key(port).key("msg_length");
            match &first {
                None => first = Some((msg_length, path)),
                Some((first, first_path)) if msg_length != *first => {
                    report.conflict(&path, &[first_path], || {
                        format!("is {msg_length}, but {first} at {first_path}")
                    });
                }
                Some(_) => {}
            }
        }
        if let Some(transmitter) = transmitter {
            lattice(transmitter, &path.key("actuators").key("wireless_transmitter"), report);
        }
    }
}

fn lattice(transmitter: &WirelessTransmitterConfig, path: &Path, report: &Report<'_>) {
    if !transmitter.quantize {
        return;
    }
    let &WirelessTransmitterConfig { n_symbols, msg_length, .. } = transmitter;
    let n_levels = transmitter.n_levels();
    let others = [&path.key("msg_length"), &path.key("quantize")];
    let path = path.key("n_symbols");
    if n_levels < 2 {
        report.conflict(&path, &others, || {
            format!("{n_symbols} symbols leave only one level for each of {msg_length} components")
        });
    }
    let n_points = u64::from(n_levels).checked_pow(msg_length);
    let limit = limits::LATTICE_POINTS;
    if n_points.is_none_or(|n_points| n_points > limit.into()) {
        report.conflict(&path, &others, || {
            format!("{n_levels}^{msg_length} lattice points are more than the limit of {limit}")
        });
    }
}

fn perturbations(robot: &RobotConfig, path: &Path, report: &Report<'_>) {
    let n_path = path.key("num_instances");
    let sensors_path = path.key("sensors");
    let actuators_path = path.key("actuators");
    let path = path.key("perturbations");
    let affected = |affected_robots: u32, path: &Path| {
        let n = robot.num_instances;
        if affected_robots > n {
            report.conflict(&path.key("affected_robots"), &[&n_path], || {
                format!("is {affected_robots}, but there are {n} robots")
            });
        }
    };
    let perturbations = &robot.perturbations;
    if perturbations.leader_failure.is_some() && robot.actuators.led_actuator.is_none() {
        let path = path.key("leader_failure");
        report.conflict(&path, &[&actuators_path], "needs an `led_actuator`");
    }
    let inhibitions = &perturbations.stimuli_inhibition;
    for (index, inhibition) in inhibitions.iter().enumerate() {
        let path = path.key("stimuli_inhibition");
        let path = if inhibitions.len() > 1 { path.index(index) } else { path };
        affected(inhibition.affected_robots, &path);
        let reading = match inhibition.stimuli {
            InhibitedStimulus::Reading(reading) => reading,
            InhibitedStimulus::Receiver(_) => SensorQuery::ReceiverMessage,
        };
        if robot.sensors.reading_len(reading).is_none() {
            let path = path.key("stimuli");
            report.conflict(&path, &[&sensors_path], "the robot has no such sensor");
        }
    }
    if let Some(rotation) = &perturbations.uncontrollable_rotation {
        let path = path.key("uncontrollable_rotation");
        affected(rotation.affected_robots, &path);
        if robot.actuators.wheel_actuator.is_none() {
            report.conflict(&path, &[&actuators_path], "needs a `wheel_actuator`");
        }
    }
}
