//! What interventions have done to a trial.

use super::Trial;
use crate::bodies::Pose;
use crate::intervention::{Act, Intervention, Thing};
use crate::simulation::EvaluateError;
use crate::swarm::Swarm;
use crate::torus::Vec2;
use crate::world::World;

/// The interventions in a trial: those to come, and the lasting effects of the others.
#[derive(Debug)]
pub(super) struct Watched<'a> {
    /// In the order of their steps.
    to_come: &'a [Intervention],
    /// Per robot.
    frozen: Vec<bool>,
    mute: Vec<bool>,
    deaf: Vec<bool>,
    /// Lights that stay where they are.
    lights_frozen: Vec<usize>,
    /// Lights and areas that are out.
    lights_out: Vec<usize>,
    areas_out: Vec<usize>,
}

impl<'a> Watched<'a> {
    /// The state before the first step; `None` without interventions.
    pub fn new(interventions: &'a [Intervention], world: &World) -> Option<Self> {
        let none = || vec![false; world.n_robots()];
        let watched = || Self {
            to_come: interventions,
            frozen: none(),
            mute: none(),
            deaf: none(),
            lights_frozen: Vec::new(),
            lights_out: Vec::new(),
            areas_out: Vec::new(),
        };
        (!interventions.is_empty()).then(watched)
    }

    /// The interventions of this step.
    fn take(&mut self, step: u32) -> &'a [Intervention] {
        let n = self.to_come.iter().take_while(|intervention| intervention.step <= step).count();
        let (now, later) = self.to_come.split_at(n);
        self.to_come = later;
        now
    }

    /// Deaf robots have received nothing.
    pub fn deafen(&self, swarm: &mut Swarm) {
        for robot in numbers(&self.deaf) {
            swarm.received[robot] = None;
            let message = swarm.message_range(robot);
            swarm.received_messages[message].fill(0.0);
        }
    }

    /// Frozen robots stand still.
    pub fn stop(&self, swarm: &mut Swarm) {
        numbers(&self.frozen).for_each(|robot| swarm.wheels[robot] = [0.0; 2]);
    }

    /// The frozen lights, each with its place: whatever moves them, they have to go back there.
    pub fn frozen_lights(&self, lights: &[Vec2]) -> Vec<(usize, Vec2)> {
        self.lights_frozen.iter().map(|&light| (light, lights[light])).collect()
    }
}

/// The numbers of the robots for which a flag is set.
fn numbers(flags: &[bool]) -> impl Iterator<Item = usize> {
    flags.iter().enumerate().filter(|(_, flag)| **flag).map(|(robot, _)| robot)
}

impl Trial<'_> {
    /// Carries out the interventions of this step, and keeps up those that last, as a script may
    /// have undone them.
    pub(super) fn intervene(&mut self, step: u32) -> Result<(), EvaluateError> {
        let Some(mut watched) = self.watched.take() else { return Ok(()) };
        for &Intervention { thing, act, .. } in watched.take(step) {
            match act {
                Act::Place(place) => self.put(thing, place, step)?,
                Act::Remove => self.remove(thing, &mut watched),
                Act::Freeze => match thing {
                    Thing::Light(light) => watched.lights_frozen.push(light),
                    _ => watched.frozen[thing.number()] = true,
                },
                Act::Mute => watched.mute[thing.number()] = true,
                Act::Deafen => watched.deaf[thing.number()] = true,
            }
        }
        let Swarm { removed, failed, .. } = &mut self.swarm;
        numbers(removed).for_each(|robot| failed[robot] = true);
        watched.lights_out.iter().for_each(|&light| self.switches.lights[light] = false);
        watched.areas_out.iter().for_each(|&area| self.switches.areas[area] = false);
        let mut silent = self.radio.silent().to_vec();
        for (robot, is_silent) in silent.iter_mut().enumerate() {
            *is_silent |= watched.mute[robot];
        }
        self.mute(&silent);
        self.watched = Some(watched);
        Ok(())
    }

    fn remove(&mut self, thing: Thing, watched: &mut Watched<'_>) {
        match thing {
            Thing::Robot(robot) => {
                watched.deaf[robot] = true;
                self.swarm.remove(robot);
                if let Some(interior) = &mut self.interior {
                    interior.bodies.remove(robot);
                }
            }
            Thing::Light(light) => watched.lights_out.push(light),
            Thing::Area(area) => watched.areas_out.push(area),
            Thing::Movable(_) => {}
        }
    }

    /// Puts a thing elsewhere.
    fn put(&mut self, thing: Thing, place: Vec2, step: u32) -> Result<(), EvaluateError> {
        let torus = self.world.torus;
        let place = torus.wrap(place);
        match thing {
            Thing::Light(light) => {
                self.lights[light] = place;
                self.light_paths[light].go_on_from(place, &torus);
            }
            Thing::Area(area) => self.areas[area] = place,
            Thing::Robot(robot) => {
                self.put_body(robot, thing, place, step)?;
                self.swarm.positions[robot] = place;
                self.swarm.moved = true;
            }
            Thing::Movable(movable) => {
                let first =
                    self.interior.as_ref().map_or(0, |interior| interior.bodies.loads().start);
                self.put_body(first + movable, thing, place, step)?;
                self.swarm.moved = true;
            }
        }
        Ok(())
    }

    /// Puts a body at rest elsewhere, in a world with bodies.
    fn put_body(
        &mut self,
        body: usize,
        thing: Thing,
        place: Vec2,
        step: u32,
    ) -> Result<(), EvaluateError> {
        let (Some(room), Some(interior)) = (&self.world.room, &mut self.interior) else {
            return Ok(());
        };
        let pose = Pose { position: place, ..interior.bodies.pose(body) };
        if room.put(&mut interior.bodies, &interior.obstacles, body, pose) {
            return Ok(());
        }
        let (kind, number) = (thing.kind(), thing.number());
        Err(EvaluateError::NoRoom { kind, number, step, place: [place.x, place.y] })
    }
}

#[cfg(test)]
mod tests;
