//! Bounds the memory and processor time that clients' requests take before they run.

use std::time::Duration;

use tokio::{task, time::sleep};
use tokio_util::sync::CancellationToken;

use sim_core::TRYING_TIME_MAX;

use crate::{
    byte_budget::{self, ByteBudget, TakenBytes},
    limits::{CHECKS_MAX, REQUESTS_LEN_MAX},
};

use super::{
    ControlError,
    turns::{Client, Turn, Turns},
};

/// Bytes that a request takes beside its content; a budget does not count less.
const REQUEST_LEN: usize = byte_budget::UNIT;

/// Requests of clients in progress: in a check, waiting, or evaluated.
#[derive(Debug, Clone)]
pub struct Requests {
    room: ByteBudget,
    checks: Turns,
    /// Ends all checks.
    shutdown: CancellationToken,
}

/// The memory reserved for a request; dropping this returns it.
#[derive(Debug)]
pub struct RequestPlace {
    _room: TakenBytes,
}

impl Requests {
    /// No requests; `shutdown` ends all checks.
    pub fn new(shutdown: CancellationToken) -> Self {
        Self { room: ByteBudget::new(REQUESTS_LEN_MAX), checks: Turns::new(CHECKS_MAX), shutdown }
    }

    /// Reserves memory for a request of `len` bytes, if enough is free.
    pub fn enter(&self, len: usize) -> Result<RequestPlace, ControlError> {
        let room = self.room.try_take(len.saturating_add(REQUEST_LEN));
        room.map(|room| RequestPlace { _room: room }).ok_or(ControlError::TooManyRequests)
    }

    /// Waits for a turn to check. Few requests have one at the same time, and clients take turns.
    pub(super) async fn turn(&self, client: Client) -> Turn {
        self.checks.wait(client).await
    }

    /// Waits for a turn, and runs a check as [`check_in`](Self::check_in) does.
    pub async fn check<T: Send + 'static>(
        &self,
        client: Client,
        check: impl FnOnce(&dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, ControlError> {
        self.check_in(self.turn(client).await, check).await
    }

    /// Runs a check on a thread of its own, because it is CPU-bound and takes memory. The check
    /// calls its argument to learn whether to continue: false if the check has taken too long, if
    /// nobody waits for its answer, or if the coordinator stops.
    pub(super) async fn check_in<T: Send + 'static>(
        &self,
        turn: Turn,
        check: impl FnOnce(&dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, ControlError> {
        self.check_within(TRYING_TIME_MAX, turn, check).await
    }

    /// As [`check`](Self::check), for a check that may take as long as it needs.
    pub async fn check_at_length<T: Send + 'static>(
        &self,
        client: Client,
        check: impl FnOnce(&dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, ControlError> {
        self.check_within(Duration::MAX, self.turn(client).await, check).await
    }

    async fn check_within<T: Send + 'static>(
        &self,
        time: Duration,
        turn: Turn,
        check: impl FnOnce(&dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<T, ControlError> {
        // Cancelled when the coordinator stops, and when the client goes away.
        let end = self.shutdown.child_token();
        let ended_in_time = end.clone().drop_guard();
        let checking = task::spawn_blocking(move || {
            // The thread keeps its place even if the client goes away.
            let _turn = turn;
            check(&|| !end.is_cancelled())
        });
        let ending = async {
            sleep(time).await;
            drop(ended_in_time);
            std::future::pending().await
        };
        tokio::select! {
            checked = checking => checked.map_err(|_| ControlError::Panicked("checking the configuration")),
            never = ending => never,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use futures_util::FutureExt as _;

    use super::*;

    fn requests() -> Requests {
        Requests::new(CancellationToken::new())
    }

    #[test]
    fn one_request_too_many_is_refused_until_another_ends() {
        let requests = requests();
        let quarter = REQUESTS_LEN_MAX / 4;
        let mut places: Vec<_> = (0..3).map(|_| requests.enter(quarter).unwrap()).collect();
        let error = requests.enter(quarter).unwrap_err();
        assert!(matches!(error, ControlError::TooManyRequests), "{error}");
        assert!(requests.enter(0).is_ok(), "a small one has room");
        places.pop();
        assert!(requests.enter(quarter).is_ok());
        assert!(requests.enter(usize::MAX).is_err());
    }

    /// A check that does nothing until it has to end, and then says so.
    fn endless(goes_on: &dyn Fn() -> bool) -> &'static str {
        while goes_on() {
            std::thread::yield_now();
        }
        "was ended"
    }

    #[tokio::test]
    async fn few_checks_are_under_way_at_the_same_time() {
        let requests = requests();
        let (release, released) = mpsc::channel::<()>();
        let busy = requests.check(Client::default(), move |_| released.recv());
        let mut busy = Box::pin(busy);
        assert!((&mut busy).now_or_never().is_none());
        let mut others = Vec::new();
        for _ in 1..CHECKS_MAX {
            others.push(requests.turn(Client::default()).await);
        }
        let mut next = Box::pin(requests.check(Client::default(), |_| ()));
        assert!((&mut next).now_or_never().is_none(), "there is no turn left");
        release.send(()).unwrap();
        busy.await.unwrap().unwrap();
        next.await.unwrap();
    }

    #[tokio::test]
    async fn a_check_is_told_to_end_when_it_takes_long() {
        let requests = requests();
        let turn = requests.turn(Client::default()).await;
        let ended = requests.check_within(Duration::ZERO, turn, endless).await;
        assert_eq!(ended.unwrap(), "was ended");
    }

    #[tokio::test]
    async fn a_check_is_told_to_end_when_the_coordinator_stops() {
        let requests = requests();
        requests.shutdown.cancel();
        let ended = requests.check_at_length(Client::default(), endless).await;
        assert_eq!(ended.unwrap(), "was ended");
    }

    #[tokio::test]
    async fn a_check_is_told_to_end_when_its_client_goes_away() {
        let requests = requests();
        let (say, said) = mpsc::channel();
        let check = move |goes_on: &dyn Fn() -> bool| say.send(endless(goes_on));
        let mut checking = Box::pin(requests.check_at_length(Client::default(), check));
        assert!((&mut checking).now_or_never().is_none());
        drop(checking);
        let ended = task::spawn_blocking(move || said.recv()).await.unwrap();
        assert_eq!(ended, Ok("was ended"));
    }
}
