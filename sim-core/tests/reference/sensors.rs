//! The sensors of section 3.2.2. Each returns its readings independently of their use.

use determinism::random::Stream;
use experiment_file::{DistanceSensorConfig, LightSensorConfig, SensorQuery};

use super::communication::Reception;
use super::lights::Light;
use super::robot::Robot;
use super::torus::{Torus, Vector, angular_difference, sector_direction};
use super::world::Area;

/// Everything a robot perceives in a step.
pub struct Readings {
    pub reception: Option<Reception>,
    /// Own mode: 1 send, 0 relay.
    pub state: f64,
    pub light: Vec<f64>,
    pub distance: Vec<f64>,
    pub ground: f64,
    pub food_area: f64,
    pub nest: f64,
    /// (x, y), cm.
    pub position: Vector,
    /// In turns.
    pub orientation: f64,
    /// (x, y, heading) of the nearest robots, cm and radians.
    pub neighborhood: Vec<f64>,
}

impl Readings {
    /// The values of the reading of this name (Eq. 3.15); zeros without a reception.
    pub fn get(&self, query: SensorQuery, msg_length: usize) -> Vec<f64> {
        let reception = self.reception.as_ref();
        match query {
            SensorQuery::ReceiverMessage => {
                reception.map_or(vec![0.0; msg_length], |r| r.message.clone())
            }
            SensorQuery::ReceiverSignal => vec![reception.map_or(0.0, |r| r.signal)],
            SensorQuery::ReceiverReceivingDirection => {
                reception.map_or([0.0, 0.0], |r| r.receiving_direction).to_vec()
            }
            SensorQuery::ReceiverSendingDirection => {
                reception.map_or([0.0, 0.0], |r| r.sending_direction).to_vec()
            }
            SensorQuery::ReceiverState => vec![self.state],
            SensorQuery::Light => self.light.clone(),
            SensorQuery::Distance => self.distance.clone(),
            SensorQuery::Ground => vec![self.ground],
            SensorQuery::FoodArea => vec![self.food_area],
            SensorQuery::Nest => vec![self.nest],
            SensorQuery::OwnPosition => self.position.to_vec(),
            SensorQuery::OwnOrientation => vec![self.orientation],
            // Only a script lets robots carry something.
            SensorQuery::Food => vec![0.0],
            SensorQuery::NeighborhoodPos => self.neighborhood.clone(),
            SensorQuery::Script | SensorQuery::Proximity | SensorQuery::Contact => {
                panic!("no equation is given")
            }
        }
    }
}

/// Eq. 3.9: per sector, the sum over the lights in range.
pub fn light(
    config: &LightSensorConfig,
    robot: &Robot<'_>,
    lights: &[Light<'_>],
    torus: Torus,
    noise: &mut Stream,
) -> Vec<f64> {
    let mut readings = Vec::new();
    for j in 0..config.n_sectors {
        let sector = sector_direction(robot.heading, j, config.n_sectors);
        let mut sum = 0.0;
        for light in lights {
            let rho = torus.distance(robot.position, light.position);
            let range = config.range.min(light.params().range);
            if light.params().color != config.color || rho > range {
                continue;
            }
            let bearing = torus.bearing(robot.position, light.position);
            let phi = angular_difference(sector, bearing);
            if phi > config.aperture {
                continue;
            }
            sum += (-config.decay_rho * rho - config.decay_phi * phi).exp();
        }
        readings.push(with_noise(sum, config.noise_variance, noise));
    }
    readings
}

/// Eq. 3.11: per sector, the largest over the robots in range.
pub fn distance(
    config: &DistanceSensorConfig,
    own_idx: usize,
    robots: &[Robot<'_>],
    torus: Torus,
    noise: &mut Stream,
) -> Vec<f64> {
    let own = &robots[own_idx];
    let mut readings = Vec::new();
    for j in 0..config.n_sectors {
        let sector = sector_direction(own.heading, j, config.n_sectors);
        let mut largest: f64 = 0.0;
        for (other_idx, other) in robots.iter().enumerate() {
            let rho = torus.distance(own.position, other.position);
            if other_idx == own_idx || rho > config.range {
                continue;
            }
            let phi = angular_difference(sector, torus.bearing(own.position, other.position));
            if phi > config.aperture {
                continue;
            }
            largest = largest.max((-config.decay_rho * rho - config.decay_phi * phi).exp());
        }
        readings.push(with_noise(largest, config.noise_variance, noise));
    }
    readings
}

/// Places and headings of the `n` nearest other robots, nearest first, with ties by number; zeros
/// for missing robots.
pub fn neighborhood(n: usize, own_idx: usize, robots: &[Robot<'_>], torus: Torus) -> Vec<f64> {
    let own = &robots[own_idx];
    let mut others: Vec<&Robot<'_>> = robots
        .iter()
        .enumerate()
        .filter(|(idx, _)| *idx != own_idx)
        .map(|(_, robot)| robot)
        .collect();
    // Stable: ties keep their order.
    others.sort_by(|a, b| {
        let [a, b] = [a, b].map(|robot| torus.distance(own.position, robot.position));
        a.total_cmp(&b)
    });
    let pose = |robot: &&Robot<'_>| [robot.position[0], robot.position[1], robot.heading];
    let mut reading: Vec<f64> = others.iter().take(n).flat_map(pose).collect();
    reading.resize(3 * n, 0.0);
    reading
}

/// 1 on an area of a colour, else 0.
pub fn ground(color: &str, position: Vector, areas: &[Area<'_>], torus: Torus) -> f64 {
    let stands_on = |area: &Area<'_>| {
        area.params.color == color && torus.distance(position, area.position) <= area.params.range
    };
    if areas.iter().any(stands_on) { 1.0 } else { 0.0 }
}

/// The value with noise, outside of the sensor's range, too.
fn with_noise(value: f64, variance: f64, noise: &mut Stream) -> f64 {
    let noise = if variance == 0.0 { 0.0 } else { noise.normal() * variance.sqrt() };
    value + noise
}
