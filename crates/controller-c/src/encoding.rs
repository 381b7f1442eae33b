//! Encoders in C: stimuli pass receptive fields, whose nodes spike.

use std::fmt::Write as _;

use experiment_file::{EncodingScheme, RadialShape};
use sim_core::blueprint::{Encoder, Field, SpikingNeurons};

use crate::literals::{float, floats};

/// Number of nodes of all encoders.
pub fn n_nodes(neurons: &SpikingNeurons) -> usize {
    neurons.encoders.last().map_or(0, |encoder| encoder.nodes.end)
}

/// Whether nodes are LIF neurons.
pub fn has_lif(neurons: &SpikingNeurons) -> bool {
    neurons.encoders.iter().any(|encoder| encoder.scheme == EncodingScheme::Lif)
}

/// Whether a field has the shape of a bell.
pub fn has_bells(neurons: &SpikingNeurons) -> bool {
    let is_bell =
        |encoder: &Encoder| matches!(encoder.field, Field::Radial { shape: RadialShape::Bell, .. });
    neurons.encoders.iter().any(is_bell)
}

/// Bytes of the tables.
pub fn tables_len(neurons: &SpikingNeurons) -> usize {
    let of_field = |encoder: &Encoder| match &encoder.field {
        Field::Identity => 0,
        Field::Radial { centres, .. } => 4 * centres.len(),
        Field::Linear(weights) => 4 * weights.len(),
    };
    neurons.encoders.iter().map(of_field).sum()
}

/// The start of the nodes' variables.
pub fn start(neurons: &SpikingNeurons) -> String {
    let mut text = String::new();
    for encoder in &neurons.encoders {
        let first = match encoder.scheme {
            EncodingScheme::Lif => neurons.lif[1],
            _ => 1.0,
        };
        let _ = write!(
            text,
            "    for (node = {}u; node < {}u; node++) {{\n        \
             swarm->node[node][0] = {};\n    }}\n",
            encoder.nodes.start,
            encoder.nodes.end,
            float(first)
        );
    }
    text
}

/// Tables, and the functions `perceive` and `encode`.
pub fn text(neurons: &SpikingNeurons, is_plastic: bool) -> String {
    let mut tables = String::new();
    if has_lif(neurons) {
        tables += &floats("NODE_CONSTANT", neurons.lif);
    }
    let (mut perceive, mut encode) = (String::new(), String::new());
    for (number, encoder) in neurons.encoders.iter().enumerate() {
        match &encoder.field {
            Field::Identity => {}
            Field::Radial { centres, .. } => {
                tables += &floats(&format!("CENTRE_{number}"), centres.iter().copied());
            }
            Field::Linear(weights) => {
                tables += &floats(&format!("FIELD_{number}"), weights.iter().copied());
            }
        }
        perceive += &field(encoder, number);
        encode += &spikes(encoder, neurons.starts.len(), is_plastic);
    }
    let uses = |text: &str, name: &str| text.contains(name);
    let mut locals = String::from("    uint32_t i, node;\n");
    if uses(&perceive, "float d") {
        locals = String::from("    uint32_t i, c, node;\n");
    }
    let unused = if uses(&encode, "substep") { "" } else { "    (void)substep;\n" };
    let unused_value = if uses(&encode, "value[") { "" } else { "    (void)value;\n" };
    format!(
        "{tables}\n/* The values of the encoders' nodes in a step. */\n\
         static void perceive(const float *inputs, float *value)\n{{\n{locals}\n{perceive}}}\n\n\
         /* The spikes of the encoders' nodes in a substep. */\n\
         static void encode(swarm_t *swarm, const float *value, uint32_t substep)\n{{\n    \
         uint32_t node;\n\n{unused}{unused_value}{encode}}}\n"
    )
}

