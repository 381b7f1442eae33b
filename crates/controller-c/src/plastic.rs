//! Weights that change while the robot lives, in C.

use std::fmt::Write as _;

use sim_core::blueprint::{Blueprint, Neurons, Plasticity};

use crate::literals::{float, floats, numbers, table, unsigned_len};
use crate::n_inputs;

/// Whether the robot must tell the controller the reward of each step.
pub fn takes_reward(blueprint: &Blueprint) -> bool {
    blueprint.plasticity.as_ref().is_some_and(|rule| rule.discounts.is_some())
}

/// Number of steps whose activities are stored.
fn n_slots(rule: &Plasticity) -> usize {
    rule.discounts.as_ref().map_or(1, Vec::len)
}

/// Number of activities that the rule may read: neurons, nodes of encoders, inputs.
fn n_activities(blueprint: &Blueprint) -> usize {
    let n_sources = match &blueprint.neurons {
        Neurons::Rate(neurons) => neurons.rows.len(),
        Neurons::Spiking(neurons) => neurons.outgoing.len(),
    };
    n_sources + n_inputs(blueprint)
}

/// Sizes; empty without plasticity.
pub fn defines(blueprint: &Blueprint) -> String {
    let Some(rule) = &blueprint.plasticity else { return String::new() };
    format!(
        "#define SWARM_SYNAPSES {}u\n/* Steps whose activities the plasticity of weights remembers. */\n\
         #define SWARM_MEMORY {}u\n#define SWARM_ACTIVITIES {}u\n",
        rule.weights.len(),
        n_slots(rule),
        n_activities(blueprint)
    )
}

/// Members of the state; empty without plasticity.
pub fn members(blueprint: &Blueprint) -> String {
    let Some(rule) = &blueprint.plasticity else { return String::new() };
    let mut text = String::from(
        "    uint32_t step; /* number of steps so far */\n    \
         float weight[SWARM_SYNAPSES]; /* they change */\n    \
         float past[SWARM_MEMORY][SWARM_ACTIVITIES]; /* activities of earlier steps */\n",
    );
    text += match rule.discounts {
        Some(_) => "    float rewards[SWARM_MEMORY]; /* of earlier steps */\n",
        None => "",
    };
    text
}

/// Bytes of the state, and of the tables.
pub fn lens(blueprint: &Blueprint) -> [usize; 2] {
    let Some(rule) = &blueprint.plasticity else { return [0, 0] };
    let n_rewards = rule.discounts.as_ref().map_or(0, Vec::len);
    let state = 4 * (1 + rule.weights.len() + n_slots(rule) * n_activities(blueprint) + n_rewards);
    let ends = unsigned_len(rule.weights.len()) + 2 * unsigned_len(n_activities(blueprint));
    let tables = 4 * (rule.weights.len() + n_rewards) + rule.synapses.len() * (16 + ends);
    [state, tables]
}

