//! `controller.c`.

use sim_core::blueprint::{Blueprint, Neurons};

use crate::literals::float;
use crate::{Names, actions, decoding, n_inputs, plastic, rate, spiking};

/// Coefficients of 2^f, lowest power first.
const COEFFICIENTS: [&str; 6] = ["@C0@", "@C1@", "@C2@", "@C3@", "@C4@", "@C5@"];

/// The whole file.
pub fn text(blueprint: &Blueprint, names: &Names) -> String {
    let mut parts = vec![HEAD.to_owned()];
    let (library, neurons, has_inputs) = match &blueprint.neurons {
        Neurons::Rate(neurons) => {
            let has_inputs = neurons.rows.iter().any(|row| !row.afferent.is_empty());
            (rate::library(neurons), rate::text(blueprint, neurons), has_inputs)
        }
        Neurons::Spiking(neurons) => {
            (spiking::library(neurons), spiking::text(blueprint, neurons), true)
        }
    };
    if library.iter().any(|text| text.contains("power_of_two")) {
        parts.push(power());
    }
    parts.extend(library.into_iter().map(str::to_owned));
    parts.extend(decoding::library(blueprint).into_iter().map(str::to_owned));
    parts.push(neurons);
    if let Some(wheel) = actions(blueprint).iter().find(|field| field.name == "wheel_right") {
        let (kind, one) = (wheel.kind, if wheel.kind == "float" { "1.0f" } else { "1.0" });
        parts.push(format!(
            "static {kind} clamped({kind} value)\n{{\n    if (value < -{one}) {{\n        \
             return -{one};\n    }}\n    return value > {one} ? {one} : value;\n}}\n"
        ));
    }
    parts.push(decoding::text(blueprint).trim_start_matches('\n').to_owned());
    parts.push(
        "void swarm_init(swarm_t *swarm)\n{\n    start(swarm);\n    swarm->user = NULL;\n}\n"
            .to_owned(),
    );
    parts.push(step(blueprint, names, has_inputs));
    parts.push(
        "uint32_t swarm_size(void)\n{\n    return (uint32_t)sizeof(swarm_t);\n}\n".to_owned(),
    );
    parts.join("\n")
}

const HEAD: &str = include_str!("../c/head.c");

/// The function 2^y, with the simulation's coefficients.
pub fn power() -> String {
    let text = include_str!("../c/power.c").to_owned();
    let coefficients = COEFFICIENTS.iter().zip(sim_core::blueprint::EXP2);
    coefficients.fold(text, |text, (place, value)| text.replace(place, &float(value)))
}

fn step(blueprint: &Blueprint, names: &Names, has_inputs: bool) -> String {
    let head = "void swarm_step(swarm_t *swarm, const swarm_stimuli_t *stimuli, \
                swarm_actions_t *actions)\n{\n";
    let n_inputs = n_inputs(blueprint);
    if blueprint.plasticity.is_none() && (!has_inputs || n_inputs == 0) {
        let call = if has_inputs { "advance(swarm, NULL)" } else { "advance(swarm)" };
        return format!("{head}    (void)stimuli;\n    {call};\n    decide(swarm, actions);\n}}\n");
    }
    let gather: String = blueprint
        .stimuli
        .iter()
        .zip(&names.stimuli)
        .map(|(stimulus, name)| {
            let first = stimulus.inputs.start;
            format!("    memcpy(&inputs[{first}], stimuli->{name}, sizeof stimuli->{name});\n")
        })
        .collect();
    let [learn, remember] = match (&blueprint.plasticity, plastic::takes_reward(blueprint)) {
        (None, _) => ["", ""],
        (Some(_), false) => ["    learn(swarm);\n", "    remember(swarm, inputs);\n"],
        (Some(_), true) => {
            ["    learn(swarm, stimuli->reward);\n", "    remember(swarm, inputs);\n"]
        }
    };
    let advance = if has_inputs { "advance(swarm, inputs)" } else { "advance(swarm)" };
    format!(
        "{head}    float inputs[{n_inputs}];\n\n{gather}{learn}    {advance};\n{remember}    \
         decide(swarm, actions);\n}}\n"
    )
}
