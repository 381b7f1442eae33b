//! Parameters that several algorithms have.

use experiment_file::Parameter;

/// Mean of the first distribution.
pub const MU_INIT: Parameter = Parameter::unit("mu_init", 0.5, "First mean of every gene");
/// Width of the first distribution.
pub const SIGMA_INIT: Parameter =
    Parameter::deviation("sigma_init", 0.2, "First standard deviation of every gene");
/// How fast the mean moves, in natural evolution strategies.
pub const ETA_MU: Parameter = Parameter::positive("eta_mu", 1.0, "Learning rate of the mean mu");
