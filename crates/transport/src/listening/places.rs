//! The places of connections, and the rules for giving them up.

use std::{
    net::SocketAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::{
    sync::{Notify, OwnedSemaphorePermit, Semaphore},
    time::{Instant, sleep},
};
use tokio_util::sync::CancellationToken;

use super::{
    Known, ListenerLimits,
    crowd::{Crowd, MemberId},
};

/// Interval between attempts to get a place.
const ADMISSION_PAUSE: Duration = Duration::from_millis(20);

type SharedCrowd = Arc<Mutex<Crowd>>;

/// The places of all connections of a server.
#[derive(Debug, Clone)]
pub(super) struct Places {
    known: KnownPlaces,
    strangers: SharedCrowd,
    /// A stranger has left.
    left: Arc<Notify>,
    admission_time: Duration,
    pub stall_time: Duration,
}

#[derive(Debug, Clone)]
enum KnownPlaces {
    Refused(Arc<Semaphore>),
    EndsAnother(SharedCrowd),
}

/// The standing of a connection's peer.
#[derive(Debug)]
enum Standing {
    /// The peer has made no permitted request yet.
    Stranger(MemberId),
    /// The peer is known, and keeps its place as long as the connection lasts.
    Known { _place: OwnedSemaphorePermit },
    /// The peer is known, and keeps its place until it has to make room.
    Guest(SharedCrowd, MemberId),
}

/// The peer at the other end of a connection.
#[derive(Debug, Clone)]
pub struct Peer {
    address: SocketAddr,
    connection: Arc<Place>,
}

/// The place of a connection, until it is closed and all its calls have ended.
#[derive(Debug)]
struct Place {
    places: Places,
    standing: Mutex<Standing>,
    has_to_go: CancellationToken,
}

/// All places are taken by other connections.
#[derive(Debug)]
pub struct TooManyConnections;

impl Places {
    pub fn new(limits: ListenerLimits) -> Self {
        Self {
            known: match limits.known {
                Known::Refused { n_places } => {
                    KnownPlaces::Refused(Arc::new(Semaphore::new(n_places)))
                }
                Known::EndsAnother(room) => KnownPlaces::EndsAnother(shared(room)),
            },
            strangers: shared(limits.strangers),
            left: Arc::default(),
            admission_time: limits.admission_time,
            stall_time: limits.stall_time,
        }
    }

    /// Waits for a place for another stranger.
    pub async fn wait_for_one(&self) {
        loop {
            let left = self.left.notified();
            let time = lock(&self.strangers).time_to_place(Instant::now());
            if time.is_zero() {
                return;
            }
            tokio::select! {
                () = sleep(time) => {}
                () = left => {}
            }
        }
    }

    /// Gives a place to a stranger. Also returns whether another one had to make room.
    pub fn enter(&self, address: SocketAddr) -> (Peer, bool) {
        let has_to_go = CancellationToken::new();
        let (id, has_ended_another) =
            lock(&self.strangers).enter(Instant::now(), address.ip(), has_to_go.clone());
        let standing = Mutex::new(Standing::Stranger(id));
        let connection = Arc::new(Place { places: self.clone(), standing, has_to_go });
        (Peer { address, connection }, has_ended_another)
    }

    fn leave_strangers(&self, id: MemberId) {
        lock(&self.strangers).leave(id);
        self.left.notify_one();
    }

    fn take_known(
        &self,
        address: SocketAddr,
        has_to_go: &CancellationToken,
    ) -> Result<Standing, TooManyConnections> {
        match &self.known {
            KnownPlaces::Refused(permits) => {
                let place = Arc::clone(permits).try_acquire_owned();
                Ok(Standing::Known { _place: place.map_err(|_| TooManyConnections)? })
            }
            KnownPlaces::EndsAnother(crowd) => {
                let (now, mut guests) = (Instant::now(), lock(crowd));
                if !guests.time_to_place(now).is_zero() {
                    return Err(TooManyConnections);
                }
                let (id, _) = guests.enter(now, address.ip(), has_to_go.clone());
                guests.on_request(id, now);
                Ok(Standing::Guest(Arc::clone(crowd), id))
            }
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let standing = self.standing.get_mut().unwrap_or_else(PoisonError::into_inner);
        match standing {
            Standing::Stranger(id) => self.places.leave_strangers(*id),
            Standing::Known { .. } => {}
            Standing::Guest(guests, id) => lock(guests).leave(*id),
        }
    }
}

impl Peer {
    /// The address from which it connected.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Admits the peer after a permitted request: its connection may stay if there is a place.
    ///
    /// # Errors
    ///
    /// If all places are taken.
    pub fn admit(&self) -> Result<(), TooManyConnections> {
        let Place { places, has_to_go, .. } = &*self.connection;
        let mut standing = lock(&self.connection.standing);
        match &*standing {
            Standing::Stranger(id) => {
                let id = *id;
                *standing = places.take_known(self.address, has_to_go)?;
                places.leave_strangers(id);
            }
            Standing::Known { .. } => {}
            Standing::Guest(guests, id) => lock(guests).on_request(*id, Instant::now()),
        }
        Ok(())
    }

    /// As [`Self::admit`], but waits for a place.
    pub async fn admitted(&self) {
        while self.admit().is_err() {
            sleep(ADMISSION_PAUSE).await;
        }
    }

    /// The peer has sent something.
    pub(super) fn on_heard(&self) {
        if let Standing::Stranger(id) = *lock(&self.connection.standing) {
            lock(&self.connection.places.strangers).on_heard(id);
        }
    }

    /// Completes when the connection has to end, because its first permitted request is late, or
    /// to make room.
    pub(super) async fn has_to_go(self) {
        let Place { places, has_to_go, standing } = &*self.connection;
        tokio::select! {
            () = has_to_go.cancelled() => return,
            () = sleep(places.admission_time) => {}
        }
        if !matches!(*lock(standing), Standing::Stranger(_)) {
            has_to_go.cancelled().await;
        }
    }
}

fn shared(room: super::Room) -> SharedCrowd {
    Arc::new(Mutex::new(Crowd::new(room)))
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
