//! Lights and how they move.

use crate::torus::{Torus, Vec2, wrap_angle};
use experiment_file::{LightController, OrbitConfig, Pace, RandomTargetsConfig};
use numeric::random::Stream;

/// Probability per step that an orbiting light turns back.
const FLIP_PROBABILITY: f64 = 0.01;
/// Radius that an orbit tends to, cm.
const ORBIT_RADIUS: f64 = 200.0;
/// Time constant with which an orbit's radius tends to it, steps.
const ORBIT_SETTLING: f64 = 50.0;
/// Side of the square around the world's centre that targets are drawn from, cm.
const TARGET_SQUARE: f64 = 200.0;

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
            LightController::Static {} => Motion::Static,
            LightController::LightOrbitController(config) => {
                let away = torus.displacement(torus.center(), position);
                Motion::Orbit { config, angle: away.angle(), radius: away.norm(), sense: 1.0 }
            }
            LightController::LightRndPosController(config) => {
                Motion::RandomTargets { config, target: position }
            }
        };
        Self { stream, motion }
    }

    /// Position after environment step `step`, from the position before.
    pub fn advance(&mut self, position: Vec2, step: u32, torus: &Torus) -> Vec2 {
        match &mut self.motion {
            Motion::Static => position,
            Motion::Orbit { config, angle, radius, sense } => {
                if self.stream.bernoulli(FLIP_PROBABILITY) {
                    *sense = -*sense;
                }
                *angle = wrap_angle(*angle + *sense * config.angle_step);
                *radius = match config.radius_step {
                    None => *radius + (ORBIT_RADIUS - *radius) / ORBIT_SETTLING,
                    Some(step) => (*radius + step).min(ORBIT_RADIUS),
                };
                let (center, direction) = (torus.center(), Vec2::unit(*angle));
                torus.wrap(Vec2 {
                    x: center.x + *radius * direction.x,
                    y: center.y + *radius * direction.y,
                })
            }
            Motion::RandomTargets { config, target } => {
                if step.is_multiple_of(config.every) {
                    let mut coordinate = |center: f64| {
                        center - 0.5 * TARGET_SQUARE + TARGET_SQUARE * self.stream.uniform()
                    };
                    let x = coordinate(torus.center().x);
                    *target = torus.wrap(Vec2 { x, y: coordinate(torus.center().y) });
                }
                let way = torus.displacement(position, *target);
                let share = match (config.pace, way.norm()) {
                    (Pace::Step(share), _) => share,
                    (Pace::Speed(_), 0.0) => 0.0,
                    (Pace::Speed(speed), distance) => speed / distance,
                };
                torus.wrap(Vec2 { x: position.x + share * way.x, y: position.y + share * way.y })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numeric::random::Purpose;

    const TORUS: Torus = Torus { width: 1000.0, height: 800.0 };

    fn path(controller: LightController, start: Vec2) -> impl FnMut(u32) -> Vec2 {
        let stream = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
        let mut path = LightPath::new(&controller, start, &TORUS, stream);
        let mut position = start;
        move |step| {
            position = path.advance(position, step, &TORUS);
            position
        }
    }

    fn orbit(config: OrbitConfig) -> impl FnMut(u32) -> Vec2 {
        path(LightController::LightOrbitController(config), Vec2::new(501.0, 400.0))
    }

    #[test]
    fn an_orbit_may_grow_by_a_constant_step() {
        let mut path = orbit(OrbitConfig { angle_step: 0.013, radius_step: Some(1.5) });
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
            // The first flip of this stream comes later.
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
    fn random_targets(pace: Pace) -> (impl FnMut(u32) -> Vec2, impl FnMut(u32) -> Vec2) {
        let config = RandomTargetsConfig { every: 50, pace };
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
        let (mut path, mut targets) = random_targets(Pace::Step(0.1));
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
        let (mut path, mut targets) = random_targets(Pace::Speed(3.0));
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
    fn a_static_light_stays() {
        let start = Vec2::new(1.0, 2.0);
        let mut path = path(LightController::Static {}, start);
        assert!((0..10).all(|step| path(step) == start));
    }
}
