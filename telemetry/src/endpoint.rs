//! The HTTP endpoint that Prometheus scrapes: `GET /metrics`, and nothing else. It
//! reads, so it asks for no token; it is there only if somebody gives it an address.

use std::{collections::VecDeque, convert::Infallible, io, net::SocketAddr, time::Duration};

use http::{
    Method, Request, Response, StatusCode,
    header::{ALLOW, CONTENT_TYPE, HeaderValue},
};
use http_body_util::Full;
use hyper::{
    body::{Bytes, Incoming},
    server::conn::http1,
    service::service_fn,
};
use hyper_util::rt::{TokioIo, TokioTimer};
use prometheus::TEXT_FORMAT;
use tokio::{
    net::{TcpListener, TcpStream},
    task::{AbortHandle, JoinSet},
    time::{sleep, timeout},
};
use tracing::{info, warn};

/// Connections at the same time, with one request each. One more ends the oldest: a
/// scrape takes milliseconds, so the oldest is nobody's who scrapes.
const CONNECTIONS_MAX: usize = 16;
/// Time for a request to come and its answer to go: Prometheus itself waits for 10 s.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(10);
/// Time for the headers of a request.
const HEADERS_TIMEOUT: Duration = Duration::from_secs(2);
/// Bytes of a request's headers, and how many there may be.
const HEADERS_LEN_MAX: usize = 16 << 10;
const N_HEADERS_MAX: usize = 64;
/// Pause after the system cannot accept a connection, for lack of descriptors, say.
const ACCEPT_PAUSE: Duration = Duration::from_millis(500);

/// The address for metrics cannot be listened on.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address} for metrics: {source}; give another --metrics-listen")]
pub struct ListenError {
    /// The address.
    pub address: SocketAddr,
    /// What the system says.
    pub source: io::Error,
}

/// An address at which metrics can be scraped.
#[derive(Debug)]
pub struct Endpoint {
    listener: TcpListener,
}

impl Endpoint {
    /// Listens; port 0 takes a free one, which the log says.
    pub async fn listen(address: SocketAddr) -> Result<Self, ListenError> {
        let error = |source| ListenError { address, source };
        let listener = TcpListener::bind(address).await.map_err(error)?;
        let address = listener.local_addr().map_err(error)?;
        info!(%address, "metrics served");
        if !address.ip().to_canonical().is_loopback() {
            warn!(%address, "everybody who reaches this address can read the metrics");
        }
        Ok(Self { listener })
    }

    /// Answers with what `scrape` says, for as long as it is polled; while that says
    /// nothing, with 503.
    pub async fn serve<S>(
        self,
        scrape: impl Fn() -> S + Clone + Send + Sync + 'static,
    ) -> Infallible
    where
        S: Future<Output = Option<String>> + Send + 'static,
    {
        let mut connections = JoinSet::new();
        let mut by_age: VecDeque<AbortHandle> = VecDeque::new();
        loop {
            tokio::select! {
                accepted = self.listener.accept() => {
                    match accepted {
                        Ok((io, _)) => {
                            by_age.retain(|connection| !connection.is_finished());
                            if by_age.len() == CONNECTIONS_MAX
                                && let Some(oldest) = by_age.pop_front()
                            {
                                oldest.abort();
                            }
                            let talk = timeout(CONNECTION_TIMEOUT, talk(io, scrape.clone()));
                            by_age.push_back(connections.spawn(talk));
                        }
                        Err(error) => {
                            warn!("cannot accept a connection for metrics: {error}");
                            sleep(ACCEPT_PAUSE).await;
                        }
                    }
                }
                Some(_) = connections.join_next() => {}
            }
        }
    }
}

/// One request and its answer. Whoever breaks off, or talks nonsense, gets none.
async fn talk<S>(io: TcpStream, scrape: impl Fn() -> S + Clone + Send + Sync + 'static)
where
    S: Future<Output = Option<String>> + Send + 'static,
{
    let service = service_fn(|request: Request<Incoming>| {
        let scrape = scrape.clone();
        async move { Ok::<_, Infallible>(answer(request.method(), request.uri().path(), scrape).await) }
    });
    let _ = http1::Builder::new()
        .keep_alive(false)
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS_TIMEOUT)
        .max_buf_size(HEADERS_LEN_MAX)
        .max_headers(N_HEADERS_MAX)
        .serve_connection(TokioIo::new(io), service)
        .await;
}

async fn answer<S>(method: &Method, path: &str, scrape: impl Fn() -> S) -> Response<Full<Bytes>>
where
    S: Future<Output = Option<String>>,
{
    if path != "/metrics" {
        return plain(StatusCode::NOT_FOUND, "there is only /metrics\n");
    }
    if method != Method::GET {
        let mut response = plain(StatusCode::METHOD_NOT_ALLOWED, "only GET\n");
        response.headers_mut().insert(ALLOW, HeaderValue::from_static("GET"));
        return response;
    }
    match scrape().await {
        Some(text) => plain(StatusCode::OK, text),
        None => plain(StatusCode::SERVICE_UNAVAILABLE, "the program is stopping\n"),
    }
}

