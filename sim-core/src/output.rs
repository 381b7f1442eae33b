//! The kind of result of a trial.

/// The kind of result to compute for each trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Output {
    /// One number per trial: its fitness. See
    /// [`Simulation::evaluate`](crate::Simulation::evaluate).
    Fitness,
    /// The fitness of a trial, and then step by step every measure of the task. See
    /// [`Simulation::measure_while`](crate::Simulation::measure_while).
    Measures,
    /// The fitness of a trial, and then its descriptors. See
    /// [`Simulation::describe_while`](crate::Simulation::describe_while).
    Descriptors,
}
