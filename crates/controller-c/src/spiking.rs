//! Spiking neurons in C: tables, and the functions that compute them substep by substep.

use std::fmt::Write as _;

use experiment_file::NeuronModel;
use sim_core::blueprint::{Blueprint, Decoder, Receptors, SpikingNeurons};

use crate::literals::{float, floats, links, links_len, numbers, table, unsigned_len, weight};
use crate::{encoding, plastic};

/// Names of receptors, and the places of their variables among those of an axon.
const RECEPTORS: [(&str, usize); 3] = [("AMPA", 0), ("GABA", 1), ("NMDA", 3)];

/// Sizes of the network.
pub fn defines(neurons: &SpikingNeurons) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "#define SWARM_VARIABLES {}u", n_variables(neurons));
    text += "/* Sources of spikes: neurons, then nodes of encoders. */\n";
    let _ = writeln!(text, "#define SWARM_SOURCES {}u", neurons.outgoing.len());
    let _ = writeln!(text, "#define SWARM_MOTOR {}u", neurons.motor.len());
    if let Some(receptors) = &neurons.receptors {
        let _ = writeln!(text, "#define SWARM_SLOTS {}u", n_slots(receptors));
    }
    let n_nodes = encoding::n_nodes(neurons);
    if n_nodes > 0 {
        let _ = writeln!(text, "#define SWARM_NODES {n_nodes}u");
    }
    text
}

/// Members of the state.
pub fn members(blueprint: &Blueprint, neurons: &SpikingNeurons) -> String {
    // The plasticity of weights reads the activity of nodes, too.
    let counted = if blueprint.plasticity.is_some() { "SWARM_SOURCES" } else { "SWARM_NEURONS" };
    let mut text = format!(
        "    float state[SWARM_NEURONS][SWARM_VARIABLES]; /* the first variable is the voltage, mV */\n    \
         uint8_t spikes[SWARM_SOURCES]; /* whether a source spiked in the last substep */\n    \
         uint16_t counts[{counted}]; /* spikes in the last step */\n",
    );
    if !neurons.motor.is_empty() {
        text += "    uint16_t first[SWARM_MOTOR]; /* substep of the first spike of decoded neurons */\n    \
                 float filter[SWARM_MOTOR][2]; /* their filtered spikes */\n";
    }
    if neurons.receptors.is_some() {
        text += "    uint32_t clock; /* slot of the next substep */\n    \
                 uint8_t history[SWARM_SLOTS][SWARM_SOURCES]; /* spikes on their way */\n    \
                 float open[SWARM_SOURCES][4]; /* receptors of each source */\n";
    }
    if encoding::n_nodes(neurons) > 0 {
        text += "    float node[SWARM_NODES][2]; /* variables of nodes of encoders */\n";
    }
    text
}

fn n_variables(neurons: &SpikingNeurons) -> usize {
    neurons.starts.first().map_or(0, Vec::len)
}

/// Number of substeps for which spikes are stored: the longest delay.
fn n_slots(receptors: &Receptors) -> usize {
    receptors.delays.iter().copied().max().unwrap_or(1)
}

/// Bytes of the state, without padding.
pub fn state_len(neurons: &SpikingNeurons) -> usize {
    let (n_neurons, n_sources) = (neurons.starts.len(), neurons.outgoing.len());
    let of_receptors =
        neurons.receptors.as_ref().map_or(0, |receptors| 4 + n_sources * (n_slots(receptors) + 16));
    let of_nodes = 8 * encoding::n_nodes(neurons);
    n_neurons * (4 * n_variables(neurons) + 2)
        + n_sources
        + 10 * neurons.motor.len()
        + of_receptors
        + of_nodes
}

/// Bytes of the tables.
pub fn tables_len(neurons: &SpikingNeurons) -> usize {
    let values = neurons.constants.iter().chain(&neurons.starts);
    let mut len: usize = values.map(|values| 4 * values.len()).sum();
    len += links_len(neurons.afferent.iter()) + links_len(neurons.outgoing.iter());
    if let Some(receptors) = &neurons.receptors {
        len += receptors.delays.len();
        len += receptors.incoming.iter().map(|of| links_len(of.iter())).sum::<usize>();
    }
    len + neurons.motor.len() * unsigned_len(neurons.starts.len()) + encoding::tables_len(neurons)
}

/// The functions that do not depend on the network.
pub fn library(neurons: &SpikingNeurons) -> Vec<&'static str> {
    let uses_exponential = !matches!(neurons.model, NeuronModel::Lif | NeuronModel::Izhikevich)
        || neurons.receptors.as_ref().is_some_and(|receptors| has_links(receptors, 2))
        || encoding::has_bells(neurons);
    let encodes_lif = encoding::has_lif(neurons);
    let is_lif = neurons.model == NeuronModel::Lif;
    let mut library = Vec::new();
    library.extend(uses_exponential.then_some(include_str!("../c/exponential.c")));
    if is_lif || encodes_lif || neurons.model == NeuronModel::ExpLif {
        library.push(include_str!("../c/neurons/gate.c"));
    }
    library.extend((is_lif || encodes_lif).then_some(include_str!("../c/neurons/lif.c")));
    library.extend(match neurons.model {
        NeuronModel::Rate | NeuronModel::Lif => None,
        NeuronModel::ExpLif => Some(include_str!("../c/neurons/exp_lif.c")),
        NeuronModel::AdEx => Some(include_str!("../c/neurons/adex.c")),
        NeuronModel::Izhikevich => Some(include_str!("../c/neurons/izhikevich.c")),
        NeuronModel::MorrisLecar => Some(include_str!("../c/neurons/morris_lecar.c")),
    });
    library
}

