//! Topologies, and queries of the genotype.

use experiment_file::NeuronModel;
use serde_json::{Value, json};

use super::learning::learning;
use super::world::Robot;
use super::{Dice, encoding, insert, object};

/// A generated topology, with the names that queries need.
pub(super) struct Network {
    pub(super) topology: Value,
    model: NeuronModel,
    is_dynamic: bool,
    /// Stimuli with an encoder, and stimuli whose receptive field has weights.
    encoded: Vec<String>,
    linear: Vec<String>,
    /// Groups of synapses that are plastic.
    plastic: Vec<String>,
    /// Outputs whose decoding has weights.
    weighted: Vec<String>,
    ensembles: Vec<String>,
    motor: Vec<String>,
    /// Name and sources of every group that evolves.
    groups: Vec<(String, Vec<String>)>,
    pub(super) has_led: bool,
    pub(super) has_wheels: bool,
}

impl Network {
    pub(super) fn new(dice: &mut Dice, robot: &Robot, share_of_spiking: f64) -> Self {
        let spiking = NeuronModel::ALL.into_iter().filter(|model| model.is_spiking());
        let spiking: Vec<NeuronModel> = spiking.collect();
        let model = if dice.chance(share_of_spiking) {
            spiking[dice.below(spiking.len())]
        } else {
            NeuronModel::Rate
        };
        let mut network = Self {
            topology: json!({}),
            model,
            is_dynamic: model.is_spiking() && dice.chance(0.5),
            encoded: Vec::new(),
            linear: Vec::new(),
            plastic: Vec::new(),
            weighted: Vec::new(),
            ensembles: Vec::new(),
            motor: Vec::new(),
            groups: Vec::new(),
            has_led: robot.actuators.contains(&"led_actuator"),
            has_wheels: robot.actuators.contains(&"wheel_actuator"),
        };
        let mut stimuli = json!({});
        let mut encoding = json!({});
        let time_scale = dice.die(30);
        for i in 0..dice.die(4) {
            let (sensor, n) = robot.readings[dice.below(robot.readings.len())];
            let name = format!("I{i}");
            insert(&mut stimuli, &name, json!({"n": n, "sensor": sensor}));
            let entry = if model.is_spiking() && dice.chance(0.6) {
                network.encoded.push(name.clone());
                let entry = encoding::entry(dice, n, time_scale);
                if entry["receptive_field"]["name"] == "linear_receptive_field" {
                    network.linear.push(name.clone());
                }
                entry
            } else {
                json!({"scheme": "IdentityEncoding"})
            };
            insert(&mut encoding, &name, entry);
        }
        let mut ensembles = json!({});
        for i in 0..dice.die(3) {
            let size = dice.die(8);
            network.ensemble(dice, &mut ensembles, &format!("H{i}"), size);
        }
        let outputs = network.outputs(dice, robot, &mut ensembles);
        let synapses = network.synapses(dice, &stimuli);
        let groups: Vec<String> = synapses.as_object().unwrap().keys().cloned().collect();
        let seed = dice.below(1 << 20);
        network.topology = object(dice, [("seed", json!(seed))]);
        insert(&mut network.topology, "time_scale", json!(time_scale));
        if model.is_spiking() || dice.chance(0.5) {
            insert(&mut network.topology, "encoding", encoding);
        }
        if network.is_dynamic {
            insert(&mut network.topology, "synapse_model", json!("dynamic_synapse"));
            let params = receptors(dice);
            insert(&mut network.topology, "synapse_params", params);
        } else if dice.chance(0.5) {
            insert(&mut network.topology, "synapse_model", json!("static_synapse"));
        }
        let of_model = if model.is_spiking() {
            insert(&mut network.topology, "neuron_model", json!(model));
            let dt = dice.number(0.1, 2.0);
            object(dice, [("dt", dt), ("neurons", json!({"model": model}))])
        } else {
            let bias_in_gain = json!(dice.chance(0.5));
            let initial_rates = json!(dice.pick(&["activation", "zero"]));
            let motor_tau = if dice.chance(0.3) { json!(null) } else { json!(0.7) };
            let dt = dice.number(0.01, 0.3);
            object(
                dice,
                [
                    ("dt", dt),
                    ("bias_in_gain", bias_in_gain),
                    ("initial_rates", initial_rates),
                    ("motor_tau", motor_tau),
                    ("neuron_model", json!("rate_model")),
                    ("neurons", json!({"model": "ctrnn"})),
                ],
            )
        };
        for (key, value) in of_model.as_object().unwrap() {
            insert(&mut network.topology, key, value.clone());
        }
        if dice.chance(0.3) {
            let (learning, plastic) = learning(dice, &groups);
            insert(&mut network.topology, "learning", learning);
            network.plastic = plastic;
        }
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
        let mut ensemble = if self.model.is_spiking() {
            json!({"params": self.spiking_params(dice)})
        } else {
            let activation = json!(dice.pick(&["sigmoid", "tanh"]));
            let [tau, gain, bias] =
                [dice.number(0.3, 9.0), dice.number(-2.0, 5.0), dice.number(-2.0, 2.0)];
            let inner = object(
                dice,
                [("tau", tau), ("gain", gain), ("bias", bias), ("activation", activation.clone())],
            );
            object(dice, [("activation", activation), ("params", inner)])
        };
        insert(&mut ensemble, "n", json!(n));
        insert(ensembles, name, ensemble);
        self.ensembles.push(name.to_owned());
    }

