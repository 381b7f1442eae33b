//! Worlds: a swarm, and sometimes lights, ground areas and vehicles.

use serde_json::{Value, json};

use super::{Dice, insert, object};

/// The devices of the generated robots, on which everything else depends.
pub(super) struct Robot {
    n: usize,
    pub(super) msg_length: usize,
    /// Readings and their lengths.
    pub(super) readings: Vec<(&'static str, usize)>,
    sensors: Value,
    pub(super) actuators: Vec<&'static str>,
    pub(super) has_light: bool,
}

impl Robot {
    pub(super) fn new(dice: &mut Dice) -> Self {
        let msg_length = dice.die(3);
        let n_sectors = dice.die(8);
        let mut robot = Self {
            n: dice.die(12),
            msg_length,
            readings: Vec::new(),
            sensors: json!({}),
            actuators: dice.some(&["wheel_actuator", "led_actuator", "wireless_transmitter"]),
            has_light: dice.chance(0.5),
        };
        if robot.actuators.is_empty() {
            robot.actuators.push("led_actuator");
        }
        let mut kinds =
            dice.some(&["wireless_receiver", "light_sensor", "distance_sensor", "ground_sensor"]);
        if kinds.is_empty() {
            kinds.push("wireless_receiver");
        }
        for kind in kinds {
            let [rho, phi] = [dice.number(0.0, 1.0), dice.number(0.0, 2.0)];
            let range = dice.number(20.0, 200.0);
            let mut sensor =
                object(dice, [("decay_rho", rho), ("decay_phi", phi), ("range", range)]);
            match kind {
                "wireless_receiver" => {
                    insert(&mut sensor, "msg_length", json!(msg_length));
                    if dice.chance(0.3) {
                        let whose = dice.pick(&["emitter", "originator"]);
                        insert(&mut sensor, "sending_direction", json!(whose));
                    }
                    insert(&mut sensor, "max_hops", json!(dice.die(20)));
                    for (reading, n) in [
                        ("wireless_receiver:msg", msg_length),
                        ("wireless_receiver:signal", 1),
                        ("wireless_receiver:state", 1),
                        ("wireless_receiver:receiving_direction", 2),
                        ("wireless_receiver:sending_direction", 2),
                    ] {
                        robot.readings.push((reading, n));
                    }
                }
                "ground_sensor" => {
                    sensor = object(dice, [("color", json!("black"))]);
                    robot.readings.push((kind, 1));
                }
                _ => {
                    insert(&mut sensor, "n_sectors", json!(n_sectors));
                    let noise = dice.pick(&["noise_variance", "noise_sigma"]);
                    insert(&mut sensor, noise, dice.number(0.0, 0.2));
                    if kind == "light_sensor" {
                        insert(&mut sensor, "color", json!("red"));
                    }
                    robot.readings.push((kind, n_sectors));
                }
            }
            insert(&mut robot.sensors, kind, sensor);
        }
        robot
    }

    pub(super) fn world(&self, dice: &mut Dice) -> Value {
        let height = dice.number(500.0, 2000.0);
        let mut world = object(
            dice,
            [("height", height), ("width", json!(1200)), ("render_connections", json!(true))],
        );
        let mut objects = json!({"swarm": self.swarm(dice)});
        if self.has_light {
            insert(&mut objects, "light", light(dice));
        }
        if dice.chance(0.3) {
            let (n, radius) = (dice.die(3), dice.number(10.0, 200.0));
            let params = object(dice, [("range", radius), ("color", json!("black"))]);
            let positions = positions(dice, n);
            let area = json!({"type": "ground_area", "num_instances": n, "params": params,
                "initializers": {"positions": positions}});
            insert(&mut objects, "floor", area);
        }
        if dice.chance(0.2) {
            let positions = positions(dice, 2);
            let controller = dice.pick(&["Braitenberg2", "braitenberg_light_follower"]);
            let vehicle = json!({"type": "robot", "num_instances": 2, "controller": controller,
                "sensors": {"light_sensor": {}}, "actuators": {"wheel_actuator": {}},
                "initializers": {"positions": positions}});
            insert(&mut objects, "vehicles", vehicle);
        }
        insert(&mut world, "objects", objects);
        world
    }

