//! The readings of robots, from which stimuli are made.

use std::ops::Range;

use crate::communication::Mode;
use crate::perturbations::{Perturbations, Sensing};
use crate::sensors::{MountedSensor, Noise, NoiseStream, Sensor, Surroundings};
use crate::swarm::Swarm;
use crate::torus::Vec2;
use crate::world::RobotGroup;
use determinism::normal::standard_normal_quantiles;
use determinism::random::{Purpose, Stream};
use experiment_file::SensorQuery;

/// Readings of the robots of one group in one trial, except those of the radio.
#[derive(Debug, Clone)]
pub(crate) struct Senses {
    /// In the order of [`RobotGroup::sensors`].
    sensors: Vec<SensorState>,
    /// The sources of noise.
    noise: Vec<NoiseSource>,
    /// `None` without pseudo-reality.
    distortion: Option<Distortion>,
}

/// What a pseudo-reality does to the measured values of a group.
#[derive(Debug, Clone)]
struct Distortion {
    sensing: Sensing,
    /// The noise of each robot; empty without noise.
    streams: Vec<Stream>,
}

/// The stream of [`Purpose::PseudoReality`] for the noise of a robot's sensors: 2^32 times this,
/// plus the robot's number. The number is part of the format of a run.
const DISTORTION_STREAMS: u64 = 1;

/// The noise of one sensor of a group, or of several that share their streams.
#[derive(Debug, Clone)]
struct NoiseSource {
    key: NoiseStream,
    /// Per robot of the group.
    streams: Vec<Stream>,
    /// Number of sensors that draw from these streams.
    n_sensors: usize,
    /// Scratch: the drawn values.
    normals: Vec<f64>,
}

/// The state of a mounted sensor in one trial.
#[derive(Debug, Clone)]
struct SensorState {
    query: SensorQuery,
    /// Number of values of a robot's reading.
    reading_len: usize,
    /// `[robot][value]`
    readings: Vec<f64>,
    /// Whether each robot's controller gets the reading, which may be inhibited.
    is_wanted: Vec<bool>,
    /// Index of its noise in [`Senses::noise`]; `None` without noise.
    noise: Option<usize>,
}

impl Senses {
    /// Senses before the first step. `stream` returns a stream by its purpose and number.
    pub fn new(
        group: &RobotGroup,
        perturbations: &Perturbations,
        stream: impl Fn(Purpose, u64) -> Stream,
    ) -> Self {
        let n_robots = group.robots.len();
        let mut sensors = Vec::new();
        let mut noise: Vec<NoiseSource> = Vec::new();
        for mounted in &group.sensors {
            let Noise { deviation, stream: key } = mounted.sensor.noise();
            let source = (deviation > 0.0).then(|| {
                let known = noise.iter().position(|source| source.key == key);
                known.unwrap_or_else(|| {
                    let streams = group.robots.clone();
                    let streams =
                        streams.map(|robot| stream(Purpose::SensorNoise, key.number(robot)));
                    let (streams, normals) = (streams.collect(), Vec::new());
                    noise.push(NoiseSource { key, streams, n_sensors: 0, normals });
                    noise.len() - 1
                })
            });
            if let Some(source) = source {
                noise[source].n_sensors += 1;
            }
            let reading_len = mounted.reading_len;
            let is_wanted = |robot| !perturbations.inhibits(robot, mounted.query);
            sensors.push(SensorState {
                query: mounted.query,
                reading_len,
                readings: vec![0.0; n_robots * reading_len],
                is_wanted: (0..n_robots).map(is_wanted).collect(),
                noise: source,
            });
        }
        let distortion = perturbations.reality().map(|reality| {
            let sensing = reality.sensing;
            let noisy = group.robots.clone().filter(|_| sensing.is_noisy());
            let number = |robot| DISTORTION_STREAMS << 32 | robot as u64;
            let streams = noisy.map(|robot| stream(Purpose::PseudoReality, number(robot)));
            Distortion { sensing, streams: streams.collect() }
        });
        Self { sensors, noise, distortion }
    }

