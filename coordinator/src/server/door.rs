//! A pipe to the services of a coordinator in the same process, without a port.

use std::{io, time::Duration};

use hyper_util::rt::TokioIo;
use tokio::{
    io::{DuplexStream, duplex},
    sync::mpsc,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tower::service_fn;

/// Capacity of a pipe in each direction, bytes.
const PIPE_LEN: usize = 256 << 10;

/// The incoming connections of a door.
pub type Visitors = ReceiverStream<io::Result<DuplexStream>>;

/// The client's end of pipes to a coordinator in this process.
#[derive(Debug, Clone)]
pub struct Door(mpsc::Sender<io::Result<DuplexStream>>);

impl Door {
    /// A door, and its incoming connections.
    pub fn new() -> (Self, Visitors) {
        let (sender, visitors) = mpsc::channel(1);
        (Self(sender), ReceiverStream::new(visitors))
    }

    /// A channel whose calls take at most `timeout`, if given. It connects at the first call.
    pub fn channel(&self, timeout: Option<Duration>) -> Channel {
        // The name is never resolved.
        let endpoint = Endpoint::from_static("http://this-process");
        let endpoint = match timeout {
            Some(timeout) => endpoint.timeout(timeout),
            None => endpoint,
        };
        let door = self.0.clone();
        endpoint.connect_with_connector_lazy(service_fn(move |_| {
            let door = door.clone();
            async move {
                let (near, far) = duplex(PIPE_LEN);
                let closed = |_| io::Error::from(io::ErrorKind::BrokenPipe);
                door.send(Ok(far)).await.map_err(closed)?;
                Ok::<_, io::Error>(TokioIo::new(near))
            }
        }))
    }
}
