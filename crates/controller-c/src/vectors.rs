//! Recorded episodes, with which the test of a controller compares every bit.

use std::ops::Range;

use sim_core::blueprint::Blueprint;
use sim_core::{RadioTestimony, Testimony};

use crate::{actions, has_radio, n_inputs, n_neurons, plastic, radio};

/// Identifies the format.
pub const MAGIC: [u8; 8] = *b"swarm-c1";

/// The test vectors of a controller: a header, and then a record per trial, step and robot, in
/// this order. Everything is in little-endian words of 32 bits.
#[derive(Debug, Clone)]
pub struct Vectors {
    bytes: Vec<u8>,
    fields: Vec<(&'static str, bool)>,
    n_inputs: usize,
    n_neurons: usize,
    takes_reward: bool,
    has_radio: bool,
    /// Places of the radio's stimuli among its readings.
    readings: Vec<Range<usize>>,
    has_facing: bool,
    sending_steps: u32,
    n_records: u32,
}

/// Place of the number of records in the header: the magic, the number of the first robot, and the
/// numbers of robots, of steps and of records.
const N_RECORDS: Range<usize> = 20..24;

impl Vectors {
    /// No records yet. `robots`: the numbers of the robots that testify, among all; `n_steps`: the
    /// steps of each episode.
    pub fn new(blueprint: &Blueprint, robots: &Range<usize>, n_steps: u32) -> Self {
        let mut bytes = MAGIC.to_vec();
        for word in [robots.start as u32, robots.len() as u32, n_steps, 0] {
            bytes.extend(word.to_le_bytes());
        }
        let message_len = blueprint.radio.message_len;
        let stimuli = blueprint.stimuli.iter();
        let fields = actions(blueprint);
        let fields = fields.iter().map(|field| (field.name, field.kind == "double"));
        Self {
            bytes,
            fields: fields.collect(),
            n_inputs: n_inputs(blueprint),
            n_neurons: n_neurons(blueprint),
            takes_reward: plastic::takes_reward(blueprint),
            has_radio: has_radio(blueprint),
            readings: stimuli.filter_map(|of| radio::reading(of.sensor, message_len)).collect(),
            has_facing: radio::observes(blueprint),
            sending_steps: blueprint.radio.transmitter.as_ref().map_or(0, |of| of.sending_steps),
            n_records: 0,
        }
    }

    /// Adds a robot's step. Testimonies come in the order of [`Simulation::testify`], one trial
    /// after the other.
    ///
    /// [`Simulation::testify`]: sim_core::Simulation::testify
    pub fn add(&mut self, testimony: &Testimony) {
        debug_assert_eq!(
            testimony.stimuli.len(),
            self.n_inputs,
            "the testimony is of the blueprint"
        );
        debug_assert_eq!(
            testimony.activity.len(),
            self.n_neurons,
            "the testimony is of the blueprint"
        );
        self.floats(&testimony.stimuli);
        if self.takes_reward {
            self.floats(&[testimony.reward]);
        }
        for &draw in &testimony.draws {
            self.double(draw);
        }
        self.floats(&testimony.activity);
        self.floats(&testimony.voltages);
        for (name, is_double) in self.fields.clone() {
            match name {
                "wheel_right" => self.real(testimony.wheels[0], is_double),
                "wheel_left" => self.real(testimony.wheels[1], is_double),
                "led" => self.word(testimony.led),
                "send" => self.word(testimony.sends.into()),
                _ => testimony.message.iter().for_each(|&value| self.real(value, is_double)),
            }
        }
        if self.has_radio {
            self.radio(testimony);
        }
        self.n_records += 1;
    }

    /// Number of records.
    pub fn n_records(&self) -> u32 {
        self.n_records
    }

    /// Bytes so far.
    pub fn n_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The content of the file.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes[N_RECORDS].copy_from_slice(&self.n_records.to_le_bytes());
        self.bytes
    }

    fn radio(&mut self, Testimony { radio, step, .. }: &Testimony) {
        if !radio.heard.is_empty() {
            self.received(radio);
        }
        // A perturbation may make a robot relay in the steps in which its radio must send.
        let overruled = *step < self.sending_steps && !radio.sends;
        self.word(if overruled { 2 } else { radio.sends.into() });
        self.double(radio.quantisation);
        if let Some(sent) = &radio.sent {
            self.frame(sent);
        }
    }

    fn received(&mut self, radio: &RadioTestimony) {
        for heard in &radio.heard {
            self.frame(&heard.frame);
            if self.has_facing {
                heard.facing.iter().for_each(|&value| self.real(value, false));
            }
            self.real(heard.signal, false);
        }
        self.double(radio.reception);
        self.word(radio.sector.map_or(u32::MAX, |sector| sector as u32));
        for range in self.readings.clone() {
            self.floats(&radio.readings[range]);
        }
    }

    fn frame(&mut self, frame: &sim_core::Frame) {
        self.word(frame.originator);
        self.word(frame.hops);
        frame.message.iter().for_each(|&value| self.real(value, false));
        if self.has_facing {
            frame.sending_direction.iter().for_each(|&value| self.real(value, false));
        }
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.word(value.to_bits()));
    }

    /// A number that the simulation has in double precision, in the precision of C.
    fn real(&mut self, value: f64, is_double: bool) {
        if is_double { self.double(value) } else { self.word((value as f32).to_bits()) }
    }

    fn double(&mut self, value: f64) {
        self.bytes.extend(value.to_bits().to_le_bytes());
    }

    fn word(&mut self, word: u32) {
        self.bytes.extend(word.to_le_bytes());
    }
}
