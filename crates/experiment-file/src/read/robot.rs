//! Reads a robot: actuators, perturbations.

use super::node::{Node, Object};
use super::world::{orientations, positions};
use crate::semantics::Semantics;
use crate::{
    ActuatorsConfig, InhibitedStimulus, LeaderFailureConfig, LedActuatorConfig,
    PerturbationsConfig, RobotConfig, RobotController, RobotInitializers, RobotParams, SensorQuery,
    SensorsConfig, StimuliInhibitionConfig, TopologySwitchConfig, UncontrollableRotationConfig,
    WheelActuatorConfig, WholeReceiver, WirelessTransmitterConfig, limits,
};

/// `center`: of the world.
pub(super) fn robot(o: &mut Object<'_>, center: [f64; 2], semantics: Semantics) -> RobotConfig {
    const UNSUPPORTED: [&str; 1] = ["cascade_controller"];
    let default = RobotParams::default();
    let num_instances = o.required("num_instances").u32(1..=limits::ROBOTS);
    RobotConfig {
        num_instances,
        controller: o
            .required("controller")
            .variant(&UNSUPPORTED)
            .unwrap_or(RobotController::NeuralController),
        sensors: o.inner("sensors", |o| SensorsConfig::read(o, semantics)),
        actuators: o.inner("actuators", |o| actuators(o, semantics)),
        initializers: o.required("initializers").object(|o| RobotInitializers {
            positions: positions(o.required("positions"), center),
            orientations: orientations(o.optional("orientations")),
        }),
        perturbations: o.inner("perturbations", |o| perturbations(o, num_instances, semantics)),
        params: o.inner("params", |o| RobotParams {
            trainable: o.or("trainable", default.trainable, Node::bool),
        }),
    }
}

fn message_length(node: Node<'_>) -> u32 {
    node.u32(1..=limits::MESSAGE_LENGTH)
}

fn actuators(o: &mut Object<'_>, semantics: Semantics) -> ActuatorsConfig {
    ActuatorsConfig {
        wheel_actuator: o.optional("wheel_actuator").map(|node| node.object(wheels)),
        led_actuator: o.optional("led_actuator").map(|node| node.object(|_| LedActuatorConfig {})),
        wireless_transmitter: o
            .optional("wireless_transmitter")
            .map(|node| node.object(|o| transmitter(o, semantics))),
    }
}

fn wheels(o: &mut Object<'_>) -> WheelActuatorConfig {
    /// The original moves by `dt` times the sum of the actions, in cm; the same
    /// as a step of `dt / 5` seconds at 10 cm/s.
    const DT_PER_SECOND: f64 = 5.0;
    let default = WheelActuatorConfig::default();
    let dt = o.optional("dt");
    let duration = o.optional("step_duration");
    if let (Some(dt), Some(_)) = (&dt, &duration) {
        dt.problem("`step_duration` says the same");
    }
    // A dead zone of no width; the original has others, too.
    o.or("min_thresh", 0.0, |node| node.number(0.0..=0.0));
    WheelActuatorConfig {
        max_speed: o.or("max_speed", default.max_speed, Node::positive),
        axle_length: o.or("axle_length", default.axle_length, Node::positive),
        step_duration: duration
            .map(Node::positive)
            .or_else(|| dt.map(|dt| dt.positive() / DT_PER_SECOND))
            .unwrap_or(default.step_duration),
    }
}

fn transmitter(o: &mut Object<'_>, semantics: Semantics) -> WirelessTransmitterConfig {
    let default: WirelessTransmitterConfig = semantics.defaults();
    WirelessTransmitterConfig {
        range: o.or("range", default.range, Node::positive),
        msg_length: o.or("msg_length", default.msg_length, message_length),
        quantize: o.or("quantize", default.quantize, Node::bool),
        n_symbols: o
            .or("n_symbols", default.n_symbols, |node| node.u32(2..=limits::LATTICE_POINTS)),
        beta: o.or("beta", default.beta, Node::amount),
        sending_steps: o
            .or("sending_steps", default.sending_steps, |node| node.u32(0..=limits::STEPS)),
        initial_frame: o.or("initial_frame", default.initial_frame, Node::bool),
    }
}

fn perturbations(
    o: &mut Object<'_>,
    num_instances: u32,
    semantics: Semantics,
) -> PerturbationsConfig {
    PerturbationsConfig {
        leader_failure: o.optional("leader_failure").map(|node| node.object(leader_failure)),
        stimuli_inhibition: o.or("stimuli_inhibition", Vec::new(), |node| {
            let one = |node: Node<'_>| {
                node.object(|o| StimuliInhibitionConfig {
                    stimuli: o.or("stimuli", LIGHT, inhibited_stimulus),
                    affected_robots: affected_robots(o, num_instances),
                })
            };
            if node.is_list() {
                node.list(1..=limits::INHIBITIONS).into_iter().map(one).collect()
            } else {
                vec![one(node)]
            }
        }),
        topology_switch: o.optional("topology_switch").map(|node| {
            let default = TopologySwitchConfig::default();
            node.object(|o| TopologySwitchConfig { every: o.or("every", default.every, steps) })
        }),
        uncontrollable_rotation: o.optional("uncontrollable_rotation").map(|node| {
            node.object(|o| UncontrollableRotationConfig {
                affected_robots: affected_robots(o, num_instances),
                start: o
                    .or("start", semantics.rotation_start(), |node| node.u32(0..=limits::STEPS)),
                targets: o.or("targets", default_targets(), |node| {
                    let targets = node.list(1..=limits::TARGETS);
                    targets.into_iter().map(Node::quantity).collect()
                }),
                switch_at: o.or("switch_at", 600, steps),
                speed: o.or("speed", semantics.rotation_speed(), Node::probability),
            })
        }),
    }
}

fn leader_failure(o: &mut Object<'_>) -> LeaderFailureConfig {
    let default = LeaderFailureConfig::default();
    o.ignored("affected_robots", "any robot may become the leader");
    LeaderFailureConfig { time_to_failure: o.or("time_to_failure", default.time_to_failure, steps) }
}

const LIGHT: InhibitedStimulus = InhibitedStimulus::Reading(SensorQuery::Light);

fn inhibited_stimulus(node: Node<'_>) -> InhibitedStimulus {
    if node.is("wireless_receiver") {
        InhibitedStimulus::Receiver(WholeReceiver::WirelessReceiver)
    } else {
        node.variant(&[]).map_or(LIGHT, InhibitedStimulus::Reading)
    }
}

/// A number, or "all", which is the default.
fn affected_robots(o: &mut Object<'_>, num_instances: u32) -> u32 {
    o.or("affected_robots", num_instances, |node| {
        if node.is_string() {
            node.one_of(&["all"], &[]);
            num_instances
        } else {
            node.u32(0..=limits::ROBOTS)
        }
    })
}

fn steps(node: Node<'_>) -> u32 {
    node.u32(1..=limits::STEPS)
}

fn default_targets() -> Vec<f64> {
    [270.0_f64, 90.0, 15.0, 180.0].map(f64::to_radians).to_vec()
}
