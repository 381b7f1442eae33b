//! What robots perceive: the readings that stimuli are made of.

use crate::communication::Mode;
use crate::perturbations::Perturbations;
use crate::sensors::{Noise, NoiseStream, Surroundings};
use crate::swarm::Swarm;
use crate::torus::Vec2;
use crate::world::RobotGroup;
use experiment_file::SensorQuery;
use numeric::random::Stream;

/// Readings of the robots of one group in one trial, beside those of the radio.
#[derive(Debug, Clone)]
pub(crate) struct Senses {
    /// As [`RobotGroup::sensors`].
    sensors: Vec<SensorState>,
    /// Where noise comes from.
    noise: Vec<NoiseSource>,
}

/// The noise of one sensor of a group, or of several that share their streams.
#[derive(Debug, Clone)]
struct NoiseSource {
    key: NoiseStream,
    /// Per robot of the group.
    streams: Vec<Stream>,
    /// How many sensors draw from them.
    n_sensors: usize,
}

/// What a mounted sensor has in one trial.
#[derive(Debug, Clone)]
struct SensorState {
    query: SensorQuery,
    /// Values of a robot's reading.
    reading_len: usize,
    /// `[robot][value]`
    readings: Vec<f64>,
    /// Per robot, whether its controller gets the reading: it is not inhibited.
    is_wanted: Vec<bool>,
    /// Place of its noise in [`Senses::noise`]; none without noise.
    noise: Option<usize>,
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
    /// Nothing perceived yet. `stream` gives a stream of noise by its number.
    pub fn new(
        group: &RobotGroup,
        perturbations: &Perturbations,
        stream: impl Fn(u64) -> Stream,
    ) -> Self {
        let n_robots = group.robots.len();
        let mut sensors = Vec::new();
        let mut noise: Vec<NoiseSource> = Vec::new();
        for mounted in &group.sensors {
            let Noise { deviation, stream: key } = mounted.sensor.noise();
            let source = (deviation > 0.0).then(|| {
                let known = noise.iter().position(|source| source.key == key);
                known.unwrap_or_else(|| {
                    let streams = group.robots.clone().map(|robot| stream(key.number(robot)));
                    noise.push(NoiseSource { key, streams: streams.collect(), n_sensors: 0 });
                    noise.len() - 1
                })
            });
            if let Some(source) = source {
                noise[source].n_sensors += 1;
            }
            let reading_len = mounted.sensor.reading_len();
            let is_wanted = |robot| !perturbations.inhibits(robot, mounted.query);
            sensors.push(SensorState {
                query: mounted.query,
                reading_len,
                readings: vec![0.0; n_robots * reading_len],
                is_wanted: (0..n_robots).map(is_wanted).collect(),
                noise: source,
            });
        }
        Self { sensors, noise }
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
        match query {
            SensorQuery::ReceiverMessage => {
                Reading::Slice(&swarm.received_messages[swarm.message_range(robot)])
            }
            SensorQuery::ReceiverSignal => Reading::Scalar([received.map_or(0.0, |r| r.signal)]),
            SensorQuery::ReceiverReceivingDirection => {
                vector(received.map(|received| received.receiving_direction))
            }
            SensorQuery::ReceiverSendingDirection => {
                vector(received.map(|received| received.sending_direction))
            }
            SensorQuery::ReceiverState => {
                Reading::Scalar([f64::from(swarm.modes[robot] == Mode::Send)])
            }
            query => {
                let sensor = self.sensors.iter().find(|sensor| sensor.query == query);
                Reading::Slice(sensor.map_or(&[], |sensor| {
                    &sensor.readings[index * sensor.reading_len..][..sensor.reading_len]
                }))
            }
        }
    }

    /// Senses with every robot of the group, sensor by sensor in the order in which
    /// they are mounted.
    pub fn update(&mut self, group: &RobotGroup, swarm: &Swarm, surroundings: &Surroundings<'_>) {
        for (mounted, state) in group.sensors.iter().zip(&mut self.sensors) {
            let SensorState { reading_len, readings, is_wanted, .. } = state;
            let robots = group.robots.clone();
            mounted.sensor.sense_group(robots, is_wanted, swarm, surroundings, readings);
            if let Some(source) = state.noise {
                let NoiseSource { streams, n_sensors, .. } = &mut self.noise[source];
                let deviation = mounted.sensor.noise().deviation;
                for ((reading, is_wanted), stream) in
                    readings.chunks_exact_mut(*reading_len).zip(is_wanted).zip(streams)
                {
                    if *is_wanted {
                        add_noise(reading, deviation, stream);
                    } else if *n_sensors > 1 {
                        // The reading is not used, but the next noise in the stream is
                        // another sensor's.
                        stream.skip(*reading_len);
                    }
                }
            }
            let range = mounted.sensor.value_range();
            for value in readings.iter_mut() {
                *value = value.clamp(*range.start(), *range.end());
            }
        }
    }
}

/// Adds Gaussian noise to each value of a reading, one draw each.
fn add_noise(reading: &mut [f64], deviation: f64, stream: &mut Stream) {
    for value in reading {
        *value += deviation * stream.normal();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numeric::random::Purpose;

    #[test]
    fn noise_has_its_deviation_and_one_draw_per_value() {
        let mut stream = Stream::new(0, 0, 0, Purpose::SensorNoise, 0);
        let mut expected = stream.clone();
        let mut reading = [0.5, 0.9, 0.1, 0.0];
        add_noise(&mut reading, 0.4, &mut stream);
        for (value, clean) in reading.into_iter().zip([0.5, 0.9, 0.1, 0.0]) {
            assert_eq!(value, clean + 0.4 * expected.normal());
        }
        assert_eq!(stream.uniform(), expected.uniform());
    }
}
