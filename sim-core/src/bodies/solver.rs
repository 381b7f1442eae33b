//! A substep: which bodies are near each other, their velocities after contact, and what pushes
//! overlapping bodies apart.

use super::collision::{self, Placed, Touch};
use super::{Bodies, Body, Fixture, Form, TOUCHING, Traction};
use crate::torus::Vec2;

/// Passes over all constraints of the velocities.
const N_VELOCITY_PASSES: usize = 10;
/// Most passes that push overlapping bodies apart.
const N_POSITION_PASSES: usize = 64;
/// The first of those in which bodies give way that would rather not: other bodies to robots, and
/// robots sideways. In a crowd, they must.
const ALL_GIVE_WAY_FROM: usize = 8;
/// Overlap that is left alone, cm.
const SLOP: f64 = 0.001;
/// How much robots give way sideways at first, as a share of how much they do along their heading.
const SIDEWAYS: f64 = 0.02;
/// Additional distance at which bodies count as near, cm.
const MARGIN: f64 = 0.1;

/// Two things that may meet within a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    first: usize,
    second: Other,
}

/// The second of two things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Other {
    /// The body of this number.
    Body(usize),
    /// The fixture of this number.
    Fixture(usize),
}

/// A place where two bodies, or a body and a fixture, are near each other.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    pub first: usize,
    /// `None`: a fixture.
    pub second: Option<usize>,
    /// From the first to the second.
    pub normal: Vec2,
    gap: f64,
    /// Levers of the impulse about the centres of mass, cm.
    levers: [f64; 2],
    /// Mass that resists the approach, kg.
    mass: f64,
    /// Impulse so far, kg cm/s, at least 0.
    impulse: f64,
}

impl Contact {
    pub fn touches(&self) -> bool {
        self.impulse > 0.0 || self.gap < TOUCHING
    }
}

/// Impulses of a drive or of the ground so far.
#[derive(Debug, Clone, Copy, Default)]
struct Hold {
    along: Vec2,
    turn: f64,
}

/// Where a body and a fixture meet.
pub(super) fn meet(body: Placed<'_>, fixture: &Fixture, within: f64, take: &mut impl FnMut(Touch)) {
    match &fixture.form {
        Form::Segment(segment) => collision::with_segment(body, segment, within, take),
        Form::Disc(position, shape) => {
            let disc = Placed { shape, position: *position, axis: Vec2::new(1.0, 0.0) };
            collision::between(body, disc, within, take);
        }
    }
}

impl Bodies {
    /// Finds all pairs that may meet within this step.
    pub(super) fn find_candidates(&mut self) {
        let Self { bodies, fixtures, bounds, by_left_end, candidates, searched, .. } = self;
        let asked = bodies.iter().map(|body| body.asked.0.abs()).fold(0.0, f64::max);
        let step = self.duration * f64::from(self.n_substeps);
        let is_new = searched.len() != bodies.len();
        searched.clear();
        searched.extend(bodies.iter().map(|body| {
            // Others may push it as fast as the fastest robot drives.
            let reach = body.velocity.norm().max(asked) * step + MARGIN;
            (body.position, reach)
        }));
        let extent = |body: usize| bodies[body].shape.reach() + searched[body].1;
        let left_end = |body: usize| bodies[body].position.x - extent(body);
        if is_new {
            by_left_end.sort_by(|&a, &b| left_end(a).total_cmp(&left_end(b)).then(a.cmp(&b)));
        }
        // Insertion, because the order is nearly right.
        for sorted in 1..by_left_end.len() {
            let mut place = sorted;
            let key = |body: usize| (left_end(body), body);
            while place > 0 && key(by_left_end[place - 1]) > key(by_left_end[place]) {
                by_left_end.swap(place - 1, place);
                place -= 1;
            }
        }
        candidates.clear();
        for (place, &first) in by_left_end.iter().enumerate() {
            let body = &bodies[first];
            let right_end = body.position.x + extent(first);
            for &second in &by_left_end[place + 1..] {
                if left_end(second) > right_end {
                    break;
                }
                let within = extent(first) + extent(second);
                let way = bodies[second].position - body.position;
                if way.dot(way) <= within * within {
                    let (first, second) = (first.min(second), first.max(second));
                    let second = Other::Body(second);
                    candidates.push(Candidate { first, second });
                }
            }
        }
        let widest = (0..bodies.len()).map(|body| 2.0 * extent(body)).fold(0.0, f64::max);
        for (number, (low, high)) in bounds.iter().enumerate() {
            let start = by_left_end.partition_point(|&body| left_end(body) < low.x - widest);
            for &first in &by_left_end[start..] {
                if left_end(first) > high.x {
                    break;
                }
                let Vec2 { x, y } = bodies[first].position;
                let within = extent(first);
                if x + within >= low.x
                    && x - within <= high.x
                    && y + within >= low.y
                    && y - within <= high.y
                {
                    let second = Other::Fixture(number);
                    candidates.push(Candidate { first, second });
                }
            }
        }
        debug_assert_eq!(fixtures.len(), bounds.len());
        candidates.sort_unstable_by_key(|candidate| (candidate.second, candidate.first));
    }

