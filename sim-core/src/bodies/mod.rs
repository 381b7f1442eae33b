//! Rigid bodies in a room: robots are discs with a drive, other things are discs and convex
//! polygons that can be pushed, and walls stand still.
//!
//! A substep solves the velocities so that no two bodies approach by more than the gap between
//! them, moves the bodies, and pushes apart what rounding and the linear constraints let overlap.
//! Velocities come from sequential impulses (Catto 2005, "Iterative dynamics with temporal
//! coherence") in index order. The drive of a robot and the ground below other bodies are
//! constraints with a largest impulse, among those of the contacts: so a robot pushes with its
//! `push_force` at most, and a body whose friction is larger does not move at all. Contacts have
//! no friction and do not rebound.
//!
//! Every operation is one of IEEE 754 or of `libm`, in a fixed order: the same bits on every
//! machine.

mod collision;
mod rays;
mod room;
mod shape;
mod solver;

use crate::record::Outline;
use crate::torus::{Vec2, wrap_angle};

use self::collision::Placed;
pub(crate) use self::collision::Segment;
pub(crate) use self::room::{Furnished, NoPlace, Room};
pub(crate) use self::shape::Shape;
use self::solver::{Candidate, Contact};

/// Acceleration by which the ground carries, cm/s^2.
const GRAVITY: f64 = 981.0;
/// Newtons in kg cm/s^2.
const NEWTON: f64 = 100.0;
/// Bodies touch if the gap between them is smaller, cm.
const TOUCHING: f64 = 0.01;

/// Properties of a robot's body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chassis {
    /// cm
    pub radius: f64,
    /// kg
    pub mass: f64,
    /// The most that the drive exerts, N.
    pub push_force: f64,
    /// Distance between the wheels, cm.
    pub axle_length: f64,
}

/// Properties of a body that can be pushed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Load {
    pub shape: Shape,
    /// kg
    pub mass: f64,
    /// Friction with the ground, as a share of the weight.
    pub friction: f64,
}

/// A place in the room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub position: Vec2,
    /// In \[0, 2 pi).
    pub heading: f64,
}

/// The resistance against a body's motion, or its drive.
#[derive(Debug, Clone, Copy)]
enum Traction {
    /// A drive, which does not slip sideways.
    Wheels { force: f64, torque: f64 },
    /// Dry friction with the ground.
    Ground { force: f64, torque: f64 },
}

/// A body that moves.
#[derive(Debug, Clone)]
struct Body {
    shape: Shape,
    position: Vec2,
    heading: f64,
    /// (cos, sin) of the heading.
    axis: Vec2,
    /// cm/s
    velocity: Vec2,
    /// rad/s
    turning: f64,
    /// 1/kg
    inverse_mass: f64,
    /// 1/(kg cm^2)
    inverse_inertia: f64,
    traction: Traction,
    /// Speed and turning that the wheels ask for.
    asked: (f64, f64),
    /// Whether it has not been removed.
    is_present: bool,
}

impl Body {
    fn placed(&self) -> Placed<'_> {
        Placed { shape: &self.shape, position: self.position, axis: self.axis }
    }

    fn is_at_rest(&self) -> bool {
        self.velocity == Vec2::default() && self.turning == 0.0
    }
}

/// What a robot touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bump {
    /// The robot.
    pub robot: usize,
    /// Where to, as a unit vector of the world.
    pub direction: Vec2,
    /// The body: robots have their numbers, then other bodies theirs; `None`: a wall.
    pub body: Option<usize>,
}

/// A thing that stands still.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fixture {
    /// Its shape and place.
    pub form: Form,
    /// Whether it is of a wall, or else of an obstacle.
    pub is_wall: bool,
}

/// The shape and place of a fixture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Form {
    /// A segment.
    Segment(Segment),
    /// A disc: its centre and its shape.
    Disc(Vec2, Shape),
}

impl Fixture {
    /// Its lowest and highest coordinates.
    fn bounds(&self) -> (Vec2, Vec2) {
        match &self.form {
            // All beyond a side of a rectangle: who was pressed into a corner still meets both.
            Form::Segment(Segment { from, inner: Some(inner), .. }) => {
                let end = |coordinate: f64, inner: f64| {
                    // 1 and -1 may be rounded.
                    let low = if inner < -0.5 { coordinate } else { f64::NEG_INFINITY };
                    let high = if inner > 0.5 { coordinate } else { f64::INFINITY };
                    (low, high)
                };
                let (x, y) = (end(from.x, inner.x), end(from.y, inner.y));
                (Vec2::new(x.0, y.0), Vec2::new(x.1, y.1))
            }
            Form::Segment(Segment { from, to, .. }) => (
                Vec2::new(from.x.min(to.x), from.y.min(to.y)),
                Vec2::new(from.x.max(to.x), from.y.max(to.y)),
            ),
            Form::Disc(centre, shape) => {
                let reach = Vec2::new(shape.reach(), shape.reach());
                (*centre - reach, *centre + reach)
            }
        }
    }
}

