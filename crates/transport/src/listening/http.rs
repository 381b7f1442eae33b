//! Serves HTTP/1.1 on the connections of a listener, with time limits for every step at which a
//! peer can be slow.

use std::{convert::Infallible, error::Error, sync::Arc, time::Duration};

use http::{Request, Response};
use http_body::Body;
use hyper::{body::Incoming, server::conn::http1, service::service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use rustls::ServerConfig;
use tokio::{
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tokio_rustls::TlsAcceptor;
use tokio_stream::StreamExt as _;
use tokio_util::{either::Either, sync::CancellationToken};

use super::{Connection, ListenerLimits, Peer, TLS_HANDSHAKE_TIMEOUT, accept};

/// Limits of requests.
#[derive(Debug, Clone, Copy)]
pub struct HttpLimits {
    /// Time for the headers of a request, and between two requests on a connection.
    pub headers_time: Duration,
    /// Bytes of a request's headers.
    pub headers_len: usize,
    /// Most headers of a request.
    pub n_headers: usize,
    /// Whether a connection may have more than one request.
    pub keep_alive: bool,
}

/// Serves until `shutdown`, and then finishes open requests; dropping the future ends these, too.
/// `answer` gets the peer with each request, and admits permitted peers.
pub async fn serve_http<S, F, B>(
    listener: TcpListener,
    limits: (ListenerLimits, HttpLimits),
    tls: Option<Arc<ServerConfig>>,
    answer: S,
    shutdown: CancellationToken,
) where
    S: Fn(Request<Incoming>, Peer) -> F + Clone + Send + Sync + 'static,
    F: Future<Output = Response<B>> + Send + 'static,
    B: Body<Data: Send, Error: Into<Box<dyn Error + Send + Sync>>> + Send + 'static,
{
    let (listener_limits, http_limits) = limits;
    let tls = tls.map(TlsAcceptor::from);
    let mut accepted = accept(listener, listener_limits, shutdown.clone());
    let mut conversations = JoinSet::new();
    loop {
        tokio::select! {
            Some(Ok(connection)) = accepted.next() => {
                let peer = connection.peer().clone();
                let (tls, answer, shutdown) = (tls.clone(), answer.clone(), shutdown.clone());
                conversations.spawn(async move {
                    let has_to_go = peer.clone().has_to_go();
                    let answer = move |request| answer(request, peer.clone());
                    tokio::select! {
                        () = has_to_go => {}
                        () = talk(connection, tls, http_limits, answer, shutdown) => {}
                    }
                });
            }
            Some(_) = conversations.join_next() => {}
            else => return,
        }
    }
}

/// Serves all requests of a connection. A peer that breaks off, or sends invalid data, gets no
/// answer.
async fn talk<F, B>(
    connection: Connection<TcpStream>,
    tls: Option<TlsAcceptor>,
    limits: HttpLimits,
    answer: impl Fn(Request<Incoming>) -> F,
    shutdown: CancellationToken,
) where
    F: Future<Output = Response<B>>,
    B: Body<Error: Into<Box<dyn Error + Send + Sync>>> + 'static,
{
    let io = match tls {
        None => Either::Left(connection),
        Some(tls) => match timeout(TLS_HANDSHAKE_TIMEOUT, tls.accept(connection)).await {
            Ok(Ok(stream)) => Either::Right(Box::new(stream)),
            // The peer does not speak TLS.
            Ok(Err(_)) | Err(_) => return,
        },
    };
    let service = service_fn(|request| {
        let answering = answer(request);
        async move { Ok::<_, Infallible>(answering.await) }
    });
    let mut conversation = std::pin::pin!(
        http1::Builder::new()
            .keep_alive(limits.keep_alive)
            .timer(TokioTimer::new())
            .header_read_timeout(limits.headers_time)
            .max_buf_size(limits.headers_len)
            .max_headers(limits.n_headers)
            .serve_connection(TokioIo::new(io), service)
    );
    let ended = tokio::select! {
        ended = conversation.as_mut() => ended,
        () = shutdown.cancelled() => {
            conversation.as_mut().graceful_shutdown();
            conversation.await
        }
    };
    // The peer has gone.
    drop(ended);
}