    /// Writes one value of a reading, robot by robot. `robots`: the robots of the group.
    pub fn write(
        &self,
        query: SensorQuery,
        value: usize,
        robots: Range<usize>,
        swarm: &Swarm,
        row: &mut [f32],
    ) {
        let received = swarm.received[robots.clone()].iter().map(Option::as_ref);
        match query {
            SensorQuery::ReceiverMessage if value < swarm.message_len => {
                let messages = &swarm.received_messages[robots.start * swarm.message_len..];
                fill(row, messages.chunks_exact(swarm.message_len).map(|message| message[value]));
            }
            SensorQuery::ReceiverSignal => {
                fill(row, robots.map(|robot| swarm.signal(robot)));
            }
            SensorQuery::ReceiverReceivingDirection => {
                fill(
                    row,
                    received.map(|received| {
                        component(received.map(|frame| frame.receiving_direction), value)
                    }),
                );
            }
            SensorQuery::ReceiverSendingDirection => {
                fill(
                    row,
                    received.map(|received| {
                        component(received.map(|frame| frame.sending_direction), value)
                    }),
                );
            }
            SensorQuery::ReceiverState => {
                let modes = swarm.modes[robots].iter();
                fill(row, modes.map(|&mode| f64::from(mode == Mode::Send)));
            }
            query => {
                let mut sensors = self.sensors.iter();
                let gives =
                    |sensor: &&SensorState| sensor.query == query && value < sensor.reading_len;
                if let Some(sensor) = sensors.find(gives) {
                    let readings = sensor.readings.chunks_exact(sensor.reading_len);
                    fill(row, readings.map(|reading| reading[value]));
                }
            }
        }
    }

    /// A reading of the group's robot number `index`, without inhibition; zeros before the first
    /// step.
    pub fn reading(
        &self,
        (query, len): (SensorQuery, usize),
        robots: &Range<usize>,
        index: usize,
        swarm: &Swarm,
    ) -> Vec<f64> {
        let robot = robots.start + index;
        let received = swarm.received[robot].as_ref();
        let pair = |direction: Option<Vec2>| (0..2).map(|at| component(direction, at)).collect();
        match query {
            SensorQuery::ReceiverMessage => {
                swarm.received_messages[swarm.message_range(robot)].to_vec()
            }
            SensorQuery::ReceiverSignal => vec![swarm.signal(robot)],
            SensorQuery::ReceiverReceivingDirection => {
                pair(received.map(|frame| frame.receiving_direction))
            }
            SensorQuery::ReceiverSendingDirection => {
                pair(received.map(|frame| frame.sending_direction))
            }
            SensorQuery::ReceiverState => {
                vec![f64::from(swarm.modes[robot] == Mode::Send)]
            }
            query => {
                let sensor = self.sensors.iter().find(|sensor| sensor.query == query);
                sensor.map_or_else(
                    || vec![0.0; len],
                    |sensor| sensor.readings[index * len..(index + 1) * len].to_vec(),
                )
            }
        }
    }

    /// Updates the readings of every robot of the group, sensor by sensor in the order of
    /// mounting.
    pub fn update(&mut self, group: &RobotGroup, swarm: &Swarm, surroundings: &Surroundings<'_>) {
        for (mounted, state) in group.sensors.iter().zip(&mut self.sensors) {
            let SensorState { reading_len, readings, is_wanted, .. } = state;
            let robots = group.robots.clone();
            mounted.sensor.sense_group(robots, is_wanted, swarm, surroundings, readings);
            if let Some(source) = state.noise {
                let deviation = mounted.sensor.noise().deviation;
                self.noise[source].add(deviation, *reading_len, readings, is_wanted);
            }
            if let Some(distortion) = &mut self.distortion
                && mounted.query != SensorQuery::Script
            {
                let each = readings.chunks_exact_mut(*reading_len).zip(&*is_wanted).enumerate();
                for (robot, (reading, is_wanted)) in each {
                    distortion.apply(mounted, robot, reading, *is_wanted);
                }
            }
            clip(&*mounted.sensor, readings);
        }
    }

