//! The radio's half of a controller: the choice of the received frame, and what is sent.

use std::fmt::Write as _;
use std::ops::Range;

use experiment_file::{SendingDirection, SensorQuery};
use sim_core::blueprint::{Blueprint, Lattice, Stimulus};

use crate::literals::{float, floats};
use crate::{Names, actions};

/// Whether frames carry the direction in which they were sent.
pub fn observes(blueprint: &Blueprint) -> bool {
    let mut stimuli = blueprint.stimuli.iter();
    stimuli.any(|stimulus| stimulus.sensor == SensorQuery::ReceiverSendingDirection)
}

/// The place of a stimulus among the radio's readings; `None` if it is no reading of the radio.
pub fn reading(sensor: SensorQuery, message_len: usize) -> Option<Range<usize>> {
    let after = |first: usize, n: usize| Some(message_len + first..message_len + first + n);
    match sensor {
        SensorQuery::ReceiverMessage => Some(0..message_len),
        SensorQuery::ReceiverSignal => after(0, 1),
        SensorQuery::ReceiverReceivingDirection => after(1, 2),
        SensorQuery::ReceiverSendingDirection => after(3, 2),
        SensorQuery::ReceiverState => after(5, 1),
        _ => None,
    }
}

/// `swarm_radio.h`.
pub fn header(blueprint: &Blueprint) -> String {
    let radio = &blueprint.radio;
    let observes = observes(blueprint);
    let mut text = String::from(
        "/* The radio of a robot: which received frame counts, and which frame it sends. */\n\
         #ifndef SWARM_RADIO_H\n#define SWARM_RADIO_H\n\n#include \"controller.h\"\n\n\
         #ifdef __cplusplus\nextern \"C\" {\n#endif\n\n\
         /* Components of a message. */\n",
    );
    let _ = writeln!(text, "#define SWARM_MESSAGE {}u", radio.message_len);
    text += "/* Instead of a number: no frame, no sector. */\n#define SWARM_NO_FRAME 0xffffffffu\n\n\
             /* A frame on the air. */\ntypedef struct {\n    \
             uint32_t originator; /* number of the robot that sent the message first */\n    \
             uint32_t hops; /* transmissions so far, from 1; SWARM_NO_FRAME: this is no frame */\n    \
             float message[SWARM_MESSAGE]; /* components, in [0, 1] if they are quantised */\n";
    if observes {
        text += "    /* (cos, sin) of the originator's sector through which it sent, in its own frame of\n     \
                 * reference; zeros until the first robot has relayed it */\n    \
                 float sending_direction[2];\n";
    }
    text += "} swarm_frame_t;\n\n/* The radio of one robot. Its members are not for others, except the last. */\n\
             typedef struct {\n    uint32_t number; /* of the robot */\n    \
             uint32_t step; /* up to the first in which it may relay */\n    \
             uint32_t sends; /* whether it sent its own message in the last step */\n    \
             swarm_frame_t received;\n    \
             void *user; /* Yours: the radio does not use it. */\n} swarm_radio_t;\n\n\
             /* Switches a radio on. Every robot of a swarm has another number, below \
             SWARM_NO_FRAME. */\n\
             void swarm_radio_init(swarm_radio_t *radio, uint32_t number);\n";
    if let Some(receiver) = &radio.receiver {
        let _ = write!(
            text,
            "\n/* Sectors around the robot, counter-clockwise; the middle of the first is ahead. */\n\
             #define SWARM_SECTORS {}u\n\n\
             /* The strongest frame that a sector hears. */\ntypedef struct {{\n    \
             swarm_frame_t frame;\n",
            receiver.directions.len()
        );
        if observes {
            text += "    /* (cos, sin) of the emitter's sector that faces this robot, in the emitter's own frame \
                     of\n     * reference: send through each sector's antenna which one it is */\n    \
                     float facing[2];\n";
        }
        text += "    float signal; /* strength in (0, 1]: exp(-decay_rho distance - decay_phi angle) */\n\
                 } swarm_heard_t;\n\n\
                 /* Before swarm_step: chooses among the strongest frames of all sectors, and fills in the \
                 stimuli\n * of the radio. Returns the sector of the chosen frame, or SWARM_NO_FRAME. */\n\
                 uint32_t swarm_radio_receive(swarm_radio_t *radio, const swarm_heard_t \
                 heard[SWARM_SECTORS],\n    swarm_stimuli_t *stimuli);\n";
    }
    if let Some(transmitter) = &radio.transmitter {
        text += "\n/* After swarm_step: the frame to send in all directions until the next step. */\n\
                 void swarm_radio_send(swarm_radio_t *radio, const swarm_actions_t *actions, \
                 swarm_frame_t *frame);\n";
        if transmitter.initial_frame {
            text += "/* Before the first step, a robot sends the message 0: its number, 1 hop, zeros. */\n";
        }
    }
    let n_draws = n_draws(blueprint);
    if n_draws > 0 {
        let _ = write!(
            text,
            "\n/* You write this function. It returns a random number, uniform in [0, 1) and \
             independent of\n * all others: {} per step. */\n\
             double swarm_radio_uniform(swarm_radio_t *radio);\n",
            match (radio.receiver.is_some(), n_draws) {
                (true, 1) => "one for the choice of a frame",
                (true, _) => "one for the choice of a frame, and one for that of a symbol",
                _ => "one for the choice of a symbol",
            }
        );
    }
    text + "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n"
}

