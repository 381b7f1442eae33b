//! Lights and their paths (sections 5.4 and 6.4).

use std::f64::consts::PI;

use determinism::random::Stream;
use experiment_file::{LightController, LightParams, LightSourceConfig};

use super::torus::{Torus, Vector, norm};

/// A light and the state of its motion.
pub struct Light<'a> {
    config: &'a LightSourceConfig,
    pub position: Vector,
    radius: f64,
    angle: f64,
    sense: f64,
    target: Vector,
    direction: Vector,
    is_caught: bool,
    stream: Stream,
}

impl<'a> Light<'a> {
    pub fn new(
        config: &'a LightSourceConfig,
        position: Vector,
        torus: Torus,
        stream: Stream,
    ) -> Self {
        let from_centre = torus.displacement(torus.centre(), position);
        Self {
            config,
            position,
            radius: norm(from_centre),
            angle: torus.bearing(torus.centre(), position),
            sense: 1.0,
            target: position,
            direction: [0.5_f64.sqrt(); 2],
            is_caught: false,
            stream,
        }
    }

    pub fn params(&self) -> &'a LightParams {
        &self.config.params
    }

    /// Movement at the end of step `k`.
    pub fn advance(&mut self, k: u32, torus: Torus, robots: &[Vector]) {
        let centre = torus.centre();
        match self.config.controller {
            LightController::Static {} => {}
            // The original's prey.
            LightController::LightPreyController {} => {
                let ways = robots.iter().map(|&robot| torus.displacement(self.position, robot));
                let ways: Vec<Vector> = ways.filter(|&way| norm(way) < 150.0).collect();
                let weights: Vec<f64> = ways.iter().map(|&way| 150.0 - norm(way)).collect();
                let towards = [0, 1].map(|axis| {
                    weights.iter().zip(&ways).map(|(weight, way)| weight * way[axis]).sum::<f64>()
                });
                if norm(towards) > 0.0 {
                    self.direction = towards.map(|component| -component / norm(towards));
                }
                if !self.is_caught {
                    self.position = torus.wrap([
                        self.position[0] + 3.0 * self.direction[0],
                        self.position[1] + 3.0 * self.direction[1],
                    ]);
                }
                self.is_caught |= ways.iter().any(|&way| norm(way) < 30.0);
            }
            LightController::ScriptController {} => panic!("no equation is given"),
            // Eq. 5.7-5.8
            LightController::LightOrbitController(orbit) => {
                if self.stream.uniform() < 0.01 {
                    self.sense = -self.sense;
                }
                self.angle += self.sense * orbit.angle_step;
                match orbit.radius_step {
                    None => self.radius += (orbit.radius - self.radius) / 50.0,
                    Some(step) => self.radius = (self.radius + step).min(orbit.radius),
                }
                self.position = torus.wrap([
                    centre[0] + self.radius * self.angle.cos(),
                    centre[1] + self.radius * self.angle.sin(),
                ]);
            }
            // Section 6.4
            LightController::LightRndPosController(config) => {
                if k.is_multiple_of(config.every) {
                    let x = centre[0] - config.square / 2.0 + config.square * self.stream.uniform();
                    let y = centre[1] - config.square / 2.0 + config.square * self.stream.uniform();
                    self.target = torus.wrap([x, y]);
                }
                let way = torus.displacement(self.position, self.target);
                let distance = norm(way);
                let length = match config.step {
                    Some(share) => share * distance,
                    None => config.speed.expect("the light has a `speed` or a `step`"),
                };
                if distance > 0.0 {
                    self.position = torus.wrap([
                        self.position[0] + length * way[0] / distance,
                        self.position[1] + length * way[1] / distance,
                    ]);
                }
            }
        }
    }
}

#[test]
fn an_orbiting_light_spirals_outwards_from_the_centre() {
    use determinism::random::Purpose;
    use experiment_file::{Initializer, OrbitConfig, PositionInitializers};

    let torus = Torus { width: 1000.0, height: 1000.0 };
    let config = LightSourceConfig {
        num_instances: 1,
        controller: LightController::LightOrbitController(OrbitConfig::default()),
        initializers: PositionInitializers {
            positions: Initializer::Fixed { values: vec![vec![500.0, 500.0]] },
        },
        params: LightParams { range: 80.0, color: "red".into() },
    };
    let stream = Stream::new(0, 0, 0, Purpose::LightMovement, 0);
    let mut light = Light::new(&config, torus.centre(), torus, stream);
    for k in 0..300 {
        light.advance(k, torus, &[]);
    }
    let radius = OrbitConfig::default().radius * (1.0 - 0.98f64.powi(300));
    assert!((torus.distance(torus.centre(), light.position) - radius).abs() < 1e-9);
    assert!(light.angle.abs() < 300.0 * 0.01 + 1e-9 && light.angle.abs() < PI);
}
