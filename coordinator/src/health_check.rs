//! Asks a running coordinator whether it is healthy; for container engines.

use std::{
    error::Error,
    future::ready,
    io,
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    sync::Arc,
    time::Duration,
};

use hyper_util::rt::TokioIo;
use swarm_transport::{PinError, pinned};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::TcpStream,
    time::timeout,
};
use tokio_rustls::{TlsConnector, rustls::pki_types::ServerName};
use tonic::{
    Status,
    transport::{Channel, Endpoint},
};
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};
use tower::service_fn;

use crate::server::Tls;

/// Time for the answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Why a coordinator does not count as healthy.
#[derive(Debug, thiserror::Error)]
pub enum Unhealthy {
    /// The port is unknown.
    #[error("--listen {0} takes any free port; name the one that the coordinator listens on")]
    UnknownPort(SocketAddr),
    /// The certificate cannot be used.
    #[error("the TLS files cannot be used: {0}")]
    Pin(#[from] PinError),
    /// No program listens on the address.
    #[error("no coordinator listens on {address}: {source}")]
    Absent {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        source: io::Error,
    },
    /// The server at the address is not the coordinator with this certificate.
    #[error(
        "no TLS with the coordinator on {address}: {source}; does it run with --tls-cert and \
         --tls-key, and with the same files? It reads a renewed certificate only at its start"
    )]
    Tls {
        /// The address.
        address: SocketAddr,
        /// The error.
        source: io::Error,
    },
    /// The call failed.
    #[error("the coordinator on {address} does not answer: {reason}; {hint}")]
    Call {
        /// The address.
        address: SocketAddr,
        /// The reason.
        reason: String,
        /// A possible cause.
        hint: &'static str,
    },
    /// It answers that it does not serve.
    #[error("the coordinator on {0} does not serve")]
    NotServing(SocketAddr),
    /// It took too long.
    #[error("no answer on {address} within {} s", PATIENCE.as_secs())]
    Silent {
        /// The address.
        address: SocketAddr,
    },
}

/// Asks the coordinator at this address, with this TLS, through its health service. The
/// coordinator has to show its own certificate. If it requires a client certificate, this check
/// shows the same one. An unspecified address, such as 0.0.0.0, is reached over loopback.
pub async fn health_check(listen: SocketAddr, tls: Option<&Tls>) -> Result<(), Unhealthy> {
    timeout(PATIENCE, ask(listen, tls)).await.unwrap_or(Err(Unhealthy::Silent { address: listen }))
}

async fn ask(address: SocketAddr, tls: Option<&Tls>) -> Result<(), Unhealthy> {
    if address.port() == 0 {
        return Err(Unhealthy::UnknownPort(address));
    }
    let connector = tls.map(|tls| pinned(&tls.identity)).transpose()?;
    let io = TcpStream::connect(&*reachable(address))
        .await
        .map_err(|source| Unhealthy::Absent { address, source })?;
    let (channel, hint) = match connector {
        Some(connector) => {
            // The certificate is known, so the name does not matter.
            let name = ServerName::IpAddress(address.ip().into());
            let io = TlsConnector::from(Arc::new(connector))
                .connect(name, io)
                .await
                .map_err(|source| Unhealthy::Tls { address, source })?;
            (
                channel(io).await,
                "if it requires client certificates, its own certificate must be valid as one",
            )
        }
        None => (channel(io).await, "does it serve TLS? Then pass its --tls-cert and --tls-key"),
    };
    let broken = |error: &dyn Error| Unhealthy::Call { address, reason: deepest(error), hint };
    let mut client = HealthClient::new(channel.map_err(|error| broken(&error))?);
    let answer = client
        .check(HealthCheckRequest::default())
        .await
        .map_err(|status: Status| broken(&status))?;
    match answer.into_inner().status() {
        ServingStatus::Serving => Ok(()),
        _ => Err(Unhealthy::NotServing(address)),
    }
}

/// Addresses at which a coordinator that listens on `listen` can be reached.
fn reachable(listen: SocketAddr) -> Vec<SocketAddr> {
    let (v4, v6) = (IpAddr::from(Ipv4Addr::LOCALHOST), IpAddr::from(Ipv6Addr::LOCALHOST));
    let hosts = match listen.ip() {
        IpAddr::V4(Ipv4Addr::UNSPECIFIED) => vec![v4],
        // Such a socket accepts IPv4 and IPv6, and the machine may have no IPv6 loopback.
        IpAddr::V6(Ipv6Addr::UNSPECIFIED) => vec![v6, v4],
        host => vec![host],
    };
    hosts.into_iter().map(|host| SocketAddr::new(host, listen.port())).collect()
}

/// gRPC over an existing connection.
async fn channel<IO>(io: IO) -> Result<Channel, tonic::transport::Error>
where
    IO: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let mut io = Some(TokioIo::new(io));
    let connect = service_fn(move |_| ready(io.take().ok_or("there is one connection only")));
    Endpoint::from_static("http://coordinator").connect_with_connector(connect).await
}

fn deepest(error: &dyn Error) -> String {
    let mut error = error;
    while let Some(cause) = error.source() {
        error = cause;
    }
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_addresses_are_asked_over_loopback_and_others_directly() {
        let cases = [
            ("0.0.0.0:7700", &["127.0.0.1:7700"][..]),
            ("[::]:1", &["[::1]:1", "127.0.0.1:1"]),
            ("192.0.2.7:7700", &["192.0.2.7:7700"]),
        ];
        for (listen, expected) in cases {
            let expected: Vec<SocketAddr> = expected.iter().map(|a| a.parse().unwrap()).collect();
            assert_eq!(reachable(listen.parse().unwrap()), expected);
        }
    }
}