    /// Sets the `script_sensor` reading of the group's robot number `index` to a script's result.
    pub fn take(&mut self, group: &RobotGroup, index: usize, reading: &[f64]) {
        for (mounted, state) in group.sensors.iter().zip(&mut self.sensors) {
            if state.query == SensorQuery::Script {
                let own = &mut state.readings[index * state.reading_len..][..state.reading_len];
                own.copy_from_slice(reading);
                if let Some(distortion) = &mut self.distortion {
                    distortion.apply(mounted, index, own, true);
                }
                clip(&*mounted.sensor, own);
            }
        }
    }
}

impl Distortion {
    /// Distorts a reading of the group's robot number `index`, with one draw per value.
    fn apply(
        &mut self,
        mounted: &MountedSensor,
        index: usize,
        reading: &mut [f64],
        is_wanted: bool,
    ) {
        if !mounted.query.is_measured() {
            return;
        }
        let mut noise = self.streams.get_mut(index);
        if !is_wanted {
            // The next draw belongs to another sensor.
            noise.iter_mut().for_each(|noise| noise.skip(reading.len()));
            return;
        }
        let range = mounted.sensor.value_range();
        let width = range.end() - range.start();
        for value in reading {
            let normal = noise.as_mut().map_or(0.0, |noise| noise.normal());
            *value = self.sensing.distort(*value, width, normal);
        }
    }
}

/// Keeps values of a reading within the sensor's range.
fn clip(sensor: &dyn Sensor, values: &mut [f64]) {
    let range = sensor.value_range();
    for value in values {
        *value = value.clamp(*range.start(), *range.end());
    }
}

/// Writes one value per robot into a row.
fn fill(row: &mut [f32], values: impl Iterator<Item = f64>) {
    for (lane, value) in row.iter_mut().zip(values) {
        *lane = value as f32;
    }
}

/// A component of a direction; zero without a direction.
fn component(direction: Option<Vec2>, index: usize) -> f64 {
    direction.map_or(0.0, |direction| if index == 0 { direction.x } else { direction.y })
}

impl NoiseSource {
    /// Adds Gaussian noise to each value of the wanted readings, `[robot][value]`, with one draw
    /// each.
    fn add(
        &mut self,
        deviation: f64,
        reading_len: usize,
        readings: &mut [f64],
        is_wanted: &[bool],
    ) {
        let Self { streams, n_sensors, normals, .. } = self;
        normals.resize(readings.len(), 0.0);
        let mut n_drawn = 0;
        for (is_wanted, stream) in is_wanted.iter().zip(streams) {
            if *is_wanted {
                stream.fill_probability(&mut normals[n_drawn..n_drawn + reading_len]);
                n_drawn += reading_len;
            } else if *n_sensors > 1 {
                // The reading is unused, but the next draw of the stream belongs to another
                // sensor.
                stream.skip(reading_len);
            }
        }
        standard_normal_quantiles(&mut normals[..n_drawn]);
        let wanted = readings.chunks_exact_mut(reading_len).zip(is_wanted);
        let wanted = wanted.filter(|(_, is_wanted)| **is_wanted);
        for ((reading, _), normals) in wanted.zip(normals.chunks_exact(reading_len)) {
            for (value, normal) in reading.iter_mut().zip(normals) {
                *value += deviation * normal;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    #[test]
    fn noise_has_its_deviation_and_one_draw_per_wanted_value() {
        let stream = |robot| Stream::new(0, 0, 0, Purpose::SensorNoise, robot);
        let mut source = NoiseSource {
            key: NoiseStream::LIGHT_AND_DISTANCE,
            streams: (0..3).map(stream).collect(),
            n_sensors: 1,
            normals: Vec::new(),
        };
        let clean = [0.5, 0.9, 0.1, 0.0, 0.3, 1.0];
        let mut readings = clean;
        source.add(0.4, 2, &mut readings, &[true, false, true]);
        for (robot, is_wanted) in [true, false, true].into_iter().enumerate() {
            let mut expected = stream(robot as u64);
            for value in 2 * robot..2 * robot + 2 {
                let noise = if is_wanted { 0.4 * expected.normal() } else { 0.0 };
                assert_eq!(readings[value], clean[value] + noise);
            }
            assert_eq!(source.streams[robot].uniform(), expected.uniform());
        }
    }
}
