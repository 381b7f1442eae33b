//! Accepts connections: a limited number, and none for long that has no business
//! here.

use std::{
    io,
    net::SocketAddr,
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Context, Poll},
};

use swarm_telemetry::Throttle;
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::{TcpListener, TcpSocket, TcpStream},
    sync::{Notify, OwnedSemaphorePermit, Semaphore, mpsc},
    time::{Instant, Sleep, sleep},
};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::transport::server::Connected;
use tracing::warn;

use super::strangers::{StrangerId, Strangers};
use crate::{
    clock,
    limits::{ACCEPT_PAUSE, ADMISSION_TIMEOUT, LISTEN_BACKLOG},
};

/// The places of all connections.
#[derive(Debug, Clone)]
struct Places {
    /// A permit per connection of somebody known.
    known: Arc<Semaphore>,
    strangers: Arc<Mutex<Strangers>>,
    /// A stranger has left.
    left: Arc<Notify>,
}

/// Whose a connection is.
#[derive(Debug)]
enum Standing {
    /// Of somebody who has made no call yet that was let in.
    Stranger(StrangerId),
    /// Of somebody known.
    Known { _place: OwnedSemaphorePermit },
}

/// Who is at the other end of a connection.
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
}

/// There are as many connections of others.
#[derive(Debug)]
pub struct TooManyConnections;

/// A connection that breaks unless it is admitted in time, and before that if it has to
/// make room.
#[derive(Debug)]
pub struct Connection<IO> {
    io: IO,
    peer: Peer,
    /// None once the peer has been admitted.
    end: Option<Pin<Box<End>>>,
}

/// When a stranger's connection breaks.
#[derive(Debug)]
struct End {
    deadline: Pin<Box<Sleep>>,
    makes_room: Pin<Box<WaitForCancellationFutureOwned>>,
    is_heard: bool,
}

/// Listens, with room for a whole fleet that comes back at once: a connection for which
/// the system's queue has no room is tried again after a second.
pub fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As std does: a coordinator that is started again gets its port back.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(LISTEN_BACKLOG)
}

/// Accepts connections, up to `n_known` of those who are known at the same time, until
/// `shutdown`.
pub fn accept(
    listener: TcpListener,
    n_known: usize,
    shutdown: CancellationToken,
) -> ReceiverStream<io::Result<Connection<TcpStream>>> {
    let (sender, accepted) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = shutdown.cancelled() => {}
            () = accept_all(&listener, Places::new(n_known), &sender) => {}
        }
    });
    ReceiverStream::new(accepted)
}

async fn accept_all(
    listener: &TcpListener,
    places: Places,
    accepted: &mpsc::Sender<io::Result<Connection<TcpStream>>>,
) {
    let mut log = Throttle::default();
    loop {
        places.wait_for_one().await;
        let (io, address) = match listener.accept().await {
            Ok(connection) => connection,
            Err(error) => {
                warn!("cannot accept a connection: {error}");
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        // Batches and heartbeats are small and urgent. If the option cannot be set
        // the connection is broken, as will be seen.
        let _ = io.set_nodelay(true);
        let (connection, has_ended_another) = Connection::new(io, address, &places);
        if has_ended_another && let Some(withheld) = log.on_line(clock::now()) {
            warn!(%address, withheld, "many connections make no permitted call; the oldest is closed");
        }
        if accepted.send(Ok(connection)).await.is_err() {
            return;
        }
    }
}

impl Places {
    fn new(n_known: usize) -> Self {
        Self {
            known: Arc::new(Semaphore::new(n_known)),
            strangers: Arc::default(),
            left: Arc::default(),
        }
    }

    fn strangers(&self) -> MutexGuard<'_, Strangers> {
        self.strangers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until another stranger may come.
    async fn wait_for_one(&self) {
        loop {
            let left = self.left.notified();
            let time = self.strangers().time_to_place(Instant::now());
            if time.is_zero() {
                return;
            }
            tokio::select! {
                () = sleep(time) => {}
                () = left => {}
            }
        }
    }
}

impl Place {
    fn standing(&self) -> MutexGuard<'_, Standing> {
        self.standing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let standing = self.standing.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Standing::Stranger(id) = standing {
            self.places.strangers().leave(*id);
            self.places.left.notify_one();
        }
    }
}

impl Peer {
    /// Where it connected from.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// It is known from now on, and its connection may stay, if there is a place.
    pub fn admit(&self) -> Result<(), TooManyConnections> {
        let Place { places, .. } = &*self.connection;
        let mut standing = self.connection.standing();
        if let Standing::Stranger(id) = *standing {
            let place = Arc::clone(&places.known).try_acquire_owned();
            *standing = Standing::Known { _place: place.map_err(|_| TooManyConnections)? };
            places.strangers().leave(id);
            places.left.notify_one();
        }
        Ok(())
    }

    /// It has said something.
    fn on_heard(&self) {
        if let Standing::Stranger(id) = *self.connection.standing() {
            self.connection.places.strangers().on_heard(id);
        }
    }

    fn is_known(&self) -> bool {
        matches!(*self.connection.standing(), Standing::Known { .. })
    }
}

impl<IO> Connection<IO> {
    /// Returns, too, whether another had to make room.
    fn new(io: IO, address: SocketAddr, places: &Places) -> (Self, bool) {
        let makes_room = CancellationToken::new();
        let (id, has_ended_another) = places.strangers().enter(Instant::now(), makes_room.clone());
        let standing = Mutex::new(Standing::Stranger(id));
        let connection = Arc::new(Place { places: places.clone(), standing });
        let end = End {
            deadline: Box::pin(sleep(ADMISSION_TIMEOUT)),
            makes_room: Box::pin(makes_room.cancelled_owned()),
            is_heard: false,
        };
        let peer = Peer { address, connection };
        (Self { io, peer, end: Some(Box::pin(end)) }, has_ended_another)
    }
}

impl<IO> Connected for Connection<IO> {
    type ConnectInfo = Peer;

    fn connect_info(&self) -> Peer {
        self.peer.clone()
    }
}

impl<IO: AsyncRead + Unpin> AsyncRead for Connection<IO> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        // The server always waits for something to read, so this is polled when
        // the time is up.
        if let Some(end) = &mut self.end {
            let is_late = end.deadline.as_mut().poll(context).is_ready();
            let makes_room = end.makes_room.as_mut().poll(context).is_ready();
            if self.peer.is_known() {
                self.end = None;
            } else if is_late || makes_room {
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
        }
        let n_before = buffer.filled().len();
        let read = Pin::new(&mut self.io).poll_read(context, buffer);
        if let Some(end) = &mut self.end
            && !end.is_heard
            && buffer.filled().len() > n_before
        {
            end.is_heard = true;
            self.peer.on_heard();
        }
        read
    }
}

