//! `semantics`: what a file means where it is silent. The original's way consists of the
//! defaults that tables of parameters call `original`. Every such key can be given alone, too;
//! `docs/fidelity.md` explains each.

use serde::Deserialize;

use super::{Parameters, parameters};

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
}