/// The values of an encoder's nodes.
fn field(encoder: &Encoder, number: usize) -> String {
    let (inputs, nodes) = (&encoder.inputs, &encoder.nodes);
    let mut text = format!("    node = {}u;\n", nodes.start);
    match &encoder.field {
        Field::Identity => {
            let _ = write!(
                text,
                "    for (i = {}u; i < {}u; i++) {{\n        value[node++] = inputs[i];\n    }}\n",
                inputs.start, inputs.end
            );
        }
        Field::Radial { shape, steepness, centres, scale, offset } => {
            let fall = float(*steepness);
            let response = match shape {
                RadialShape::Bell => {
                    format!("            const float x = exponential(-({fall} * (d * d)));\n")
                }
                RadialShape::Cone => format!(
                    "            const float left = 1.0f - {fall} * (d > -d ? d : -d);\n            \
                     const float x = left > 0.0f ? left : 0.0f;\n"
                ),
                RadialShape::Parabola => format!(
                    "            const float left = 1.0f - {fall} * (d * d);\n            \
                     const float x = left > 0.0f ? left : 0.0f;\n"
                ),
            };
            let _ = write!(
                text,
                "    for (i = {}u; i < {}u; i++) {{\n        for (c = 0; c < {}u; c++) {{\n            \
                 const float d = inputs[i] - CENTRE_{number}[c];\n{response}\n            \
                 value[node++] = fmaf({}, x, {});\n        }}\n    }}\n",
                inputs.start,
                inputs.end,
                centres.len(),
                float(*scale),
                float(*offset)
            );
        }
        Field::Linear(_) => {
            let n = inputs.len();
            let _ = write!(
                text,
                "    for (; node < {}u; node++) {{\n        float sum = 0.0f;\n\n        \
                 for (i = 0; i < {n}u; i++) {{\n            \
                 sum = fmaf(FIELD_{number}[(node - {}u) * {n}u + i], inputs[{}u + i], sum);\n        \
                 }}\n        value[node] = sum;\n    }}\n",
                nodes.end, nodes.start, inputs.start
            );
        }
    }
    if let Some([low, high]) = encoder.limits {
        let (low, high) = (float(low), float(high));
        let _ = write!(
            text,
            "    for (node = {}u; node < {}u; node++) {{\n        \
             value[node] = value[node] < {high} ? value[node] : {high};\n        \
             value[node] = value[node] > {low} ? value[node] : {low};\n    }}\n",
            nodes.start, nodes.end
        );
    }
    text
}

/// The spikes of an encoder's nodes in a substep.
fn spikes(encoder: &Encoder, n_neurons: usize, counts: bool) -> String {
    let body = match encoder.scheme {
        EncodingScheme::Lif => {
            "        swarm->spikes[SPIKES + node] = lif(NODE_CONSTANT, swarm->node[node], \
             value[node]);\n"
        }
        EncodingScheme::PoissonRate => {
            "        const float draw = (float)swarm_uniform(swarm);\n        \
             const float share = value[node] * (1.0f / 10000.0f);\n        \
             const float loss = share * swarm->node[node][0];\n        \
             const float survival = swarm->node[node][0] - loss;\n        \
             const uint8_t spike = draw < 1.0f - survival;\n\n        \
             swarm->node[node][0] = spike ? 1.0f : survival;\n        \
             swarm->spikes[SPIKES + node] = spike;\n"
        }
        EncodingScheme::RankOrder => {
            "        const float now = (float)(substep + 1u);\n\n        \
             swarm->spikes[SPIKES + node] = value[node] >= now && value[node] - now < 1.0f;\n"
        }
    };
    let count = match counts {
        true => {
            "        swarm->counts[SPIKES + node] =\n            \
                 (uint16_t)(swarm->counts[SPIKES + node] + swarm->spikes[SPIKES + node]);\n"
        }
        false => "",
    };
    format!(
        "    for (node = {}u; node < {}u; node++) {{\n{}    }}\n",
        encoder.nodes.start,
        encoder.nodes.end,
        (body.to_owned() + count).replace("SPIKES", &format!("{n_neurons}u"))
    )
}
