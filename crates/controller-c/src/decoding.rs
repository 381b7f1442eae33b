//! Decisions in C: from activities or spikes to actions.

use experiment_file::ActuatorQuery;
use sim_core::blueprint::{Blueprint, Decoder, Neurons, Output, SpikingNeurons};

use crate::literals::{double, table};

/// The functions that do not depend on the network.
pub fn library(blueprint: &Blueprint) -> Vec<&'static str> {
    let has = |wanted: fn(&Decoder) -> bool| {
        blueprint.outputs.iter().any(|output| wanted(&output.decoder) && output.n_draws > 0)
    };
    let draws = has(|decoder| *decoder == Decoder::Softmax);
    let is_population = |output: &Output| {
        matches!(output.decoder, Decoder::LinearPopulation { .. }) && !output.weights.is_empty()
    };
    let mut library = Vec::new();
    if draws || blueprint.outputs.iter().any(is_population) {
        library.push(include_str!("../c/double_exp.c"));
    }
    library.extend(draws.then_some(include_str!("../c/draw.c")));
    library
}

/// Tables of weights, and the function `decide`.
pub fn text(blueprint: &Blueprint) -> String {
    let mut tables = String::new();
    let mut body = String::new();
    for (number, output) in blueprint.outputs.iter().enumerate() {
        match &blueprint.neurons {
            Neurons::Rate(_) => body += &of_activities(output, blueprint.radio.message_len),
            Neurons::Spiking(neurons) => {
                let values = output.weights.concat();
                if !values.is_empty() {
                    let values: Vec<String> = values.iter().map(|&value| double(value)).collect();
                    tables += &table("double", &format!("DECODER_{number}"), "[]", &values);
                }
                let message_len = blueprint.radio.message_len;
                body += &of_spikes(output, number, neurons, message_len);
            }
        }
    }
    body += &rest_of_message(blueprint);
    if body.is_empty() {
        body += "    (void)swarm;\n    (void)actions;\n";
    }
    format!(
        "{tables}\n/* The decisions, in the order in which they draw. */\n\
         static void decide(swarm_t *swarm, swarm_actions_t *actions)\n{{\n{body}}}\n"
    )
}

/// Zeros for the components of the message that no neuron decides.
fn rest_of_message(blueprint: &Blueprint) -> String {
    let message = |output: &&Output| output.actuator == ActuatorQuery::Message;
    let Some(output) = blueprint.outputs.iter().rfind(message) else { return String::new() };
    let n_decided = match &blueprint.neurons {
        Neurons::Rate(_) => output.neurons.len(),
        Neurons::Spiking(_) => output.weights.len(),
    };
    (n_decided..blueprint.radio.message_len)
        .map(|index| format!("    actions->message[{index}] = 0;\n"))
        .collect()
}

/// An activity as a value in C.
fn activity(neuron: usize) -> String {
    format!("swarm_activity(swarm, {neuron}u)")
}

/// The value of one activity.
fn value(decoder: Decoder, neuron: usize) -> String {
    let activity = activity(neuron);
    match decoder {
        Decoder::Threshold => format!("{activity} >= 0.5f ? 1.0f : 0.0f"),
        Decoder::Bernoulli => {
            format!("swarm_uniform(swarm) < (double){activity} ? 1.0f : 0.0f")
        }
        _ => activity,
    }
}

fn of_activities(output: &Output, message_len: usize) -> String {
    let Output { actuator, neurons, decoder, .. } = output;
    let first = neurons.start;
    match actuator {
        ActuatorQuery::Message => {
            let set = |(index, neuron)| {
                format!("    actions->message[{index}] = {};\n", value(*decoder, neuron))
            };
            (0..message_len).zip(neurons.clone()).map(set).collect()
        }
        ActuatorQuery::Wheels => {
            let right = value(*decoder, first);
            let left = match neurons.len() {
                1 => "-right".to_owned(),
                _ => value(*decoder, first + 1),
            };
            format!(
                "    {{\n        const float right = {right};\n        \
                 const float left = {left};\n\n        \
                 actions->wheel_right = clamped(right);\n        \
                 actions->wheel_left = clamped(left);\n    }}\n"
            )
        }
        ActuatorQuery::Led | ActuatorQuery::Mode => {
            let category = match decoder {
                Decoder::Softmax => {
                    let n = neurons.len();
                    let gather: String = (0..n)
                        .map(|index| {
                            format!("        activity[{index}] = {};\n", activity(first + index))
                        })
                        .collect();
                    let target = category_target(*actuator, "drawn_colour");
                    return format!(
                        "    {{\n        float activity[{n}];\n        uint32_t drawn_colour;\n\n\
                         {gather}        \
                         drawn_colour = drawn(activity, {n}u, swarm_uniform(swarm));\n        \
                         {target}\n    }}\n"
                    );
                }
                Decoder::Threshold => format!("{} >= 0.5f ? 1u : 0u", activity(first)),
                Decoder::Bernoulli => {
                    format!("swarm_uniform(swarm) < (double){} ? 1u : 0u", activity(first))
                }
                _ => format!("{} >= 1.0f ? (uint32_t){0} : 0u", activity(first)),
            };
            format!("    {}\n", category_target(*actuator, &category))
        }
    }
}

/// The assignment of a category.
fn category_target(actuator: ActuatorQuery, category: &str) -> String {
    match actuator {
        ActuatorQuery::Led => format!("actions->led = {category};"),
        _ if category.contains('?') => format!("actions->send = {category};"),
        _ => format!("actions->send = {category} > 0u ? 1u : 0u;"),
    }
}

fn of_spikes(
    output: &Output,
    number: usize,
    neurons: &SpikingNeurons,
    message_len: usize,
) -> String {
    let Output { actuator, neurons: own, decoder, weights, .. } = output;
    // Motor neurons are numbered among themselves.
    let first = neurons.motor.iter().position(|&neuron| neuron == own.start).unwrap_or(0);
    let n = own.len();
    if !matches!(decoder, Decoder::RankOrder | Decoder::LinearPopulation { .. }) {
        let earliest = format!("earliest(swarm, {first}u, {n}u)");
        return match actuator {
            ActuatorQuery::Led => format!("    actions->led = {earliest};\n"),
            _ => format!("    actions->send = {earliest} > 0u ? 1u : 0u;\n"),
        };
    }
    let value = |index: usize| {
        let weights = format!("&DECODER_{number}[{}]", index * n);
        match decoder {
            Decoder::LinearPopulation { rest_value } => {
                let rest = double(*rest_value);
                format!(
                    "1.0 / (1.0 + double_exp(-3.0 * filtered(swarm, {first}u, {n}u, {weights}))) \
                     + {rest} - 0.5"
                )
            }
            _ => format!("ranked(swarm, {first}u, {n}u, {weights})"),
        }
    };
    match actuator {
        ActuatorQuery::Message => (0..message_len.min(weights.len()))
            .map(|index| format!("    actions->message[{index}] = {};\n", value(index)))
            .collect(),
        ActuatorQuery::Wheels => {
            let left = if weights.len() > 1 { value(1) } else { "-right".to_owned() };
            format!(
                "    {{\n        const double right = {};\n        const double left = {left};\n\n        \
                 actions->wheel_right = clamped(right);\n        \
                 actions->wheel_left = clamped(left);\n    }}\n",
                value(0)
            )
        }
        ActuatorQuery::Led => format!("    actions->led = ({}) >= 0.5 ? 1u : 0u;\n", value(0)),
        ActuatorQuery::Mode => format!("    actions->send = ({}) >= 0.5 ? 1u : 0u;\n", value(0)),
    }
}
