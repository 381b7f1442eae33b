//! Rate neurons in C: tables, and the functions that compute them row by row.

use std::fmt::Write as _;

use experiment_file::Activation;
use sim_core::blueprint::{Blueprint, RateNeurons, RateRow};

use crate::literals::{floats, links, links_len, numbers, unsigned_len, weight};
use crate::plastic;

/// Members of the state.
pub fn members() -> String {
    "    float y[SWARM_ROWS]; /* the exponents of the activation functions */\n    \
     float u[SWARM_ROWS]; /* activities */\n"
        .to_owned()
}

/// Bytes of the state on a machine whose floats have 4 bytes.
pub fn state_len(neurons: &RateNeurons) -> usize {
    8 * neurons.rows.len()
}

/// Bytes of the tables.
pub fn tables_len(neurons: &RateNeurons) -> usize {
    let RateNeurons { rows_of, rows, .. } = neurons;
    let afferent = links_len(rows.iter().map(|row| &row.afferent));
    let recurrent = links_len(rows.iter().map(|row| &row.recurrent));
    12 * rows.len() + rows_of.len() * unsigned_len(rows.len()) + afferent + recurrent
}

/// The number of fused multiply-adds, and of pairs of activation functions, in a step of
/// `n_substeps` substeps.
pub fn cost(neurons: &RateNeurons, n_substeps: usize) -> [usize; 2] {
    let n_afferent: usize = neurons.rows.iter().map(|row| row.afferent.len()).sum();
    let n_recurrent: usize = neurons.rows.iter().map(|row| row.recurrent.len()).sum();
    let n_rows = neurons.rows.len();
    [n_afferent + n_substeps * (n_recurrent + n_rows), n_substeps * n_rows / 2]
}

/// Which activation functions the rows have.
fn functions(rows: &[RateRow]) -> [bool; 2] {
    [Activation::Sigmoid, Activation::Tanh]
        .map(|function| rows.iter().any(|row| row.activation == function))
}

/// The functions that do not depend on the network.
pub fn library(neurons: &RateNeurons) -> Vec<&'static str> {
    let [has_sigmoid, has_tanh] = functions(&neurons.rows);
    let mut library = Vec::new();
    library.extend(has_sigmoid.then_some(include_str!("../c/sigmoid.c")));
    library.extend(has_tanh.then_some(include_str!("../c/tanh.c")));
    library
}

/// The function that computes activities. With plastic weights, every neuron has its own division.
fn activate(kinds: [bool; 2], is_plastic: bool) -> String {
    let (y, u, row) = match is_plastic {
        true => ("pair", "both", "row"),
        false => ("&swarm->y[row]", "&swarm->u[row]", "row / 2u"),
    };
    let apply = match kinds {
        [true, true] => format!(
            "        if (IS_TANH[{row}]) {{\n            hyperbolic({y}, {u});\n        }} else {{\n            \
             sigmoid({y}, {u});\n        }}\n"
        ),
        [_, true] => format!("        hyperbolic({y}, {u});\n"),
        _ => format!("        sigmoid({y}, {u});\n"),
    };
    if is_plastic {
        return format!(
            "static void activate(swarm_t *swarm)\n{{\n    uint32_t row;\n\n    \
             for (row = 0; row < SWARM_ROWS; row++) {{\n        \
             const float pair[2] = {{swarm->y[row], swarm->y[row]}};\n        \
             float both[2];\n\n{apply}        swarm->u[row] = both[0];\n    }}\n}}\n"
        );
    }
    format!(
        "/* Rows 2k and 2k + 1 share a division. */\n\
         static void activate(swarm_t *swarm)\n{{\n    uint32_t row;\n\n    \
         for (row = 0; row < SWARM_ROWS; row += 2u) {{\n{apply}    }}\n}}\n"
    )
}

