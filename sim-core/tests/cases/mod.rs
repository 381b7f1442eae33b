//! The episodes in which simulator and reference are compared, by subject.

mod borderline;
mod genotypes;
mod leaders;
mod learning;
mod movers;
mod semantics;
mod sensors;
mod spiking;
