//! Letting a worker out of quarantine.

use crate::driver::DriverEvent;

use super::{Control, ControlError};

impl Control {
    /// Lets a worker out of quarantine, so that it gets items again.
    pub async fn readmit(&self, name: &str) -> Result<(), ControlError> {
        let told = self
            .ask(|reply| DriverEvent::WorkerReadmitted { name: name.to_owned(), reply })
            .await?;
        told.map_err(|there| ControlError::NotInQuarantine { name: name.to_owned(), there })
    }
}