/// Tables and functions: `start`, `advance` and `swarm_activity`.
pub fn text(blueprint: &Blueprint, neurons: &RateNeurons) -> String {
    let is_plastic = blueprint.plasticity.is_some();
    let RateNeurons { rows_of, rows, start_active } = neurons;
    let mut text = String::new();
    let kinds = functions(rows);
    text += &floats("START", rows.iter().map(|row| row.start));
    text += &floats("RETENTION", rows.iter().map(|row| row.retention));
    text += &floats("DRIVE", rows.iter().map(|row| row.drive));
    if let Some(rule) = &blueprint.plasticity {
        text += &floats("SCALE", rows.iter().map(|row| row.scale));
        text += &plastic::text(blueprint, rule);
    }
    let has_afferent = rows.iter().any(|row| !row.afferent.is_empty());
    let has_recurrent = rows.iter().any(|row| !row.recurrent.is_empty());
    if has_afferent {
        text += &links("AFFERENT", rows.iter().map(|row| &row.afferent), is_plastic);
    }
    if has_recurrent {
        text += &links("RECURRENT", rows.iter().map(|row| &row.recurrent), is_plastic);
    }
    if kinds == [true, true] && is_plastic {
        let is_tanh = |row: &RateRow| usize::from(row.activation == Activation::Tanh);
        text += &numbers("IS_TANH", rows.iter().map(is_tanh));
    } else if kinds == [true, true] {
        let is_tanh = |pair: &[RateRow]| usize::from(pair[0].activation == Activation::Tanh);
        text += &numbers("IS_TANH", rows.chunks(2).map(is_tanh));
    }
    text += "/* The row of each neuron. */\n";
    text += &numbers("ROW", rows_of.iter().copied());
    text.push('\n');
    text += &activate(kinds, is_plastic);
    let start = if *start_active {
        "    activate(swarm);\n"
    } else {
        "    for (row = 0; row < SWARM_ROWS; row++) {\n        swarm->u[row] = 0.0f;\n    }\n"
    };
    let _ = write!(
        text,
        "\nstatic void start(swarm_t *swarm)\n{{\n    uint32_t row;\n\n    \
         for (row = 0; row < SWARM_ROWS; row++) {{\n        swarm->y[row] = START[row];\n    \
         }}\n{start}{}}}\n",
        plastic::start(blueprint)
    );
    text += "\n/* All substeps of a step. The order of every sum is part of the result. */\n";
    text += if has_afferent {
        "static void advance(swarm_t *swarm, const float *inputs)\n"
    } else {
        "static void advance(swarm_t *swarm)\n"
    };
    text += "{\n    float drive[SWARM_ROWS];\n    uint32_t substep, row";
    text += if has_afferent || has_recurrent { ", k" } else { "" };
    text += ";\n\n";
    text += if has_afferent { "    k = 0;\n" } else { "" };
    text += "    for (row = 0; row < SWARM_ROWS; row++) {\n        float sum = ";
    text += if is_plastic { "0.0f;\n\n" } else { "DRIVE[row];\n\n" };
    if has_afferent {
        let weight = weight("AFFERENT", "k", is_plastic);
        let _ = write!(
            text,
            "        for (; k < AFFERENT_END[row]; k++) {{\n            \
             sum = fmaf({weight}, inputs[AFFERENT_FROM[k]], sum);\n        }}\n"
        );
    }
    text += "        drive[row] = sum;\n    }\n    \
             for (substep = 0; substep < SWARM_SUBSTEPS; substep++) {\n";
    text += if has_recurrent { "        k = 0;\n" } else { "" };
    text += "        for (row = 0; row < SWARM_ROWS; row++) {\n            \
             float sum = drive[row];\n\n";
    if has_recurrent {
        let weight = weight("RECURRENT", "k", is_plastic);
        let _ = write!(
            text,
            "            for (; k < RECURRENT_END[row]; k++) {{\n                \
             sum = fmaf({weight}, swarm->u[RECURRENT_FROM[k]], sum);\n            }}\n"
        );
    }
    // With plastic weights, the scale is no part of them.
    text += if is_plastic { "            sum = fmaf(SCALE[row], sum, DRIVE[row]);\n" } else { "" };
    text += "            swarm->y[row] = fmaf(RETENTION[row], swarm->y[row], sum);\n        }\n        \
             activate(swarm);\n    }\n}\n";
    text += "\nfloat swarm_activity(const swarm_t *swarm, uint32_t neuron)\n{\n    \
             return swarm->u[ROW[neuron]];\n}\n";
    text
}