    /// Some of the model's parameters, within their ranges; time constants above dt / 2.
    fn spiking_params(&self, dice: &mut Dice) -> Value {
        let mut params = json!({});
        for parameter in self.model.spec().parameters {
            let (low, high) = (*parameter.range().start(), *parameter.range().end());
            let low = if parameter.is_time_constant { 1.0 } else { low };
            if dice.chance(0.5) {
                let value = if parameter.is_whole() {
                    json!(dice.below(high as usize + 1))
                } else {
                    dice.number(low, high)
                };
                insert(&mut params, parameter.name(), value);
            }
        }
        params
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
                _ if self.model.is_spiking() => self.spiking_decoding(dice, actuator),
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
            match scheme {
                "ThresholdDecoding" => {
                    insert(&mut params, "stochastic", json!(dice.chance(0.5)));
                }
                "RankOrderDecoding" | "LinearPopulationDecoding" => {
                    let n = match actuator {
                        "wireless_transmitter" => robot.msg_length,
                        "wheel_actuator" => dice.die(2),
                        _ => 1,
                    };
                    insert(&mut params, "num_outputs", json!(n));
                    if scheme == "LinearPopulationDecoding" && dice.chance(0.5) {
                        insert(&mut params, "rest_value", dice.number(-1.0, 1.0));
                    }
                    self.weighted.push(format!("out{i}"));
                }
                _ => {}
            }
            let mut entry = if self.model.is_spiking() {
                json!({"params": params})
            } else {
                object(dice, [("params", params)])
            };
            insert(&mut entry, "scheme", json!(scheme));
            insert(&mut decoding, &format!("out{i}"), entry);
        }
        [outputs, decoding]
    }

    /// Neurons and the decoding of their spikes.
    fn spiking_decoding(&self, dice: &mut Dice, actuator: &str) -> (usize, &'static str) {
        let categorical = actuator == "led_actuator" || actuator == "wireless_transmitter:state";
        match dice.below(3) {
            0 if categorical => (2, "FirstToSpike"),
            1 => (dice.die(4), "RankOrderDecoding"),
            _ => (dice.die(4), "LinearPopulationDecoding"),
        }
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
                if self.is_dynamic && dice.chance(0.7) {
                    let transmitter = dice.pick(&["AMPA", "GABA", "AMPA+NDMA", "AMPA+NMDA"]);
                    insert(&mut group, "neuroTX", json!(transmitter));
                }
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
    pub(super) fn is_spiking(&self) -> bool {
        self.model.is_spiking()
    }

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
        let rate = [("bias", [-1.5, 1.5]), ("tau", [-1.0, 0.75]), (gain, [0.05, 5.0])];
        let of_model = if self.model.is_spiking() {
            let evolvable = self.model.spec().evolvable().map(|parameter| {
                let (low, high) = (*parameter.range().start(), *parameter.range().end());
                let low = if parameter.is_time_constant { 1.0 } else { low };
                (parameter.name(), [low, high])
            });
            evolvable.collect()
        } else {
            rate.to_vec()
        };
        for (parameter, bounds) in of_model {
            let selectors = match dice.below(3) {
                0 => vec!["all".to_owned()],
                1 => dice.some(&self.ensembles),
                _ => Vec::new(),
            };
            let named = selectors.into_iter().map(|s| (format!("neurons:{parameter}:{s}"), bounds));
            queries.extend(named);
        }
        if self.is_dynamic {
            let delays = dice.some(&[&self.ensembles[..], &self.encoded].concat());
            queries.extend(
                delays.into_iter().map(|name| (format!("synapses:delays:{name}"), [1.0, 9.0])),
            );
        }
        if !self.plastic.is_empty() {
            let groups = match dice.below(3) {
                0 => vec!["all".to_owned()],
                1 => dice.some(&self.plastic),
                _ => Vec::new(),
            };
            queries.extend(
                groups
                    .into_iter()
                    .map(|name| (format!("learning:coefficients:{name}"), [-1e6, 1e6])),
            );
        }
        if !self.linear.is_empty() {
            let stimuli = match dice.below(3) {
                0 => vec!["all".to_owned()],
                1 => dice.some(&self.linear),
                _ => Vec::new(),
            };
            let part = dice.pick(&["encoders", "encoding"]);
            queries.extend(
                stimuli.into_iter().map(|name| (format!("{part}:weights:{name}"), [-50.0, 50.0])),
            );
        }
        if !self.weighted.is_empty() {
            let outputs = match dice.below(3) {
                0 => vec!["all".to_owned()],
                1 => dice.some(&self.weighted),
                _ => Vec::new(),
            };
            let part = dice.pick(&["decoders", "decoding"]);
            queries.extend(
                outputs.into_iter().map(|name| (format!("{part}:weights:{name}"), [-2.0, 2.0])),
            );
        }
        if queries.is_empty() {
            let parameter = self.model.spec().evolvable().nth(1).unwrap();
            let bounds = [*parameter.range().start(), *parameter.range().end()];
            let bounds = if parameter.is_time_constant { [1.0, bounds[1]] } else { bounds };
            let bounds = if parameter.name() == "gain" { [-1.0, 1.0] } else { bounds };
            queries.push((format!("neurons:{}:all", parameter.name()), bounds));
        }
        queries
    }
}

/// Some of the parameters of receptors.
fn receptors(dice: &mut Dice) -> Value {
    let mut params = json!({});
    for name in ["AMPA", "GABA", dice.pick(&["NMDA", "NDMA"])] {
        let (gain, tau) = (dice.number(0.0, 1000.0), dice.number(2.0, 200.0));
        let reversal = if dice.chance(0.3) { json!(null) } else { dice.number(-200.0, 200.0) };
        let receptor = if name.starts_with('N') {
            let (rise, magnesium) = (dice.number(2.0, 50.0), dice.number(0.0, 1000.0));
            object(
                dice,
                [
                    ("gain", gain),
                    ("tau_rise", rise),
                    ("tau_decay", tau),
                    ("Mg2", magnesium),
                    ("E", reversal),
                ],
            )
        } else {
            object(dice, [("gain", gain), ("tau", tau), ("E", reversal)])
        };
        insert(&mut params, name, receptor);
    }
    params
}
