//! A budget of bytes that many requests share. A request waits, or is refused, until others
//! return their bytes.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Bytes per permit; a remainder is not counted.
pub const UNIT: usize = 16 << 10;

/// The budget; clones share it.
#[derive(Debug, Clone)]
pub struct ByteBudget {
    /// A permit per unit.
    left: Arc<Semaphore>,
    n_units: u32,
}

/// Bytes taken from the budget; dropping this returns them.
pub type TakenBytes = OwnedSemaphorePermit;

impl ByteBudget {
    /// A budget of `len` bytes, all of them free.
    pub fn new(len: usize) -> Self {
        let n_units = n_units(len);
        Self { left: Arc::new(Semaphore::new(n_units as usize)), n_units }
    }

    /// Takes `len` bytes; `None` if fewer are free.
    pub fn try_take(&self, len: usize) -> Option<TakenBytes> {
        Arc::clone(&self.left).try_acquire_many_owned(n_units(len)).ok()
    }

    /// Waits for `len` bytes, or for the whole budget if that is smaller; first come, first
    /// served.
    pub fn take(&self, len: usize) -> impl Future<Output = Option<TakenBytes>> + use<> {
        let n_units = n_units(len).min(self.n_units);
        let taken = Arc::clone(&self.left).acquire_many_owned(n_units);
        async { taken.await.ok() }
    }

    /// Number of free bytes.
    #[cfg(test)]
    pub fn len_left(&self) -> usize {
        self.left.available_permits() * UNIT
    }
}

/// Number of permits for `len` bytes.
fn n_units(len: usize) -> u32 {
    u32::try_from(len / UNIT).unwrap_or(u32::MAX)
}
