//! What the robot does, from activities: decisions, or the probabilities of those that are drawn.

use experiment_file::ActuatorQuery;
use sim_core::blueprint::{Blueprint, Decoder, Output};

use crate::builder::{Builder, table};
use crate::proto::ValueInfoProto;

/// Adds the outputs of all actuators. `activities`: `[robots, neurons]`.
pub fn put(graph: &mut Builder, blueprint: &Blueprint, activities: &str) -> Vec<ValueInfoProto> {
    let mut outputs = Vec::new();
    for actuator in
        [ActuatorQuery::Wheels, ActuatorQuery::Led, ActuatorQuery::Mode, ActuatorQuery::Message]
    {
        // If several outputs drive an actuator, the last one decides.
        let mut of_actuator = blueprint.outputs.iter().filter(|output| output.actuator == actuator);
        let Some(output) = of_actuator.next_back() else { continue };
        let (name, width, doc) = match actuator {
            ActuatorQuery::Wheels => wheels(graph, output, activities),
            ActuatorQuery::Message => {
                message(graph, output, activities, blueprint.radio.message_len)
            }
            ActuatorQuery::Led => led(graph, output, activities),
            ActuatorQuery::Mode => send(graph, output, activities),
        };
        outputs.push(table(name.to_owned(), width, doc));
    }
    outputs
}

/// Name, columns and meaning of an output.
type Decision = (&'static str, usize, &'static str);

/// 1 where an activity is at least one half, else 0.
fn threshold(graph: &mut Builder, activities: &str) -> String {
    let half = graph.floats(&[], &[0.5]);
    // sign(0) would be 0.
    let below = graph.op("Less", &[activities, &half]);
    let [zero, one] = [0.0, 1.0].map(|value| graph.floats(&[], &[value]));
    graph.op("Where", &[&below, &zero, &one])
}

fn clip(graph: &mut Builder, values: &str, low: f32, high: f32, name: &str) {
    let [low, high] = [low, high].map(|value| graph.floats(&[], &[value]));
    graph.put("Clip", &[values, &low, &high], None, name);
}

fn wheels(graph: &mut Builder, output: &Output, activities: &str) -> Decision {
    let neurons = output.neurons.clone().take(2);
    let is_one = output.neurons.len() == 1;
    let own = graph.columns(activities, neurons);
    if output.decoder == Decoder::Bernoulli {
        let (name, doc) = match is_one {
            true => {
                ("wheels_probability", "probability of (1, -1), else (0, 0): right, left wheel")
            }
            false => ("wheels_probability", "probability of 1, else 0: right, left wheel"),
        };
        clip(graph, &own, 0.0, 1.0, name);
        return (name, if is_one { 1 } else { 2 }, doc);
    }
    let own = match output.decoder {
        Decoder::Threshold => threshold(graph, &own),
        _ => own,
    };
    let both = match is_one {
        true => {
            let left = graph.op("Neg", &[&own]);
            graph.along("Concat", 1, &[&own, &left])
        }
        false => own,
    };
    clip(graph, &both, -1.0, 1.0, "wheels");
    ("wheels", 2, "speed of the right and of the left wheel over `max_speed`, in [-1, 1]")
}

fn message(graph: &mut Builder, output: &Output, activities: &str, n: usize) -> Decision {
    let n_decided = output.neurons.len().min(n);
    let mut own = graph.columns(activities, output.neurons.clone().take(n));
    if output.decoder == Decoder::Threshold {
        own = threshold(graph, &own);
    }
    let (name, doc) = match output.decoder {
        Decoder::Bernoulli => ("message_probability", "probability of 1, else 0, by component"),
        _ => ("message", "the robot's own message, before quantisation"),
    };
    // Zeros for components that no neuron decides.
    let pads = graph.numbers(&[0, 0, 0, (n - n_decided) as i64]);
    graph.put("Pad", &[&own, &pads], None, name);
    (name, n, doc)
}

fn led(graph: &mut Builder, output: &Output, activities: &str) -> Decision {
    if output.decoder == Decoder::Softmax {
        let own = graph.columns(activities, output.neurons.clone());
        graph.put("Softmax", &[&own], Some(1), "led_probabilities");
        return ("led_probabilities", output.neurons.len(), "probability of each colour; 0 is off");
    }
    let own = graph.columns(activities, output.neurons.clone().take(1));
    match output.decoder {
        Decoder::Bernoulli => {
            clip(graph, &own, 0.0, 1.0, "led_probability");
            return ("led_probability", 1, "probability that the LED is on");
        }
        Decoder::Threshold => {
            let on = threshold(graph, &own);
            graph.put("Identity", &[&on], None, "led");
        }
        _ => {
            let colour = graph.op("Floor", &[&own]);
            graph.put("Relu", &[&colour], None, "led");
        }
    }
    ("led", 1, "colour of the LED; 0 is off")
}

fn send(graph: &mut Builder, output: &Output, activities: &str) -> Decision {
    let probability =
        ("send_probability", 1, "probability of sending its own message, else it relays");
    if output.decoder == Decoder::Softmax {
        let own = graph.columns(activities, output.neurons.clone());
        let all = graph.along("Softmax", 1, &[&own]);
        let relay = graph.columns(&all, [0]);
        let one = graph.floats(&[], &[1.0]);
        graph.put("Sub", &[&one, &relay], None, "send_probability");
        return probability;
    }
    let own = graph.columns(activities, output.neurons.clone().take(1));
    match output.decoder {
        Decoder::Bernoulli => {
            clip(graph, &own, 0.0, 1.0, "send_probability");
            return probability;
        }
        Decoder::Threshold => {
            let sends = threshold(graph, &own);
            graph.put("Identity", &[&sends], None, "send");
        }
        _ => {
            let mode = graph.op("Floor", &[&own]);
            clip(graph, &mode, 0.0, 1.0, "send");
        }
    }
    ("send", 1, "1: the robot sends its own message; 0: it relays the received frame")
}
