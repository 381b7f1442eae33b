//! Compares bodies with Chipmunk; `sim-core/tests/fixtures/pymunk.py` makes the fixtures.

use std::f64::consts::TAU;

use serde_json::Value;

use super::tests::{ROBOT, STEP, at, rectangle, room};
use super::*;
use determinism::random::{Purpose, Stream, TrialSet};

fn fixture() -> Value {
    serde_json::from_str(include_str!("../../tests/fixtures/pymunk.json")).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// When a box on ice, which a robot pushes, passes x = 150, s.
fn passage(mass: f64, start: f64) -> f64 {
    let mut bodies = room(200.0);
    bodies.add_robot(&ROBOT, at(30.0, 100.0, 0.0));
    bodies.add_load(
        &Load { shape: rectangle(20.0, 20.0), mass, friction: 0.0 },
        at(start, 100.0, 0.0),
    );
    bodies.ask(0, 10.0, 0.0);
    let mut before = start;
    for step in 0..100 {
        bodies.step();
        let now = bodies.pose(1).position.x;
        if before < 150.0 && now >= 150.0 {
            return (f64::from(step) + (150.0 - before) / (now - before)) * STEP;
        }
        before = now;
    }
    f64::INFINITY
}

#[test]
fn a_box_on_ice_passes_as_soon_as_in_chipmunk() {
    for theirs in fixture()["pushes"].as_array().unwrap() {
        let [mass, start, expected] = ["mass", "start", "passage"].map(|key| number(&theirs[key]));
        let ours = passage(mass, start);
        // A substep takes 0.08 s here.
        let difference = (ours - expected).abs();
        assert!(difference < 0.1, "{mass} kg from {start}: {ours}, {expected}");
    }
}

/// Robots drive at random among posts: mean distance that they cover, cm, and share of steps in
/// contact.
fn wander(trial: u32, n_robots: usize, n_steps: usize) -> [f64; 2] {
    const SIDE: f64 = 120.0;
    let mut stream = Stream::new(9, TrialSet::Generation(0), trial.into(), Purpose::Positions, 0);
    let mut between = |low: f64, high: f64| low + (high - low) * stream.uniform();
    let mut bodies = room(SIDE);
    bodies.add_fixtures([(40.0, 40.0), (80.0, 40.0), (40.0, 80.0), (80.0, 80.0)].map(|(x, y)| {
        Fixture { form: Form::Disc(Vec2::new(x, y), Shape::Disc(10.0)), is_wall: false }
    }));
    while bodies.n_robots < n_robots {
        let pose = at(between(3.5, SIDE - 3.5), between(3.5, SIDE - 3.5), between(0.0, TAU));
        if bodies.is_free(&Shape::Disc(ROBOT.radius), pose) {
            bodies.add_robot(&ROBOT, pose);
        }
    }
    let (mut way, mut touching) = (0.0, 0.0);
    for step in 0..n_steps {
        let starts: Vec<Vec2> = (0..n_robots).map(|robot| bodies.pose(robot).position).collect();
        if step % 20 == 0 {
            (0..n_robots).for_each(|robot| {
                bodies.ask(robot, between(0.0, 10.0), between(-1.0, 1.0));
            });
        }
        bodies.step();
        for (robot, start) in starts.into_iter().enumerate() {
            way += (bodies.pose(robot).position - start).norm();
            touching += if bodies.bumps(robot).is_empty() { 0.0 } else { 1.0 };
        }
    }
    [way / n_robots as f64, touching / (n_robots * n_steps) as f64]
}

#[test]
fn a_crowd_drives_as_far_and_touches_as_often_as_in_chipmunk() {
    const N_TRIALS: u32 = 200;
    let fixture = fixture();
    let crowd = &fixture["crowd"];
    let [n_robots, n_steps] = ["robots", "steps"].map(|key| number(&crowd[key]) as usize);
    let trials: Vec<[f64; 2]> = (0..N_TRIALS).map(|t| wander(t, n_robots, n_steps)).collect();
    for (index, (name, tolerance)) in [("way", 0.03), ("touching", 0.08)].into_iter().enumerate() {
        let ours = trials.iter().map(|trial| trial[index]).sum::<f64>() / f64::from(N_TRIALS);
        let theirs = number(&crowd["means"][name]);
        // Their error of the mean is the larger one; the rest is what the models differ by.
        let error = 3.0 * number(&crowd["standard_errors"][name]);
        let difference = (ours - theirs).abs();
        assert!(difference < tolerance * theirs + error, "{name}: {ours}, Chipmunk {theirs}");
    }
}