/// The bodies of one trial: robots first, then those that can be pushed.
#[derive(Debug, Clone)]
pub(crate) struct Bodies {
    bodies: Vec<Body>,
    n_robots: usize,
    fixtures: Vec<Fixture>,
    bounds: Vec<(Vec2, Vec2)>,
    n_substeps: u32,
    /// Duration of a substep, s.
    duration: f64,
    /// Bodies in the order of their left ends, which changes little from step to step.
    by_left_end: Vec<usize>,
    /// Where each body was when candidates were found, and how far it may go from there, cm.
    searched: Vec<(Vec2, f64)>,
    candidates: Vec<Candidate>,
    contacts: Vec<Contact>,
    bumps: Vec<Bump>,
    /// Whether a load has moved in this step.
    loads_moved: bool,
}

impl Bodies {
    /// A room with fixtures only. `step_duration`: of the steps of all robots, s.
    pub fn new(fixtures: Vec<Fixture>, n_substeps: u32, step_duration: f64) -> Self {
        Self {
            bodies: Vec::new(),
            n_robots: 0,
            bounds: fixtures.iter().map(Fixture::bounds).collect(),
            fixtures,
            n_substeps,
            duration: step_duration / f64::from(n_substeps),
            by_left_end: Vec::new(),
            searched: Vec::new(),
            candidates: Vec::new(),
            contacts: Vec::new(),
            bumps: Vec::new(),
            loads_moved: false,
        }
    }

    /// Adds a robot; robots come before all loads.
    pub fn add_robot(&mut self, chassis: &Chassis, pose: Pose) {
        debug_assert_eq!(self.n_robots, self.bodies.len(), "robots are first");
        self.n_robots += 1;
        let force = chassis.push_force * NEWTON;
        let traction = Traction::Wheels { force, torque: 0.5 * force * chassis.axle_length };
        self.add(Shape::Disc(chassis.radius), chassis.mass, traction, pose);
    }

    /// Adds a body to push.
    pub fn add_load(&mut self, load: &Load, pose: Pose) {
        let force = load.friction * load.mass * GRAVITY;
        let traction = Traction::Ground { force, torque: force * load.shape.lever() };
        self.add(load.shape.clone(), load.mass, traction, pose);
    }

    fn add(&mut self, shape: Shape, mass: f64, traction: Traction, pose: Pose) {
        let inertia = mass * shape.inertia();
        self.by_left_end.push(self.bodies.len());
        self.bodies.push(Body {
            shape,
            position: pose.position,
            heading: pose.heading,
            axis: Vec2::unit(pose.heading),
            velocity: Vec2::default(),
            turning: 0.0,
            inverse_mass: 1.0 / mass,
            inverse_inertia: 1.0 / inertia,
            traction,
            asked: (0.0, 0.0),
            is_present: true,
        });
    }

    /// Number of bodies that move.
    fn n_bodies(&self) -> usize {
        self.bodies.len()
    }

    /// Forgets the bodies from this number on.
    fn truncate(&mut self, n_bodies: usize) {
        self.bodies.truncate(n_bodies);
        self.by_left_end.retain(|&body| body < n_bodies);
    }

    fn add_fixtures(&mut self, fixtures: impl IntoIterator<Item = Fixture>) {
        self.fixtures.extend(fixtures);
        self.bounds = self.fixtures.iter().map(Fixture::bounds).collect();
    }

    fn into_fixtures(self) -> Vec<Fixture> {
        self.fixtures
    }

    /// The bodies that can be pushed.
    pub fn loads(&self) -> std::ops::Range<usize> {
        self.n_robots..self.bodies.len()
    }

    /// Where a body is.
    pub fn pose(&self, body: usize) -> Pose {
        let Body { position, heading, .. } = self.bodies[body];
        Pose { position, heading }
    }

    /// Radius of a robot, cm.
    pub fn radius(&self, robot: usize) -> f64 {
        self.bodies[robot].shape.reach()
    }

    /// Outline of a body about its centre of mass, with heading 0.
    fn outline(&self, body: usize) -> Outline {
        match &self.bodies[body].shape {
            Shape::Disc(radius) => Outline::Disc { center: Vec2::default(), radius: *radius },
            Shape::Polygon(polygon) => Outline::Polygon(polygon.corners.clone()),
        }
    }

    /// What a robot touches after the last step.
    pub fn bumps(&self, robot: usize) -> &[Bump] {
        let first = self.bumps.partition_point(|bump| bump.robot < robot);
        let bumps = &self.bumps[first..];
        &bumps[..bumps.partition_point(|bump| bump.robot == robot)]
    }

