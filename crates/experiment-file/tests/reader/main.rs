//! The reader of experiment files, from outside.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod aims;
mod bodies;
mod descriptors;
mod generated;
mod generator;
mod hostile;
mod original;
mod parameters;
mod platforms;
mod problems;
mod realities;
mod reference;
mod schema;
mod sensors;
mod shipped;
mod units;
mod validator;
mod values;

use evolution::ALGORITHMS;
use experiment_file::{AlgorithmDescription, ConfigError, ExperimentConfig, Params, Problem};

/// A small experiment that uses a bit of everything; lines count from 1.
const BASE: &str = r#"{
  "name": "base",
  "topology": {
    "stimuli": {
      "MSG": {"n": 2, "sensor": "wireless_receiver:msg"},
      "LIGHT": {"n": 6, "sensor": "light_sensor"}
    },
    "encoding": {"MSG": {"scheme": "IdentityEncoding"}},
    "neuron_model": "rate_model",
    "ensembles": {
      "H": {"n": 4},
      "OUT_MSG": {"n": 2},
      "OUT_LED": {"n": 1},
      "OUT_MODE": {"n": 1},
      "OUT_WHEELS": {"n": 2, "activation": "tanh"}
    },
    "outputs": {
      "msg": {"ensemble": "OUT_MSG", "actuator": "wireless_transmitter", "enc": "real"},
      "led": {"ensemble": "OUT_LED", "actuator": "led_actuator", "enc": "cat"},
      "mode": {"ensemble": "OUT_MODE", "actuator": "wireless_transmitter:state"},
      "wheels": {"ensemble": "OUT_WHEELS", "actuator": "wheel_actuator"}
    },
    "synapses": {
      "in": {"pre": ["MSG", "LIGHT"], "post": "H", "trainable": true, "p": 1},
      "out": {"pre": "H", "post": ["OUT_MSG", "OUT_LED", "OUT_MODE", "OUT_WHEELS"], "p": 0.5}
    },
    "decoding": {
      "msg": {"scheme": "IdentityDecoding", "params": {"is_cat": false}},
      "led": {"scheme": "ThresholdDecoding", "params": {"stochastic": true}},
      "mode": {"scheme": "ThresholdDecoding"},
      "wheels": {"scheme": "IdentityDecoding"}
    }
  },
  "algorithm": {
    "name": "GA",
    "evolvable_object": "bots",
    "population_size": 20,
    "generations": 10,
    "evaluation_steps": 200,
    "num_evaluations": 2,
    "fitness_function": "goto_light",
    "populations": {
      "weights": {"objects": ["synapses:weights:all"], "max_vals": 3, "min_vals": -3,
        "params": {"encoding": "real"}},
      "neurons": {"objects": ["neurons:bias:all", "neurons:tau:H"],
        "max_vals": [1.5, 0.75], "min_vals": [-1.5, -1], "num_elite": 2}
    }
  },
  "world": {
    "objects": {
      "bots": {
        "type": "robot",
        "num_instances": 4,
        "controller": "neural_controller",
        "sensors": {"wireless_receiver": {}, "light_sensor": {}},
        "actuators": {"wireless_transmitter": {}, "led_actuator": {}, "wheel_actuator": {}},
        "initializers": {"positions": {"name": "random_graph"}},
        "perturbations": {"stimuli_inhibition": {"affected_robots": 2}}
      },
      "lamp": {
        "type": "light_source",
        "num_instances": 1,
        "controller": null,
        "initializers": {"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}}
      }
    }
  }
}
"#;

/// [`BASE`] with one passage replaced.
fn edited(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "{from:?} must occur once");
    BASE.replace(from, to)
}

fn read(text: &str) -> Result<(ExperimentConfig, Vec<Problem>), ConfigError> {
    ExperimentConfig::from_json(text, "default", ALGORITHMS)
}

/// The configuration of a text that must be valid. It may have warnings only about unused inputs
/// or about units.
fn accept(text: &str) -> ExperimentConfig {
    match read(text) {
        Ok((config, mut warnings)) => {
            warnings.retain(|warning| !warning.path.starts_with("topology.stimuli"));
            warnings.retain(|warning| !warning.message.ends_with('?'));
            assert_eq!(warnings, [], "{text}");
            config
        }
        Err(error) => panic!("{error}\nin\n{text}"),
    }
}

/// The problems of a text that must be refused, as people see them.
fn refuse(text: &str) -> String {
    match read(text) {
        Ok(_) => panic!("accepted\n{text}"),
        Err(error) => error.to_string(),
    }
}

/// The parameters of an algorithm as the reader fills them in.
fn defaults(algorithm: &str) -> Params {
    let description = AlgorithmDescription::find(ALGORITHMS, algorithm).unwrap();
    let mut params = Params::default();
    for parameter in description.parameters {
        if let Some(value) = parameter.default.value() {
            params.set(parameter.key, value);
        }
    }
    params
}
