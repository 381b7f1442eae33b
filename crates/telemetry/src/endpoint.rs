//! The HTTP endpoint for Prometheus: `GET /metrics`, and nothing else. It only reads, so it
//! requires no token. It exists only if an option gives it an address.

use std::{convert::Infallible, future::pending, io, net::SocketAddr, time::Duration};

use http::{
    Method, Response, StatusCode,
    header::{ALLOW, CONTENT_TYPE, HeaderValue},
};
use http_body_util::Full;
use hyper::body::Bytes;
use prometheus::TEXT_FORMAT;
use swarm_transport::listening::{self, HttpLimits, Known, ListenerLimits, Room, serve_http};
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tracing::{info, warn};

/// Limits of connections, with one request each, equal for all peers. One connection too many
/// ends the oldest: a scrape takes milliseconds, so the oldest does not belong to a scraper.
/// Prometheus itself waits for 10 s.
const CONNECTIONS: ListenerLimits = ListenerLimits {
    strangers: Room {
        n_places: 64,
        silent_grace: Duration::from_millis(20),
        heard_grace: Duration::from_millis(100),
    },
    admission_time: Duration::from_secs(10),
    known: Known::Refused { n_places: 0 },
    stall_time: Duration::from_secs(10),
};
/// Limits of requests.
const REQUESTS: HttpLimits = HttpLimits {
    headers_time: Duration::from_secs(2),
    headers_len: 16 << 10,
    n_headers: 64,
    keep_alive: false,
};

/// Listening on the address for metrics failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address} for metrics: {source}; give another --metrics-listen")]
pub struct ListenError {
    /// The address.
    pub address: SocketAddr,
    /// The system's error.
    pub source: io::Error,
}

/// An address at which metrics can be scraped.
#[derive(Debug)]
pub struct Endpoint {
    listener: TcpListener,
}

impl Endpoint {
    /// Listens on the address. Port 0 takes a free port, which the log shows.
    pub async fn listen(address: SocketAddr) -> Result<Self, ListenError> {
        let error = |source| ListenError { address, source };
        let listener = listening::bind(address).map_err(error)?;
        let address = listener.local_addr().map_err(error)?;
        info!(%address, "metrics served");
        if !address.ip().to_canonical().is_loopback() {
            warn!(%address, "everybody who reaches this address can read the metrics");
        }
        Ok(Self { listener })
    }

    /// Answers with the text of `scrape`, or with 503 if that returns `None`, for as long as the
    /// future is polled.
    pub async fn serve<S>(
        self,
        scrape: impl Fn() -> S + Clone + Send + Sync + 'static,
    ) -> Infallible
    where
        S: Future<Output = Option<String>> + Send + 'static,
    {
        let answer = move |request: http::Request<_>, _| {
            let scrape = scrape.clone();
            async move { answer(request.method(), request.uri().path(), scrape).await }
        };
        let never = CancellationToken::new();
        serve_http(self.listener, (CONNECTIONS, REQUESTS), None, answer, never).await;
        pending().await
    }
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
    use std::future::ready;

    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        net::TcpStream,
        time::timeout,
    };

    use super::*;

    async fn endpoint(text: Option<&'static str>) -> SocketAddr {
        let endpoint = Endpoint::listen("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = endpoint.listener.local_addr().unwrap();
        tokio::spawn(endpoint.serve(move || ready(text.map(str::to_owned))));
        address
    }

    /// Sends a request; returns the whole answer, up to the connection's end.
    async fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).await.unwrap();
        // The answer and the end of the connection may arrive before the whole request is sent.
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
        let long =
            format!("GET /metrics HTTP/1.1\r\nx: {}\r\n\r\n", "x".repeat(REQUESTS.headers_len));
        let many =
            format!("GET /metrics HTTP/1.1\r\n{}\r\n", "x: y\r\n".repeat(REQUESTS.n_headers + 1));
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
        for _ in 0..10 * CONNECTIONS.strangers.n_places {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(b"GET /metrics HTTP/1.1\r\n").await.unwrap();
            slow.push(stream);
        }
        let scrape = ask(address, "GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n");
        let answer = timeout(REQUESTS.headers_time, scrape).await.expect("it is not delayed");
        assert!(answer.ends_with("up 1\n"), "{answer}");
    }

    #[tokio::test]
    async fn one_connection_too_many_ends_the_oldest() {
        let endpoint = Endpoint::listen("127.0.0.1:0".parse().unwrap()).await.unwrap();
        let address = endpoint.listener.local_addr().unwrap();
        // No connection gets an answer, and every one sends its request.
        let (asked, mut questions) = tokio::sync::mpsc::unbounded_channel();
        tokio::spawn(endpoint.serve(move || {
            asked.send(()).unwrap();
            pending::<Option<String>>()
        }));
        let mut taken = Vec::new();
        for _ in 0..=CONNECTIONS.strangers.n_places {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(b"GET /metrics HTTP/1.1\r\nhost: x\r\n\r\n").await.unwrap();
            questions.recv().await.unwrap();
            taken.push(stream);
        }
        let mut answer = Vec::new();
        // The server has ended the connection, properly or not.
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
