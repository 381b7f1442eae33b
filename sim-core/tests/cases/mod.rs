//! Episodes that compare simulator and reference, by subject.

mod borderline;
mod genotypes;
mod leaders;
mod learning;
mod movers;
mod realities;
mod semantics;
mod sensors;
mod spiking;
