//! The gRPC services: they translate between the wire and the core, and nothing
//! else.

mod convert;
mod evaluation_service;
mod experiment_service;
mod explain;
mod fleet_service;
mod history;
mod worker_service;

use tonic::Status;

use crate::store::StoreError;

pub use convert::WelcomeTimes;
pub use evaluation_service::Evaluations;
pub use experiment_service::Experiments;
pub use fleet_service::Fleet;
pub use worker_service::Workers;

/// Says on the wire what went wrong with the store.
fn store_status(error: StoreError) -> Status {
    match error {
        // Not UNAVAILABLE, which is what clients make up when there is no coordinator.
        StoreError::Unavailable(_) => Status::resource_exhausted(error.to_string()),
        StoreError::Ended(_) => Status::failed_precondition(error.to_string()),
        StoreError::Corrupt(_) => Status::data_loss(error.to_string()),
        _ => Status::internal(error.to_string()),
    }
}

/// For whoever is connected, or connects, while the coordinator stops.
fn shutting_down() -> Status {
    Status::unavailable("the coordinator is shutting down")
}

#[cfg(test)]
mod tests;
