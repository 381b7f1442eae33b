//! Events of an episode, so that a test can check that its subject occurred.

/// Counts of events.
#[derive(Clone, Debug, Default)]
pub struct Witness {
    /// Robot-steps in which a frame was received.
    pub n_receptions: usize,
    /// Robot-steps in which a relayed frame was received.
    pub n_relayed_receptions: usize,
    /// Largest number of hops of a received frame.
    pub max_hops: u32,
    /// Robot-steps in which the receiver had to choose among sectors.
    pub n_choices: usize,
    /// Robot-steps in send mode and in relay mode.
    pub n_sending: usize,
    pub n_relaying: usize,
    /// Robot-steps with the LED on.
    pub n_lit: usize,
    /// Largest LED colour.
    pub max_color: u32,
    /// Robot-steps in which a pseudo-reality lost a frame.
    pub n_lost: usize,
    /// Robots that became faulty.
    pub n_faults: usize,
    /// Readings of the light, distance and ground sensors that are not 0.
    pub n_light: usize,
    pub n_distance: usize,
    pub n_ground: usize,
    /// Robot-steps with a zeroed stimulus that would not have been 0.
    pub n_inhibited: usize,
    /// Robot-steps with wheel actions that the network did not decide.
    pub n_uncontrollable: usize,
    /// Robot-steps in the interior, if the fitness uses them.
    pub n_interior: usize,
    /// Number of redraws of positions.
    pub n_redrawn: usize,
    /// Steps with a fitness other than 0.
    pub n_rewarded: usize,
}
