//! The engine alone: drives, contacts, friction, crowds.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use determinism::random::{Purpose, Stream, TrialSet};
use proptest::prelude::*;

use super::shape::sides;
use super::*;
use crate::drive::Drive;
use crate::torus::Torus;

pub(super) const ROBOT: Chassis =
    Chassis { radius: 3.5, mass: 0.15, push_force: 0.5, axle_length: 11.0 };
pub(super) const STEP: f64 = 0.33;

/// A square room.
pub(super) fn room(side: f64) -> Bodies {
    let corners =
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(x, y)| Vec2::new(x, y));
    let walls = sides(&corners).map(|(from, to)| {
        let inner = Some((to - from).unit_or_zero().turned_left());
        Fixture { form: Form::Segment(Segment { from, to, inner }), is_wall: true }
    });
    Bodies::new(walls.collect(), 4, STEP)
}

pub(super) fn at(x: f64, y: f64, heading: f64) -> Pose {
    Pose { position: Vec2::new(x, y), heading }
}

pub(super) fn rectangle(width: f64, height: f64) -> Shape {
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
    Shape::polygon(&corners.map(|(x, y)| Vec2::new(x, y)))
}

/// Lets all robots drive straight on at full speed for so many steps.
fn charge(bodies: &mut Bodies, n_steps: usize) {
    for _ in 0..n_steps {
        (0..bodies.n_robots).for_each(|robot| bodies.ask(robot, 10.0, 0.0));
        bodies.step();
    }
}

