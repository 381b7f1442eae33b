//! A way to the services of a coordinator for the process that it is in: a pipe, no port.

use std::{io, time::Duration};

use hyper_util::rt::TokioIo;
use tokio::{
    io::{DuplexStream, duplex},
    sync::mpsc,
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tower::service_fn;

/// Bytes that wait in a pipe, each way.
const PIPE_LEN: usize = 256 << 10;

/// Where connections come in.
pub type Visitors = ReceiverStream<io::Result<DuplexStream>>;

/// A way to the services of a coordinator in this process.
#[derive(Debug, Clone)]
pub struct Door(mpsc::Sender<io::Result<DuplexStream>>);

impl Door {
    /// A door, and who comes in by it.
    pub fn new() -> (Self, Visitors) {
        let (sender, visitors) = mpsc::channel(1);
        (Self(sender), ReceiverStream::new(visitors))
    }

    /// A channel whose calls take no longer than `timeout`, if there is one. It connects with the
    /// first call.
    pub fn channel(&self, timeout: Option<Duration>) -> Channel {
        // Nobody looks the name up.
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
