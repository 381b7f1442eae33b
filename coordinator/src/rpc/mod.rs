//! The gRPC services: they translate between the wire and the core, and nothing
//! else.

mod bundles;
mod convert;
mod evaluation_service;
mod experiment_service;
mod explain;
mod fleet_service;
mod pages;
mod status;
mod worker_service;

pub use convert::WelcomeTimes;
pub use evaluation_service::Evaluations;
pub use experiment_service::Experiments;
pub use fleet_service::Fleet;
pub use worker_service::{WorkerOutflow, Workers};

use status::shutting_down;
use tonic::Request;

use swarm_transport::listening::Peer;

use crate::control::Client;

/// The client of a request, by which clients take turns.
fn client<T>(request: &Request<T>) -> Client {
    let peer = request.extensions().get::<Peer>();
    Client(peer.map(|peer| peer.address().ip().to_canonical()))
}

#[cfg(test)]
mod tests;
