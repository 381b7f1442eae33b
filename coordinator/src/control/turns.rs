//! A fair queue for a few places: clients take turns, however many requests each of them has.

use std::{
    collections::VecDeque,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard},
};

use tokio::sync::oneshot;

/// A client, whose requests share one queue: a machine, or this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Client(pub Option<IpAddr>);

/// A fixed number of places.
#[derive(Debug, Clone)]
pub(super) struct Turns(Arc<Mutex<Line<oneshot::Sender<Turn>>>>);

/// A place, until it is dropped.
#[derive(Debug)]
pub(super) struct Turn(Option<Turns>);

/// Clients and their waiting requests, the next client first.
#[derive(Debug)]
struct Line<T> {
    n_free: usize,
    waiting: VecDeque<(Client, VecDeque<T>)>,
}

impl<T> Line<T> {
    fn new(n_free: usize) -> Self {
        Self { n_free, waiting: VecDeque::new() }
    }

    /// Takes a place, if one is free.
    fn take(&mut self) -> bool {
        let is_free = self.n_free > 0;
        self.n_free -= usize::from(is_free);
        is_free
    }

    /// Adds a request behind the client's other ones.
    fn wait(&mut self, client: Client, waiter: T) {
        match self.waiting.iter_mut().find(|(other, _)| *other == client) {
            Some((_, waiters)) => waiters.push_back(waiter),
            None => self.waiting.push_back((client, VecDeque::from([waiter]))),
        }
    }

    /// Returns the request that gets a freed place; the place stays free if none waits.
    fn next(&mut self) -> Option<T> {
        let Some((client, mut waiters)) = self.waiting.pop_front() else {
            self.n_free += 1;
            return None;
        };
        let next = waiters.pop_front();
        if !waiters.is_empty() {
            self.waiting.push_back((client, waiters));
        }
        next
    }
}

impl Turns {
    pub fn new(n_places: usize) -> Self {
        Self(Arc::new(Mutex::new(Line::new(n_places))))
    }

    /// Waits for a place.
    pub async fn wait(&self, client: Client) -> Turn {
        let place = {
            let mut line = self.line();
            if line.take() {
                return Turn(Some(self.clone()));
            }
            let (give, place) = oneshot::channel();
            line.wait(client, give);
            place
        };
        place.await.expect("a place is given to everyone who waits")
    }

    fn line(&self) -> MutexGuard<'_, Line<oneshot::Sender<Turn>>> {
        self.0.lock().expect("nothing panics while it holds the line")
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let Some(turns) = self.0.take() else { return };
        // A client that has gone away returns the place. The loop empties its `Turn`, so that
        // dropping it does not return the place again.
        loop {
            let Some(next) = turns.line().next() else { return };
            match next.send(Turn(Some(turns.clone()))) {
                Ok(()) => return,
                Err(mut turn) => turn.0 = None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use futures_util::FutureExt as _;

    use super::*;

    fn client(number: u8) -> Client {
        Client(Some(Ipv4Addr::new(192, 0, 2, number).into()))
    }

    #[test]
    fn clients_take_turns_however_many_requests_each_has() {
        let mut line = Line::new(1);
        assert!(line.take() && !line.take());
        (0..100).for_each(|number| line.wait(client(1), (1, number)));
        line.wait(client(2), (2, 0));
        line.wait(client(3), (3, 0));
        line.wait(client(2), (2, 1));
        let next: Vec<_> = std::iter::from_fn(|| line.next()).take(7).collect();
        assert_eq!(next, [(1, 0), (2, 0), (3, 0), (1, 1), (2, 1), (1, 2), (1, 3)]);
    }

    #[tokio::test]
    async fn a_place_skips_clients_that_have_gone() {
        let turns = Turns::new(1);
        let first = turns.wait(client(1)).await;
        let mut gone = Box::pin(turns.wait(client(1)));
        let mut next = Box::pin(turns.wait(client(2)));
        assert!((&mut gone).now_or_never().is_none() && (&mut next).now_or_never().is_none());
        drop(gone);
        drop(first);
        let turn = next.await;
        drop(turn);
        turns.wait(client(3)).await;
    }
}
