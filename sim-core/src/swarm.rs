//! State of all robots of one trial, as arrays indexed by robot.

use std::ops::Range;

use crate::communication::{FrameOrigin, Mode};
use crate::controllers::Action;
use crate::perturbations::Sensing;
use crate::record::{ReceivedFrame, RobotRecord};
use crate::torus::Vec2;

/// Positions, actions and received frames of all robots.
#[derive(Debug, Clone)]
pub(crate) struct Swarm {
    /// Positions, cm.
    pub positions: Vec<Vec2>,
    /// Headings, in \[0, 2 pi).
    pub headings: Vec<f64>,
    /// Right and left wheel, in \[-1, 1\].
    pub wheels: Vec<[f64; 2]>,
    /// Colours of the LEDs, 0 off.
    pub leds: Vec<u32>,
    /// Communication modes.
    pub modes: Vec<Mode>,
    /// Own messages, `[robot][component]`.
    pub messages: Vec<f64>,
    /// The frame that each robot took from the air in this step.
    pub received: Vec<Option<Received>>,
    /// Messages of those frames, `[robot][component]`; zero without a frame.
    pub received_messages: Vec<f64>,
    /// Components of a message.
    pub message_len: usize,
    /// Whether each robot's controller gets light readings.
    pub photosensitive: Vec<bool>,
    /// Whether each robot has failed: it stands still, its LED is off, and no robot hears it.
    pub failed: Vec<bool>,
    /// Whether an intervention has removed each robot; empty if none has.
    pub removed: Vec<bool>,
    /// Whether each robot carries something.
    pub carries: Vec<bool>,
    /// Headings of the radios, in \[0, 2 pi); empty if they are those of their robots.
    pub antenna_headings: Vec<f64>,
    /// What a pseudo-reality does to each radio; empty without one.
    pub radio_flaws: Vec<Option<RadioFlaw>>,
    /// Whether any robot changed its place in this step.
    pub moved: bool,
    /// Whether any robot changed its heading in this step.
    pub turned: bool,
}

/// What a pseudo-reality does to a robot's radio in a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadioFlaw {
    /// What becomes of the strength.
    pub sensing: Sensing,
    /// Noise of the strength, a standard normal number.
    pub normal: f64,
    /// Whether the robot receives nothing.
    pub is_lost: bool,
}

/// The headings of the radios, given those of the robots and `Swarm::antenna_headings`.
pub(crate) fn antennas<'a>(headings: &'a [f64], antenna_headings: &'a [f64]) -> &'a [f64] {
    if antenna_headings.is_empty() { headings } else { antenna_headings }
}

/// A frame taken from the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Received {
    /// The robot that emitted it.
    pub emitter: usize,
    /// The receiving sector.
    pub sector: usize,
    /// Logarithm of the frame's strength.
    pub log_strength: f64,
    /// (cos, sin) of the receiving sector in the receiver's own frame of reference.
    pub receiving_direction: Vec2,
    /// (cos, sin) of the sending sector, in its robot's own frame of reference; zero if not
    /// computed.
    pub sending_direction: Vec2,
    /// Its origin, with the sending direction.
    pub origin: FrameOrigin,
}

impl Received {
    /// Strength of the frame.
    pub fn signal(&self) -> f64 {
        libm::exp(self.log_strength)
    }
}

impl Swarm {
    /// The swarm at the start of a trial: no frames received, everything off, mode send.
    pub fn new(positions: Vec<Vec2>, headings: Vec<f64>, message_len: usize) -> Self {
        let n = positions.len();
        Self {
            positions,
            headings,
            wheels: vec![[0.0; 2]; n],
            leds: vec![0; n],
            modes: vec![Mode::Send; n],
            messages: vec![0.0; n * message_len],
            received: vec![None; n],
            received_messages: vec![0.0; n * message_len],
            message_len,
            photosensitive: vec![false; n],
            failed: vec![false; n],
            removed: Vec::new(),
            carries: vec![false; n],
            antenna_headings: Vec::new(),
            radio_flaws: Vec::new(),
            moved: true,
            turned: true,
        }
    }

    /// Fills in the record of a robot, except the data of its controller and of the task.
    pub fn record(&self, robot: usize, record: &mut RobotRecord) {
        let message = self.message_range(robot);
        record.position = self.positions[robot];
        record.heading = self.headings[robot];
        record.received = self.received[robot].as_ref().map(|received| ReceivedFrame {
            emitter: received.emitter,
            originator: received.origin.originator,
            hops: received.origin.hops,
            sector: received.sector,
            signal: self.measured(robot, received.signal()),
        });
        refill(&mut record.received_message, &self.received_messages[message.clone()]);
        record.wheels = self.wheels[robot];
        record.led = self.leds[robot];
        record.mode = self.modes[robot];
        refill(&mut record.message, &self.messages[message]);
        record.failed = self.failed[robot];
        record.carries = self.carries[robot];
        record.touches = false;
        record.target = None;
    }

    /// The headings of the radios.
    pub fn antennas(&self) -> &[f64] {
        antennas(&self.headings, &self.antenna_headings)
    }

    /// The strength that a robot's radio measures of a frame of this strength.
    pub fn measured(&self, robot: usize, strength: f64) -> f64 {
        match self.radio_flaws.get(robot) {
            Some(Some(flaw)) => flaw.sensing.distort(strength, 1.0, flaw.normal).clamp(0.0, 1.0),
            _ => strength,
        }
    }

    /// Whether a robot's radio receives nothing in this step.
    pub fn has_lost(&self, robot: usize) -> bool {
        matches!(self.radio_flaws.get(robot), Some(Some(flaw)) if flaw.is_lost)
    }

    /// The strength that a robot's radio measures of the received frame; 0 without a frame.
    pub fn signal(&self, robot: usize) -> f64 {
        let received = self.received[robot].as_ref();
        received.map_or(0.0, |received| self.measured(robot, received.signal()))
    }

    /// Range of a robot's message in `messages` and `received_messages`.
    pub fn message_range(&self, robot: usize) -> Range<usize> {
        robot * self.message_len..(robot + 1) * self.message_len
    }

    /// Removes a robot for good.
    pub fn remove(&mut self, robot: usize) {
        self.removed.resize(self.positions.len(), false);
        self.removed[robot] = true;
        // Its neighbours lose it.
        self.moved = true;
    }

    /// Whether a robot is removed, so that no other robot senses it.
    pub fn is_removed(&self, robot: usize) -> bool {
        self.removed.get(robot) == Some(&true)
    }

    /// Stops failed robots, and turns their LEDs off.
    pub fn stop_failed(&mut self) {
        for robot in (0..self.failed.len()).filter(|&robot| self.failed[robot]) {
            self.wheels[robot] = [0.0; 2];
            self.leds[robot] = 0;
        }
    }

    /// The robot's action, reset to standing still, LED off, sending zeros.
    pub fn fresh_action(&mut self, robot: usize) -> Action<'_> {
        let message = self.message_range(robot);
        let action = Action {
            wheels: &mut self.wheels[robot],
            led: &mut self.leds[robot],
            mode: &mut self.modes[robot],
            message: &mut self.messages[message],
        };
        *action.wheels = [0.0; 2];
        *action.led = 0;
        *action.mode = Mode::Send;
        action.message.fill(0.0);
        action
    }
}

/// Refills a list without another allocation.
fn refill(list: &mut Vec<f64>, values: &[f64]) {
    list.clear();
    list.extend_from_slice(values);
}
