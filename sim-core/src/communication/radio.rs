//! All robots' radios in one trial: the frames on the air, their receivers, and the random
//! choices.

use super::Mode;
use super::antenna::Antenna;
use super::draws::Draws;
use super::frame::{Ether, FrameOrigin};
use super::hearing::{Heard, Hearing, Listeners};
use super::quantisation::Scratch;
use crate::neighbours::Neighbours;
use crate::swarm::{Received, Swarm, antennas};
use crate::testimony::{Frame, HeardFrame};
use crate::torus::Vec2;
use crate::world::{RobotGroup, World};
use determinism::Isa;
use determinism::random::Stream;
use experiment_file::SendingDirection;

/// State of the wireless link.
#[derive(Debug)]
pub(crate) struct Radio {
    ether: Ether,
    hearing: Hearing,
    /// Reach of each transmitter that is not muted, cm; negative if the robot does not emit.
    reaches: Vec<f64>,
    /// Whether each robot is muted.
    silent: Vec<bool>,
    /// For the choice among valid frames; empty if no robot receives.
    reception: Draws,
    /// For quantisation; empty if no robot quantises.
    quantisation: Draws,
    scratch: Scratch,
    /// Scratch: the sectors of a robot whose strongest frame is valid.
    valid: Vec<usize>,
}

impl Radio {
    /// The air before the first step. One antenna and one stream for each purpose per robot.
    pub fn new(
        world: &World,
        antennas: &[Antenna],
        reception: Vec<Stream>,
        quantisation: Vec<Stream>,
    ) -> Self {
        let mut ether = Ether::new(world.n_robots(), world.message_len);
        let only_if = |is_needed: bool, streams| if is_needed { streams } else { Vec::new() };
        let receives = antennas.iter().any(|antenna| antenna.receiver.is_some());
        let quantises = world.groups.iter().any(|group| group.quantiser.is_some());
        let groups = world.groups.iter().filter(|group| group.initial_frame);
        for robot in groups.flat_map(|group| group.robots.clone()) {
            ether.emit(robot, FrameOrigin::sent_by(robot), &vec![0.0; world.message_len]);
        }
        Self {
            ether,
            hearing: Hearing::new(antennas),
            reaches: antennas.iter().map(Antenna::reach).collect(),
            silent: vec![false; world.n_robots()],
            reception: Draws::new(only_if(receives, reception)),
            quantisation: Draws::new(only_if(quantises, quantisation)),
            scratch: Scratch::default(),
            valid: Vec::new(),
        }
    }

    /// Updates the hearing after robots have started, moved or turned.
    pub fn listen(&mut self, neighbours: &Neighbours, swarm: &Swarm) {
        self.hearing.update(neighbours, swarm.antennas());
    }

    /// Whether each robot is muted.
    pub fn silent(&self) -> &[bool] {
        &self.silent
    }

    /// Mutes robots that have failed or are silent. Returns whether the set of muted robots has
    /// changed.
    pub fn mute(&mut self, silent: &[bool]) -> bool {
        if self.silent == silent {
            return false;
        }
        self.silent.copy_from_slice(silent);
        let reach = |(&reach, &silent): (&f64, &bool)| if silent { -1.0 } else { reach };
        self.hearing.set_reaches(self.reaches.iter().zip(silent).map(reach));
        true
    }

    /// Every receiver takes a frame from the air, chosen uniformly among the sectors whose
    /// strongest frame is valid.
    pub fn receive(&mut self, neighbours: &Neighbours, swarm: &mut Swarm) {
        // One draw per step and robot, needed or not.
        self.reception.advance();
        self.quantisation.advance();
        let Self { ether, hearing, reception, valid, .. } = self;
        let message_len = swarm.message_len;
        let Swarm { received, received_messages, headings, antenna_headings, .. } = swarm;
        let headings = antennas(headings, antenna_headings);
        for listeners in hearing.listeners() {
            let receiver = listeners.receiver;
            valid.resize(receiver.n_sectors + 1, 0);
            for (robot, heard) in listeners.iter() {
                let mut n_valid = 0;
                for (sector, heard) in heard.iter().enumerate() {
                    // Without a branch, because the result is unpredictable.
                    valid[n_valid] = sector;
                    let is_valid = ether.is_valid(heard.robot as usize, robot, receiver.max_hops);
                    n_valid += usize::from(is_valid);
                }
                let u = reception.current()[robot];
                let message = &mut received_messages[robot * message_len..][..message_len];
                if n_valid == 0 {
                    received[robot] = None;
                    message.fill(0.0);
                    continue;
                }
                let sector = valid[((u * n_valid as f64) as usize).min(n_valid - 1)];
                let heard = heard[sector];
                let emitter = heard.robot as usize;
                message.copy_from_slice(ether.message(emitter));
                let sending_direction = if receiver.observes_sending_direction {
                    hearing.sending_direction(listeners, heard, neighbours, headings)
                } else {
                    Vec2::default()
                };
                // The first robot to hear a frame observes the direction in which its message was
                // sent.
                let mut origin = ether.origin(emitter);
                if origin.hops == 1 {
                    origin.sending_direction = sending_direction;
                }
                let log_strength =
                    listeners.log_strength(robot, sector, heard, neighbours, headings);
                received[robot] = Some(Received {
                    emitter,
                    sector,
                    log_strength,
                    receiving_direction: listeners.directions[sector],
                    sending_direction: match receiver.sending_direction {
                        SendingDirection::Emitter => sending_direction,
                        SendingDirection::Originator => origin.sending_direction,
                    },
                    origin,
                });
            }
        }
    }