    /// Number of things that may be in the way of a body.
    pub fn n_things(&self) -> usize {
        self.fixtures.len() + self.bodies.len()
    }

    /// Number of parts of walls and obstacles.
    pub fn n_fixtures(&self) -> usize {
        self.fixtures.len()
    }

    /// Puts a body at rest elsewhere if it would overlap nothing there; returns whether it did.
    fn put(&mut self, number: usize, pose: Pose) -> bool {
        if !self.is_free_beside(&self.bodies[number].shape, pose, Some(number)) {
            return false;
        }
        let body = &mut self.bodies[number];
        (body.position, body.heading) = (pose.position, pose.heading);
        body.axis = Vec2::unit(pose.heading);
        (body.velocity, body.turning) = (Vec2::default(), 0.0);
        self.bumps.retain(|bump| bump.robot != number && bump.body != Some(number));
        true
    }

    /// Takes a robot out of the room for good: it meets nothing, and nothing meets it.
    pub fn remove(&mut self, robot: usize) {
        let body = &mut self.bodies[robot];
        body.is_present = false;
        (body.velocity, body.turning) = (Vec2::default(), 0.0);
        self.by_left_end.retain(|&other| other != robot);
        self.bumps.retain(|bump| bump.robot != robot && bump.body != Some(robot));
    }

    /// Whether a body of this shape would overlap nothing at this pose.
    pub fn is_free(&self, shape: &Shape, pose: Pose) -> bool {
        self.is_free_beside(shape, pose, None)
    }

    /// The same for a body of the room, `itself`, which is about to leave its place.
    fn is_free_beside(&self, shape: &Shape, pose: Pose, itself: Option<usize>) -> bool {
        let placed = Placed { shape, position: pose.position, axis: Vec2::unit(pose.heading) };
        let mut is_free = true;
        let mut meet = |touch: collision::Touch| is_free &= touch.gap >= 0.0;
        for fixture in &self.fixtures {
            solver::meet(placed, fixture, 0.0, &mut meet);
        }
        for (number, body) in self.bodies.iter().enumerate() {
            if Some(number) != itself && body.is_present {
                collision::between(placed, body.placed(), 0.0, &mut meet);
            }
        }
        is_free
    }

    /// Lets a robot's wheels ask for a speed, cm/s, and a rate of turning, rad/s.
    pub fn ask(&mut self, robot: usize, speed: f64, turning: f64) {
        self.bodies[robot].asked = (speed, turning);
    }

    /// One environment step; returns whether a load has moved.
    pub fn step(&mut self) -> bool {
        self.loads_moved = false;
        self.find_candidates();
        for substep in 0..self.n_substeps {
            if substep > 0 && self.outruns_candidates() {
                self.find_candidates();
            }
            self.find_contacts();
            self.solve_velocities();
            self.advance();
            self.push_apart();
        }
        // The axes of bodies are products of rotations, which drift; also of those that turned and
        // came to rest within the step.
        for body in &mut self.bodies {
            body.heading = wrap_angle(body.heading);
            body.axis = Vec2::unit(body.heading);
        }
        self.find_bumps();
        self.loads_moved
    }

    /// Moves every body for one substep by its velocity: a robot along the exact arc of its wheels.
    fn advance(&mut self) {
        let duration = self.duration;
        self.loads_moved |= self.bodies[self.n_robots..].iter().any(|load| !load.is_at_rest());
        for body in self.bodies.iter_mut().filter(|body| !body.is_at_rest()) {
            let half = 0.5 * body.turning * duration;
            if half == 0.0 {
                body.position = body.position + body.velocity * duration;
                continue;
            }
            let half_turn = Vec2::unit(half);
            let full_turn = half_turn.rotated(half_turn);
            let way = match body.traction {
                Traction::Wheels { .. } => {
                    // The velocity turns with the robot.
                    let chord = half_turn.y / half;
                    let way = body.velocity.rotated(half_turn) * (chord * duration);
                    body.velocity = body.velocity.rotated(full_turn);
                    way
                }
                Traction::Ground { .. } => body.velocity * duration,
            };
            body.position = body.position + way;
            body.axis = body.axis.rotated(full_turn);
            body.heading += 2.0 * half;
        }
    }

    fn find_bumps(&mut self) {
        self.bumps.clear();
        let n_robots = self.n_robots;
        for contact in self.contacts.iter().filter(|contact| contact.touches()) {
            let robots = [(contact.first, contact.normal, contact.second)];
            let back = contact.second.map(|second| (second, -contact.normal, Some(contact.first)));
            for (robot, direction, body) in robots.into_iter().chain(back) {
                if robot < n_robots {
                    self.bumps.push(Bump { robot, direction, body });
                }
            }
        }
        self.bumps.sort_by_key(|bump| bump.robot);
    }
}

#[cfg(test)]
mod against_chipmunk;
#[cfg(test)]
mod tests;
