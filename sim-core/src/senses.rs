//! What robots perceive: the readings that stimuli are made of.

use crate::communication::Mode;
use crate::neighbours::Neighbours;
use crate::sensors::Viewpoint;
use crate::swarm::Swarm;
use crate::torus::{Torus, Vec2};
use crate::world::RobotGroup;
use experiment_file::SensorQuery;
use numeric::random::Stream;

/// Readings of the robots of one group in one trial, beside those of the radio;
/// empty without the sensor.
#[derive(Debug, Clone)]
pub(crate) struct Senses {
    /// `[robot][sector]`
    light: Vec<f64>,
    /// `[robot][sector]`
    distance: Vec<f64>,
    /// `[robot]`
    ground: Vec<f64>,
    n_robots: usize,
}

/// What there is to sense beside frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    /// The plane.
    pub torus: &'a Torus,
    /// Who is near whom.
    pub neighbours: &'a Neighbours,
    /// Positions of all lights.
    pub lights: &'a [Vec2],
    /// Centres of all ground areas.
    pub areas: &'a [Vec2],
}

/// A reading of one robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reading<'a> {
    /// One value.
    Scalar([f64; 1]),
    /// A direction.
    Vector([f64; 2]),
    /// Any number of values.
    Slice(&'a [f64]),
}

impl Reading<'_> {
    /// Its values.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Scalar(values) => values,
            Self::Vector(values) => values,
            Self::Slice(values) => values,
        }
    }
}

impl Senses {
    /// Nothing perceived yet.
    pub fn new(group: &RobotGroup) -> Self {
        let n = group.robots.len();
        let zeros = |n_values: Option<usize>| vec![0.0; n * n_values.unwrap_or(0)];
        Self {
            light: zeros(group.light_sensor.as_ref().map(|sensor| sensor.n_sectors)),
            distance: zeros(group.distance_sensor.as_ref().map(|sensor| sensor.n_sectors)),
            ground: zeros(group.ground_sensor.as_ref().map(|_| 1)),
            n_robots: n,
        }
    }

    /// A reading of robot `robot`, the group's number `index`.
    pub fn reading<'a>(
        &'a self,
        query: SensorQuery,
        swarm: &'a Swarm,
        index: usize,
        robot: usize,
    ) -> Reading<'a> {
        let received = swarm.received[robot].as_ref();
        let vector = |direction: Option<Vec2>| {
            Reading::Vector(direction.map_or([0.0; 2], |direction| [direction.x, direction.y]))
        };
        let of_robot = |readings: &'a [f64]| {
            let n = readings.len() / self.n_robots;
            Reading::Slice(&readings[index * n..(index + 1) * n])
        };
        match query {
            SensorQuery::ReceiverMessage => {
                Reading::Slice(&swarm.received_messages[swarm.message_range(robot)])
            }
            SensorQuery::ReceiverSignal => Reading::Scalar([received.map_or(0.0, |r| r.signal)]),
            SensorQuery::ReceiverReceivingDirection => {
                vector(received.map(|received| received.receiving_direction))
            }
            SensorQuery::ReceiverSendingDirection => {
                vector(received.map(|received| received.origin.sending_direction))
            }
            SensorQuery::ReceiverState => {
                Reading::Scalar([f64::from(swarm.modes[robot] == Mode::Send)])
            }
            SensorQuery::Light => of_robot(&self.light),
            SensorQuery::Distance => of_robot(&self.distance),
            SensorQuery::Ground => of_robot(&self.ground),
        }
    }

    /// Senses with every robot of the group. Noise comes from each robot's own
    /// stream, the light sensor's first.
    pub fn update(
        &mut self,
        group: &RobotGroup,
        swarm: &Swarm,
        surroundings: Surroundings<'_>,
        noise: &mut [Stream],
    ) {
        let Surroundings { torus, neighbours, lights, areas } = surroundings;
        for (index, robot) in group.robots.clone().enumerate() {
            let position = swarm.positions[robot];
            let from = Viewpoint { torus, position, heading: swarm.headings[robot] };
            let noise = &mut noise[robot];
            if let Some(sensor) = &group.light_sensor {
                let readings = &mut self.light[index * sensor.n_sectors..][..sensor.n_sectors];
                if swarm.photosensitive[robot] {
                    sensor.sense(from, lights, noise, readings);
                } else if group.distance_sensor.is_some() {
                    // Nobody looks at the readings, but the other sensor's noise
                    // comes after theirs.
                    sensor.skip(noise);
                }
            }
            if let Some(sensor) = &group.distance_sensor {
                let readings = &mut self.distance[index * sensor.n_sectors..][..sensor.n_sectors];
                sensor.sense(neighbours.of(robot), from.heading, noise, readings);
            }
            if let Some(sensor) = &group.ground_sensor {
                self.ground[index] = sensor.sense(torus, position, areas);
            }
        }
    }
}
