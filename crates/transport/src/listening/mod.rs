//! The one accept loop of all servers: a limited number of connections, and none for long
//! that has no business here.

mod connection;
mod crowd;
mod http;
mod places;

use std::{io, net::SocketAddr, time::Duration};

use tokio::{
    net::{TcpListener, TcpSocket, TcpStream},
    sync::mpsc,
    time::{Instant, sleep},
};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tracing::warn;

pub use connection::Connection;
pub use crowd::Room;
pub use http::{HttpLimits, serve_http};
pub use places::{Peer, TooManyConnections};

use crate::Throttle;
use places::Places;

/// Connections that wait in the system's queue, as far as the system permits: room for a
/// whole fleet that comes back at once.
const LISTEN_BACKLOG: u32 = 4096;
/// Pause after the system cannot accept a connection, for lack of descriptors, say.
const ACCEPT_PAUSE: Duration = Duration::from_millis(500);
/// Time for a TLS handshake.
pub const TLS_HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);

/// How many connections a server has, and for how long.
#[derive(Debug, Clone, Copy)]
pub struct ListenerLimits {
    /// For those who have made no permitted request yet. They have places of their own, so
    /// that they cannot keep out the others.
    pub strangers: Room,
    /// Time for a connection to make a request that is permitted. So those who know no
    /// token cannot keep the others out by holding all connections.
    pub admission_time: Duration,
    /// For those who have.
    pub known: Known,
    /// Time for a peer to read something of an answer that waits for it.
    pub stall_time: Duration,
}

/// What becomes of one connection too many of those who have made a permitted request.
#[derive(Debug, Clone, Copy)]
pub enum Known {
    /// Its request is refused.
    Refused {
        /// Connections at the same time.
        n_places: usize,
    },
    /// It ends another.
    EndsAnother(Room),
}

/// Listens; a connection for which the system's queue has no room is tried again by the
/// peer's system after a second.
pub fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As std does: a server that is started again gets its port back.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(LISTEN_BACKLOG)
}

/// Accepts connections until `shutdown`.
pub fn accept(
    listener: TcpListener,
    limits: ListenerLimits,
    shutdown: CancellationToken,
) -> ReceiverStream<io::Result<Connection<TcpStream>>> {
    let (sender, accepted) = mpsc::channel(1);
    let places = Places::new(limits);
    tokio::spawn(async move {
        tokio::select! {
            () = shutdown.cancelled() => {}
            // The server has gone.
            () = sender.closed() => {}
            () = accept_all(&listener, &places, &sender) => {}
        }
    });
    ReceiverStream::new(accepted)
}

async fn accept_all(
    listener: &TcpListener,
    places: &Places,
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
        let (connection, has_ended_another) = Connection::new(io, address, places);
        if has_ended_another && let Some(withheld) = log.on_line(Instant::now().into_std()) {
            warn!(%address, withheld, "many connections make no permitted call; the oldest is closed");
        }
        if accepted.send(Ok(connection)).await.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests;
