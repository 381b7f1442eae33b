//! `semantics`: chooses the defaults of omitted keys. Tables of parameters call SpikeSwarmSim's
//! defaults `original`. A file may also state each such key itself; `docs/fidelity.md` explains
//! them.

use serde::Deserialize;

use super::{Parameters, parameters};

/// The source of defaults for omitted keys. The source is not part of an experiment, because the
/// canonical form contains the values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Semantics {
    /// Those of the thesis.
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
