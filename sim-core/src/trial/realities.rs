//! What the pseudo-realities of a trial do to wheels and radios.

use std::borrow::Cow;
use std::mem;

use super::Group;
use super::address::Address;
use crate::communication::Antenna;
use crate::swarm::{RadioFlaw, Swarm};
use crate::torus::wrap_angle;
use crate::world::World;
use determinism::random::{Purpose, Stream};

/// Streams of [`Purpose::PseudoReality`] of a robot: 2^32 times this, plus its number. The numbers
/// are part of the format of a run.
const LOSS_STREAMS: u64 = 2;
const SIGNAL_STREAMS: u64 = 3;

/// The pseudo-realities of all robots. Robots without one have the neutral one.
pub(super) struct Realities {
    /// Factors of the speed of the right and left wheel.
    wheel_factors: Vec<[f64; 2]>,
    /// Scratch: what the wheels do, or what they were told, per robot.
    others: Vec<[f64; 2]>,
    /// The robots' radios.
    radios: Vec<Option<Flawed>>,
}

/// A radio.
struct Flawed {
    angle: f64,
    loss: f64,
    losses: Stream,
    /// `None` without noise.
    noise: Option<Stream>,
}

impl Realities {
    /// `None` if no robots have one.
    pub fn new(world: &World, groups: &[Group], address: Address) -> Option<Self> {
        groups.iter().find_map(|group| group.perturbations.reality())?;
        let n_robots = world.n_robots();
        let mut wheel_factors = vec![[1.0; 2]; n_robots];
        let mut radios: Vec<Option<Flawed>> = (0..n_robots).map(|_| None).collect();
        for (group, state) in world.groups.iter().zip(groups) {
            let Some(reality) = state.perturbations.reality() else { continue };
            wheel_factors[group.robots.clone()].copy_from_slice(&reality.wheel_factors);
            for (robot, &angle) in group.robots.clone().zip(&reality.antenna_angles) {
                let stream = |kind| {
                    let number = kind << 32 | robot as u64;
                    address.numbered_stream(Purpose::PseudoReality, number)
                };
                radios[robot] = Some(Flawed {
                    angle,
                    loss: reality.radio_loss,
                    losses: stream(LOSS_STREAMS),
                    noise: reality.sensing.is_noisy().then(|| stream(SIGNAL_STREAMS)),
                });
            }
        }
        Some(Self { wheel_factors, others: Vec::new(), radios })
    }

    /// The antennas of all robots, with their reaches in this trial.
    pub fn antennas<'a>(world: &'a World, groups: &[Group]) -> Cow<'a, [Antenna]> {
        let mut antennas = Cow::Borrowed(&world.antennas[..]);
        for (group, state) in world.groups.iter().zip(groups) {
            let Some(reality) = state.perturbations.reality() else { continue };
            if reality.radio_range != 1.0 {
                let own = &mut antennas.to_mut()[group.robots.clone()];
                own.iter_mut().for_each(|antenna| antenna.scale(reality.radio_range));
            }
        }
        antennas
    }

    /// Prepares a swarm before its first step.
    pub fn begin(&self, world: &World, groups: &[Group], swarm: &mut Swarm) {
        swarm.antenna_headings = swarm.headings.clone();
        swarm.radio_flaws = vec![None; world.n_robots()];
        for (group, state) in world.groups.iter().zip(groups) {
            let Some(reality) = state.perturbations.reality() else { continue };
            let sensing = reality.sensing;
            let flaw = RadioFlaw { sensing, normal: 0.0, is_lost: false };
            swarm.radio_flaws[group.robots.clone()].fill(Some(flaw));
        }
    }

    /// Turns the radios with their robots.
    pub fn turn_antennas(&self, swarm: &mut Swarm) {
        let headings = swarm.antenna_headings.iter_mut().zip(&swarm.headings);
        for ((antenna, &heading), radio) in headings.zip(&self.radios) {
            let angle = radio.as_ref().map_or(0.0, |radio| radio.angle);
            *antenna = if angle == 0.0 { heading } else { wrap_angle(heading + angle) };
        }
    }

    /// Loses received frames, and draws the noise of their strengths: one draw each per robot and
    /// step, needed or not.
    pub fn receive(&mut self, swarm: &mut Swarm) {
        for (robot, radio) in self.radios.iter_mut().enumerate() {
            let (Some(radio), Some(flaw)) = (radio, &mut swarm.radio_flaws[robot]) else {
                continue;
            };
            flaw.is_lost = radio.losses.bernoulli(radio.loss);
            flaw.normal = radio.noise.as_mut().map_or(0.0, Stream::normal);
            if flaw.is_lost {
                swarm.received[robot] = None;
                let message = swarm.message_range(robot);
                swarm.received_messages[message].fill(0.0);
            }
        }
    }

    /// Makes the wheels do what they do instead of what they are told.
    pub fn turn_wheels(&mut self, wheels: &mut Vec<[f64; 2]>) {
        let factors = wheels.iter().zip(&self.wheel_factors);
        self.others.clear();
        self.others.extend(factors.map(|(told, factors)| [0, 1].map(|at| told[at] * factors[at])));
        mem::swap(wheels, &mut self.others);
    }

    /// Takes back [`turn_wheels`](Self::turn_wheels).
    pub fn tell_wheels(&mut self, wheels: &mut Vec<[f64; 2]>) {
        mem::swap(wheels, &mut self.others);
    }
}

#[cfg(test)]
mod tests;