fn plain(status: StatusCode, text: impl Into<Bytes>) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(text.into()));
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(TEXT_FORMAT));
    response
}

#[cfg(test)]
mod tests {
    use std::future::{pending, ready};

    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        net::TcpStream,
    };

    use super::*;

    async fn endpoint(text: Option<&'static str>) -> SocketAddr {
        let endpoint = Endpoint::listen("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = endpoint.listener.local_addr().unwrap();
        tokio::spawn(endpoint.serve(move || ready(text.map(str::to_owned))));
        address
    }

    /// Sends a request; returns all of the answer, up to the connection's end.
    async fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).await.unwrap();
        // The answer may come, and the connection end, before all of it is sent.
        let _ = stream.write_all(request.as_bytes()).await;
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer).await;
        String::from_utf8(answer).unwrap()
    }

    #[tokio::test]
    async fn only_get_metrics_is_answered_with_metrics() {
        let address = endpoint(Some("up 1\n")).await;
        for (request, status) in [
            ("GET /metrics", "200"),
            ("GET /metrics?name=x", "200"),
            ("GET /", "404"),
            ("GET /metrics/", "404"),
            ("POST /metrics", "405"),
            ("DELETE /metrics", "405"),
        ] {
            let answer = ask(address, &format!("{request} HTTP/1.1\r\nhost: x\r\n\r\n")).await;
            assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request}: {answer}");
            assert_eq!(answer.ends_with("\r\n\r\nup 1\n"), status == "200", "{answer}");
            assert_eq!(answer.contains("\r\nallow: GET\r\n"), status == "405", "{answer}");
        }
        let answer = ask(address, "GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n").await;
        assert!(answer.contains("content-type: text/plain; version=0.0.4\r\n"), "{answer}");
    }

    #[tokio::test]
    async fn headers_have_limits_and_nonsense_gets_no_metrics() {
        let address = endpoint(Some("up 1\n")).await;
        let long = format!("GET /metrics HTTP/1.1\r\nx: {}\r\n\r\n", "x".repeat(HEADERS_LEN_MAX));
        let many = format!("GET /metrics HTTP/1.1\r\n{}\r\n", "x: y\r\n".repeat(N_HEADERS_MAX + 1));
        for request in [long.as_str(), &many, "\0\u{1}\u{2}\r\n\r\n", "PRI * HTTP/2.0\r\n\r\n"] {
            let answer = ask(address, request).await;
            assert!(!answer.contains("up 1"), "{request}: {answer}");
        }
        let answer = ask(address, "GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n").await;
        assert!(answer.ends_with("up 1\n"), "it goes on: {answer}");
    }

    #[tokio::test]
    async fn a_program_that_stops_says_so() {
        let address = endpoint(None).await;
        let answer = ask(address, "GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n").await;
        assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
    }

    #[tokio::test]
    async fn slow_connections_do_not_delay_a_scrape() {
        let address = endpoint(Some("up 1\n")).await;
        let mut slow = Vec::new();
        for _ in 0..10 * CONNECTIONS_MAX {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(b"GET /metrics HTTP/1.1\r\n").await.unwrap();
            slow.push(stream);
        }
        let scrape = ask(address, "GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n");
        let answer = timeout(HEADERS_TIMEOUT / 2, scrape).await.expect("it is not delayed");
        assert!(answer.ends_with("up 1\n"), "{answer}");
    }

    #[tokio::test]
    async fn one_connection_too_many_ends_the_oldest() {
        let endpoint = Endpoint::listen("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = endpoint.listener.local_addr().unwrap();
        // Nobody is answered, and every connection gets as far as asking.
        let (asked, mut questions) = tokio::sync::mpsc::unbounded_channel();
        tokio::spawn(endpoint.serve(move || {
            asked.send(()).unwrap();
            pending::<Option<String>>()
        }));
        let mut taken = Vec::new();
        for _ in 0..=CONNECTIONS_MAX {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(b"GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n").await.unwrap();
            questions.recv().await.unwrap();
            taken.push(stream);
        }
        let mut answer = Vec::new();
        // Ended, whether in order or not.
        let _ = taken[0].read_to_end(&mut answer).await;
        assert!(answer.is_empty());
    }

    #[tokio::test]
    async fn an_address_in_use_is_named() {
        let address = endpoint(None).await;
        let error = Endpoint::listen(address).await.unwrap_err().to_string();
        assert!(error.contains(&address.to_string()), "{error}");
    }
}