#[test]
fn a_polygon_has_the_moment_of_inertia_of_the_textbook() {
    let square = rectangle(6.0, 6.0);
    assert!((square.inertia() - 36.0 / 6.0).abs() < 1e-12);
    assert!((rectangle(3.0, 4.0).inertia() - 25.0 / 12.0).abs() < 1e-12);
    assert!((square.reach() - 3.0 * 2.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!(Shape::Disc(2.0).inertia(), 2.0);
}

#[test]
fn the_direction_in_which_corners_go_round_does_not_matter() {
    let corners = [(0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (0.0, 3.0)].map(|(x, y)| Vec2::new(x, y));
    let mut reversed = corners;
    reversed.reverse();
    let (Shape::Polygon(one), Shape::Polygon(other)) =
        (Shape::polygon(&corners), Shape::polygon(&reversed))
    else {
        panic!("polygons are polygons");
    };
    for corner in &one.corners {
        assert!(other.corners.iter().any(|c| (*c - *corner).norm() < 1e-12));
    }
    assert!((one.inertia() - other.inertia()).abs() < 1e-9);
}

#[test]
fn a_polygon_far_from_its_own_origin_is_the_same() {
    let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)];
    let far = Shape::polygon(&corners.map(|(x, y)| Vec2::new(x + 536_870_912.0, y - 3e8)));
    assert!((far.inertia() - 52.0 / 12.0).abs() < 1e-5, "{far:?}");
    assert!((far.reach() - 13.0_f64.sqrt()).abs() < 1e-5, "{far:?}");
    assert!((far.lever() - 2.0 / 3.0 * (24.0 / PI).sqrt()).abs() < 1e-5, "{far:?}");
}

proptest! {
    #[test]
    fn a_robot_alone_follows_the_arc_of_its_wheels(
        right in -1.0..=1.0f64, left in -1.0..=1.0f64, heading in 0.0..TAU,
    ) {
        let torus = Torus::new(1000.0, 1000.0);
        let drive = Drive { max_speed: 10.0, axle_length: 11.0, step_duration: STEP };
        let mut bodies = room(1000.0);
        bodies.add_robot(&ROBOT, at(500.0, 500.0, heading));
        let (mut position, mut direction) = (Vec2::new(500.0, 500.0), heading);
        for _ in 0..30 {
            (position, direction) = drive.advance(&torus, position, direction, [right, left]);
            bodies.ask(0, 5.0 * (right + left), 10.0 * (right - left) / 11.0);
            bodies.step();
        }
        let pose = bodies.pose(0);
        prop_assert!((pose.position - position).norm() < 1e-3, "{pose:?} {position:?}");
        let difference = (pose.heading - direction).rem_euclid(TAU);
        prop_assert!(difference.min(TAU - difference) < 1e-6);
    }
}

#[test]
fn a_robot_stops_at_a_wall_and_touches_it() {
    let mut bodies = room(100.0);
    bodies.add_robot(&ROBOT, at(90.0, 50.0, 0.0));
    charge(&mut bodies, 10);
    let Pose { position, heading } = bodies.pose(0);
    assert!((position.x - 96.5).abs() < 0.01, "{position:?}");
    assert_eq!((position.y, heading), (50.0, 0.0));
    let bump = Bump { robot: 0, direction: Vec2::new(1.0, 0.0), body: None };
    assert_eq!(bodies.bumps(0), [bump]);
}

#[test]
fn a_pushed_box_takes_its_part_of_the_momentum() {
    // A robot that pushes with no force, at its speed; a box on ice.
    let chassis = Chassis { push_force: 1e-9, ..ROBOT };
    let mut bodies = room(1000.0);
    bodies.add_robot(&chassis, at(100.0, 50.0, 0.0));
    let load = Load { shape: rectangle(10.0, 10.0), mass: 0.45, friction: 0.0 };
    bodies.add_load(&load, at(110.0, 50.0, 0.0));
    bodies.bodies[0].velocity = Vec2::new(10.0, 0.0);
    charge(&mut bodies, 5);
    let [robot, pushed] = [0, 1].map(|body| bodies.bodies[body].velocity);
    // 0.15 kg at 10 cm/s become 0.6 kg at 2.5 cm/s.
    assert!((robot.x - 2.5).abs() < 1e-3 && (pushed.x - 2.5).abs() < 1e-3, "{robot:?} {pushed:?}");
    assert!(bodies.bodies[1].turning.abs() < 1e-9 && pushed.y.abs() < 1e-9);
}

#[test]
fn one_robot_does_not_move_a_heavy_box_and_three_do() {
    // Friction 0.981 N; each robot pushes with 0.5 N.
    let load = Load { shape: rectangle(30.0, 30.0), mass: 0.5, friction: 0.2 };
    let moved = |n_robots: usize| {
        let mut bodies = room(300.0);
        for robot in 0..n_robots {
            let y = 150.0 + 8.0 * (robot as f64 - 0.5 * (n_robots as f64 - 1.0));
            bodies.add_robot(&ROBOT, at(100.0, y, 0.0));
        }
        bodies.add_load(&load, at(125.0, 150.0, 0.0));
        charge(&mut bodies, 50);
        bodies.pose(n_robots)
    };
    assert_eq!(moved(1), at(125.0, 150.0, 0.0), "not by a bit");
    let by_three = moved(3);
    assert!(by_three.position.x > 200.0, "{by_three:?}");
    assert!((by_three.position.y - 150.0).abs() < 0.5, "{by_three:?}");
}

#[test]
fn a_push_beside_the_centre_turns_a_box() {
    let mut bodies = room(300.0);
    bodies.add_robot(&ROBOT, at(100.0, 160.0, 0.0));
    let load = Load { shape: rectangle(30.0, 30.0), mass: 0.3, friction: 0.1 };
    bodies.add_load(&load, at(125.0, 150.0, 0.0));
    charge(&mut bodies, 10);
    let heading = bodies.pose(1).heading;
    assert!(heading > PI && heading < TAU - 0.05, "clockwise: {heading}");
}

#[test]
fn a_box_that_leans_on_a_wall_stops_whoever_pushes_it() {
    let mut bodies = room(100.0);
    bodies.add_robot(&ROBOT, at(80.0, 50.0, 0.0));
    let load = Load { shape: rectangle(10.0, 10.0), mass: 0.1, friction: 0.1 };
    bodies.add_load(&load, at(90.0, 50.0, 0.0));
    charge(&mut bodies, 40);
    assert!((bodies.pose(1).position.x - 95.0).abs() < 0.01);
    assert!((bodies.pose(0).position.x - 86.5).abs() < 0.05, "{:?}", bodies.pose(0));
    assert!(bodies.bumps(0).iter().any(|bump| bump.body == Some(1)));
}

#[test]
fn a_robot_without_orders_is_hard_to_push() {
    let mut bodies = room(200.0);
    bodies.add_robot(&ROBOT, at(50.0, 100.0, 0.0));
    bodies.add_robot(&ROBOT, at(60.0, 100.0, FRAC_PI_2));
    for _ in 0..20 {
        bodies.ask(0, 10.0, 0.0);
        bodies.step();
    }
    // The other does not slip sideways.
    assert!((bodies.pose(1).position.x - 60.0).abs() < 0.02, "{:?}", bodies.pose(1));
    assert!((bodies.pose(0).position.x - 53.0).abs() < 0.02, "{:?}", bodies.pose(0));
}

#[test]
fn who_was_pressed_through_a_corner_of_the_room_comes_back() {
    let box_ = Load { shape: rectangle(6.0, 6.0), mass: 0.1, friction: 0.2 };
    for (x, y) in [(-1.0, -2.0), (101.0, -9.0), (130.0, 130.0), (50.0, -5.0)] {
        let mut bodies = room(100.0);
        bodies.add_robot(&ROBOT, at(x, y, 1.0));
        bodies.add_load(&box_, at(100.0 - x, y, 0.3));
        bodies.step();
        for body in 0..2 {
            let Vec2 { x, y } = bodies.pose(body).position;
            let inside = 2.9..=97.1;
            assert!(inside.contains(&x) && inside.contains(&y), "{body}: {x}, {y}");
        }
    }
}

#[test]
fn a_load_that_comes_to_rest_within_a_step_has_moved_and_has_a_heading_in_range() {
    let mut bodies = room(100.0);
    bodies.add_robot(&ROBOT, at(20.0, 50.0, 0.0));
    let load = Load { shape: rectangle(10.0, 10.0), mass: 0.1, friction: 1.0 };
    bodies.add_load(&load, at(50.0, 50.0, 0.0));
    assert!(!bodies.step(), "nothing moves");
    (bodies.bodies[1].velocity, bodies.bodies[1].turning) = (Vec2::new(90.0, 0.0), -40.0);
    assert!(bodies.step(), "it moves");
    let body = &bodies.bodies[1];
    assert!(body.is_at_rest(), "{body:?}");
    assert!(body.position.x > 50.0 && body.heading > PI && body.heading < TAU, "{body:?}");
    assert_eq!(body.axis, Vec2::unit(body.heading));
    assert!(!bodies.step(), "it rests");
}

#[test]
fn light_things_on_ice_slip_away_but_stay_in_the_room() {
    // Robots squeeze out discs of a gram, which become faster than any robot.
    let side = 60.0;
    let mut bodies = room(side);
    for robot in 0..16 {
        let place = |k: usize| 9.0 + 14.0 * k as f64;
        bodies.add_robot(&ROBOT, at(place(robot % 4), place(robot / 4), robot as f64));
    }
    for disc in 0..9 {
        let place = |k: usize| 16.0 + 14.0 * k as f64;
        let shape = if disc % 2 == 0 { Shape::Disc(0.5) } else { rectangle(1.0, 1.0) };
        let load = Load { shape, mass: 0.001, friction: 0.0 };
        bodies.add_load(&load, at(place(disc % 3), place(disc / 3), 0.0));
    }
    let mut fastest = 0.0_f64;
    for step in 0..1_000 {
        for robot in 0..16 {
            bodies.ask(robot, 10.0, if (step / 20 + robot) % 3 == 0 { 1.0 } else { 0.0 });
        }
        bodies.step();
        for load in bodies.loads() {
            let Vec2 { x, y } = bodies.pose(load).position;
            let inside = 0.4..=side - 0.4;
            assert!(inside.contains(&x) && inside.contains(&y), "{load} at {step}: {x}, {y}");
            fastest = fastest.max(bodies.bodies[load].velocity.norm());
        }
    }
    assert!(fastest > 12.0, "{fastest}");
}

/// A crowd, loads and obstacles in a room, driven at random.
struct Crowd {
    bodies: Bodies,
    stream: Stream,
    side: f64,
}

impl Crowd {
    fn new(n_robots: usize, seed: u64) -> Self {
        let side = 40.0 + 20.0 * (n_robots as f64).sqrt();
        let mut stream = Stream::new(seed, TrialSet::Generation(0), 0, Purpose::Positions, 0);
        let mut bodies = room(side);
        let post = Form::Disc(Vec2::new(0.5 * side, 0.5 * side), Shape::Disc(8.0));
        bodies.fixtures.push(Fixture { form: post, is_wall: false });
        bodies.bounds.push(bodies.fixtures.last().unwrap().bounds());
        let shapes = [rectangle(12.0, 8.0), Shape::Disc(5.0)];
        let mut place = |bodies: &Bodies, shape: &Shape| loop {
            let mut coordinate = || side * stream.uniform();
            let position = Vec2::new(coordinate(), coordinate());
            let pose = Pose { position, heading: TAU * stream.uniform() };
            let beyond = [position.x, position.y, side - position.x, side - position.y];
            if beyond.iter().all(|way| *way > shape.reach()) && bodies.is_free(shape, pose) {
                return pose;
            }
        };
        for _ in 0..n_robots {
            let pose = place(&bodies, &Shape::Disc(ROBOT.radius));
            bodies.add_robot(&ROBOT, pose);
        }
        for shape in shapes {
            let pose = place(&bodies, &shape);
            bodies.add_load(&Load { shape, mass: 0.1, friction: 0.2 }, pose);
        }
        Self { bodies, stream, side }
    }

    /// Steps; the greatest overlap of two robots, and the greatest way of one into a wall, cm.
    fn run(&mut self, n_steps: usize) -> (f64, f64) {
        let (mut overlap, mut beyond) = (0.0_f64, 0.0_f64);
        let n_robots = self.bodies.n_robots;
        for step in 0..n_steps {
            for robot in 0..n_robots {
                if (step + robot) % 20 == 0 {
                    let [right, left] = if self.stream.uniform() < 0.5 {
                        [1.0, 1.0]
                    } else {
                        [0, 1].map(|_| 2.0 * self.stream.uniform() - 1.0)
                    };
                    self.bodies.ask(robot, 5.0 * (right + left), 10.0 * (right - left) / 11.0);
                }
            }
            self.bodies.step();
            for robot in 0..n_robots {
                let Vec2 { x, y } = self.bodies.pose(robot).position;
                let nearest = [x, y, self.side - x, self.side - y];
                beyond = nearest.iter().fold(beyond, |beyond, way| beyond.max(3.5 - way));
                for other in 0..robot {
                    let way = self.bodies.pose(other).position - Vec2::new(x, y);
                    overlap = overlap.max(7.0 - way.norm());
                }
            }
        }
        (overlap, beyond)
    }

    fn bits(&self) -> Vec<[u64; 3]> {
        let pose = |body| {
            let Pose { position, heading } = self.bodies.pose(body);
            [position.x, position.y, heading].map(f64::to_bits)
        };
        (0..self.bodies.bodies.len()).map(pose).collect()
    }
}

#[test]
fn robots_neither_overlap_nor_leave_the_room() {
    // `.ci/run` asks for ten million.
    let n = std::env::var("SWARM_TEST_ROBOT_STEPS").map_or(100_000, |n| n.parse().unwrap());
    for (seed, n_robots) in [(1, 4), (2, 12), (3, 60)] {
        let (overlap, beyond) = Crowd::new(n_robots, seed).run(n / 3 / n_robots);
        assert!(overlap < 0.02 * 3.5, "{n_robots} robots overlap by {overlap} cm");
        assert!(beyond < 0.02 * 3.5, "{n_robots} robots: one is {beyond} cm in a wall");
    }
}

#[test]
fn a_copy_in_the_middle_of_an_episode_goes_on_to_the_same_bits() {
    let mut crowd = Crowd::new(10, 5);
    crowd.run(50);
    let mut copy = Crowd { bodies: crowd.bodies.clone(), stream: crowd.stream.clone(), ..crowd };
    crowd.run(50);
    copy.run(50);
    assert_eq!(crowd.bits(), copy.bits());
}

#[test]
fn a_known_crowd_has_known_bits() {
    let mut crowd = Crowd::new(10, 7);
    crowd.run(200);
    let sum =
        crowd.bits().as_flattened().iter().fold(0, |sum: u64, bits| {
            sum.rotate_left(5).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ bits
        });
    assert_eq!(sum, 0x5d06_9568_dac9_b2b8, "format 1 of bodies: {sum:#x}");
}

#[test]
fn nothing_fits_where_something_is() {
    let mut bodies = room(100.0);
    bodies.add_robot(&ROBOT, at(50.0, 50.0, 0.0));
    let robot = Shape::Disc(3.5);
    assert!(bodies.is_free(&robot, at(57.0, 50.0, 0.0)), "side by side");
    assert!(!bodies.is_free(&robot, at(56.9, 50.0, 0.0)));
    assert!(!bodies.is_free(&robot, at(3.0, 50.0, 0.0)), "in the wall");
    assert!(!bodies.is_free(&robot, at(-10.0, 50.0, 0.0)), "behind the wall");
    let bar = rectangle(20.0, 2.0);
    assert!(!bodies.is_free(&bar, at(62.0, 50.0, 0.0)), "along");
    assert!(bodies.is_free(&bar, at(62.0, 50.0, FRAC_PI_2)), "across");
}
