//! `controller.h`: stimuli and actions by name, with what sensors and actuators must do.

use std::fmt::Write as _;

use experiment_file::{ActuatorQuery, SensorQuery};
use sim_core::blueprint::{Blueprint, Neurons};

use crate::names::shown;
use crate::{About, Names, actions, n_draws, n_inputs, n_neurons, plastic, rate, spiking};

/// The whole header.
pub fn header(blueprint: &Blueprint, names: &Names, about: &About) -> String {
    let mut text = format!(
        "/* The controller of a robot: {}, {}.\n * README.md has its digest and its costs. */\n\
         #ifndef SWARM_CONTROLLER_H\n#define SWARM_CONTROLLER_H\n\n#include <stdint.h>\n\n\
         #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n",
        shown(&about.experiment),
        shown(&about.genotype),
    );
    text += &defines(blueprint);
    text += "\n/* What the robot perceives at the start of a step. Fill in everything. */\n\
             typedef struct {\n";
    for (stimulus, name) in blueprint.stimuli.iter().zip(&names.stimuli) {
        let n = stimulus.inputs.len();
        let _ = writeln!(
            text,
            "    /* {}: {} */\n    float {name}[{n}];",
            shown(&stimulus.name),
            delivers(stimulus.sensor)
        );
    }
    if plastic::takes_reward(blueprint) {
        text += "    /* The fitness of the step before, as the robot can tell it; 0 in the first step. The network \
                 learns\n     * from it. */\n    float reward;\n";
    } else if n_inputs(blueprint) == 0 {
        text += "    float nothing; /* The network has no stimuli. */\n";
    }
    text += "} swarm_stimuli_t;\n\n/* What the robot does in the step. */\ntypedef struct {\n";
    let fields = actions(blueprint);
    for field in &fields {
        let shape = if field.n == 0 { String::new() } else { format!("[{}]", field.n) };
        let _ = writeln!(
            text,
            "    /* {} */\n    {} {}{shape};",
            does(field.name, field.actuator),
            field.kind,
            field.name
        );
    }
    if fields.is_empty() {
        text += "    uint32_t nothing; /* The network has no outputs. */\n";
    }
    text += "} swarm_actions_t;\n\n/* The state of one robot. Its members are not for others, except the last. */\n\
             typedef struct {\n";
    text += &match &blueprint.neurons {
        Neurons::Rate(_) => rate::members(),
        Neurons::Spiking(neurons) => spiking::members(blueprint, neurons),
    };
    text += &plastic::members(blueprint);
    text += "    void *user; /* Yours: the controller does not use it. */\n} swarm_t;\n\n\
             /* Puts a controller at rest. Call it once per robot and episode. */\n\
             void swarm_init(swarm_t *swarm);\n\n\
             /* One step: perceives, and decides. */\n\
             void swarm_step(swarm_t *swarm, const swarm_stimuli_t *stimuli, \
             swarm_actions_t *actions);\n\n\
             /* Bytes of a swarm_t, for callers in other languages. */\n\
             uint32_t swarm_size(void);\n\n";
    text += match &blueprint.neurons {
        Neurons::Rate(_) => "/* Activity of a neuron, from 0. */\n",
        Neurons::Spiking(_) => {
            "/* Share of the last step's substeps in which a neuron, from 0, spiked. */\n"
        }
    };
    text += "float swarm_activity(const swarm_t *swarm, uint32_t neuron);\n";
    if let Neurons::Spiking(_) = blueprint.neurons {
        text += "\n/* Voltage of a neuron, from 0, mV. */\n\
                 float swarm_voltage(const swarm_t *swarm, uint32_t neuron);\n";
    }
    let n_draws = n_draws(blueprint);
    if n_draws > 0 {
        let _ = write!(
            text,
            "\n/* You write this function. It returns a random number, uniform in [0, 1) and \
             independent of\n * all others. Every step calls it {} for its robot. */\n\
             double swarm_uniform(swarm_t *swarm);\n",
            times(n_draws)
        );
    }
    text + "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n"
}