    fn swarm(&self, dice: &mut Dice) -> Value {
        let mut initializers = json!({"positions": positions(dice, self.n)});
        if dice.chance(0.5) {
            let orientations = match dice.below(3) {
                0 => json!({"name": "fixed", "params": {"values": [[dice.number(0.0, 6.2)]]}}),
                1 => json!({"name": "random_uniform", "params": {"low": 0, "high": 6.2}}),
                _ => json!({"name": "random_uniform"}),
            };
            insert(&mut initializers, "orientations", orientations);
        }
        let mut swarm = object(dice, [("params", json!({"trainable": true}))]);
        for (key, value) in [
            ("type", json!("robot")),
            ("num_instances", json!(self.n)),
            ("controller", json!("neural_controller")),
            ("sensors", self.sensors.clone()),
            ("actuators", self.actuators(dice)),
            ("initializers", initializers),
            ("perturbations", self.perturbations(dice)),
        ] {
            insert(&mut swarm, key, value);
        }
        swarm
    }

    fn actuators(&self, dice: &mut Dice) -> Value {
        let mut actuators = json!({});
        for &kind in &self.actuators {
            let actuator = match kind {
                "led_actuator" => json!({}),
                "wheel_actuator" => {
                    let duration = dice.pick(&["step_duration", "dt"]);
                    let [value, speed] = [dice.number(0.1, 2.0), dice.number(1.0, 20.0)];
                    object(
                        dice,
                        [(duration, value), ("max_speed", speed), ("axle_length", json!(9))],
                    )
                }
                _ => {
                    let [beta, range] = [dice.number(0.0, 200.0), dice.number(50.0, 150.0)];
                    let quantize = json!(dice.chance(0.5));
                    let symbols = json!(dice.pick(&[&16, &27, &64]));
                    let [steps, frame] = [json!(dice.below(20)), json!(dice.chance(0.5))];
                    let mut transmitter = object(
                        dice,
                        [
                            ("sending_steps", steps),
                            ("initial_frame", frame),
                            ("beta", beta),
                            ("range", range),
                            ("quantize", quantize),
                            ("n_symbols", symbols),
                        ],
                    );
                    insert(&mut transmitter, "msg_length", json!(self.msg_length));
                    transmitter
                }
            };
            insert(&mut actuators, kind, actuator);
        }
        actuators
    }

