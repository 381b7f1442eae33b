//! Lights and their motion.

use std::f64::consts::FRAC_PI_4;

use crate::torus::{Torus, Vec2, wrap_angle};
use determinism::random::Stream;
use experiment_file::{LightController, OrbitConfig, RandomTargetsConfig};

/// Probability per step that an orbiting light turns back.
const FLIP_PROBABILITY: f64 = 0.01;
/// Time constant with which an orbit's radius approaches its final value, steps.
const ORBIT_SETTLING: f64 = 50.0;
/// Distance within which prey flees from a robot, cm.
const PREY_SIGHT: f64 = 150.0;
/// Distance within which a robot catches prey, cm.
const PREY_CATCH: f64 = 30.0;
/// Distance that prey moves per step, cm.
const PREY_SPEED: f64 = 3.0;

/// The path of one light in one trial.
#[derive(Debug, Clone)]
pub(crate) struct LightPath {
    stream: Stream,
    motion: Motion,
}

#[derive(Debug, Clone)]
enum Motion {
    Static,
    /// Polar coordinates around the centre of the world (Eq. 5.7 and 5.8).
    Orbit {
        config: OrbitConfig,
        angle: f64,
        radius: f64,
        sense: f64,
    },
    /// The prey of SpikeSwarmSim.
    Prey {
        direction: Vec2,
        is_caught: bool,
    },
    /// Section 6.4.
    RandomTargets {
        config: RandomTargetsConfig,
        target: Vec2,
    },
}

impl LightPath {
    /// The path of a light that starts at `position`.
    pub fn new(
        controller: &LightController,
        position: Vec2,
        torus: &Torus,
        stream: Stream,
    ) -> Self {
        let motion = match *controller {
            // A script moves this light.
            LightController::ScriptController {} | LightController::Static {} => Motion::Static,
            LightController::LightOrbitController(config) => {
                let away = torus.displacement(torus.center(), position);
                Motion::Orbit { config, angle: away.angle(), radius: away.norm(), sense: 1.0 }
            }
            LightController::LightPreyController {} => {
                Motion::Prey { direction: Vec2::unit(FRAC_PI_4), is_caught: false }
            }
            LightController::LightRndPosController(config) => {
                Motion::RandomTargets { config, target: position }
            }
        };
        Self { stream, motion }
    }

    /// Goes on from a place to which somebody has put the light.
    pub fn go_on_from(&mut self, position: Vec2, torus: &Torus) {
        if let Motion::Orbit { angle, radius, .. } = &mut self.motion {
            let away = torus.displacement(torus.center(), position);
            (*angle, *radius) = (away.angle(), away.norm());
        }
    }

    /// The next position after environment step `step`, with robots at `robots`.
    pub fn advance(&mut self, position: Vec2, step: u32, torus: &Torus, robots: &[Vec2]) -> Vec2 {
        match &mut self.motion {
            Motion::Static => position,
            Motion::Orbit { config, angle, radius, sense } => {
                if self.stream.bernoulli(FLIP_PROBABILITY) {
                    *sense = -*sense;
                }
                *angle = wrap_angle(*angle + *sense * config.angle_step);
                *radius = match config.radius_step {
                    None => *radius + (config.radius - *radius) / ORBIT_SETTLING,
                    Some(step) => (*radius + step).min(config.radius),
                };
                let (center, direction) = (torus.center(), Vec2::unit(*angle));
                torus.wrap(Vec2 {
                    x: center.x + *radius * direction.x,
                    y: center.y + *radius * direction.y,
                })
            }
            Motion::Prey { direction, is_caught } => {
                flee(position, torus, robots, direction, is_caught)
            }
            Motion::RandomTargets { config, target } => {
                if step.is_multiple_of(config.every) {
                    let mut coordinate = |center: f64| {
                        center - 0.5 * config.square + config.square * self.stream.uniform()
                    };
                    let x = coordinate(torus.center().x);
                    *target = torus.wrap(Vec2 { x, y: coordinate(torus.center().y) });
                }
                let way = torus.displacement(position, *target);
                let share = match (config.step, config.speed, way.norm()) {
                    (Some(share), _, _) => share,
                    (None, Some(speed), distance) if distance > 0.0 => speed / distance,
                    _ => 0.0,
                };
                torus.wrap(Vec2 { x: position.x + share * way.x, y: position.y + share * way.y })
            }
        }
    }
}

