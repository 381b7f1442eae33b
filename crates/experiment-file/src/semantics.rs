//! `semantics`: what a file means where it is silent. The original's way consists of the
//! defaults that tables of parameters call `original`, and of those below. Every such key can
//! be given alone, too; `docs/fidelity.md` explains each.

use serde::Deserialize;

use super::{InitialRates, Parameters, parameters};

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
    pub fn defaults<T: Parameters>(self) -> T {
        parameters::defaults(self)
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

    fn either<T>(self, thesis: impl FnOnce() -> T, original: impl FnOnce() -> T) -> T {
        match self {
            Self::Thesis => thesis(),
            Self::Original => original(),
        }
    }
}