/// Tables, and the functions `learn`, before the substeps of a step, and `remember`, after them.
pub fn text(blueprint: &Blueprint, rule: &Plasticity) -> String {
    let mut text = floats("INITIAL_WEIGHT", rule.weights.iter().copied());
    text +=
        "/* The plastic synapses: number, presynaptic and postsynaptic activity, A, B, C, D. */\n";
    text += &numbers("PLASTIC", rule.synapses.iter().map(|synapse| synapse.synapse));
    text += &numbers("PLASTIC_PRE", rule.synapses.iter().map(|synapse| synapse.pre));
    text += &numbers("PLASTIC_POST", rule.synapses.iter().map(|synapse| synapse.post));
    let row = |values: [f32; 4]| format!("{{{}}}", values.map(float).join(", "));
    let rows: Vec<String> = rule.synapses.iter().map(|synapse| row(synapse.coefficients)).collect();
    let rows = if rows.is_empty() { vec!["{0}".to_owned()] } else { rows };
    text += &table("float", "COEFFICIENT", "[][4]", &rows);
    if let Some(discounts) = &rule.discounts {
        text += &floats("DISCOUNT", discounts.iter().copied());
    }
    text += "\n/* Changes the weights by earlier activities";
    text += if rule.discounts.is_some() { " and the rewards since then. */\n" } else { ". */\n" };
    text += if rule.discounts.is_some() {
        "static void learn(swarm_t *swarm, float reward)\n"
    } else {
        "static void learn(swarm_t *swarm)\n"
    };
    text += "{\n    const float *past = swarm->past[swarm->step % SWARM_MEMORY];\n    \
             float received = 1.0f;\n    uint32_t i;\n\n";
    if rule.discounts.is_some() {
        text += "    if (swarm->step > 0u) {\n        \
                 swarm->rewards[(swarm->step - 1u) % SWARM_MEMORY] = reward;\n    }\n";
    }
    text += "    if (swarm->step < SWARM_MEMORY) {\n        return;\n    }\n";
    if rule.discounts.is_some() {
        text += "    received = 0.0f;\n    for (i = 0; i < SWARM_MEMORY; i++) {\n        \
                 const float then = swarm->rewards[(swarm->step + i) % SWARM_MEMORY];\n\n        \
                 received = fmaf(DISCOUNT[i], then, received);\n    }\n";
    }
    let max = float(rule.max_weight);
    let _ = write!(
        text,
        "    for (i = 0; i < {}u; i++) {{\n        const float *factor = COEFFICIENT[i];\n        \
         const float pre = past[PLASTIC_PRE[i]];\n        \
         const float post = past[PLASTIC_POST[i]];\n        \
         const float slope = fmaf(factor[0], post, factor[2]);\n        \
         const float rest = fmaf(factor[1], post, factor[3]);\n        \
         const float change = fmaf(slope, pre, rest);\n        \
         float weight = fmaf(received, change, swarm->weight[PLASTIC[i]]);\n\n        \
         weight = weight < {max} ? weight : {max};\n        \
         weight = weight > -{max} ? weight : -{max};\n        \
         swarm->weight[PLASTIC[i]] = weight;\n    }}\n}}\n",
        rule.synapses.len().max(1)
    );
    let n_inputs = n_inputs(blueprint);
    let (n_sources, activity) = match &blueprint.neurons {
        Neurons::Rate(_) => ("SWARM_ROWS", "swarm->u[i]"),
        Neurons::Spiking(_) => {
            ("SWARM_SOURCES", "(float)swarm->counts[i] * (1.0f / (float)SWARM_SUBSTEPS)")
        }
    };
    let _ = write!(
        text,
        "\n/* Stores the activities of a step. */\n\
         static void remember(swarm_t *swarm, const float *inputs)\n{{\n    \
         float *past = swarm->past[swarm->step % SWARM_MEMORY];\n    uint32_t i;\n\n    \
         for (i = 0; i < {n_sources}; i++) {{\n        past[i] = {activity};\n    }}\n    \
         for (i = 0; i < {n_inputs}u; i++) {{\n        past[{n_sources} + i] = inputs[i];\n    }}\n    \
         swarm->step++;\n}}\n"
    );
    text
}

/// The weights and the memory at the start.
pub fn start(blueprint: &Blueprint) -> &'static str {
    match (&blueprint.plasticity, takes_reward(blueprint)) {
        (None, _) => "",
        (Some(_), false) => {
            "    memcpy(swarm->weight, INITIAL_WEIGHT, sizeof swarm->weight);\n    \
             memset(swarm->past, 0, sizeof swarm->past);\n    swarm->step = 0;\n"
        }
        (Some(_), true) => {
            "    memcpy(swarm->weight, INITIAL_WEIGHT, sizeof swarm->weight);\n    \
             memset(swarm->past, 0, sizeof swarm->past);\n    \
             memset(swarm->rewards, 0, sizeof swarm->rewards);\n    swarm->step = 0;\n"
        }
    }
}
