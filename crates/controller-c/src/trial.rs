//! `test.c`, which compares a controller with its test vectors, and the `Makefile`.

use std::fmt::Write as _;

use sim_core::blueprint::{Blueprint, Neurons};

use crate::{Names, actions, has_radio, plastic, radio};

/// `test.c`.
pub fn text(blueprint: &Blueprint, names: &Names) -> String {
    let has_radio = has_radio(blueprint);
    let fields = actions(blueprint);
    let mut text = include_str!("../c/test.c").to_owned();
    let mut put = |place: &str, value: &str| text = text.replace(&format!("@{place}@"), value);
    put(
        "INCLUDES",
        if has_radio { "#include \"swarm_radio.h\"\n" } else { "#include \"controller.h\"\n" },
    );
    put("RADIO_MEMBER", if has_radio { "    swarm_radio_t radio;\n" } else { "" });
    put(
        "INIT_RADIO",
        if has_radio {
            "            swarm_radio_init(&robots[robot].radio, first_number + robot);\n            \
             robots[robot].radio.user = &robots[robot];\n"
        } else {
            ""
        },
    );
    let mut random = String::new();
    if crate::n_draws(blueprint) > 0 {
        random += "double swarm_uniform(swarm_t *swarm)\n{\n    robot_t *tested = swarm->user;\n\n    \
                   return tested->draws[tested->n_drawn++];\n}\n\n";
    }
    if has_radio && radio::n_draws(blueprint) > 0 {
        random += "double swarm_radio_uniform(swarm_radio_t *radio)\n{\n    \
                   return ((robot_t *)radio->user)->radio_draw;\n}\n\n";
    }
    put("RANDOM", &random);
    let has_doubles = fields.iter().any(|field| field.kind == "double");
    put("DOUBLES", if has_doubles { include_str!("../c/same_double.c") } else { "" });
    let has_words = has_radio || fields.iter().any(|field| field.kind == "uint32_t");
    put("SAME_WORD", if has_words { include_str!("../c/same_word.c") } else { "" });
    let ensembles = names.ensembles.iter().map(|name| format!("    \"{name}\",\n"));
    put("ENSEMBLES", &ensembles.collect::<String>());
    let ends = blueprint.ensembles.iter().map(|(_, neurons)| format!("    {}u,\n", neurons.end));
    put("ENSEMBLE_ENDS", &ends.collect::<String>());
    let mut stimuli = String::new();
    for (stimulus, name) in blueprint.stimuli.iter().zip(&names.stimuli) {
        let _ = write!(
            stimuli,
            "    for (i = 0; i < {}u; i++) {{\n        stimuli.{name}[i] = next_float();\n    }}\n",
            stimulus.inputs.len()
        );
    }
    if plastic::takes_reward(blueprint) {
        stimuli += "    stimuli.reward = next_float();\n";
    }
    put("STIMULI", &stimuli);
    let n_draws = crate::n_draws(blueprint);
    let reads_doubles = has_doubles || has_radio || n_draws > 0;
    put("NEXT_DOUBLE", if reads_doubles { include_str!("../c/next_double.c") } else { "" });
    put("DRAWS", if n_draws > 0 { DRAWS } else { "" });
    put("N_DRAWS", &n_draws.to_string());
    put(
        "VOLTAGES",
        match blueprint.neurons {
            Neurons::Rate(_) => "",
            Neurons::Spiking(_) => "    same_neurons(swarm_voltage, &tested->swarm);\n",
        },
    );
    let mut compare = String::new();
    for field in &fields {
        let same = match field.kind {
            "double" => "same_double",
            "float" => "same_float",
            _ => "same_word",
        };
        let name = field.name;
        let _ = match field.n {
            0 => writeln!(compare, "    {same}(\"{name}\", 0, actions.{name});"),
            n => writeln!(
                compare,
                "    for (i = 0; i < {n}u; i++) {{\n        \
                 {same}(\"{name}\", i, actions.{name}[i]);\n    }}"
            ),
        };
    }
    if has_radio {
        compare += "    test_radio(tested, &actions);\n";
    }
    put("ACTIONS", &compare);
    put("FIRST", if has_radio { "" } else { "    (void)first_number;\n" });
    // A perturbation may make a robot relay in the steps in which its radio must send.
    let skips = has_radio && blueprint.radio.transmitter.is_some();
    put("NO_COMPARISON", if skips { "static int no_comparison;\n" } else { "" });
    put("AND_COMPARED", if skips { " && no_comparison == 0" } else { "" });
    if has_radio {
        let place = "static void test_controller(";
        text = text.replacen(place, &(test_radio(blueprint, names) + place), 1);
    }
    text
}