/// Number of uniform numbers that the radio draws in a step.
pub fn n_draws(blueprint: &Blueprint) -> usize {
    let radio = &blueprint.radio;
    usize::from(radio.receiver.is_some()) + usize::from(quantiser(blueprint).is_some())
}

fn quantiser(blueprint: &Blueprint) -> Option<&Lattice> {
    blueprint.radio.transmitter.as_ref()?.quantiser.as_ref()
}

/// `swarm_radio.c`.
pub fn text(blueprint: &Blueprint, names: &Names) -> String {
    let radio = &blueprint.radio;
    let head = include_str!("../c/head.c").replace("\"controller.h\"", "\"swarm_radio.h\"");
    let mut parts = vec![head];
    if let Some(lattice) = quantiser(blueprint) {
        let n = lattice.levels.len();
        let n_points = n.pow(radio.message_len as u32);
        parts.push(format!(
            "#define LEVELS {n}u\n#define POINTS {n_points}u\n#define SLOPE ({})\n\n{}",
            float(lattice.slope),
            floats("LEVEL", lattice.levels.iter().map(|&level| level as f32))
        ));
        parts.push(crate::controller::power());
        parts.push(include_str!("../c/root.c").to_owned());
        parts.push(include_str!("../c/quantise.c").to_owned());
    }
    parts.push(include_str!("../c/no_frame.c").to_owned());
    parts.push(
        "void swarm_radio_init(swarm_radio_t *radio, uint32_t number)\n{\n    \
         radio->number = number;\n    radio->step = 0;\n    radio->sends = 1u;\n    \
         radio->user = NULL;\n    no_frame(&radio->received);\n}\n"
            .to_owned(),
    );
    if let Some(receiver) = &radio.receiver {
        let mut receive = format!("#define MAX_HOPS {}u\n", receiver.max_hops);
        let mut stimuli = blueprint.stimuli.iter();
        if stimuli.any(|stimulus| stimulus.sensor == SensorQuery::ReceiverReceivingDirection) {
            let directions = receiver.directions.as_flattened();
            receive += "\n/* (cos, sin) of each sector. */\n";
            receive += &floats("DIRECTION", directions.iter().map(|&value| value as f32));
        }
        let observe = if observes(blueprint) {
            "        if (radio->received.hops == 1u) {\n            \
             memcpy(radio->received.sending_direction, heard[sector].facing,\n                \
             sizeof radio->received.sending_direction);\n        }\n"
        } else {
            ""
        };
        let fill: String = blueprint
            .stimuli
            .iter()
            .zip(&names.stimuli)
            .map(|(stimulus, name)| fill(stimulus, name, blueprint, receiver.sending_direction))
            .collect();
        let fill = if fill.is_empty() { "    (void)stimuli;\n".to_owned() } else { fill };
        receive.push('\n');
        receive += &include_str!("../c/receive.c")
            .replace("@OBSERVE@", observe)
            .replace("@STIMULI@", &fill);
        parts.push(receive);
    }
    if radio.transmitter.is_some() {
        parts.push(send(blueprint));
    }
    parts.join("\n")
}