/// The next position of prey. The prey flees from the robots that it sees, more strongly from near
/// robots. While it sees no robot, it moves straight on. Once it is caught, it stops.
fn flee(
    position: Vec2,
    torus: &Torus,
    robots: &[Vec2],
    direction: &mut Vec2,
    is_caught: &mut bool,
) -> Vec2 {
    let seen = robots.iter().map(|&robot| torus.displacement(position, robot));
    let seen: Vec<Vec2> = seen.filter(|way| way.norm() < PREY_SIGHT).collect();
    let weight = |way: &Vec2| (PREY_SIGHT - way.norm()) / PREY_SIGHT;
    let total: f64 = seen.iter().map(weight).fold(0.0, |sum, weight| sum + weight);
    let towards = seen.iter().fold(Vec2::default(), |sum, way| {
        let share = weight(way) / total;
        Vec2 { x: sum.x + share * way.x, y: sum.y + share * way.y }
    });
    let length = towards.norm();
    if length > 0.0 {
        *direction = Vec2 { x: -towards.x / length, y: -towards.y / length };
    }
    if *is_caught {
        return position;
    }
    *is_caught = seen.iter().any(|way| way.norm() < PREY_CATCH);
    torus.wrap(Vec2 {
        x: position.x + PREY_SPEED * direction.x,
        y: position.y + PREY_SPEED * direction.y,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    const TORUS: Torus = Torus::new(1000.0, 800.0);

    fn path(controller: LightController, start: Vec2) -> impl FnMut(u32) -> Vec2 {
        let stream = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
        let mut path = LightPath::new(&controller, start, &TORUS, stream);
        let mut position = start;
        move |step| {
            position = path.advance(position, step, &TORUS, &[]);
            position
        }
    }

    fn orbit(config: OrbitConfig) -> impl FnMut(u32) -> Vec2 {
        path(LightController::LightOrbitController(config), Vec2::new(501.0, 400.0))
    }

    #[test]
    fn an_orbit_may_grow_by_a_constant_step() {
        let mut path = orbit(OrbitConfig {
            angle_step: 0.013,
            radius_step: Some(1.5),
            ..OrbitConfig::default()
        });
        for step in 0..40 {
            let (radius, angle) = (1.0 + 1.5 * f64::from(step + 1), 0.013 * f64::from(step + 1));
            let expected =
                Vec2::new(500.0 + radius * libm::cos(angle), 400.0 + radius * libm::sin(angle));
            assert!(TORUS.distance(path(step), expected) < 1e-9, "step {step}");
        }
        let settled = (40..200).map(&mut path).last().unwrap();
        assert!((TORUS.distance(settled, TORUS.center()) - 200.0).abs() < 1e-9);
    }

    #[test]
    fn an_orbit_starts_where_the_light_is_and_settles_at_its_radius() {
        let mut path = orbit(OrbitConfig::default());
        let mut radius = 1.0;
        for step in 0..40 {
            // The light turns back only after these steps.
            let position = path(step);
            radius += (200.0 - radius) / 50.0;
            let angle = 0.01 * f64::from(step + 1);
            let expected =
                Vec2::new(500.0 + radius * libm::cos(angle), 400.0 + radius * libm::sin(angle));
            assert!(TORUS.distance(position, expected) < 1e-9, "step {step}");
        }
        let settled = (40..1000).map(&mut path).last().unwrap();
        assert!((TORUS.distance(settled, TORUS.center()) - 200.0).abs() < 1e-3);
    }

    #[test]
    fn an_orbit_flips_once_in_a_hundred_steps() {
        let mut path = orbit(OrbitConfig::default());
        let angle = |p: Vec2| TORUS.displacement(TORUS.center(), p).angle();
        let angles: Vec<f64> = (0..20_000).map(|step| angle(path(step))).collect();
        let senses: Vec<bool> =
            angles.windows(2).map(|pair| wrap_angle(pair[1] - pair[0]) < 1.0).collect();
        let flips = senses.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!((150..250).contains(&flips), "{flips}");
    }

    const START: Vec2 = Vec2::new(500.0, 400.0);

    /// The path of a light, and its targets.
    fn random_targets(
        speed: Option<f64>,
        step: Option<f64>,
    ) -> (impl FnMut(u32) -> Vec2, impl FnMut(u32) -> Vec2) {
        let config = RandomTargetsConfig { speed, step, ..Default::default() };
        let mut draws = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
        let mut target = START;
        let targets = move |step| {
            if step % 50 == 0 {
                let x = 400.0 + 200.0 * draws.uniform();
                target = Vec2::new(x, 300.0 + 200.0 * draws.uniform());
            }
            target
        };
        (path(LightController::LightRndPosController(config), START), targets)
    }

    #[test]
    fn a_light_at_a_share_of_the_way_per_step_slows_down() {
        let (mut path, mut targets) = random_targets(None, Some(0.1));
        let mut position = START;
        for step in 0..200 {
            let target = targets(step);
            position = Vec2::new(
                position.x + 0.1 * (target.x - position.x),
                position.y + 0.1 * (target.y - position.y),
            );
            assert!(TORUS.distance(path(step), position) < 1e-9, "step {step}");
        }
    }

    #[test]
    fn a_light_of_constant_speed_goes_straight_to_its_target_and_oscillates_there() {
        let (mut path, mut targets) = random_targets(Some(3.0), None);
        let mut position = START;
        let mut n_at_target = 0;
        for step in 0..200 {
            let target = targets(step);
            let before = position;
            position = path(step);
            assert!((TORUS.distance(before, position) - 3.0).abs() < 1e-9, "step {step}");
            let [from, to] = [before, position].map(|point| TORUS.distance(point, target));
            assert!((to - (from - 3.0).abs()).abs() < 1e-9, "step {step}");
            n_at_target += usize::from(from < 3.0 && to < 3.0);
        }
        assert!(n_at_target > 20, "{n_at_target}");
    }

    #[test]
    fn orbits_and_target_squares_have_the_configured_size() {
        let mut path_of_orbit = orbit(OrbitConfig { radius: 50.0, ..OrbitConfig::default() });
        let settled = (0..1000).map(&mut path_of_orbit).last().unwrap();
        assert!((TORUS.distance(settled, TORUS.center()) - 50.0).abs() < 1e-3);
        let config = RandomTargetsConfig { every: 1, square: 20.0, speed: None, step: Some(1.0) };
        let mut path = path(LightController::LightRndPosController(config), START);
        let away = (0..500).map(|step| {
            let way = TORUS.displacement(TORUS.center(), path(step));
            way.x.abs().max(way.y.abs())
        });
        let farthest = away.fold(0.0, f64::max);
        assert!(farthest <= 10.0 && farthest > 9.0, "{farthest}");
    }

    /// The displacement of prey in a step among robots.
    fn way_of_prey(robots: &[Vec2]) -> Vec2 {
        let stream = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
        let mut path =
            LightPath::new(&LightController::LightPreyController {}, START, &TORUS, stream);
        TORUS.displacement(START, path.advance(START, 0, &TORUS, robots))
    }

    fn assert_way(way: Vec2, (x, y): (f64, f64)) {
        assert!((way.x - x).abs() + (way.y - y).abs() < 1e-9, "{way:?}");
    }

    #[test]
    fn prey_flees_most_from_the_nearest_robots() {
        let at = |x: f64, y: f64| Vec2::new(START.x + x, START.y + y);
        let straight = 3.0 * libm::sqrt(0.5);
        assert_way(way_of_prey(&[at(150.0, 0.0)]), (straight, straight));
        assert_way(way_of_prey(&[at(100.0, 0.0)]), (-3.0, 0.0));
        // Weights 2/3 and 1/3 of displacements (-50, 0) and (0, 100): the robots are towards (-1,
        // 1).
        assert_way(way_of_prey(&[at(-50.0, 0.0), at(0.0, 100.0)]), (straight, -straight));
        // Surrounded prey keeps its direction.
        assert_way(way_of_prey(&[at(-50.0, 0.0), at(50.0, 0.0)]), (straight, straight));
    }

    #[test]
    fn caught_prey_stays() {
        let stream = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
        let mut path =
            LightPath::new(&LightController::LightPreyController {}, START, &TORUS, stream);
        let near = [Vec2::new(START.x + 29.0, START.y)];
        let position = path.advance(START, 0, &TORUS, &near);
        assert!((TORUS.distance(START, position) - 3.0).abs() < 1e-9, "its last displacement");
        for step in 1..20 {
            assert_eq!(path.advance(position, step, &TORUS, &[]), position);
        }
    }

    #[test]
    fn a_static_light_stays() {
        let start = Vec2::new(1.0, 2.0);
        let mut path = path(LightController::Static {}, start);
        assert!((0..10).all(|step| path(step) == start));
    }
}