    fn perturbations(&self, dice: &mut Dice) -> Value {
        let affected = if dice.chance(0.5) { json!("all") } else { json!(dice.below(self.n + 1)) };
        let (every, reading) = (dice.die(300), self.readings[dice.below(self.readings.len())].0);
        let inhibition = object(dice, [("affected_robots", affected.clone())]);
        let mut perturbations = object(dice, [("topology_switch", json!({"every": every}))]);
        if dice.chance(0.3) {
            insert(&mut perturbations, "stimuli_inhibition", inhibition);
            let whole = reading.starts_with("wireless") && dice.chance(0.3);
            let stimulus = if whole { "wireless_receiver" } else { reading };
            insert(&mut perturbations["stimuli_inhibition"], "stimuli", json!(stimulus));
            if dice.chance(0.3) {
                let one = perturbations["stimuli_inhibition"].take();
                perturbations["stimuli_inhibition"] = json!([one, {"stimuli": reading}]);
            }
        }
        if self.actuators.contains(&"led_actuator") && dice.chance(0.3) {
            let failure = object(dice, [("time_to_failure", json!(every))]);
            insert(&mut perturbations, "leader_failure", failure);
        }
        if self.actuators.contains(&"wheel_actuator") && dice.chance(0.3) {
            let targets = json!([dice.number(0.0, 6.0), dice.number(-6.0, 6.0)]);
            let speed = dice.number(0.0, 1.0);
            let rotation = object(
                dice,
                [
                    ("affected_robots", affected),
                    ("start", json!(every)),
                    ("targets", targets),
                    ("switch_at", json!(every)),
                    ("speed", speed),
                ],
            );
            insert(&mut perturbations, "uncontrollable_rotation", rotation);
        }
        if dice.chance(0.3) {
            insert(&mut perturbations, "pseudo_reality", reality(dice));
        }
        perturbations
    }
}

fn reality(dice: &mut Dice) -> Value {
    let mut drawn = |low: f64, high: f64| match dice.chance(0.5) {
        true => dice.number(low, high),
        false => json!([dice.number(low, low), dice.number(low, high)]),
    };
    let keys = [
        ("wheel_gain", drawn(0.5, 1.5)),
        ("wheel_asymmetry", drawn(0.0, 0.2)),
        ("slow_robot", drawn(0.0, 1.0)),
        ("sensor_gain", drawn(0.5, 1.5)),
        ("sensor_offset", drawn(-0.1, 0.1)),
        ("sensor_noise", drawn(0.0, 0.1)),
        ("radio_range", drawn(0.5, 1.5)),
        ("radio_loss", drawn(0.0, 1.0)),
        ("antenna_heading", drawn(0.0, 3.0)),
        ("actuation_delay", json!([0, dice.below(5)])),
    ];
    object(dice, keys)
}

fn light(dice: &mut Dice) -> Value {
    let n = dice.die(3);
    let controller = match dice.below(6) {
        0 => json!(null),
        1 => {
            let radius_step = if dice.chance(0.5) { json!(null) } else { json!(0.5) };
            let params = object(
                dice,
                [("angle_step", json!(0.02)), ("radius_step", radius_step), ("radius", json!(150))],
            );
            json!({"name": "light_orbit_controller", "params": params})
        }
        2 => json!("light_rnd_pos_controller"),
        3 => json!({"name": "static"}),
        4 => json!("light_prey_controller"),
        _ => {
            let pace = dice.pick(&["speed", "step"]);
            let value = dice.number(0.0, 1.0);
            let params =
                object(dice, [("every", json!(n * 10)), ("square", json!(90)), (pace, value)]);
            json!({"name": "light_rnd_pos_controller", "params": params})
        }
    };
    let range = dice.number(10.0, 200.0);
    let params = object(dice, [("range", range), ("color", json!("red"))]);
    let positions = positions(dice, n);
    json!({"type": "light_source", "num_instances": n, "controller": controller,
        "params": params, "initializers": {"positions": positions}})
}

fn positions(dice: &mut Dice, n: usize) -> Value {
    let coordinate = |dice: &mut Dice| dice.number(-100.0, 1500.0);
    let point = json!([coordinate(dice), coordinate(dice)]);
    let (name, params) = match dice.below(4) {
        0 => {
            let n = if dice.chance(0.5) { n } else { 1 };
            let values: Vec<Value> =
                (0..n).map(|_| json!([coordinate(dice), coordinate(dice)])).collect();
            ("fixed", json!({"values": values}))
        }
        1 => {
            let [low, high] = [dice.number(0.0, 400.0), dice.number(400.0, 900.0)];
            ("random_uniform", object(dice, [("low", low), ("high", high), ("size", json!(2))]))
        }
        2 => {
            let radius = dice.number(0.0, 300.0);
            ("random_circumference", object(dice, [("radius", radius), ("center", point)]))
        }
        _ => {
            let radius = dice.number(50.0, 300.0);
            ("random_graph", object(dice, [("max_rad", radius), ("initial_pos", point)]))
        }
    };
    let mut initializer = json!({"name": name});
    if name == "fixed" || dice.chance(0.7) {
        insert(&mut initializer, "params", params);
    }
    initializer
}
