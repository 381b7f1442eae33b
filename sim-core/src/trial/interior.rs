//! The bodies of a trial and what they do to its robots: they block frames, stop and turn wheels.

use crate::bodies::{Bodies, Pose};
use crate::neighbours::Neighbours;
use crate::record::{MovableRecord, Outline, RobotRecord};
use crate::swarm::Swarm;
use crate::torus::Vec2;
use crate::world::World;

/// What is in the room of a trial.
pub(crate) struct Interior {
    /// Robots, and the things that they push.
    pub bodies: Bodies,
    /// Obstacles in their order.
    pub obstacles: Vec<Outline>,
}

impl Interior {
    /// Removes the neighbours whose frames something blocks.
    pub(super) fn retain_audible(
        &self,
        world: &World,
        positions: &[Vec2],
        neighbours: &mut Neighbours,
    ) {
        neighbours.retain(|robot, neighbour| {
            let other = neighbour.robot;
            let blocked_by = world.groups[world.group_of(robot)].frames_blocked_by;
            let ends = [robot, other];
            self.bodies.is_clear(positions[robot], positions[other], blocked_by, &ends)
        });
    }

    /// Moves all robots by their wheels, as far as other bodies let them, and what they push.
    pub(super) fn drive(&mut self, world: &World, swarm: &mut Swarm) {
        for group in &world.groups {
            let Some(drive) = &group.drive else { continue };
            for robot in group.robots.clone() {
                let (speed, turning) = drive.asks(swarm.wheels[robot]);
                self.bodies.ask(robot, speed, turning);
            }
        }
        swarm.moved |= self.bodies.step();
        for robot in 0..swarm.positions.len() {
            let Pose { position, heading } = self.bodies.pose(robot);
            swarm.moved |= swarm.positions[robot] != position;
            swarm.turned |= swarm.headings[robot] != heading;
            (swarm.positions[robot], swarm.headings[robot]) = (position, heading);
        }
    }

    /// Fills in which robots touch something, and where movables are.
    pub(super) fn record(&self, robots: &mut [RobotRecord], movables: &mut Vec<MovableRecord>) {
        for (robot, record) in robots.iter_mut().enumerate() {
            record.touches = !self.bodies.bumps(robot).is_empty();
        }
        movables.clear();
        movables.extend(self.bodies.loads().map(|load| {
            let Pose { position, heading } = self.bodies.pose(load);
            MovableRecord { position, heading }
        }));
    }
}
