//! Sensors beside the wireless receiver (section 3.2.2 of the thesis). Sector j of
//! n points to heading + j * 2 pi / n.
//!
//! A kind of sensor implements [`Sensor`] in the file of what it measures. A function with the
//! name of its key in files makes it, and [`mount`] calls that function.

mod ground;
mod light;
mod own;
mod robots;
mod scripted;

use std::fmt::Debug;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use self::{ground::*, light::*, own::*, robots::*, scripted::*};
use crate::neighbours::Neighbours;
use crate::objects::Switches;
use crate::swarm::Swarm;
use crate::torus::{Torus, Vec2, angular_difference, sector_angle};
use crate::world::World;
use experiment_file::{SensorQuery, SensorsConfig, for_each_sensor};

/// A kind of sensor with its parameters, as mounted on the robots of a group.
pub(crate) trait Sensor: Debug + Send + Sync {
    /// Range to which the values of a reading are clipped, after noise.
    fn value_range(&self) -> RangeInclusive<f64> {
        0.0..=1.0
    }

    /// Noise of each value.
    fn noise(&self) -> Noise {
        Noise::NONE
    }

    /// Distance beyond which it senses no other robot, cm; 0: it senses none.
    fn robots_within(&self) -> f64 {
        0.0
    }

    /// Fills in the reading of one robot, without noise.
    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]);

    /// Fills in the readings of a group, `[robot][value]`, without noise; those of
    /// robots whose reading is not wanted are left as they are. It is one virtual
    /// call per group and step, in which `sense` is none; not to be overridden.
    fn sense_group(
        &self,
        robots: Range<usize>,
        is_wanted: &[bool],
        swarm: &Swarm,
        surroundings: &Surroundings<'_>,
        readings: &mut [f64],
    ) {
        let readings = readings.chunks_exact_mut(readings.len() / robots.len());
        for ((robot, reading), _) in
            robots.zip(readings).zip(is_wanted).filter(|(_, is_wanted)| **is_wanted)
        {
            let (position, heading) = (swarm.positions[robot], swarm.headings[robot]);
            self.sense(Viewpoint { robot, position, heading }, surroundings, reading);
        }
    }
}

/// Gaussian noise on each value of a reading, one draw each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation, in the values' unit; 0: nothing is drawn.
    pub deviation: f64,
    /// Which of a robot's streams it is drawn from.
    pub stream: NoiseStream,
}

impl Noise {
    /// No noise.
    pub const NONE: Self = Self { deviation: 0.0, stream: NoiseStream::LIGHT_AND_DISTANCE };
}

/// One of the streams that the noise of a robot's sensors is drawn from. Every
/// kind of sensor has its own, so that no reading depends on which other sensors
/// are mounted. The numbers are part of the format of a run: never reuse one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NoiseStream(u32);

impl NoiseStream {
    /// Of the light sensor and, after it, the distance sensor. They share one, in
    /// this order, because they did so in the first version of the format: with
    /// streams of their own they would draw other noise, and every run of them would
    /// be another one.
    pub const LIGHT_AND_DISTANCE: Self = Self(0);

    /// The stream's number, at [`Purpose::SensorNoise`](determinism::random::Purpose),
    /// for a robot.
    pub fn number(self, robot: usize) -> u64 {
        // Robots are far fewer.
        u64::from(self.0) << 32 | robot as u64
    }
}

/// A sensor of a group of robots, and the reading that it gives.
#[derive(Debug, Clone)]
pub(crate) struct MountedSensor {
    /// The name that stimuli have for the reading.
    pub query: SensorQuery,
    /// Number of values of the reading.
    pub reading_len: usize,
    /// The sensor.
    pub sensor: Arc<dyn Sensor>,
}

/// The sensors of a group of robots, in the order of the rows in `sensors!`, in which those that
/// share a stream of noise draw from it.
pub(crate) fn mount(config: &SensorsConfig, world: &World) -> Vec<MountedSensor> {
    let mut mounted = Vec::new();
    let mut add = |query, sensor: Arc<dyn Sensor>| {
        let reading_len = config.reading_len(query).unwrap_or(0) as usize;
        mounted.push(MountedSensor { query, reading_len, sensor });
    };
    macro_rules! mount {
        // What frames a receiver takes is the radio's business.
        (wireless_receiver: $($query:ident)*) => {};
        ($key:ident: $query:ident) => {
            if let Some(sensor) = &config.$key {
                add(SensorQuery::$query, Arc::new($key(sensor, world)));
            }
        };
    }
    for_each_sensor!(mount);
    mounted
}

/// What there is to sense beside frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    /// The plane.
    pub torus: &'a Torus,
    /// The robots.
    pub swarm: &'a Swarm,
    /// Who is near whom, within the largest [`Sensor::robots_within`] at least.
    pub neighbours: &'a Neighbours,
    /// Positions of all lights.
    pub lights: &'a [Vec2],
    /// Centres of all ground areas.
    pub areas: &'a [Vec2],
    /// Which lights and areas are on.
    pub switches: &'a Switches,
}

/// How what a robot perceives fades with distance and angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decay {
    /// Per cm.
    pub rho: f64,
    /// Per radian.
    pub phi: f64,
}

impl Decay {
    /// Strength, in (0, 1\], at distance `rho` and angle `phi` off the sector.
    pub fn strength(&self, rho: f64, phi: f64) -> f64 {
        libm::exp(self.log_strength(rho, phi))
    }

    /// Logarithm of the strength.
    pub fn log_strength(&self, rho: f64, phi: f64) -> f64 {
        -self.rho * rho - self.phi * phi
    }
}

/// A sensing robot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewpoint {
    /// Its number.
    pub robot: usize,
    /// Where it is, cm.
    pub position: Vec2,
    /// Where it looks, in \[0, 2 pi).
    pub heading: f64,
}

/// Hands each sector's strength of something at distance `rho` and in direction
/// `bearing`, in the robot's own frame, to `take`, if it is within `aperture` of the
/// sector's direction.
fn take_sectors(
    rho: f64,
    bearing: f64,
    decay: Decay,
    aperture: f64,
    readings: &mut [f64],
    take: impl Fn(f64, f64) -> f64,
) {
    let n_sectors = readings.len();
    for (sector, reading) in readings.iter_mut().enumerate() {
        let phi = angular_difference(bearing, sector_angle(sector, n_sectors));
        if phi <= aperture {
            *reading = take(*reading, decay.strength(rho, phi));
        }
    }
}