fn times(n: usize) -> String {
    match n {
        1 => "once".into(),
        2 => "twice".into(),
        n => format!("{n} times"),
    }
}

fn defines(blueprint: &Blueprint) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "#define SWARM_INPUTS {}u", n_inputs(blueprint));
    let _ = writeln!(text, "#define SWARM_NEURONS {}u", n_neurons(blueprint));
    let _ = writeln!(text, "#define SWARM_SUBSTEPS {}u", blueprint.n_substeps);
    match &blueprint.neurons {
        Neurons::Rate(neurons) => {
            let _ = writeln!(text, "#define SWARM_ROWS {}u", neurons.rows.len());
        }
        Neurons::Spiking(neurons) => text += &spiking::defines(neurons),
    }
    text + &plastic::defines(blueprint)
}

/// What a sensor must deliver.
fn delivers(sensor: SensorQuery) -> &'static str {
    match sensor {
        SensorQuery::ReceiverMessage => {
            "the message of the chosen frame, zeros without one; swarm_radio_receive fills it in."
        }
        SensorQuery::ReceiverSignal => {
            "the strength of the chosen frame, in (0, 1], 0 without one; swarm_radio_receive fills\n     \
             * it in."
        }
        SensorQuery::ReceiverReceivingDirection => {
            "(cos, sin) of the sector that received the frame, zeros without one;\n     \
             * swarm_radio_receive fills it in."
        }
        SensorQuery::ReceiverSendingDirection => {
            "(cos, sin) of the sector of the emitter that faced the receiver, zeros without a\n     \
             * frame; swarm_radio_receive fills it in."
        }
        SensorQuery::ReceiverState => {
            "1 if the robot sent its own message in the step before, 0 if it relayed;\n     \
             * swarm_radio_receive fills it in."
        }
        SensorQuery::Light => {
            "light per sector, counter-clockwise from the heading: the sum over lights of\n     \
             * exp(-decay_rho distance - decay_phi angle), in cm and radians, as the experiment file \
             says."
        }
        SensorQuery::Distance => {
            "nearness of robots per sector, counter-clockwise from the heading: the largest\n     \
             * exp(-decay_rho distance - decay_phi angle), in cm and radians, as the experiment file \
             says."
        }
        SensorQuery::Ground => "1 on a ground area of the sensor's colour, else 0.",
        SensorQuery::FoodArea => "1 on a food area, else 0.",
        SensorQuery::Nest => "1 on a nest, else 0.",
        SensorQuery::Food => "1 while the robot carries something, else 0.",
        SensorQuery::OwnPosition => "x and y of the robot, cm.",
        SensorQuery::OwnOrientation => "heading of the robot, in turns from 0 to 1.",
        SensorQuery::NeighborhoodPos => {
            "x and y, cm, and heading, radians, of the nearest robots, the nearest first."
        }
        SensorQuery::Script => {
            "the numbers that the function `sense` of the task's script returns."
        }
        SensorQuery::Proximity => {
            "per ray, 1 - distance / range of the first thing that it meets, 0 if there is none."
        }
        SensorQuery::Contact => {
            "1 per sector in which the body touches something, counter-clockwise from the\n     \
             * heading, else 0."
        }
    }
}

/// What an actuator must do.
fn does(name: &str, actuator: ActuatorQuery) -> &'static str {
    match actuator {
        ActuatorQuery::Wheels if name == "wheel_right" => {
            "Speed of the right wheel over `max_speed` of the experiment file, in [-1, 1]."
        }
        ActuatorQuery::Wheels => "Speed of the left wheel, likewise.",
        ActuatorQuery::Led => "Colour of the LED; 0 is off.",
        ActuatorQuery::Mode => {
            "1: the robot sends its own message; 0: it relays the frame that it received."
        }
        ActuatorQuery::Message => {
            "The robot's own message, before quantisation; swarm_radio_send reads it."
        }
    }
}
