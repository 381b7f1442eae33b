//! Topologies, and queries of the genotype.

use serde_json::{Value, json};

use super::world::Robot;
use super::{Dice, insert, object};

/// A generated topology, and what queries have to know of it.
pub(super) struct Network {
    pub(super) topology: Value,
    ensembles: Vec<String>,
    motor: Vec<String>,
    /// Name, starts, of every group that evolves.
    groups: Vec<(String, Vec<String>)>,
    pub(super) has_led: bool,
    pub(super) has_wheels: bool,
}

impl Network {
    pub(super) fn new(dice: &mut Dice, robot: &Robot) -> Self {
        let mut network = Self {
            topology: json!({}),
            ensembles: Vec::new(),
            motor: Vec::new(),
            groups: Vec::new(),
            has_led: robot.actuators.contains(&"led_actuator"),
            has_wheels: robot.actuators.contains(&"wheel_actuator"),
        };
        let mut stimuli = json!({});
        let mut encoding = json!({});
        for i in 0..dice.die(4) {
            let (sensor, n) = robot.readings[dice.below(robot.readings.len())];
            insert(&mut stimuli, &format!("I{i}"), json!({"n": n, "sensor": sensor}));
            insert(&mut encoding, &format!("I{i}"), json!({"scheme": "IdentityEncoding"}));
        }
        let mut ensembles = json!({});
        for i in 0..dice.die(3) {
            let size = dice.die(8);
            network.ensemble(dice, &mut ensembles, &format!("H{i}"), size);
        }
        let outputs = network.outputs(dice, robot, &mut ensembles);
        let synapses = network.synapses(dice, &stimuli);
        let (seed, time_scale) = (dice.below(1 << 20), dice.die(30));
        let bias_in_gain = json!(dice.chance(0.5));
        let initial_rates = json!(dice.pick(&["activation", "zero"]));
        let motor_tau = if dice.chance(0.3) { json!(null) } else { json!(0.7) };
        let dt = dice.number(0.01, 0.3);
        network.topology = object(
            dice,
            [
                ("dt", dt),
                ("time_scale", json!(time_scale)),
                ("bias_in_gain", bias_in_gain),
                ("initial_rates", initial_rates),
                ("motor_tau", motor_tau),
                ("seed", json!(seed)),
                ("encoding", encoding),
                ("neuron_model", json!("rate_model")),
                ("neurons", json!({"model": "ctrnn"})),
                ("synapse_model", json!("static_synapse")),
            ],
        );
        let [outputs, decoding] = outputs;
        for (key, value) in [
            ("stimuli", stimuli),
            ("ensembles", ensembles),
            ("outputs", outputs),
            ("decoding", decoding),
            ("synapses", synapses),
        ] {
            insert(&mut network.topology, key, value);
        }
        network
    }

    fn ensemble(&mut self, dice: &mut Dice, ensembles: &mut Value, name: &str, n: usize) {
        let activation = json!(dice.pick(&["sigmoid", "tanh"]));
        let [tau, gain, bias] =
            [dice.number(0.3, 9.0), dice.number(-2.0, 5.0), dice.number(-2.0, 2.0)];
        let inner = object(
            dice,
            [("tau", tau), ("gain", gain), ("bias", bias), ("activation", activation.clone())],
        );
        let mut ensemble = object(dice, [("activation", activation), ("params", inner)]);
        insert(&mut ensemble, "n", json!(n));
        insert(ensembles, name, ensemble);
        self.ensembles.push(name.to_owned());
    }

