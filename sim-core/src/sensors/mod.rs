//! Sensors beside the wireless receiver (section 3.2.2 of the thesis). Sector j of
//! n points to heading + j * 2 pi / n.
//!
//! A kind of sensor implements [`Sensor`] in the file of its subject. [`mount`] makes a sensor by
//! the function with the name of the sensor's key in files.

mod bodies;
mod ground;
mod light;
mod own;
mod robots;
mod scripted;

use std::fmt::Debug;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use self::{bodies::*, ground::*, light::*, own::*, robots::*, scripted::*};
use crate::bodies::Bodies;
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

    /// Distance beyond which it senses no other robot, cm; 0 if it senses no robots.
    fn robots_within(&self) -> f64 {
        0.0
    }

    /// Fills in the reading of one robot, without noise.
    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]);

    /// Fills in the wanted readings of a group, `[robot][value]`, without noise, and leaves the
    /// others unchanged. This is the only virtual call per group and step: within it, calls of
    /// `sense` are static. Implementations must not override it.
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
    /// Standard deviation, in the unit of the values; if it is 0, nothing is drawn.
    pub deviation: f64,
    /// The stream of a robot from which the noise is drawn.
    pub stream: NoiseStream,
}

impl Noise {
    /// No noise.
    pub const NONE: Self = Self { deviation: 0.0, stream: NoiseStream::LIGHT_AND_DISTANCE };
}

/// One of the streams from which the noise of a robot's sensors is drawn. Every kind of sensor has
/// its own stream, so that no reading depends on other mounted sensors. The numbers are part of the
/// format of a run: never reuse one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NoiseStream(u32);

impl NoiseStream {
    /// The stream of the light sensor and then the distance sensor. They share it, in this order,
    /// since the first version of the format; streams of their own would change every run with
    /// these sensors.
    pub const LIGHT_AND_DISTANCE: Self = Self(0);

    /// Of the proximity sensor.
    pub const PROXIMITY: Self = Self(1);

    /// The stream's number, at [`Purpose::SensorNoise`](determinism::random::Purpose),
    /// for a robot.
    pub fn number(self, robot: usize) -> u64 {
        // There are far fewer than 2^32 robots.
        u64::from(self.0) << 32 | robot as u64
    }
}

/// A sensor of a group of robots, and the reading that it gives.
#[derive(Debug, Clone)]
pub(crate) struct MountedSensor {
    /// The name of the reading in stimuli.
    pub query: SensorQuery,
    /// Number of values of the reading.
    pub reading_len: usize,
    /// The sensor.
    pub sensor: Arc<dyn Sensor>,
}

/// The sensors of a group of robots, in the order of the rows in `sensors!`. Sensors that share a
/// stream of noise draw in this order.
pub(crate) fn mount(config: &SensorsConfig, world: &World) -> Vec<MountedSensor> {
    let mut mounted = Vec::new();
    let mut add = |query, sensor: Arc<dyn Sensor>| {
        let reading_len = config.reading_len(query).unwrap_or(0) as usize;
        mounted.push(MountedSensor { query, reading_len, sensor });
    };
    macro_rules! mount {
        // The radio chooses the frames of a receiver.
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

/// Everything that robots can sense beside frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    /// The plane.
    pub torus: &'a Torus,
    /// The robots.
    pub swarm: &'a Swarm,
    /// The neighbours of each robot, at least within the largest [`Sensor::robots_within`].
    pub neighbours: &'a Neighbours,
    /// Positions of all lights.
    pub lights: &'a [Vec2],
    /// Centres of all ground areas.
    pub areas: &'a [Vec2],
    /// Which lights and areas are on.
    pub switches: &'a Switches,
    /// Bodies, in a world with them.
    pub bodies: Option<&'a Bodies>,
}

/// The fading of perceived strength with distance and angle.
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
    /// Its position, cm.
    pub position: Vec2,
    /// Its heading, in \[0, 2 pi).
    pub heading: f64,
}

/// Calls `take` with the strength, in each sector, of an object at distance `rho` and in direction
/// `bearing` in the robot's own frame. Skips sectors whose direction is more than `aperture` away.
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
