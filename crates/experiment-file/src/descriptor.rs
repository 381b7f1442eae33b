//! Descriptors: measures that tell behaviours apart, each with the grid of a repertoire along it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits;
use crate::DefaultValue::{Name, Required};
use crate::parameters::{parameters, variants};
use crate::{AlgorithmDescription, Domain, LearnsFrom, Parameter, Params};

/// How the values of a measure in the steps of a trial become one value.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Summarises {
    /// Their mean over the steps that have the measure.
    #[default]
    Mean,
    /// The value in the last step.
    End,
}

variants! {
    Summarises, unsupported: &[];
}

parameters! {
    /// A measure that tells behaviours apart. A behaviour is a point with one coordinate per
    /// descriptor, and a repertoire divides the space of these points into the cells of a grid.
    pub struct DescriptorConfig {
        /// Name of a measure of the fitness function or of the script.
        measure: String = of(Domain::Text, Required),
        /// Which value of a trial counts. The coordinate is its mean over the trials.
        summarises as "of": Summarises = of(Domain::Variant(Summarises::VARIANTS), Name("mean")),
        /// Range of values that the grid covers, `[low, high]`. Values beyond it belong to the
        /// cells at its ends.
        range: [f64; 2] = of(Domain::Numbers(2, 2), Required),
        /// Number of cells along the range, all of the same width.
        cells: u32 = whole([1, limits::ELITES], 32),
    }
}

impl DescriptorConfig {
    /// Number of cells of the grid of these descriptors.
    pub fn n_cells(descriptors: &[Self]) -> u64 {
        let cells = descriptors.iter().map(|descriptor| u64::from(descriptor.cells));
        cells.fold(1, u64::saturating_mul)
    }
}

/// Number of elites of a repertoire that does not follow from the grid.
pub const ELITES: Parameter = Parameter::whole(
    "elites",
    [1, limits::ELITES],
    1024,
    "Number of elites that the repertoire keeps",
);

/// Number of elites in a cell of the grid.
pub const DEPTH: Parameter = Parameter::whole(
    "depth",
    [1, 8],
    2,
    "Elites that a cell keeps, the best of which is shown; fewer if the whole grid had more than \
     16384",
);

impl AlgorithmDescription {
    /// Whether the algorithm measures the distances between behaviours, which takes time for each
    /// pair.
    pub(crate) fn compares_behaviours(&self) -> bool {
        self.learns_from == LearnsFrom::Descriptors && self.has(ELITES.key)
    }

    /// The largest number of elites that the algorithm keeps with these parameters. `n_cells`:
    /// number of cells of the grid.
    pub fn elites_max(&self, params: &Params, n_cells: u64, population_size: u64) -> u64 {
        if self.learns_from == LearnsFrom::Aims {
            return population_size;
        }
        if self.has(ELITES.key) {
            return params.value_of::<u32>(&ELITES).into();
        }
        let depth: u32 = params.value_of(&DEPTH);
        n_cells.saturating_mul(depth.into()).min(limits::ELITES.into())
    }
}