fn has_links(receptors: &Receptors, receptor: usize) -> bool {
    receptors.incoming[receptor].iter().any(|links| !links.is_empty())
}

/// Tables and functions: `start`, `advance`, `swarm_activity`, `swarm_voltage`, and those that
/// decoders need.
pub fn text(blueprint: &Blueprint, neurons: &SpikingNeurons) -> String {
    let has_afferent = neurons.afferent.iter().any(|links| !links.is_empty());
    let has_outgoing = neurons.outgoing.iter().any(|links| !links.is_empty());
    let is_plastic = blueprint.plasticity.is_some();
    let mut text = String::new();
    let rows = |values: &[Vec<f32>]| -> Vec<String> {
        let row = |row: &Vec<f32>| {
            let values: Vec<String> = row.iter().map(|&value| float(value)).collect();
            format!("{{{}}}", values.join(", "))
        };
        values.iter().map(row).collect()
    };
    let n_constants = neurons.constants.first().map_or(0, Vec::len);
    let shape = format!("[][{n_constants}]");
    text += &table("float", "CONSTANT", &shape, &rows(&neurons.constants));
    text += &table("float", "START", "[][SWARM_VARIABLES]", &rows(&neurons.starts));
    if has_afferent {
        text += &links("AFFERENT", neurons.afferent.iter(), is_plastic);
    }
    if has_outgoing {
        text += &links("OUTGOING", neurons.outgoing.iter(), is_plastic);
    }
    let has_motor = !neurons.motor.is_empty();
    if has_motor {
        text += "/* The neurons that outputs decode. */\n";
        text += &numbers("MOTOR", neurons.motor.iter().copied());
        text += &floats("FILTER", neurons.filter);
    }
    if let Some(receptors) = &neurons.receptors {
        text.push('\n');
        text += &receptors_text(receptors, is_plastic);
    }
    if encoding::n_nodes(neurons) > 0 {
        text.push('\n');
        text += &encoding::text(neurons, is_plastic);
    }
    if let Some(rule) = &blueprint.plasticity {
        text.push('\n');
        text += &plastic::text(blueprint, rule);
    }
    if has_motor {
        text.push('\n');
        text += include_str!("../c/neurons/listen.c");
    }
    for (decodes, function) in [
        (Decoder::FirstToSpike, include_str!("../c/neurons/earliest.c")),
        (Decoder::RankOrder, include_str!("../c/neurons/ranked.c")),
        (Decoder::LinearPopulation { rest_value: 0.0 }, include_str!("../c/neurons/filtered.c")),
    ] {
        let is_same = |decoder| std::mem::discriminant(decoder) == std::mem::discriminant(&decodes);
        if blueprint.outputs.iter().any(|output| is_same(&output.decoder)) {
            text.push('\n');
            text += function;
        }
    }
    text.push('\n');
    text += &start(blueprint, neurons);
    text.push('\n');
    text += &advance(neurons, has_afferent, has_outgoing, is_plastic);
    text += "\nfloat swarm_activity(const swarm_t *swarm, uint32_t neuron)\n{\n    \
             return (float)swarm->counts[neuron] / (float)SWARM_SUBSTEPS;\n}\n\n\
             float swarm_voltage(const swarm_t *swarm, uint32_t neuron)\n{\n    \
             return swarm->state[neuron][0];\n}\n";
    text
}

