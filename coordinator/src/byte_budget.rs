//! Bytes that many share: one that wants some waits, or is refused, until others give theirs back.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Bytes that are counted together: what is short of them is not counted.
const UNIT: usize = 16 << 10;

/// A number of bytes. Clones share it.
#[derive(Debug, Clone)]
pub struct ByteBudget {
    /// A permit per unit.
    left: Arc<Semaphore>,
    n_units: usize,
}

/// Bytes that are taken until this is dropped.
pub type TakenBytes = OwnedSemaphorePermit;

impl ByteBudget {
    /// All are left.
    pub fn new(len: usize) -> Self {
        let n_units = len / UNIT;
        Self { left: Arc::new(Semaphore::new(n_units)), n_units }
    }

    /// Takes so many bytes; none if fewer are left.
    pub fn try_take(&self, len: usize) -> Option<TakenBytes> {
        let n_units = u32::try_from(len / UNIT).unwrap_or(u32::MAX);
        Arc::clone(&self.left).try_acquire_many_owned(n_units).ok()
    }

    /// Waits for so many bytes, or for all of them if there are no more; first come, first served.
    pub fn take(&self, len: usize) -> impl Future<Output = Option<TakenBytes>> + use<> {
        let n_units = u32::try_from((len / UNIT).min(self.n_units)).unwrap_or(u32::MAX);
        let taken = Arc::clone(&self.left).acquire_many_owned(n_units);
        async { taken.await.ok() }
    }

    /// Bytes that nobody has taken.
    #[cfg(test)]
    pub fn len_left(&self) -> usize {
        self.left.available_permits() * UNIT
    }
}