    /// `outputs` and `decoding`.
    fn outputs(&mut self, dice: &mut Dice, robot: &Robot, ensembles: &mut Value) -> [Value; 2] {
        let (mut outputs, mut decoding) = (json!({}), json!({}));
        let mut actuators = robot.actuators.clone();
        if actuators.contains(&"wireless_transmitter") && dice.chance(0.7) {
            actuators.push("wireless_transmitter:state");
        }
        for (i, actuator) in actuators.into_iter().enumerate() {
            let (n, scheme) = match actuator {
                "wheel_actuator" => (dice.die(2), "IdentityDecoding"),
                "wireless_transmitter" => {
                    (robot.msg_length, dice.pick(&["IdentityDecoding", "ThresholdDecoding"]))
                }
                "led_actuator" if dice.chance(0.3) => (2 + dice.below(3), "SoftmaxDecoding"),
                _ => (1, "ThresholdDecoding"),
            };
            let name = format!("OUT{i}");
            self.ensemble(dice, ensembles, &name, n);
            self.motor.push(name.clone());
            let enc = json!(dice.pick(&["real", "cat"]));
            let mut output = object(dice, [("enc", enc)]);
            insert(&mut output, "ensemble", json!(name));
            insert(&mut output, "actuator", json!(actuator));
            insert(&mut outputs, &format!("out{i}"), output);
            let mut params = object(dice, [("is_cat", json!(scheme != "IdentityDecoding"))]);
            if scheme == "ThresholdDecoding" {
                insert(&mut params, "stochastic", json!(dice.chance(0.5)));
            }
            let mut entry = object(dice, [("params", params)]);
            insert(&mut entry, "scheme", json!(scheme));
            insert(&mut decoding, &format!("out{i}"), entry);
        }
        [outputs, decoding]
    }

    /// Groups over disjoint pairs.
    fn synapses(&mut self, dice: &mut Dice, stimuli: &Value) -> Value {
        let stimuli = stimuli.as_object().unwrap().keys().cloned();
        let sources: Vec<String> = stimuli.chain(self.ensembles.iter().cloned()).collect();
        let mut synapses = json!({});
        for (i, target) in self.ensembles.iter().enumerate() {
            let mut rest = dice.some(&sources);
            while let Some(first) = rest.pop() {
                let mut pre = vec![first];
                pre.extend(rest.pop().filter(|_| dice.chance(0.3)));
                let name = format!("S{i}-{}", pre[0]);
                let (p, is_trainable) = (dice.number(0.1, 1.0), dice.chance(0.8));
                let mut group = object(dice, [("p", p)]);
                if !is_trainable || dice.chance(0.5) {
                    insert(&mut group, "trainable", json!(is_trainable));
                }
                let one = pre.len() == 1 && dice.chance(0.7);
                insert(&mut group, "pre", if one { json!(pre[0]) } else { json!(pre) });
                let post = if dice.chance(0.7) { json!(target) } else { json!([target]) };
                insert(&mut group, "post", post);
                insert(&mut synapses, &name, group);
                if is_trainable {
                    self.groups.push((name, pre));
                }
            }
        }
        if synapses == json!({}) {
            synapses = json!({"only": {"pre": sources[0], "post": self.ensembles[0]}});
            self.groups.push(("only".to_owned(), vec![sources[0].clone()]));
        }
        synapses
    }

    /// Disjoint queries that match something, with their bounds.
    pub(super) fn queries(&self, dice: &mut Dice) -> Vec<(String, [f64; 2])> {
        let weights: Vec<String> = match dice.below(4) {
            _ if self.groups.is_empty() => Vec::new(),
            0 => vec!["all".to_owned()],
            1 => {
                let kind = |name: &String| match name {
                    name if name.starts_with('I') => "sensory",
                    name if self.motor.contains(name) => "motor",
                    _ => "hidden",
                };
                let mut kinds: Vec<&str> =
                    self.groups.iter().flat_map(|(_, pre)| pre).map(kind).collect();
                kinds.sort_unstable();
                kinds.dedup();
                dice.some(&kinds).into_iter().map(str::to_owned).collect()
            }
            2 => dice.some(&self.groups).into_iter().map(|(name, _)| name).collect(),
            _ => {
                let mut names: Vec<String> =
                    self.groups.iter().flat_map(|(_, pre)| pre).cloned().collect();
                names.sort_unstable();
                names.dedup();
                dice.some(&names)
            }
        };
        let weights =
            weights.into_iter().map(|name| (format!("synapses:weights:{name}"), [-3.0, 3.0]));
        let mut queries: Vec<_> = weights.collect();
        let gain = dice.pick(&["gain", "gains"]);
        for (parameter, bounds) in
            [("bias", [-1.5, 1.5]), ("tau", [-1.0, 0.75]), (gain, [0.05, 5.0])]
        {
            let selectors = match dice.below(3) {
                0 => vec!["all".to_owned()],
                1 => dice.some(&self.ensembles),
                _ => Vec::new(),
            };
            let named = selectors.into_iter().map(|s| (format!("neurons:{parameter}:{s}"), bounds));
            queries.extend(named);
        }
        if queries.is_empty() {
            queries.push(("neurons:bias:all".to_owned(), [-1.0, 1.0]));
        }
        queries
    }
}
