//! Accepts connections: a limited number, and none for long that has no business
//! here.

use std::{
    io,
    net::SocketAddr,
    pin::Pin,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll},
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::{TcpListener, TcpStream},
    sync::{OwnedSemaphorePermit, Semaphore, mpsc},
    time::{Sleep, sleep},
};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::transport::server::Connected;
use tracing::warn;

use super::throttle::Throttle;
use crate::{
    clock,
    limits::{ACCEPT_PAUSE, ADMISSION_TIMEOUT},
};

/// Who is at the other end of a connection.
#[derive(Debug, Clone)]
pub struct Peer {
    address: SocketAddr,
    is_admitted: Arc<AtomicBool>,
}

/// A connection that counts until it is closed, and that breaks unless it is
/// admitted in time.
#[derive(Debug)]
pub struct Connection<IO> {
    io: IO,
    peer: Peer,
    /// None once the peer has been admitted.
    deadline: Option<Pin<Box<Sleep>>>,
    _slot: OwnedSemaphorePermit,
}

/// Accepts up to `n_max` connections at the same time, until `shutdown`.
pub fn accept(
    listener: TcpListener,
    n_max: usize,
    shutdown: CancellationToken,
) -> ReceiverStream<io::Result<Connection<TcpStream>>> {
    let (sender, accepted) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = shutdown.cancelled() => {}
            () = accept_all(&listener, Arc::new(Semaphore::new(n_max)), &sender) => {}
        }
    });
    ReceiverStream::new(accepted)
}

async fn accept_all(
    listener: &TcpListener,
    slots: Arc<Semaphore>,
    accepted: &mpsc::Sender<io::Result<Connection<TcpStream>>>,
) {
    let mut log = Throttle::default();
    loop {
        if slots.available_permits() == 0
            && let Some(withheld) = log.on_line(clock::now())
        {
            warn!(withheld, "all connections are taken; more have to wait until some end");
        }
        let slot = Arc::clone(&slots).acquire_owned().await.expect("nobody closes it");
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
        if accepted.send(Ok(Connection::new(io, address, slot))).await.is_err() {
            return;
        }
    }
}

impl Peer {
    /// Where it connected from.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Its connection may stay.
    pub fn admit(&self) {
        self.is_admitted.store(true, Ordering::Relaxed);
    }
}

impl<IO> Connection<IO> {
    fn new(io: IO, address: SocketAddr, slot: OwnedSemaphorePermit) -> Self {
        let peer = Peer { address, is_admitted: Arc::default() };
        Self { io, peer, deadline: Some(Box::pin(sleep(ADMISSION_TIMEOUT))), _slot: slot }
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
        if let Some(deadline) = &mut self.deadline {
            let is_late = deadline.as_mut().poll(context).is_ready();
            if self.peer.is_admitted.load(Ordering::Relaxed) {
                self.deadline = None;
            } else if is_late {
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
        }
        Pin::new(&mut self.io).poll_read(context, buffer)
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
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex},
        time::Instant,
    };
    use tokio_stream::StreamExt as _;

    use super::*;

    async fn connection() -> (Connection<DuplexStream>, DuplexStream) {
        let (near, far) = duplex(64);
        let slot = Arc::new(Semaphore::new(1)).acquire_owned().await.unwrap();
        (Connection::new(near, "127.0.0.1:1".parse().unwrap(), slot), far)
    }

    #[tokio::test(start_paused = true)]
    async fn a_connection_that_is_never_admitted_breaks_even_if_it_talks() {
        let (mut connection, mut far) = connection().await;
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
        let (mut connection, mut far) = connection().await;
        connection.connect_info().admit();
        tokio::spawn(async move {
            sleep(ADMISSION_TIMEOUT * 100).await;
            far.write_all(b"x").await.unwrap();
        });
        assert_eq!(connection.read_u8().await.unwrap(), b'x');
    }

    #[tokio::test]
    async fn one_connection_too_many_waits_until_another_ends() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut accepted = accept(listener, 1, CancellationToken::new());
        let _first = TcpStream::connect(address).await.unwrap();
        let _second = TcpStream::connect(address).await.unwrap();
        let first = accepted.next().await.unwrap().unwrap();
        tokio::select! {
            biased;
            _ = accepted.next() => panic!("there was room for one"),
            () = tokio::task::yield_now() => {}
        }
        drop(first);
        accepted.next().await.unwrap().unwrap();
    }
}
