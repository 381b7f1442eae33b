//! `semantics`: chooses the defaults of omitted keys. SpikeSwarmSim's defaults are those
//! that tables of parameters call `original`. Every such key can be given alone, too;
//! `docs/fidelity.md` explains each.

use serde::Deserialize;

use super::{Parameters, parameters};

/// The source of defaults for omitted keys. It is not part of an experiment, because the
/// canonical form contains the values.
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
}