fn receptors_text(receptors: &Receptors, is_plastic: bool) -> String {
    let mut tables = numbers("DELAY", receptors.delays.iter().copied());
    tables += &floats("LEFT", receptors.retention);
    let _ = writeln!(tables, "#define RISE ({})", float(receptors.rise));
    let _ = writeln!(tables, "#define DECAY ({})", float(receptors.decay));
    let (mut counters, mut body) = (String::new(), String::new());
    for (receptor, (name, variable)) in RECEPTORS.into_iter().enumerate() {
        if !has_links(receptors, receptor) {
            continue;
        }
        tables += &links(name, receptors.incoming[receptor].iter(), is_plastic);
        let k = format!("k_{}", name.to_lowercase());
        let _ = writeln!(counters, "    uint32_t {k} = 0;");
        let (gain, reversal) = receptors.drives[receptor];
        let weight = weight(name, &k, is_plastic);
        let _ = write!(
            body,
            "        if ({k} < {name}_END[post]) {{\n            sum = 0.0f;\n            \
             for (; {k} < {name}_END[post]; {k}++) {{\n                \
             sum = fmaf({weight}, swarm->open[{name}_FROM[{k}]][{variable}], sum);\n            \
             }}\n            flow = {} * sum;\n",
            float(gain)
        );
        if let Some(reversal) = reversal {
            let _ = writeln!(body, "            flow = flow * ({} - v);", float(reversal));
        }
        if name == "NMDA" {
            let _ = writeln!(
                body,
                "            flow = flow / (1.0f + {} * exponential(-0.062f * v));",
                float(receptors.magnesium)
            );
        }
        body += "            current[post] = current[post] + flow;\n        }\n";
    }
    let function = include_str!("../c/neurons/receptors.c");
    if body.is_empty() {
        // Nothing listens to the receptors.
        let (before, _) = function.split_once("    for (post").unwrap_or((function, ""));
        let before = before.replace("uint32_t axon, post;", "uint32_t axon;");
        return tables + "\n" + &before.replace("@COUNTERS@", "") + "    (void)current;\n}\n";
    }
    let voltage = "        const float v = swarm->state[post][0];\n";
    let mut function = function.replace("@COUNTERS@", &counters).replace("@RECEPTORS@", &body);
    if !body.contains("- v)") && !body.contains("* v)") {
        function = function.replace(voltage, "");
    }
    tables + "\n" + &function
}

fn start(blueprint: &Blueprint, neurons: &SpikingNeurons) -> String {
    let mut text = String::from("static void start(swarm_t *swarm)\n{\n");
    let nodes = encoding::start(neurons);
    text += if nodes.is_empty() { "" } else { "    uint32_t node;\n\n" };
    text += "    memset(swarm, 0, sizeof *swarm);\n    \
             memcpy(swarm->state, START, sizeof swarm->state);\n";
    text += plastic::start(blueprint);
    text + &nodes + "}\n"
}

fn advance(
    neurons: &SpikingNeurons,
    has_afferent: bool,
    has_outgoing: bool,
    is_plastic: bool,
) -> String {
    let [afferent, outgoing] =
        ["AFFERENT", "OUTGOING"].map(|prefix| weight(prefix, "k", is_plastic));
    let has_nodes = encoding::n_nodes(neurons) > 0;
    let has_motor = !neurons.motor.is_empty();
    let mut text = String::from(
        "/* All substeps of a step. The order of every sum is part of the result. */\n\
         static void advance(swarm_t *swarm, const float *inputs)\n{\n    \
         float drive[SWARM_NEURONS];\n    float current[SWARM_NEURONS];\n",
    );
    text += if has_nodes { "    float value[SWARM_NODES];\n" } else { "" };
    text += if has_afferent || has_outgoing {
        "    uint32_t substep, i, k;\n\n"
    } else {
        "    uint32_t substep, i;\n\n"
    };
    text += if has_afferent { "    k = 0;\n" } else { "" };
    text += if has_afferent || has_nodes { "" } else { "    (void)inputs;\n" };
    text += "    for (i = 0; i < SWARM_NEURONS; i++) {\n        float sum = 0.0f;\n\n";
    if has_afferent {
        let _ = write!(
            text,
            "        for (; k < AFFERENT_END[i]; k++) {{\n            \
             sum = fmaf({afferent}, inputs[AFFERENT_FROM[k]], sum);\n        }}\n"
        );
    }
    text += "        drive[i] = sum;\n    }\n    \
             memset(swarm->counts, 0, sizeof swarm->counts);\n";
    text += if has_nodes { "    perceive(inputs, value);\n" } else { "" };
    if has_motor {
        text += "    for (i = 0; i < SWARM_MOTOR; i++) {\n        \
                 swarm->first[i] = SWARM_SUBSTEPS;\n    }\n";
    }
    text += "    for (substep = 0; substep < SWARM_SUBSTEPS; substep++) {\n";
    text += if has_nodes { "        encode(swarm, value, substep);\n" } else { "" };
    text += "        memcpy(current, drive, sizeof current);\n";
    if has_outgoing {
        let _ = write!(
            text,
            "        k = 0;\n        for (i = 0; i < SWARM_SOURCES; i++) {{\n            \
             if (swarm->spikes[i] == 0u) {{\n                k = OUTGOING_END[i];\n            }}\n            \
             for (; k < OUTGOING_END[i]; k++) {{\n                \
             current[OUTGOING_FROM[k]] += {outgoing};\n            }}\n        }}\n"
        );
    }
    text += if neurons.receptors.is_some() { "        receive(swarm, current);\n" } else { "" };
    let function = if neurons.model == NeuronModel::Lif { "lif" } else { "neuron" };
    let _ = write!(
        text,
        "        for (i = 0; i < SWARM_NEURONS; i++) {{\n            \
         swarm->spikes[i] = {function}(CONSTANT[i], swarm->state[i], current[i]);\n            \
         swarm->counts[i] = (uint16_t)(swarm->counts[i] + swarm->spikes[i]);\n        }}\n"
    );
    text += if has_motor { "        listen(swarm, substep);\n" } else { "" };
    text + "    }\n}\n"
}
