//! `README.md` of a controller: what it is, what it costs, and how to use it.

use std::fmt::Write as _;

use sim_core::blueprint::{Blueprint, Neurons};

use crate::names::shown;
use crate::{About, Names, has_radio, n_draws, n_inputs, n_neurons, plastic, radio, rate, spiking};

/// The whole page.
pub fn page(blueprint: &Blueprint, names: &Names, about: &About, episodes: &str) -> String {
    let mut text = format!(
        "# The controller of a robot\n\n\
         | | |\n|---|---|\n\
         | experiment | {} |\n| controller | {} |\n| configuration | digest `{}` |\n\
         | simulation | {} |\n| recorded | {} |\n",
        shown(&about.experiment),
        shown(&about.genotype),
        shown(&about.config_digest),
        sim_core::FINGERPRINT,
        episodes,
    );
    let n_substeps = blueprint.n_substeps as usize;
    let (state, tables, work) = match &blueprint.neurons {
        Neurons::Rate(neurons) => {
            let [n_fused, n_pairs] = rate::cost(neurons, n_substeps);
            let work = format!(
                "{n_fused} fused multiply-adds of synapses and neurons, and {n_pairs} pairs of \
                 activation functions, each with some 14 further multiply-adds and a division"
            );
            (rate::state_len(neurons), rate::tables_len(neurons), work)
        }
        Neurons::Spiking(neurons) => {
            let n_updates = neurons.starts.len() * n_substeps;
            let work = format!(
                "{n_updates} updates of neurons, and one addition per synapse of every spike"
            );
            (spiking::state_len(neurons), spiking::tables_len(neurons), work)
        }
    };
    let [state_of_weights, tables_of_weights] = plastic::lens(blueprint);
    let (state, tables) = (state + state_of_weights, tables + tables_of_weights);
    let _ = write!(
        text,
        "| network | {} inputs, {} neurons, {n_substeps} substeps per step |\n\
         | a step | {work} |\n",
        n_inputs(blueprint),
        n_neurons(blueprint),
    );
    if let Some(duration) = blueprint.step_duration {
        let _ = writeln!(text, "| a step lasts | {duration} s |");
    }
    let _ = write!(
        text,
        "| RAM | {state} bytes of `swarm_t`, besides alignment and the pointer `user` |\n\
         | flash | {tables} bytes of tables, and the code; `make size` shows the sum |\n\n\
         `make test` compiles the controller and compares it with the recorded episodes: every robot, \
         every step, every bit. It names the first difference.\n\n\
         ## Use it\n\n```c\n"
    );
    text += &example(blueprint, names);
    text += "```\n\nThe comments in the headers say what every sensor must deliver and what every \
             actuator must do. Functions that the headers mark as yours return random numbers; with \
             numbers that are not uniform and independent, robots decide otherwise than in the \
             simulation.\n\n\
             ## The bits\n\n\
             The controller computes the bits of the simulation where `float` is IEEE 754 single \
             precision, `double` double precision, and `fmaf` is correct, in hardware or in the \
             library. Compile it as the `Makefile` does: `-std=c99 -ffp-contract=off`, without \
             `-ffast-math`. The optimisation level does not matter. On a processor without fused \
             multiply-add, first run `make test` there: the `fmaf` of some small C libraries rounds \
             twice.\n";
    text
}

fn example(blueprint: &Blueprint, names: &Names) -> String {
    let has_radio = has_radio(blueprint);
    let (receives, sends) =
        (blueprint.radio.receiver.is_some(), blueprint.radio.transmitter.is_some());
    let mut text = String::new();
    text +=
        if has_radio { "#include \"swarm_radio.h\"\n\n" } else { "#include \"controller.h\"\n\n" };
    if n_draws(blueprint) > 0 {
        text += "double swarm_uniform(swarm_t *swarm) { return random_number(); }\n";
    }
    if has_radio && radio::n_draws(blueprint) > 0 {
        text += "double swarm_radio_uniform(swarm_radio_t *radio) { return random_number(); }\n";
    }
    text += "\nstatic swarm_t swarm;\n";
    text += if has_radio { "static swarm_radio_t radio;\n" } else { "" };
    text += "\nvoid start(void)\n{\n    swarm_init(&swarm);\n";
    text += if has_radio { "    swarm_radio_init(&radio, MY_NUMBER);\n" } else { "" };
    text += "}\n\nvoid step(void)\n{\n    swarm_stimuli_t stimuli;\n    swarm_actions_t actions;\n";
    text += if receives { "    swarm_heard_t heard[SWARM_SECTORS];\n" } else { "" };
    text += if sends { "    swarm_frame_t frame;\n" } else { "" };
    text.push('\n');
    if receives {
        text += "    listen(heard);\n    swarm_radio_receive(&radio, heard, &stimuli);\n";
    }
    for (stimulus, name) in blueprint.stimuli.iter().zip(&names.stimuli) {
        if radio::reading(stimulus.sensor, 0).is_none() {
            let _ = writeln!(text, "    read_sensor(stimuli.{name}, {});", stimulus.inputs.len());
        }
    }
    if plastic::takes_reward(blueprint) {
        text += "    stimuli.reward = last_fitness();\n";
    }
    text += "    swarm_step(&swarm, &stimuli, &actions);\n";
    if sends {
        text += "    swarm_radio_send(&radio, &actions, &frame);\n    send(&frame);\n";
    }
    text + "    act(&actions);\n}\n"
}