    /// Whether a body may go farther in the next substep than the candidates allow for: between
    /// others, a light body slips out faster than anything drives.
    pub(super) fn outruns_candidates(&self) -> bool {
        self.bodies.iter().zip(&self.searched).any(|(body, &(from, reach))| {
            let way = body.velocity.norm() * self.duration;
            (body.position - from).norm() + way > reach
        })
    }

    /// Finds where candidates may meet within this substep.
    pub(super) fn find_contacts(&mut self) {
        let Self { bodies, fixtures, candidates, contacts, duration, .. } = self;
        contacts.clear();
        for candidate in &*candidates {
            let body = &bodies[candidate.first];
            let mut fastest = body.velocity.norm().max(body.asked.0.abs())
                + body.turning.abs() * body.shape.reach();
            if let Other::Body(second) = candidate.second {
                let other = &bodies[second];
                fastest += other.velocity.norm().max(other.asked.0.abs())
                    + other.turning.abs() * other.shape.reach();
            }
            let within = fastest * *duration + MARGIN;
            let mut take = |touch: Touch| {
                let second = match candidate.second {
                    Other::Body(second) => Some(second),
                    Other::Fixture(_) => None,
                };
                contacts.push(Contact::new(bodies, candidate.first, second, touch));
            };
            match candidate.second {
                Other::Body(second) => {
                    let other = bodies[second].placed();
                    collision::between(body.placed(), other, within, &mut take);
                }
                Other::Fixture(second) => {
                    meet(body.placed(), &fixtures[second], within, &mut take);
                }
            }
        }
    }

    /// Velocities that drives and friction can bring about, and by which no bodies overlap.
    pub(super) fn solve_velocities(&mut self) {
        let Self { bodies, contacts, duration, n_robots, .. } = self;
        let mut holds = vec![Hold::default(); bodies.len()];
        // Without contacts, one pass is exact.
        let n_passes = if contacts.is_empty() { 1 } else { N_VELOCITY_PASSES };
        for _ in 0..n_passes {
            let (robots, loads) = holds.split_at_mut(*n_robots);
            for (body, hold) in bodies.iter_mut().zip(robots) {
                body.drive(hold, *duration);
            }
            for contact in &mut *contacts {
                let approach = contact.approach(bodies);
                // They may come as near as they are far.
                let allowed = contact.gap.max(0.0) / *duration;
                let impulse = (contact.impulse + contact.mass * (approach - allowed)).max(0.0);
                let change = impulse - contact.impulse;
                contact.impulse = impulse;
                contact.push(bodies, change);
            }
            // Last, so that a body which friction holds stands perfectly still.
            for (body, hold) in bodies[*n_robots..].iter_mut().zip(loads) {
                body.rub(hold, *duration);
            }
        }
        // Contacts may have pushed robots sideways, where their wheels hold.
        for body in &mut bodies[..*n_robots] {
            body.velocity = body.axis * body.velocity.dot(body.axis);
        }
    }

    /// Pushes overlapping bodies apart: robots give way to other bodies, and all to walls.
    pub(super) fn push_apart(&mut self) {
        let Self { bodies, fixtures, candidates, n_robots, loads_moved, .. } = self;
        for pass in 0..N_POSITION_PASSES {
            let sideways = if pass < ALL_GIVE_WAY_FROM { SIDEWAYS } else { 1.0 };
            let mut is_done = true;
            // All candidates: a crowd pushes robots to where nothing was near. Fixtures are last.
            for &Candidate { first, second } in &*candidates {
                let mut worst: Option<Touch> = None;
                let mut take = |touch: Touch| {
                    if worst.is_none_or(|worst| touch.gap < worst.gap) {
                        worst = Some(touch);
                    }
                };
                match second {
                    Other::Body(second) => collision::between(
                        bodies[first].placed(),
                        bodies[second].placed(),
                        -SLOP,
                        &mut take,
                    ),
                    Other::Fixture(second) => {
                        meet(bodies[first].placed(), &fixtures[second], -SLOP, &mut take);
                    }
                }
                let Some(Touch { normal, gap, .. }) = worst else { continue };
                is_done = false;
                let share = match second {
                    Other::Fixture(_) => 1.0,
                    Other::Body(second)
                        if first < *n_robots && second >= *n_robots && pass < ALL_GIVE_WAY_FROM =>
                    {
                        1.0
                    }
                    Other::Body(second) => {
                        let [own, other] =
                            [first, second].map(|body| bodies[body].mobility(normal, sideways));
                        let share = own / (own + other);
                        // Light things between robots and a wall have nowhere to go.
                        let is_load = first < *n_robots && second >= *n_robots;
                        if is_load { share.max(0.5) } else { share }
                    }
                };
                let way = normal * gap;
                bodies[first].position = bodies[first].position + way * share;
                if let Other::Body(second) = second {
                    bodies[second].position = bodies[second].position - way * (1.0 - share);
                    *loads_moved |= second >= *n_robots && share < 1.0;
                }
                *loads_moved |= first >= *n_robots;
            }
            if is_done {
                break;
            }
        }
    }
}