impl<IO: AsyncWrite + Unpin> AsyncWrite for Connection<IO> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write_vectored(context, bytes)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex};

    use super::*;
    use crate::limits::{SILENT_STRANGER_GRACE, STRANGERS_MAX};

    fn connection(places: &Places) -> (Connection<DuplexStream>, DuplexStream) {
        let (near, far) = duplex(64);
        (Connection::new(near, "127.0.0.1:1".parse().unwrap(), places).0, far)
    }

    #[tokio::test(start_paused = true)]
    async fn a_connection_that_is_never_admitted_breaks_even_if_it_talks() {
        let (mut connection, mut far) = connection(&Places::new(1));
        let start = Instant::now();
        tokio::spawn(async move {
            while far.write_all(b"x").await.is_ok() {
                sleep(ADMISSION_TIMEOUT / 10).await;
            }
        });
        let error = loop {
            match connection.read_u8().await {
                Ok(_) => {}
                Err(error) => break error,
            }
        };
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(start.elapsed() < ADMISSION_TIMEOUT * 2);
    }

    #[tokio::test(start_paused = true)]
    async fn an_admitted_connection_may_be_silent() {
        let (mut connection, mut far) = connection(&Places::new(1));
        connection.connect_info().admit().unwrap();
        tokio::spawn(async move {
            sleep(ADMISSION_TIMEOUT * 100).await;
            far.write_all(b"x").await.unwrap();
        });
        assert_eq!(connection.read_u8().await.unwrap(), b'x');
    }

    #[tokio::test]
    async fn strangers_make_room_for_others_and_who_is_known_stays() {
        let places = Places::new(2);
        let (mut known, mut known_far) = connection(&places);
        known.connect_info().admit().unwrap();
        let (mut oldest, _oldest_far) = connection(&places);
        let _others: Vec<_> = (0..STRANGERS_MAX).map(|_| connection(&places)).collect();
        let error = oldest.read_u8().await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        known_far.write_all(b"x").await.unwrap();
        assert_eq!(known.read_u8().await.unwrap(), b'x');
    }

    #[tokio::test]
    async fn one_known_connection_too_many_is_refused_until_another_ends() {
        let places = Places::new(1);
        let (first, _first_far) = connection(&places);
        let (second, _second_far) = connection(&places);
        first.connect_info().admit().unwrap();
        first.connect_info().admit().unwrap();
        assert!(second.connect_info().admit().is_err());
        drop(first);
        second.connect_info().admit().unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn a_flood_waits_until_the_strangers_had_time_to_introduce_themselves() {
        let places = Places::new(1);
        let mut strangers: Vec<_> = (0..STRANGERS_MAX).map(|_| connection(&places)).collect();
        let start = Instant::now();
        places.wait_for_one().await;
        assert!(start.elapsed() >= SILENT_STRANGER_GRACE);
        // Unless one leaves, or is let in.
        strangers.extend([connection(&places)]);
        strangers.truncate(STRANGERS_MAX);
        strangers[1].0.connect_info().admit().unwrap();
        places.wait_for_one().await;
    }
}
