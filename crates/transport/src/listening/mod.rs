//! The accept loop of all servers, with a limited number of connections, and little time for
//! unauthorised ones.

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

/// Length of the system's queue of connections, if the system permits: room for a whole fleet
/// that reconnects at once.
const LISTEN_BACKLOG: u32 = 4096;
/// Pause after the system could not accept a connection, for example for lack of file
/// descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(500);
/// Time for a TLS handshake.
pub const TLS_HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);

/// Limits of a server's connections.
#[derive(Debug, Clone, Copy)]
pub struct ListenerLimits {
    /// Places of strangers, connections without a permitted request so far. Strangers have their
    /// own places, so that they cannot keep out the others.
    pub strangers: Room,
    /// Time for a connection to make a permitted request. So peers without a token cannot keep
    /// others out by holding all connections.
    pub admission_time: Duration,
    /// Places of connections with a permitted request.
    pub known: Known,
    /// Time for a peer to read a part of a waiting answer.
    pub stall_time: Duration,
}

/// How to handle one permitted connection too many.
#[derive(Debug, Clone, Copy)]
pub enum Known {
    /// Its request is refused.
    Refused {
        /// Number of simultaneous connections.
        n_places: usize,
    },
    /// It ends another.
    EndsAnother(Room),
}

/// Listens on an address. If the system's queue is full, the peer's system tries again after a
/// second.
pub fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // As std does: a restarted server gets its port back.
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
        // Batches and heartbeats are small and urgent. If the option cannot be set, the
        // connection is broken, and the next operation fails.
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