impl Contact {
    fn new(bodies: &[Body], first: usize, second: Option<usize>, touch: Touch) -> Self {
        let Touch { normal, point, gap } = touch;
        let body = &bodies[first];
        let lever = (point - body.position).cross(normal);
        let mut resistance = body.inverse_mass + body.inverse_inertia * lever * lever;
        let mut levers = [lever, 0.0];
        if let Some(second) = second {
            let body = &bodies[second];
            let point = point + normal * gap;
            levers[1] = (point - body.position).cross(normal);
            resistance += body.inverse_mass + body.inverse_inertia * levers[1] * levers[1];
        }
        let mass = 1.0 / resistance;
        Self { first, second, normal, gap, levers, mass, impulse: 0.0 }
    }

    /// Speed at which the two approach each other, cm/s.
    fn approach(&self, bodies: &[Body]) -> f64 {
        let body = &bodies[self.first];
        let speed = body.velocity.dot(self.normal) + body.turning * self.levers[0];
        let other = self.second.map_or(0.0, |second| {
            let body = &bodies[second];
            body.velocity.dot(self.normal) + body.turning * self.levers[1]
        });
        speed - other
    }

    fn push(&self, bodies: &mut [Body], impulse: f64) {
        if impulse == 0.0 {
            return;
        }
        bodies[self.first].push(self.normal * -impulse, -impulse * self.levers[0]);
        if let Some(second) = self.second {
            bodies[second].push(self.normal * impulse, impulse * self.levers[1]);
        }
    }
}

impl Body {
    /// How far it gives way in a direction, beside other bodies: light ones do more, and robots
    /// roll rather than slip: `sideways` is the share of what they do along their heading.
    fn mobility(&self, direction: Vec2, sideways: f64) -> f64 {
        match self.traction {
            Traction::Wheels { .. } => {
                let along = direction.dot(self.axis);
                self.inverse_mass * (along * along + sideways * (1.0 - along * along))
            }
            Traction::Ground { .. } => self.inverse_mass,
        }
    }

    fn push(&mut self, impulse: Vec2, turn: f64) {
        self.velocity = self.velocity + impulse * self.inverse_mass;
        self.turning += turn * self.inverse_inertia;
    }

    /// The wheels bring about what was asked of them, with their force at most; sideways, they
    /// hold with any force.
    fn drive(&mut self, hold: &mut Hold, duration: f64) {
        let Traction::Wheels { force, torque } = self.traction else { return };
        let (speed, turning) = self.asked;
        let missing = speed - self.velocity.dot(self.axis);
        let along = limited(hold.along.x + missing / self.inverse_mass, force * duration);
        let change = (along - hold.along.x) * self.inverse_mass;
        hold.along.x = along;
        // Exactly as asked, where the force suffices.
        let speed = if along.abs() < force * duration { speed } else { speed - missing + change };
        self.velocity = self.axis * speed;
        let missing = turning - self.turning;
        let turn = limited(hold.turn + missing / self.inverse_inertia, torque * duration);
        let change = (turn - hold.turn) * self.inverse_inertia;
        hold.turn = turn;
        self.turning = if turn.abs() < torque * duration { turning } else { self.turning + change };
    }

    /// Friction with the ground brings the body to rest, with its force at most.
    fn rub(&mut self, hold: &mut Hold, duration: f64) {
        let Traction::Ground { force, torque } = self.traction else { return };
        if self.is_at_rest() {
            return;
        }
        let wanted = hold.along - self.velocity * (1.0 / self.inverse_mass);
        let (size, most) = (wanted.norm(), force * duration);
        if size <= most {
            (hold.along, self.velocity) = (wanted, Vec2::default());
        } else {
            let along = wanted * (most / size);
            self.velocity = self.velocity + (along - hold.along) * self.inverse_mass;
            hold.along = along;
        }
        let wanted = hold.turn - self.turning / self.inverse_inertia;
        let most = torque * duration;
        if wanted.abs() <= most {
            (hold.turn, self.turning) = (wanted, 0.0);
        } else {
            let turn = limited(wanted, most);
            self.turning += (turn - hold.turn) * self.inverse_inertia;
            hold.turn = turn;
        }
    }
}

fn limited(value: f64, most: f64) -> f64 {
    value.clamp(-most, most)
}
