//! The episodes in which simulator and reference are compared, by subject.

mod genotypes;
mod leaders;
