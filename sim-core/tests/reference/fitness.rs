//! Fitness of a step and of a trial (chapter 5).

use std::f64::consts::PI;

use experiment_file::FitnessFunction;

use super::alpha_shape::borderline;
use super::lights::Light;
use super::perturbations::SoleLeader;
use super::robot::Robot;
use super::torus::{Torus, Vector, angular_difference};

/// Fitness of a trial: the mean over its steps. `alignment` leaves out the first
/// 100.
pub fn of_trial(function: FitnessFunction, of_steps: &[f64]) -> f64 {
    let counted = match function {
        FitnessFunction::Alignment => &of_steps[100..],
        _ => of_steps,
    };
    mean(counted.iter().copied())
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len();
    values.sum::<f64>() / n as f64
}

/// Experiment A, Eq. 5.2-5.3 in the reading under which F* = 2.45: min(0.1 c, 5) with exactly one
/// leader, where c is the number of directly preceding steps in which the same robot was the sole
/// leader; otherwise 0.
pub fn identify_leader(leader: &SoleLeader) -> f64 {
    match leader.robot {
        Some(_) => (0.1 * f64::from(leader.n_steps - 1)).min(5.0),
        None => 0.0,
    }
}

/// Experiment B's target: for each robot, whether it is on the border of the alpha shape.
pub fn borderline_of_swarm(robots: &[Robot<'_>], torus: Torus, alpha: f64) -> Vec<bool> {
    let range = robots[0].communication_range();
    borderline(&positions(robots), torus, range, torus.width / alpha)
}

/// Experiment B, Eq. 5.4: TPR * TNR of "LED on" as a sign of the border; TPR
/// alone if no robot is interior.
pub fn identify_borderline(robots: &[Robot<'_>], is_border: &[bool]) -> f64 {
    let [mut n_border, mut n_interior, mut n_true_border, mut n_true_interior] = [0.0; 4];
    for (robot, &is_border) in robots.iter().zip(is_border) {
        let is_lit = robot.led > 0;
        if is_border {
            n_border += 1.0;
            n_true_border += if is_lit { 1.0 } else { 0.0 };
        } else {
            n_interior += 1.0;
            n_true_interior += if is_lit { 0.0 } else { 1.0 };
        }
    }
    let tpr = n_true_border / n_border;
    if n_interior == 0.0 { tpr } else { tpr * n_true_interior / n_interior }
}

/// Experiment C, Eq. 5.5: (1 - mean |err| / pi) * (1 - mean |a_r|), err being
/// the difference to the circular mean heading.
pub fn orientation_consensus(robots: &[Robot<'_>]) -> f64 {
    let sin: f64 = robots.iter().map(|robot| robot.heading.sin()).sum();
    let cos: f64 = robots.iter().map(|robot| robot.heading.cos()).sum();
    let mean_heading = sin.atan2(cos);
    let error = mean(robots.iter().map(|robot| angular_difference(robot.heading, mean_heading)));
    let speed = mean(robots.iter().map(|robot| robot.wheels[0].abs()));
    (1.0 - error / PI) * (1.0 - speed)
}

/// The original's experiment C: clip(1 - E / (0.4 pi), 0, 1) * mean
/// clip(1 - |a_r|, 0, 1), E being the largest pairwise difference of headings.
pub fn alignment(robots: &[Robot<'_>]) -> f64 {
    let mut largest: f64 = 0.0;
    for a in robots {
        for b in robots {
            largest = largest.max(angular_difference(a.heading, b.heading));
        }
    }
    let stillness = mean(robots.iter().map(|robot| (1.0 - robot.wheels[0].abs()).clamp(0.0, 1.0)));
    (1.0 - largest / (0.4 * PI)).clamp(0.0, 1.0) * stillness
}

/// Experiment D: share of the robots within `near` cm of the light (of a light, if
/// there are several).
pub fn goto_light(robots: &[Robot<'_>], lights: &[Light<'_>], torus: Torus, near: f64) -> f64 {
    let is_near = |robot: &Robot<'_>| {
        lights.iter().any(|light| torus.distance(robot.position, light.position) <= near)
    };
    mean(robots.iter().map(|robot| if is_near(robot) { 1.0 } else { 0.0 }))
}

/// mean clip(1 - distance to the centroid / 100 cm, 0, 1), if no two robots are within 20 cm of
/// each other; else 0. On a torus, the centroid of a swarm is the mean of the displacements from
/// its first robot.
pub fn grouping(robots: &[Robot<'_>], torus: Torus) -> f64 {
    let positions = positions(robots);
    let origin = positions[0];
    let centroid_of = |axis: usize| {
        let displacements = positions.iter().map(|&p| torus.displacement(origin, p)[axis]);
        origin[axis] + mean(displacements)
    };
    let centroid = torus.wrap([centroid_of(0), centroid_of(1)]);
    for (i, &a) in positions.iter().enumerate() {
        for &b in &positions[i + 1..] {
            if torus.distance(a, b) <= 20.0 {
                return 0.0;
            }
        }
    }
    mean(positions.iter().map(|&p| (1.0 - torus.distance(p, centroid) / 100.0).clamp(0.0, 1.0)))
}

fn positions(robots: &[Robot<'_>]) -> Vec<Vector> {
    robots.iter().map(|robot| robot.position).collect()
}

#[test]
fn fifty_steps_of_one_leader_are_worth_two_point_four_five() {
    let mut leader = SoleLeader::default();
    let of_steps: Vec<f64> = (0..50)
        .map(|_| {
            leader.observe(&[0, 0, 1, 0]);
            identify_leader(&leader)
        })
        .collect();
    assert_eq!(of_steps[..3], [0.0, 0.1, 0.2]);
    assert!((of_trial(FitnessFunction::IdentifyLeader, &of_steps) - 2.45).abs() < 1e-12);
    leader.observe(&[1, 0, 1, 0]);
    assert_eq!(identify_leader(&leader), 0.0);
    leader.observe(&[0, 0, 1, 0]);
    assert_eq!(identify_leader(&leader), 0.0);
}
