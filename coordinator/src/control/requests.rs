//! The memory and the processors that requests of clients take before anything runs.

use std::sync::Arc;

use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    task,
};

use crate::limits::{CHECKS_MAX, REQUESTS_LEN_MAX};

use super::ControlError;

/// Bytes that are counted together; every request counts as one at least.
const UNIT: usize = 16 << 10;

/// What clients have sent that is being checked, waits, or is computed.
#[derive(Debug, Clone)]
pub struct Requests {
    /// A permit per unit.
    room: Arc<Semaphore>,
    checks: Arc<Semaphore>,
}

/// The room that a request takes, until it is dropped.
#[derive(Debug)]
pub struct RequestPlace {
    _room: OwnedSemaphorePermit,
}

impl Default for Requests {
    fn default() -> Self {
        Self {
            room: Arc::new(Semaphore::new(REQUESTS_LEN_MAX / UNIT)),
            checks: Arc::new(Semaphore::new(CHECKS_MAX)),
        }
    }
}

impl Requests {
    /// Takes room for a request of `len` bytes, if there is any.
    pub fn enter(&self, len: usize) -> Result<RequestPlace, ControlError> {
        let n_units = u32::try_from(1 + len / UNIT).unwrap_or(u32::MAX);
        let room = Arc::clone(&self.room).try_acquire_many_owned(n_units);
        room.map(|room| RequestPlace { _room: room }).map_err(|_| ControlError::TooManyRequests)
    }

    /// Checks something on a thread of its own, as that is work for a processor, and
    /// takes memory: not for many at the same time.
    pub async fn check<T: Send + 'static>(
        &self,
        check: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, ControlError> {
        let turn = Arc::clone(&self.checks).acquire_owned().await.expect("nobody closes it");
        let checking = task::spawn_blocking(move || {
            // Goes on to count if the client goes away.
            let _turn = turn;
            check()
        });
        checking.await.map_err(|_| ControlError::Panicked("checking the configuration"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_request_too_many_is_refused_until_another_ends() {
        let requests = Requests::default();
        let quarter = REQUESTS_LEN_MAX / 4;
        let mut places: Vec<_> = (0..3).map(|_| requests.enter(quarter).unwrap()).collect();
        let error = requests.enter(quarter).unwrap_err();
        assert!(matches!(error, ControlError::TooManyRequests), "{error}");
        assert!(requests.enter(0).is_ok(), "a small one has room");
        places.pop();
        assert!(requests.enter(quarter).is_ok());
        assert!(requests.enter(usize::MAX).is_err());
    }

    #[tokio::test]
    async fn few_checks_are_under_way_at_the_same_time() {
        let requests = Requests::default();
        let (release, released) = std::sync::mpsc::channel::<()>();
        let busy = requests.check(move || released.recv());
        let mut busy = Box::pin(busy);
        let _others: Vec<_> = {
            // All turns but one.
            let turns = (1..CHECKS_MAX).map(|_| Arc::clone(&requests.checks).try_acquire_owned());
            turns.map(Result::unwrap).collect()
        };
        assert!(is_pending(&mut busy).await);
        let mut next = Box::pin(requests.check(|| ()));
        assert!(is_pending(&mut next).await, "there is no turn left");
        release.send(()).unwrap();
        busy.await.unwrap().unwrap();
        next.await.unwrap();
    }

    /// Polls once.
    async fn is_pending<T>(future: &mut std::pin::Pin<Box<impl Future<Output = T>>>) -> bool {
        std::future::poll_fn(|context| {
            std::task::Poll::Ready(future.as_mut().poll(context).is_pending())
        })
        .await
    }
}
