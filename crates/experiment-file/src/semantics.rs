//! `semantics`: what a file means where it is silent. Every key that is mentioned here
//! can be given alone, too; this file is the list of what the original's way consists
//! of, and `docs/fidelity.md` explains each.

use std::f64::consts::PI;

use serde::Deserialize;

use super::{
    DistanceSensorConfig, InitialRates, LightParams, LightSensorConfig, OrbitConfig,
    SendingDirection, WirelessReceiverConfig, WirelessTransmitterConfig,
};

/// Whose values the keys have that a file leaves out. It is no part of an experiment:
/// the canonical form has the values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Semantics {
    /// The thesis's.
    #[default]
    Thesis,
    /// Those of the thesis's Python simulator.
    Original,
}

impl Semantics {
    /// The defaults of a group of keys.
    pub fn defaults<T: OriginalDefault>(self) -> T {
        self.either(T::default, T::original)
    }

    /// `topology.bias_in_gain`
    pub fn bias_in_gain(self) -> bool {
        self == Self::Thesis
    }

    /// `topology.initial_rates`
    pub fn initial_rates(self) -> InitialRates {
        self.either(InitialRates::default, || InitialRates::Zero)
    }

    /// `topology.motor_tau`, s
    pub fn motor_tau(self) -> Option<f64> {
        self.either(|| None, || Some(0.5))
    }

    /// `light_sensor.aperture`, radians
    pub fn light_aperture(self, n_sectors: u32) -> f64 {
        self.either(|| PI, || 3.0 * PI / f64::from(n_sectors))
    }

    /// `distance_sensor.aperture`, radians
    pub fn distance_aperture(self, n_sectors: u32) -> f64 {
        self.either(|| PI, || PI / f64::from(n_sectors))
    }

    /// `uncontrollable_rotation.start`
    pub fn rotation_start(self) -> u32 {
        self.either(|| 200, || 101)
    }

    /// `uncontrollable_rotation.speed`
    pub fn rotation_speed(self) -> f64 {
        self.either(|| 0.1, || 0.3)
    }

    fn either<T>(self, thesis: impl FnOnce() -> T, original: impl FnOnce() -> T) -> T {
        match self {
            Self::Thesis => thesis(),
            Self::Original => original(),
        }
    }
}

/// A group of keys some of which have another default in the original.
pub(super) trait OriginalDefault: Default {
    /// Its defaults.
    fn original() -> Self;
}

impl OriginalDefault for LightSensorConfig {
    fn original() -> Self {
        let thesis = Self::default();
        Self { n_sectors: 2, range: 100.0, decay_rho: 0.005, noise_variance: 0.0, ..thesis }
    }
}

impl OriginalDefault for DistanceSensorConfig {
    fn original() -> Self {
        let thesis = Self::default();
        Self { n_sectors: 2, range: 100.0, decay_rho: 0.005, noise_variance: 0.0, ..thesis }
    }
}

impl OriginalDefault for WirelessReceiverConfig {
    fn original() -> Self {
        let sending_direction = SendingDirection::Originator;
        Self { n_sectors: 2, decay_rho: 0.005, sending_direction, ..Self::default() }
    }
}

impl OriginalDefault for WirelessTransmitterConfig {
    fn original() -> Self {
        Self { sending_steps: 11, initial_frame: true, ..Self::default() }
    }
}

impl OriginalDefault for LightParams {
    fn original() -> Self {
        Self { range: 150.0, ..Self::default() }
    }
}

impl OriginalDefault for OrbitConfig {
    fn original() -> Self {
        Self { angle_step: 0.013, radius_step: Some(1.0), ..Self::default() }
    }
}
