//! Connections that end when they have to make room, and when their peer stops reading.

use std::{
    fmt, io,
    net::SocketAddr,
    pin::Pin,
    task::{Context, Poll, ready},
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Sleep, sleep},
};
use tonic::transport::server::Connected;

use super::places::{Peer, Places};

/// A connection that ends if it is not admitted in time, if it has to make room, or if its peer
/// does not read.
pub struct Connection<IO> {
    io: IO,
    peer: Peer,
    has_to_go: Pin<Box<dyn Future<Output = ()> + Send>>,
    is_heard: bool,
    /// The time limit of a write that waits for the peer.
    stall: Option<Pin<Box<Sleep>>>,
    places: Places,
}

impl<IO> Connection<IO> {
    /// Takes a place for a connection. Also returns whether another one had to make room.
    pub(super) fn new(io: IO, address: SocketAddr, places: &Places) -> (Self, bool) {
        let (peer, has_ended_another) = places.enter(address);
        let has_to_go = Box::pin(peer.clone().has_to_go());
        let places = places.clone();
        let connection = Self { io, peer, has_to_go, is_heard: false, stall: None, places };
        (connection, has_ended_another)
    }

    /// The peer at the other end.
    pub fn peer(&self) -> &Peer {
        &self.peer
    }

    /// An error once the connection has to go.
    fn poll_end(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        match self.has_to_go.as_mut().poll(context) {
            Poll::Ready(()) => {
                // The future stays ready.
                self.has_to_go = Box::pin(std::future::ready(()));
                Err(io::ErrorKind::TimedOut.into())
            }
            Poll::Pending => Ok(()),
        }
    }

    /// Ends a write if the peer does not read for too long.
    fn unless_stalled<T>(
        &mut self,
        written: Poll<io::Result<T>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<T>> {
        if written.is_ready() {
            self.stall = None;
            return written;
        }
        let stall_time = self.places.stall_time;
        let stall = self.stall.get_or_insert_with(|| Box::pin(sleep(stall_time)));
        ready!(stall.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<IO: fmt::Debug> fmt::Debug for Connection<IO> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Connection").field("io", &self.io).field("peer", &self.peer).finish()
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
        // A gRPC server always waits for input, so it polls this when the time is up. An HTTP/1
        // server may not, so `serve_http` also checks by itself.
        self.poll_end(context)?;
        let n_before = buffer.filled().len();
        let read = Pin::new(&mut self.io).poll_read(context, buffer);
        if !self.is_heard && buffer.filled().len() > n_before {
            self.is_heard = true;
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
        let written = Pin::new(&mut self.io).poll_write(context, bytes);
        self.unless_stalled(written, context)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.io).poll_flush(context);
        self.unless_stalled(flushed, context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.io).poll_write_vectored(context, bytes);
        self.unless_stalled(written, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }
}