const DRAWS: &str = "    for (i = 0; i < @N_DRAWS@u; i++) {
        tested->draws[i] = next_double();
    }
";

/// The function that compares a radio.
fn test_radio(blueprint: &Blueprint, names: &Names) -> String {
    let radio = &blueprint.radio;
    let observes = radio::observes(blueprint);
    let frame = |call: &dyn Fn(&str, &str) -> String| {
        let mut text = call("originator", "word") + &call("hops", "word");
        text += "    for (i = 0; i < SWARM_MESSAGE; i++) {\n    ";
        text += &call("message[i]", "float");
        text += "    }\n";
        if observes {
            text += &call("sending_direction[0]", "float");
            text += &call("sending_direction[1]", "float");
        }
        text
    };
    let mut text = String::from(
        "static void test_radio(robot_t *tested, const swarm_actions_t *decided)\n{\n",
    );
    if radio.receiver.is_some() {
        text += "    swarm_heard_t heard[SWARM_SECTORS];\n    swarm_stimuli_t stimuli;\n    \
                 uint32_t sector;\n";
    }
    if radio.transmitter.is_some() {
        text += "    swarm_actions_t actions = *decided;\n    swarm_frame_t frame;\n";
    }
    text += "    uint32_t i, mode;\n\n";
    if radio.receiver.is_some() {
        text += "    for (sector = 0; sector < SWARM_SECTORS; sector++) {\n";
        let read = frame(&|member, kind| {
            format!("        heard[sector].frame.{member} = next_{kind}();\n")
        });
        text += &read.replace("\n    for", "\n        for").replace("\n    }", "\n        }");
        if observes {
            text += "        heard[sector].facing[0] = next_float();\n        \
                     heard[sector].facing[1] = next_float();\n";
        }
        text += "        heard[sector].signal = next_float();\n    }\n    \
                 tested->radio_draw = next_double();\n    \
                 memset(&stimuli, 0, sizeof stimuli);\n    \
                 sector = swarm_radio_receive(&tested->radio, heard, &stimuli);\n    \
                 same_word(\"sector\", 0, sector);\n";
        for (stimulus, name) in blueprint.stimuli.iter().zip(&names.stimuli) {
            if radio::reading(stimulus.sensor, radio.message_len).is_some() {
                let _ = write!(
                    text,
                    "    for (i = 0; i < {}u; i++) {{\n        \
                     same_float(\"radio {name}\", i, stimuli.{name}[i]);\n    }}\n",
                    stimulus.inputs.len()
                );
            }
        }
    }
    text += "    mode = next_word();\n";
    if let Some(transmitter) = &radio.transmitter {
        text += "    tested->radio_draw = next_double();\n";
        if actions(blueprint).iter().any(|field| field.name == "send") {
            let _ = write!(
                text,
                "    /* A perturbation of the task may overrule the decision, but not the radio's first \
                 steps. */\n    if (tested->radio.step >= {}u) {{\n        \
                 actions.send = mode;\n    }}\n",
                transmitter.sending_steps
            );
        }
        text += "    swarm_radio_send(&tested->radio, &actions, &frame);\n    \
                 if (mode == 2u) {\n        \
                 tested->radio.sends = 0;\n        no_comparison = 1;\n    }\n";
        text += &frame(&|member, kind| {
            let name = member.split('[').next().unwrap_or(member);
            let index = if member.contains("[i]") {
                "i"
            } else if member.contains("[1]") {
                "1"
            } else {
                "0"
            };
            format!("    same_{kind}(\"frame {name}\", {index}, frame.{member});\n")
        });
        text += "    no_comparison = 0;\n";
    } else {
        text += "    (void)mode;\n    (void)decided;\n    (void)next_double();\n";
    }
    text + "}\n\n"
}

/// The `Makefile`.
pub fn makefile(blueprint: &Blueprint) -> String {
    let (sources, headers) = if has_radio(blueprint) {
        ("controller.c swarm_radio.c", "controller.h swarm_radio.h")
    } else {
        ("controller.c", "controller.h")
    };
    include_str!("../c/Makefile").replace("@SOURCES@", sources).replace("@HEADERS@", headers)
}
