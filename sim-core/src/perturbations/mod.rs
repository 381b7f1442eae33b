//! What goes wrong with a swarm.

mod leader_failure;

pub(crate) use leader_failure::LeaderFailure;
