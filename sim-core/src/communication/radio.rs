//! All robots' radios in one trial: what is on the air, who hears it, and what
//! chance decides.

use super::frame::{Ether, Origin};
use super::hearing::Hearing;
use super::{Mode, Quantiser};
use crate::random::Stream;
use crate::swarm::{Received, Swarm};
use crate::torus::{Vec2, sector_angle};
use crate::world::World;

/// State of the wireless link.
#[derive(Debug)]
pub(crate) struct Radio {
    ether: Ether,
    hearing: Hearing,
    /// Per robot.
    reception: Vec<Stream>,
    /// Per robot.
    quantisation: Vec<Stream>,
    /// Scratch of the quantiser.
    weights: Vec<f64>,
}

impl Radio {
    /// Silence. One stream per robot for each purpose.
    pub fn new(world: &World, reception: Vec<Stream>, quantisation: Vec<Stream>) -> Self {
        Self {
            ether: Ether::new(world.n_robots(), world.message_len),
            hearing: Hearing::new(&world.antennas),
            reception,
            quantisation,
            weights: Vec::new(),
        }
    }

    /// Robots have taken their places, or moved.
    pub fn relocate(&mut self, world: &World, swarm: &Swarm) {
        self.hearing.update(&world.torus, &world.antennas, &swarm.positions, &swarm.headings);
    }

    /// Every receiver takes a frame from the air: one uniformly chosen among the
    /// sectors whose strongest frame is valid.
    pub fn receive(&mut self, world: &World, swarm: &mut Swarm) {
        for (robot, antenna) in world.antennas.iter().enumerate() {
            let Some(receiver) = antenna.receiver else { continue };
            let ether = &self.ether;
            let accepted =
                |origin: &&Origin| origin.originator != robot && origin.hops < receiver.max_hops;
            let sectors = self.hearing.of(robot).iter().enumerate();
            let mut valid = sectors.filter_map(|(sector, heard)| {
                let heard = heard.as_ref()?;
                let origin = ether.origin(heard.emitter).filter(accepted)?;
                Some((sector, heard, origin))
            });
            // One draw per step, needed or not.
            let u = self.reception[robot].uniform();
            let count = valid.clone().count();
            let chosen = valid.nth(((u * count as f64) as usize).min(count.saturating_sub(1)));
            let message = swarm.message_range(robot);
            let message = &mut swarm.received_messages[message];
            let Some((sector, heard, origin)) = chosen else {
                swarm.received[robot] = None;
                message.fill(0.0);
                continue;
            };
            message.copy_from_slice(ether.message(heard.emitter));
            // The first to hear a frame sees the direction in which it was sent.
            let sending_direction =
                if origin.hops == 1 { heard.sending_direction } else { origin.sending_direction };
            swarm.received[robot] = Some(Received {
                sector,
                signal: heard.strength,
                receiving_direction: Vec2::unit(sector_angle(sector, receiver.n_sectors)),
                origin: Origin { sending_direction, ..*origin },
            });
        }
    }

    /// Puts a robot's frame on the air: its own message, quantised, or the frame
    /// that it received in this step. A robot without transmitter stays silent.
    pub fn emit(
        &mut self,
        world: &World,
        swarm: &mut Swarm,
        quantiser: Option<&Quantiser>,
        robot: usize,
    ) {
        if world.antennas[robot].emits_within.is_none() {
            return;
        }
        let message = swarm.message_range(robot);
        if let Some(quantiser) = quantiser {
            // One draw per step, needed or not.
            let u = self.quantisation[robot].uniform();
            quantiser.quantise(&mut swarm.messages[message.clone()], u, &mut self.weights);
        }
        match swarm.modes[robot] {
            Mode::Send => {
                let origin =
                    Origin { originator: robot, hops: 1, sending_direction: Vec2::default() };
                self.ether.emit(robot, Some(origin), &swarm.messages[message]);
            }
            Mode::Relay => {
                let origin = swarm.received[robot]
                    .map(|Received { origin, .. }| Origin { hops: origin.hops + 1, ..origin });
                self.ether.emit(robot, origin, &swarm.received_messages[message]);
            }
        }
    }
}