    /// The strongest frame in each sector of a robot, with the strength that its radio measures;
    /// empty without a receiver. A radio that loses its frame has heard nothing.
    pub fn heard(&self, robot: usize, neighbours: &Neighbours, swarm: &Swarm) -> Vec<HeardFrame> {
        let headings = swarm.antennas();
        let mut listeners = self.hearing.listeners().iter();
        let own = listeners.find_map(|listeners| {
            let (_, heard) = listeners.iter().find(|(listener, _)| *listener == robot)?;
            Some((listeners, heard))
        });
        let Some((listeners, heard)) = own else { return Vec::new() };
        let hear = |(sector, &heard): (usize, &Heard)| {
            let emitter = heard.robot as usize;
            if emitter == self.silent.len() || swarm.has_lost(robot) {
                let message = vec![0.0; self.ether.message_len()];
                let frame = Frame::new(FrameOrigin::NOTHING, &message);
                return HeardFrame { frame, facing: [0.0; 2], signal: 0.0 };
            }
            let facing = self.facing(listeners, heard, neighbours, headings);
            let log_strength = listeners.log_strength(robot, sector, heard, neighbours, headings);
            HeardFrame {
                frame: self.sent(emitter),
                facing: [facing.x, facing.y],
                signal: swarm.measured(robot, libm::exp(log_strength)),
            }
        };
        heard.iter().enumerate().map(hear).collect()
    }

    /// (cos, sin) of the emitter's sector that faces the listener; zero if it is not observed.
    fn facing(
        &self,
        listeners: &Listeners,
        heard: Heard,
        neighbours: &Neighbours,
        headings: &[f64],
    ) -> Vec2 {
        if listeners.receiver.observes_sending_direction {
            self.hearing.sending_direction(listeners, heard, neighbours, headings)
        } else {
            Vec2::default()
        }
    }

    /// The frame of a robot that is on the air.
    pub fn sent(&self, robot: usize) -> Frame {
        Frame::new(self.ether.origin(robot), self.ether.message(robot))
    }

    /// Puts the frames of a group of robots on the air.
    pub fn emit(&mut self, isa: Isa, world: &World, swarm: &mut Swarm, group: &RobotGroup) {
        if let Some(quantiser) = &group.quantiser {
            let u = &self.quantisation.current()[group.robots.clone()];
            let messages =
                group.robots.start * swarm.message_len..group.robots.end * swarm.message_len;
            quantiser.quantise(isa, &mut swarm.messages[messages], u, &mut self.scratch);
        }
        for robot in group.robots.clone() {
            if world.antennas[robot].emits_within.is_some() {
                self.emit_frame(swarm, robot);
            }
        }
    }

    /// Puts a robot's frame on the air: its own message, or the frame that it
    /// received in this step.
    fn emit_frame(&mut self, swarm: &Swarm, robot: usize) {
        let message = swarm.message_range(robot);
        match swarm.modes[robot] {
            Mode::Send => {
                let origin = FrameOrigin::sent_by(robot);
                self.ether.emit(robot, origin, &swarm.messages[message]);
            }
            Mode::Relay => {
                let received = swarm.received[robot].as_ref();
                let origin =
                    received.map_or(FrameOrigin::NOTHING, |Received { origin, .. }| FrameOrigin {
                        hops: origin.hops + 1,
                        ..*origin
                    });
                self.ether.emit(robot, origin, &swarm.received_messages[message]);
            }
        }
    }
}
