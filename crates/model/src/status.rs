//! Converts errors of queries to gRPC statuses.

use tonic::Status;

use crate::{queries::QueryError, store::StoreError};

impl From<StoreError> for Status {
    fn from(error: StoreError) -> Self {
        let text = error.to_string();
        match error {
            // Not UNAVAILABLE, which client libraries return when there is no coordinator.
            StoreError::Unavailable(_) => Self::resource_exhausted(text),
            StoreError::ParentGone(_) => Self::not_found(text),
            StoreError::Ended(_)
            | StoreError::Unfinished(_)
            | StoreError::WentOn(_)
            | StoreError::NeededByForks { .. }
            | StoreError::NoCheckpoint(_)
            | StoreError::Unsound { .. } => Self::failed_precondition(text),
            StoreError::TakenOver { .. } => Self::unavailable(text),
            StoreError::Corrupt(_) => Self::data_loss(text),
            _ => Self::internal(text),
        }
    }
}

impl From<QueryError> for Status {
    fn from(error: QueryError) -> Self {
        let text = error.to_string();
        match error {
            QueryError::NotFound(_) => Self::not_found(text),
            QueryError::NoIndividual { .. }
            | QueryError::NoMean { .. }
            | QueryError::NoRepertoire { .. }
            | QueryError::NoFront { .. }
            | QueryError::WrongReference { .. }
            | QueryError::EmptyCell { .. }
            | QueryError::NoLineage(_) => Self::invalid_argument(text),
            QueryError::NoChampion(_)
            | QueryError::NotEnded(_)
            | QueryError::TooLongForBundle { .. }
            | QueryError::NoGeneration { .. }
            | QueryError::NotInLog { .. }
            | QueryError::OtherBits { .. } => Self::failed_precondition(text),
            QueryError::DamagedLog { .. } | QueryError::Undecodable(_) => Self::data_loss(text),
            QueryError::Store(error) => error.into(),
        }
    }
}