/// Fills in a stimulus of the radio; empty for others.
fn fill(
    stimulus: &Stimulus,
    name: &str,
    blueprint: &Blueprint,
    sending_direction: SendingDirection,
) -> String {
    let n = stimulus.inputs.len();
    let of_frame = |index: usize, value: &str| {
        format!("    stimuli->{name}[{index}] = sector == SWARM_NO_FRAME ? 0.0f : {value};\n")
    };
    match stimulus.sensor {
        SensorQuery::ReceiverMessage => (0..n.min(blueprint.radio.message_len))
            .map(|index| {
                format!("    stimuli->{name}[{index}] = radio->received.message[{index}];\n")
            })
            .collect(),
        SensorQuery::ReceiverSignal => of_frame(0, "heard[sector].signal"),
        SensorQuery::ReceiverReceivingDirection => (0..n)
            .map(|index| of_frame(index, &format!("DIRECTION[2u * sector + {index}u]")))
            .collect(),
        SensorQuery::ReceiverSendingDirection => {
            let of = match sending_direction {
                SendingDirection::Emitter => "heard[sector].facing",
                SendingDirection::Originator => "radio->received.sending_direction",
            };
            (0..n).map(|index| of_frame(index, &format!("{of}[{index}]"))).collect()
        }
        SensorQuery::ReceiverState => {
            format!("    stimuli->{name}[0] = radio->sends != 0u ? 1.0f : 0.0f;\n")
        }
        _ => String::new(),
    }
}

fn send(blueprint: &Blueprint) -> String {
    let radio = &blueprint.radio;
    let fields = actions(blueprint);
    let has = |name: &str| fields.iter().any(|field| field.name == name);
    let steps = radio.transmitter.as_ref().map_or(0, |transmitter| transmitter.sending_steps);
    let mut text = String::from(
        "void swarm_radio_send(swarm_radio_t *radio, const swarm_actions_t *actions, \
         swarm_frame_t *frame)\n{\n",
    );
    let is_quantised = quantiser(blueprint).is_some();
    if is_quantised {
        text += "    /* One draw per step, needed or not. */\n    \
                 const double u = swarm_radio_uniform(radio);\n";
    }
    text += "    uint32_t i;\n\n";
    text += if has("send") {
        "    radio->sends = actions->send;\n"
    } else if has("message") {
        "    radio->sends = 1u;\n"
    } else {
        "    (void)actions;\n    radio->sends = 1u;\n"
    };
    if steps > 0 {
        let _ = write!(
            text,
            "    /* Frames have to spread before relaying makes sense. */\n    \
             if (radio->step < {steps}u) {{\n        radio->step++;\n        \
             radio->sends = 1u;\n    }}\n"
        );
    }
    text += "    if (radio->sends == 0u) {\n        *frame = radio->received;\n        \
             if (frame->hops != SWARM_NO_FRAME) {\n            frame->hops++;\n        }\n        \
             return;\n    }\n    memset(frame, 0, sizeof *frame);\n    \
             frame->originator = radio->number;\n    frame->hops = 1u;\n    \
             for (i = 0; i < SWARM_MESSAGE; i++) {\n";
    text += if has("message") {
        "        frame->message[i] = (float)actions->message[i];\n"
    } else {
        "        frame->message[i] = 0.0f;\n"
    };
    text += "    }\n";
    text += if is_quantised { "    quantise(frame->message, u);\n" } else { "" };
    text + "}\n"
}
