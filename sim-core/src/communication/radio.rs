//! All robots' radios in one trial: what is on the air, who hears it, and what
//! chance decides.

use super::Mode;
use super::frame::{Ether, FrameOrigin};
use super::hearing::{Hearing, Observed};
use super::quantisation::Scratch;
use crate::neighbours::Neighbours;
use crate::swarm::{Received, Swarm};
use crate::world::{RobotGroup, World};
use experiment_file::SendingDirection;
use numeric::Isa;
use numeric::random::Stream;

/// State of the wireless link.
#[derive(Debug)]
pub(crate) struct Radio {
    ether: Ether,
    hearing: Hearing,
    /// Per robot.
    reception: Vec<Stream>,
    /// Per robot.
    quantisation: Vec<Stream>,
    /// What the quantiser's draws are, for a group.
    u: Vec<f64>,
    scratch: Scratch,
}

impl Radio {
    /// The air before the first step. One stream per robot for each purpose.
    pub fn new(world: &World, reception: Vec<Stream>, quantisation: Vec<Stream>) -> Self {
        let mut ether = Ether::new(world.n_robots(), world.message_len);
        let groups = world.groups.iter().filter(|group| group.initial_frame);
        for robot in groups.flat_map(|group| group.robots.clone()) {
            ether.emit(robot, Some(FrameOrigin::sent_by(robot)), &vec![0.0; world.message_len]);
        }
        Self {
            ether,
            hearing: Hearing::new(&world.antennas),
            reception,
            quantisation,
            u: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Robots have taken their places, moved or turned.
    pub fn listen(&mut self, world: &World, neighbours: &Neighbours, swarm: &Swarm) {
        self.hearing.update(&world.antennas, neighbours, &swarm.headings);
    }

    /// Every receiver takes a frame from the air: one uniformly chosen among the
    /// sectors whose strongest frame is valid.
    pub fn receive(&mut self, world: &World, swarm: &mut Swarm) {
        for (robot, antenna) in world.antennas.iter().enumerate() {
            let Some(receiver) = antenna.receiver else { continue };
            let ether = &self.ether;
            let accepted = |origin: &&FrameOrigin| {
                origin.originator != robot && origin.hops < receiver.max_hops
            };
            let sectors = self.hearing.of(robot).iter().enumerate();
            let mut valid = sectors.filter_map(|(sector, heard)| {
                let heard = heard.as_ref()?;
                let origin = ether.origin(heard.emitter.robot).filter(accepted)?;
                Some((sector, heard, origin))
            });
            // One draw per step, needed or not.
            let u = self.reception[robot].uniform();
            let count = valid.clone().count();
            let chosen = valid.nth(((u * count as f64) as usize).min(count.saturating_sub(1)));
            let chosen =
                chosen.map(|(sector, heard, &origin)| (sector, heard.emitter.robot, origin));
            let chosen = chosen.and_then(|(sector, emitter, origin)| {
                let (decay, headings) = (receiver.decay, &swarm.headings);
                let observed = self.hearing.observe(robot, sector, decay, headings)?;
                Some((sector, emitter, origin, observed))
            });
            let message = swarm.message_range(robot);
            let message = &mut swarm.received_messages[message];
            let Some((sector, emitter, origin, Observed { signal, sending_direction })) = chosen
            else {
                swarm.received[robot] = None;
                message.fill(0.0);
                continue;
            };
            message.copy_from_slice(ether.message(emitter));
            // The first to hear a frame sees the direction in which its message was sent.
            let origin = match origin.hops {
                1 => FrameOrigin { sending_direction, ..origin },
                _ => origin,
            };
            swarm.received[robot] = Some(Received {
                sector,
                signal,
                receiving_direction: self.hearing.direction(robot, sector),
                sending_direction: match receiver.sending_direction {
                    SendingDirection::Emitter => sending_direction,
                    SendingDirection::Originator => origin.sending_direction,
                },
                origin,
            });
        }
    }

    /// Puts the frames of a group of robots on the air.
    pub fn emit(&mut self, isa: Isa, world: &World, swarm: &mut Swarm, group: &RobotGroup) {
        if let Some(quantiser) = &group.quantiser {
            // One draw per step and robot, needed or not.
            let streams = &mut self.quantisation[group.robots.clone()];
            self.u.clear();
            self.u.extend(streams.iter_mut().map(Stream::uniform));
            let messages =
                group.robots.start * swarm.message_len..group.robots.end * swarm.message_len;
            quantiser.quantise(isa, &mut swarm.messages[messages], &self.u, &mut self.scratch);
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
                self.ether.emit(robot, Some(origin), &swarm.messages[message]);
            }
            Mode::Relay => {
                let origin = swarm.received[robot]
                    .map(|Received { origin, .. }| FrameOrigin { hops: origin.hops + 1, ..origin });
                self.ether.emit(robot, origin, &swarm.received_messages[message]);
            }
        }
    }
}
