//! The answers to wrong files: every problem, its place, and the allowed values.

use super::{BASE, accept, edited, refuse};
use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;

/// [`BASE`] with several passages replaced.
fn edited_often(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(BASE.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
        text.replace(from, to)
    })
}

#[test]
fn one_mistake_has_one_answer() {
    for (from, to, expected) in MISTAKES {
        assert_eq!(refuse(&edited(from, to)), *expected, "{from} -> {to}");
    }
}

/// Edits of the base, each with the exact message that it gets.
#[rustfmt::skip]
const MISTAKES: &[(&str, &str, &str)] = &[
    // Semantics.
    (r#""name": "base","#, r#""name": "base", "semantics": "originals","#,
     "line 2: semantics: unknown name `originals`; did you mean `original`?"),
    (r#""neuron_model": "rate_model","#, r#""motor_tau": 0.04,"#,
     "line 9: topology.motor_tau: 0.04 s is below dt / 2: the network would be unstable"),
    (r#""controller": null"#, r#""controller": {"name": "light_rnd_pos_controller", "params": {"speed": 1, "step": 0.1}}"#,
     "line 63: world.objects.lamp.controller.params.step: `speed` states the same quantity"),
    // Shape.
    (r#""name": "base","#, r#""name": "base", "name": "other","#,
     "line 2: name: duplicate key"),
    (r#""generations": 10"#, r#""generation": 10"#,
     "line 34: algorithm: missing key `generations`\n\
      line 38: algorithm.generation: unknown key; did you mean `generations`?"),
    (r#""generations": 10"#, r#""generations": "10""#,
     "line 38: algorithm.generations: expected a whole number, found a string"),
    (r#""generations": 10"#, r#""generations": 10.5"#,
     "line 38: algorithm.generations: expected a whole number, found 10.5"),
    (r#""generations": 10"#, r#""generations": 0"#,
     "line 38: algorithm.generations: must be between 1 and 10000000, is 0"),
    (r#""generations": 10"#, r#""generations": -3"#,
     "line 38: algorithm.generations: must be between 1 and 10000000, is -3"),
    (r#""evaluation_steps": 200,"#, r#""evaluation_steps": 200000,"#,
     "line 39: algorithm.evaluation_steps: must be between 1 and 100000, is 200000"),
    (r#""H": {"n": 4}"#, r#""H": {}"#,
     "line 11: topology.ensembles.H: missing key `n`"),
    (r#""H": {"n": 4}"#, r#""H": 4"#,
     "line 11: topology.ensembles.H: expected an object, found a number"),
    (r#""H": {"n": 4}"#, r#""": {"n": 4}"#,
     "line 11: topology.ensembles.: a name must not be empty\n\
      line 24: topology.synapses.in.post: no ensemble is named `H`; known: ``, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`\n\
      line 25: topology.synapses.out.pre: no ensemble or stimulus is named `H`; known: ``, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`, `MSG`, `LIGHT`\n\
      line 45: algorithm.populations.neurons.objects[1]: no ensemble is named `H`; known: ``, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`"),
    (r#"{"objects": ["synapses:weights:all"], "max_vals": 3"#, r#"{"objects": "synapses:weights:all", "max_vals": 3"#,
     "line 43: algorithm.populations.weights.objects: expected a list, found a string"),
    (r#""encoding": {"MSG": {"scheme": "IdentityEncoding"}},"#, r#""stimulus": {}, "encoding": {"MSG": {"scheme": "IdentityEncoding"}},"#,
     "line 8: topology.stimulus: unknown key; did you mean `stimuli`?"),
    (r#""p": 0.5"#, r#""p": 1.5"#,
     "line 25: topology.synapses.out.p: must be between 0 and 1, is 1.5"),
    (r#""p": 0.5"#, r#""p": true"#,
     "line 25: topology.synapses.out.p: expected a number, found true or false"),
    (r#""values": [[500, 500]]"#, r#""values": [[500]]"#,
     "line 64: world.objects.lamp.initializers.positions.params.values[0]: expected a list of 2 elements, found 1"),
    (r#""values": [[500, 500]]"#, r#""values": []"#,
     "line 64: world.objects.lamp.initializers.positions.params.values: expected a list of 1 to 10000 elements, found 0"),
    (r#""name": "random_graph""#, r#""name": "random_graph", "params": {"max_rad": 0}"#,
     "line 57: world.objects.bots.initializers.positions.params.max_rad: must be positive and at most 1000000000, is 0"),
    (r#""name": "random_graph""#, r#""name": "random_uniform", "params": {"size": 1}"#,
     "line 57: world.objects.bots.initializers.positions.params.size: must be 2, is 1"),
    (r#""name": "random_graph""#, r#""name": "random_uniform", "params": {"low": 9, "high": 3}"#,
     "line 57: world.objects.bots.initializers.positions.params.high: 3 is below `low` 9"),
    // Names.
    (r#""name": "GA""#, r#""name": "GAA""#,
     "line 35: algorithm.name: unknown name `GAA`; did you mean `GA`?"),
    (r#""name": "GA""#, r#""name": "sness""#,
     "line 35: algorithm.name: unknown name `sness`; did you mean `SNES`?"),
    (r#""fitness_function": "goto_light""#, r#""fitness_function": "go_to_light""#,
     "line 41: algorithm.fitness_function: unknown name `go_to_light`; did you mean `goto_light`?"),
    (r#""sensor": "light_sensor""#, r#""sensor": "lightsensor""#,
     "line 6: topology.stimuli.LIGHT.sensor: unknown name `lightsensor`; did you mean `light_sensor`?"),
    (r#""activation": "tanh""#, r#""activation": "relu""#,
     "line 15: topology.ensembles.OUT_WHEELS.activation: unknown name `relu`; known: `sigmoid`, `tanh`"),
    (r#""activation": "tanh""#, r#""activation": "tanh", "params": {"activation": "sigmoid"}"#,
     "line 15: topology.ensembles.OUT_WHEELS.activation: `params` has another activation"),
    (r#""pre": ["MSG", "LIGHT"]"#, r#""pre": ["MSG", "LIHGT"]"#,
     "line 24: topology.synapses.in.pre[1]: no ensemble or stimulus is named `LIHGT`; did you mean `LIGHT`?"),
    (r#""pre": ["MSG", "LIGHT"]"#, r#""pre": ["MSG", "MSG"]"#,
     "line 24: topology.synapses.in.pre[1]: names `MSG` twice"),
    (r#""post": "H""#, r#""post": "MSG""#,
     "line 24: topology.synapses.in.post: no ensemble is named `MSG`; known: `H`, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`"),
    (r#""ensemble": "OUT_LED""#, r#""ensemble": "OUT_LEDS""#,
     "line 19: topology.outputs.led.ensemble: no ensemble is named `OUT_LEDS`; did you mean `OUT_LED`?"),
    (r#""encoding": {"MSG""#, r#""encoding": {"MSGS""#,
     "line 8: topology.encoding.MSGS: no stimulus has this name; did you mean `MSG`?"),
    (r#""wheels": {"scheme""#, r#""wheel": {"scheme""#,
     "line 27: topology.decoding: missing key `wheels`: every output needs a decoding\n\
      line 31: topology.decoding.wheel: no output has this name; did you mean `wheels`?"),
    (r#""evolvable_object": "bots""#, r#""evolvable_object": "robots""#,
     "line 36: algorithm.evolvable_object: no object is named `robots`; did you mean `bots`?"),
    (r#""evolvable_object": "bots""#, r#""evolvable_object": "lamp""#,
     "line 36: algorithm.evolvable_object: `lamp` is not a robot"),
    (r#""initializers": {"positions": {"name": "random_graph"}},"#, r#""initializers": {"positions": {"name": "random_graph"}}, "params": {"trainable": false},"#,
     "line 36: algorithm.evolvable_object: `bots` is not `trainable`"),
    (r#""LIGHT": {"n": 6"#, r#""H": {"n": 6"#,
     "line 11: topology.ensembles.H: a stimulus has the same name\n\
      line 24: topology.synapses.in.pre[1]: no ensemble or stimulus is named `LIGHT`; known: `H`, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`, `MSG`, `H`"),
    // Features that only SpikeSwarmSim has.
    (r#""neuron_model": "rate_model""#, r#""neuron_model": "rate_model", "synapse_model": "dynamic_synapse""#,
     "line 9: topology.synapse_model: dynamic synapses need spiking neurons"),
    (r#"{"scheme": "IdentityEncoding"}"#, r#"{"scheme": "PoissonRateCoding"}"#,
     "line 8: topology.encoding.MSG.scheme: encodes into spikes, which `rate_model` neurons do not take; they take `IdentityEncoding`"),
    (r#"{"scheme": "IdentityEncoding"}"#, r#"{"scheme": "PoissonCoding"}"#,
     "line 8: topology.encoding.MSG.scheme: unknown name `PoissonCoding`; did you mean `PoissonRateCoding`?"),
    (r#"{"scheme": "ThresholdDecoding"}"#, r#"{"scheme": "ArgmaxDecoding", "params": {"num_outputs": 3}}"#,
     "line 30: topology.decoding.mode.scheme: not supported: `ArgmaxDecoding`; known: `IdentityDecoding`, `ThresholdDecoding`, `SoftmaxDecoding`, `FirstToSpike`, `RankOrderDecoding`, `LinearPopulationDecoding`"),
    (r#""sensors": {"wireless_receiver": {}, "#, r#""sensors": {"wireless_receiver": {}, "neighbors_state_sensor": {}, "#,
     "line 55: world.objects.bots.sensors.neighbors_state_sensor: not supported"),
    (r#""sensor": "light_sensor""#, r#""sensor": "wireless_receiver:n_hops""#,
     "line 6: topology.stimuli.LIGHT.sensor: not supported: `wireless_receiver:n_hops`; known: `wireless_receiver:msg`, `wireless_receiver:signal`, `wireless_receiver:receiving_direction`, `wireless_receiver:sending_direction`, `wireless_receiver:state`, `light_sensor`, `distance_sensor`, `ground_sensor`, `food_area_sensor`, `nest_sensor`, `food_sensor`, `own_position_sensor`, `own_orientation_sensor`, `neighborhood_pos_sensor`, `script_sensor`, `proximity_sensor`, ..."),
    (r#""neurons:tau:H""#, r#""encoders:weights:all""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers nothing that can evolve"),
    (r#""neurons:tau:H""#, r#""encoders:weights:LIGTH""#,
     "line 45: algorithm.populations.neurons.objects[1]: no stimulus is named `LIGTH`; did you mean `LIGHT`?"),
    (r#""neurons:tau:H""#, r#""learning:coefficients:in""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers nothing that can evolve"),
    (r#""neurons:tau:H""#, r#""learning:coefficients:inn""#,
     "line 45: algorithm.populations.neurons.objects[1]: no synapse group is named `inn`; did you mean `in`?"),
    // Plasticity.
    (r#""neuron_model": "rate_model""#, r#""neuron_model": "rate_model", "learning": {"synapses": ["in", "aut", "in"]}"#,
     "line 9: topology.learning.synapses[1]: no synapse group is named `aut`; known: `in`, `out`\n\
      line 9: topology.learning.synapses[2]: names `in` twice"),
    (r#""neuron_model": "rate_model""#, r#""neuron_model": "rate_model", "learning": {"A": 2e6, "learning_rate": 2, "reward": {"delay": 0}, "E": 1}"#,
     "line 9: topology.learning.A: must be between -1000000 and 1000000, is 2e6\n\
      line 9: topology.learning.learning_rate: must be between 0 and 1, is 2\n\
      line 9: topology.learning.reward.delay: must be between 1 and 1000, is 0\n\
      line 9: topology.learning.E: unknown key; known: `learning_rate`, `max_weight`, `A`, `B`, `C`, `D`, `synapses`, `reward`"),
    // Spiking neurons.
    (r#"{"scheme": "ThresholdDecoding"}"#, r#"{"scheme": "FirstToSpike"}"#,
     "line 30: topology.decoding.mode: decodes spikes, which `rate_model` neurons do not have"),
    (r#""neurons:tau:H""#, r#""decoders:weights:all""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers nothing that can evolve"),
    (r#""neurons:tau:H""#, r#""decoding:weights:modes""#,
     "line 45: algorithm.populations.neurons.objects[1]: no output is named `modes`; did you mean `mode`?"),
    (r#""controller": null"#, r#""controller": "light_pray_controller""#,
     "line 63: world.objects.lamp.controller: unknown name `light_pray_controller`; did you mean `light_prey_controller`?"),
    (r#""controller": null"#, r#""controller": "script_controller""#,
     "line 63: world.objects.lamp.controller: needs a `task` whose `script` has a function `move`"),
    (r#""fitness_function": "goto_light""#, r#""fitness_function": "goto_light", "fitness_params": {"alpha": 9}"#,
     "line 41: algorithm.fitness_params.alpha: `goto_light` has no such constant"),
    (r#""type": "light_source""#, r#""type": "cloud""#,
     "line 61: world.objects.lamp.type: unknown name `cloud`; known: `robot`, `light_source`, `ground_area`, `food_area`, `nest`, `wall`, `obstacle`, `movable`"),
    (r#""wheel_actuator": {}}"#, r#""wheel_actuator": {"min_thresh": 0.1}}"#,
     "line 56: world.objects.bots.actuators.wheel_actuator.min_thresh: must be 0, is 0.1"),
    // Sizes.
    (r#""LIGHT": {"n": 6"#, r#""LIGHT": {"n": 4"#,
     "line 6: topology.stimuli.LIGHT.n: is 4, but the reading of robot `bots` has length 6"),
    (r#""OUT_MSG": {"n": 2}"#, r#""OUT_MSG": {"n": 3}"#,
     "line 12: topology.ensembles.OUT_MSG.n: is 3, but messages of robot `bots` have `msg_length` 2"),
    (r#""OUT_MODE": {"n": 1}"#, r#""OUT_MODE": {"n": 2}"#,
     "line 30: topology.decoding.mode: the actuator needs 1 neuron, the ensemble has 2"),
    (r#""OUT_WHEELS": {"n": 2"#, r#""OUT_WHEELS": {"n": 3"#,
     "line 31: topology.decoding.wheels: the actuator needs 1 or 2 neurons, the ensemble has 3"),
    (r#"{"scheme": "ThresholdDecoding", "params": {"stochastic": true}}"#, r#"{"scheme": "SoftmaxDecoding"}"#,
     "line 29: topology.decoding.led: the actuator needs one neuron per colour, 2 or more, the ensemble has 1"),
    (r#"{"scheme": "ThresholdDecoding", "params": {"stochastic": true}}"#, r#"{"scheme": "IdentityDecoding"}"#,
     "line 29: topology.decoding.led: an LED needs `ThresholdDecoding` or `SoftmaxDecoding`"),
    (r#""wireless_transmitter": {},"#, r#""wireless_transmitter": {"msg_length": 3},"#,
     "line 12: topology.ensembles.OUT_MSG.n: is 2, but messages of robot `bots` have `msg_length` 3\n\
      line 56: world.objects.bots.actuators.wireless_transmitter.msg_length: is 3, but 2 at world.objects.bots.sensors.wireless_receiver.msg_length"),
    (r#""wireless_transmitter": {},"#, r#""wireless_transmitter": {"n_symbols": 2},"#,
     "line 56: world.objects.bots.actuators.wireless_transmitter.n_symbols: 2 symbols leave only one level for each of 2 components"),
    (r#""sensors": {"wireless_receiver": {}, "light_sensor": {}}"#, r#""sensors": {"wireless_receiver": {}}"#,
     "line 6: topology.stimuli.LIGHT.sensor: robot `bots` has no such sensor\n\
      line 58: world.objects.bots.perturbations.stimuli_inhibition: the robot has no such sensor"),
    (r#""led_actuator": {}, "#, r#""#,
     "line 19: topology.outputs.led.actuator: robot `bots` has no such actuator"),
    (r#""actuator": "led_actuator""#, r#""actuator": "wheel_actuator""#,
     "line 21: topology.outputs.wheels.actuator: output `led` drives the same actuator"),
    (r#""affected_robots": 2"#, r#""affected_robots": 5"#,
     "line 58: world.objects.bots.perturbations.stimuli_inhibition.affected_robots: is 5, but there are 4 robots"),
    (r#"{"stimuli_inhibition": {"affected_robots": 2}}"#, r#"{"stimuli_inhibition": {"stimuli": "distance_sensor"}}"#,
     "line 58: world.objects.bots.perturbations.stimuli_inhibition.stimuli: the robot has no such sensor"),
    (r#"{"affected_robots": 2}"#, r#"{"affected_robots": "every"}"#,
     "line 58: world.objects.bots.perturbations.stimuli_inhibition.affected_robots: unknown name `every`; known: `all`"),
    (r#""controller": "neural_controller""#, r#""controller": null"#,
     "line 54: world.objects.bots.controller: expected a string, found null"),
    // The genotype.
    (r#""max_vals": [1.5, 0.75]"#, r#""max_vals": [1.5, 0.75, 3]"#,
     "line 46: algorithm.populations.neurons.max_vals: expected a list of 2 elements, found 3"),
    (r#""max_vals": 3"#, r#""max_vals": -3"#,
     "line 43: algorithm.populations.weights.max_vals: the maximum -3 of `synapses:weights:all` is not above its minimum -3"),
    (r#""min_vals": [-1.5, -1]"#, r#""min_vals": [-1.5, -2]"#,
     "line 46: algorithm.populations.neurons.min_vals[1]: tau = 2 * 10^-2 s is below dt / 2: the network would be unstable"),
    (r#""neurons:tau:H""#, r#""neurons:tau:HH""#,
     "line 45: algorithm.populations.neurons.objects[1]: no ensemble is named `HH`; did you mean `H`?"),
    (r#""neurons:tau:H""#, r#""neurons:tau""#,
     "line 45: algorithm.populations.neurons.objects[1]: expected `synapses:weights:NAME`, `synapses:delays:NAME`, `encoders:weights:NAME`, `decoders:weights:NAME`, `learning:coefficients:NAME` or `neurons:PARAMETER:NAME`, with a parameter of the neuron model"),
    (r#""neurons:tau:H""#, r#""neurons:bias:H""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers the bias of ensemble `H` a second time, after `neurons:bias:all` of population `neurons`"),
    (r#""neurons:tau:H""#, r#""synapses:weights:in""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers the weights of group `in` from `MSG` a second time, after `synapses:weights:all` of population `weights`"),
    (r#""neurons:tau:H""#, r#""synapses:weights:motor""#,
     "line 45: algorithm.populations.neurons.objects[1]: covers nothing that can evolve"),
    (r#""post": ["OUT_MSG", "OUT_LED", "OUT_MODE", "OUT_WHEELS"]"#, r#""post": ["OUT_MSG", "H"]}, "out2": {"pre": ["H", "MSG"], "post": ["H", "OUT_LED"]"#,
     "line 25: topology.synapses.out2: connects `H` to `H`, as group `out` does"),
    (r#""num_elite": 2"#, r#""num_elite": 20"#,
     "line 45: algorithm.populations.neurons: `num_elite` 20 leaves no room in a population of 20"),
    (r#""num_elite": 2"#, r#""num_elite": 2, "params": {"num_elite": 2}"#,
     "line 46: algorithm.populations.neurons.num_elite: `params` has the same key"),
    // Limits.
    (r#""population_size": 20"#, r#""population_size": 200000"#,
     "line 37: algorithm.population_size: must be between 1 and 100000, is 200000"),
    (r#""num_instances": 4"#, r#""num_instances": 100000"#,
     "line 53: world.objects.bots.num_instances: must be between 1 and 10000, is 100000"),
    (r#""H": {"n": 4}"#, r#""H": {"n": 9999}"#,
     "line 10: topology.ensembles: 10005 neurons are more than the limit of 10000"),
    (r#""wireless_transmitter": {},"#, r#""wireless_transmitter": {"n_symbols": 4096, "msg_length": 9},"#,
     "line 12: topology.ensembles.OUT_MSG.n: is 2, but messages of robot `bots` have `msg_length` 9\n\
      line 56: world.objects.bots.actuators.wireless_transmitter.n_symbols: 3^9 lattice points are more than the limit of 4096\n\
      line 56: world.objects.bots.actuators.wireless_transmitter.msg_length: is 9, but 2 at world.objects.bots.sensors.wireless_receiver.msg_length"),
];

#[test]
fn a_query_with_two_meanings_is_ambiguous() {
    let text = edited_often(&[
        (r#""out": {"pre": "H""#, r#""H": {"pre": "H""#),
        (r#""synapses:weights:all""#, r#""synapses:weights:H""#),
    ]);
    assert_eq!(
        refuse(&text),
        "line 43: algorithm.populations.weights.objects[0]: ambiguous: `H` is a synapse group, and \
         an ensemble or stimulus"
    );
}

#[test]
fn a_file_without_a_name_needs_a_valid_default() {
    let text = edited(r#""name": "base","#, "");
    let error = ExperimentConfig::from_json(&text, "", ALGORITHMS).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 1: `name` is missing, and the default name is invalid: a name must not be empty"
    );
}

#[test]
fn a_query_of_a_fixed_group_covers_nothing() {
    let text = edited_often(&[
        (r#""trainable": true, "p": 1"#, r#""trainable": false"#),
        (r#""synapses:weights:all""#, r#""synapses:weights:in""#),
    ]);
    assert_eq!(
        refuse(&text),
        "line 43: algorithm.populations.weights.objects[0]: covers nothing that can evolve"
    );
}

#[test]
fn fitness_functions_need_the_objects_that_they_measure() {
    let task = r#""fitness_function": "goto_light""#;
    let light = r#""type": "light_source",
        "num_instances": 1,
        "controller": null,"#;
    let area = r#""type": "ground_area", "num_instances": 1,"#;
    let led = r#"      "led": {"ensemble": "OUT_LED", "actuator": "led_actuator", "enc": "cat"},
"#;
    let led_decoding = r#"      "led": {"scheme": "ThresholdDecoding", "params": {"stochastic": true}},
"#;
    let wheels = r#",
      "wheels": {"ensemble": "OUT_WHEELS", "actuator": "wheel_actuator"}"#;
    let wheels_decoding = r#",
      "wheels": {"scheme": "IdentityDecoding"}"#;
    let steps = (r#""evaluation_steps": 200"#, r#""evaluation_steps": 100"#);
    for (function, [first, second], expected) in [
        ("goto_light", [(light, area), ("", "")], "needs a `light_source` in the world"),
        ("identify_leader", [(led, ""), (led_decoding, "")], "needs an output to `led_actuator`"),
        (
            "identify_borderline",
            [(led, ""), (led_decoding, "")],
            "needs an output to `led_actuator`",
        ),
        ("alignment", [(wheels, ""), (wheels_decoding, "")], "needs an output to `wheel_actuator`"),
        (
            "orientation_consensus",
            [(wheels, ""), (wheels_decoding, "")],
            "needs an output to `wheel_actuator`",
        ),
        ("alignment", [steps, ("", "")], "is 100, but `alignment` counts from step 100 on"),
    ] {
        let task_edit = format!(r#""fitness_function": "{function}""#);
        let edits = [(task, task_edit.as_str()), first, second];
        let edits: Vec<_> = edits.into_iter().filter(|(from, _)| !from.is_empty()).collect();
        let problems = refuse(&edited_often(&edits));
        assert!(problems.ends_with(expected) && problems.lines().count() == 1, "{problems}");
    }
}

#[test]
fn all_robots_share_one_length_of_messages() {
    let listener = r#"{"type": "robot", "num_instances": 1, "controller": "Braitenberg2",
        "sensors": {"light_sensor": {}, "wireless_receiver": {"msg_length": 3}},
        "initializers": {"positions": {"name": "random_uniform"}}}"#;
    assert_eq!(
        refuse(&edited(r#""lamp": {"#, &format!(r#""listener": {listener}, "lamp": {{"#))),
        "line 60: world.objects.listener.controller: needs a `wheel_actuator`\n\
         line 61: world.objects.listener.sensors.wireless_receiver.msg_length: is 3, but 2 at \
         world.objects.bots.sensors.wireless_receiver.msg_length"
    );
}

#[test]
fn costs_are_limited_in_sum() {
    let many_robots = (r#""num_instances": 4"#, r#""num_instances": 5000"#);
    let long_trials = (r#""evaluation_steps": 200"#, r#""evaluation_steps": 100000"#);
    let many_neurons = (r#""H": {"n": 4}"#, r#""H": {"n": 9000}"#);
    let full_matrix = (r#""name": "GA""#, r#""name": "xNES""#);
    let large_population = (r#""population_size": 20"#, r#""population_size": 100000"#);
    let many_trials = (r#""num_evaluations": 2"#, r#""num_evaluations": 1000"#);
    for (edits, expected) in [
        (&[many_robots, long_trials][..], "500000000 steps of all robots per trial"),
        (&[many_robots, many_neurons], "45070000 inputs and neurons of all robots"),
        (&[many_neurons, long_trials], "operations per episode"),
        (&[many_neurons, full_matrix], "possible genes for an algorithm with a full matrix"),
        (&[many_neurons, large_population], "possible genes per generation"),
        (&[many_trials, large_population], "100000000 trials per generation"),
    ] {
        let problems = refuse(&edited_often(edits));
        assert!(problems.contains(expected), "{problems}");
    }
}

/// Replaces one passage of the shipped leader selection with LIF neurons.
#[test]
fn mistakes_of_spiking_networks_have_answers() {
    let (_, base) = super::shipped::spiking()
        .into_iter()
        .find(|(name, _)| name.contains("r_selection_lif"))
        .unwrap();
    for (from, to, expected) in SPIKING_MISTAKES {
        assert_eq!(base.matches(from).count(), 1, "{from:?} must occur once");
        assert_eq!(refuse(&base.replace(from, to)), *expected, "{from} -> {to}");
    }
}

#[rustfmt::skip]
const SPIKING_MISTAKES: &[(&str, &str, &str)] = &[
    (r#""dt": 1,"#, r#""dt": 2.5,"#,
     "line 5: topology.dt: must be between 0.001 and 2, is 2.5"),
    (r#""synapse_model": "static_synapse""#, r#""synapse_model": "dynamic_synapse", "synapse_params": {"AMPA": {"tau": 0.5}}"#,
     "line 19: topology.synapse_params.AMPA.tau: 0.5 ms is below dt: the receptors would overshoot"),
    (r#""synapse_model": "static_synapse""#, r#""synapse_model": "dynamic_synapse", "synapse_params": {"NDMA": {"gain": -1}}"#,
     "line 19: topology.synapse_params.NDMA.gain: must be between 0 and 1000, is -1"),
    (r#""neurons:v_rest:all""#, r#""synapses:delays:all""#,
     "line 65: algorithm.populations.p1.objects[3]: covers nothing that can evolve\n\
      line 66: algorithm.populations.p1.max_vals[3]: delays are from 1 to 9 substeps, not -45\n\
      line 67: algorithm.populations.p1.min_vals[3]: delays are from 1 to 9 substeps, not -65"),
    (r#""dt": 1,"#, r#""dt": 1, "motor_tau": 0.5,"#,
     "line 5: topology.motor_tau: only rate neurons have this key; these neurons spike"),
    (r#""H1": {"n": 10}"#, r#""H1": {"n": 10, "activation": "tanh"}"#,
     "line 21: topology.ensembles.H1.activation: unknown key; known: `n`, `params`"),
    (r#""H1": {"n": 10}"#, r#""H1": {"n": 10, "params": {"time_refrac": 2.5}}"#,
     "line 21: topology.ensembles.H1.params.time_refrac: expected a whole number, found 2.5"),
    (r#""H1": {"n": 10}"#, r#""H1": {"n": 10, "params": {"tau": -20}}"#,
     "line 21: topology.ensembles.H1.params.tau: must be between 0.01 and 10000, is -20"),
    (r#""min_vals": [-60, -150, -150, -65, 5, -2]"#, r#""min_vals": [-60, -150, -150, -65, 0.4, -2]"#,
     "line 67: algorithm.populations.p1.min_vals[4]: tau = 0.4 ms is below dt / 2: the network would be unstable"),
    (r#"{"scheme": "FirstToSpike"}"#, r#"{"scheme": "ThresholdDecoding"}"#,
     "line 52: topology.decoding.outC: decodes activities, which `lif` neurons do not have"),
    (r#"{"scheme": "FirstToSpike"}"#, r#"{"scheme": "RankOrderDecoding", "params": {"num_outputs": 2}}"#,
     "line 52: topology.decoding.outC: the actuator needs 1 output, not 2"),
    (r#""outA": {"scheme": "LinearPopulationDecoding", "params": {"num_outputs": 2}}"#,
     r#""outA": {"scheme": "LinearPopulationDecoding"}"#,
     "line 50: topology.decoding.outA: has 1 outputs, but messages of robot `robotA` have `msg_length` 2"),
    (r#""outA": {"scheme": "LinearPopulationDecoding", "params": {"num_outputs": 2}}"#,
     r#""outA": {"scheme": "FirstToSpike"}"#,
     "line 50: topology.decoding.outA: the actuator takes numbers, `FirstToSpike` yields a category"),
    (r#""neurons:v_rest:all""#, r#""neurons:V_rest:all""#,
     "line 65: algorithm.populations.p1.objects[3]: covers nothing that can evolve"),
    (r#""decoders:weights:all""#, r#""decoders:weights:outC""#,
     "line 65: algorithm.populations.p1.objects[5]: covers nothing that can evolve"),
];

/// No problem hides another, and consequences of a problem are not reported.
#[test]
fn everything_wrong_is_reported_at_once() {
    let text = edited_often(&[
        (r#""neuron_model": "rate_model""#, r#""neuron_model": "hodgkin_huxley", "dt": 0"#),
        (r#""LIGHT": {"n": 6"#, r#""LIGHT": {"n": "six""#),
        (r#""H": {"n": 4}"#, r#""H": {"n": 4, "tau": 1}"#),
        (r#""pre": ["MSG", "LIGHT"]"#, r#""pre": ["MSG", "DARK"]"#),
        (r#"{"ensemble": "OUT_LED", "#, "{"),
        (r#""name": "GA""#, r#""name": "Genetic""#),
        (r#""generations": 10,"#, ""),
        (r#""max_vals": 3"#, r#""max_vals": 1e999"#),
        (r#""num_elite": 2"#, r#""eta_mu": 2"#),
        (r#""neurons:tau:H""#, r#""neurons:tau:I""#),
        (r#""num_instances": 4"#, r#""num_instances": 0"#),
        (r#""affected_robots": 2"#, r#""affected_robots": 2.5"#),
        (r#""values": [[500, 500]]"#, r#""values": [[500, 500, 0]]"#),
    ]);
    let problems = refuse(&text);
    assert_eq!(problems.lines().collect::<Vec<_>>(), EVERYTHING);
}

#[rustfmt::skip]
const EVERYTHING: &[&str] = &[
    "line 6: topology.stimuli.LIGHT.n: expected a whole number, found a string",
    "line 9: topology.neuron_model: unknown name `hodgkin_huxley`; known: `rate_model`, `ctrnn`, `lif`, `exp_lif`, `adex`, `izhikevich`, `morris_lecar`",
    "line 9: topology.dt: must be positive and at most 1000000000, is 0",
    "line 11: topology.ensembles.H.tau: unknown key; known: `n`, `activation`, `params`",
    "line 19: topology.outputs.led: missing key `ensemble`",
    "line 24: topology.synapses.in.pre[1]: no ensemble or stimulus is named `DARK`; known: `H`, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`, `MSG`, `LIGHT`",
    "line 34: algorithm: missing key `generations`",
    "line 35: algorithm.name: unknown name `Genetic`; known: `GA`, `SNES`, `xNES`, `CMA-ES`, `sep-CMA-ES`, `openaiES`, `PGPE`, `MAP-Elites`, `DNS`, `novelty`, `CMA-MAE`, `sep-CMA-MAE`, `NSGA-II`",
    "line 43: algorithm.populations.weights.max_vals: must be between -1000000000 and 1000000000, is 1e999",
    "line 45: algorithm.populations.neurons.objects[1]: no ensemble is named `I`; known: `H`, `OUT_MSG`, `OUT_LED`, `OUT_MODE`, `OUT_WHEELS`",
    "line 53: world.objects.bots.num_instances: must be between 1 and 10000, is 0",
    "line 58: world.objects.bots.perturbations.stimuli_inhibition.affected_robots: expected a whole number, found 2.5",
    "line 64: world.objects.lamp.initializers.positions.params.values[0]: expected a list of 2 elements, found 3",
];

/// The light follower with LIF neurons, its light encoded.
fn encoded(entry: &str) -> String {
    let text = include_str!("../../../../configs/spiking/light_follower_lif.json");
    let identity = r#""I5": {"scheme": "IdentityEncoding"}"#;
    assert!(text.contains(identity));
    text.replace(identity, &format!(r#""I5": {entry}"#))
}

#[test]
fn mistakes_of_encoders_have_answers() {
    for (entry, expected) in [
        (
            r#"{"scheme": "LIF_Encoding"}"#,
            "encoding.I5: no node would ever spike: 1 is its largest current, and a LIF neuron \
             needs more than 15",
        ),
        (
            r#"{"scheme": "PoissonRateCoding", "receptive_field": {"params": {"max_val": 20000, "sigma": -1}}}"#,
            "encoding.I5.receptive_field.params.max_val: a rate must be between 0 and 10000, is \
             20000\nencoding.I5.receptive_field.params.sigma: must be between 0 and 1000000, is -1",
        ),
        (
            r#"{"scheme": "RankOrderCoding", "receptive_field": {"params": {"n_neurons": 4}}}"#,
            "encoding.I5: 24 nodes cannot be ranked in 20 substeps",
        ),
        (
            r#"{"scheme": "RankOrderCoding", "receptive_field": {"params": {"min_val": 0}}}"#,
            "encoding.I5.receptive_field.params.min_val: a substep must be between 1 and 20, is 0",
        ),
        (
            r#"{"scheme": "PoissonRateCoding", "receptive_field": {"name": "conic_receptive_field", "params": {"n_neurons": 2, "min_stim": 1, "min_val": 9, "max_val": 3}}}"#,
            "encoding.I5.receptive_field.params: 1 is not above `min_stim` 1: all nodes would be \
             the same\nencoding.I5.receptive_field.params.max_val: 3 is below `min_val` 9; \
             `inverted` turns a field around",
        ),
        (
            r#"{"scheme": "PoissonRateCoding", "receptive_field": {"name": "identity_receptive_field", "params": {"n_neurons": 2}}}"#,
            "encoding.I5.receptive_field.params.n_neurons: unknown key; none is allowed here",
        ),
        (
            r#"{"scheme": "PoissonRateCoding", "receptive_field": {"name": "cubic"}}"#,
            "encoding.I5.receptive_field.name: unknown name `cubic`; known: \
             `identity_receptive_field`, `gaussian_receptive_field`, `triangular_receptive_field`, \
             `conic_receptive_field`, `parabolic_receptive_field`, `linear_receptive_field`",
        ),
    ] {
        let expected: Vec<String> =
            expected.lines().map(|line| format!("line 20: topology.{line}")).collect();
        assert_eq!(refuse(&encoded(entry)), expected.join("\n"), "{entry}");
    }
    let right = r#"{"scheme": "LIF_Encoding", "receptive_field": {"params": {"n_neurons": 3, "max_val": 40}}}"#;
    let config = accept(&encoded(right));
    assert_eq!(config.topology.n_sources("I5"), 18);
}
