//! Strangers and slow peers, with connections in memory and with real sockets.

use std::{convert::Infallible, sync::Arc};

use ::http::{Request, Response};
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex},
    time::timeout,
};
use tonic::transport::server::Connected as _;

use super::*;

const ROOM: Room = Room {
    n_places: 64,
    silent_grace: Duration::from_millis(100),
    heard_grace: Duration::from_millis(500),
};

fn limits(known: Known) -> ListenerLimits {
    let admission_time = Duration::from_secs(30);
    ListenerLimits { strangers: ROOM, admission_time, known, stall_time: Duration::from_secs(30) }
}

fn places(n_known: usize) -> Places {
    Places::new(limits(Known::Refused { n_places: n_known }))
}

fn connection(places: &Places) -> (Connection<DuplexStream>, DuplexStream) {
    let (near, far) = duplex(64);
    (Connection::new(near, "127.0.0.1:1".parse().unwrap(), places).0, far)
}

#[tokio::test(start_paused = true)]
async fn a_connection_that_is_never_admitted_breaks_even_if_it_talks() {
    let (mut connection, mut far) = connection(&places(1));
    let start = Instant::now();
    tokio::spawn(async move {
        while far.write_all(b"x").await.is_ok() {
            sleep(Duration::from_secs(3)).await;
        }
    });
    let error = loop {
        match connection.read_u8().await {
            Ok(_) => {}
            Err(error) => break error,
        }
    };
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    assert!(start.elapsed() < Duration::from_secs(60));
}

#[tokio::test(start_paused = true)]
async fn an_admitted_connection_may_be_silent() {
    let (mut connection, mut far) = connection(&places(1));
    connection.connect_info().admit().unwrap();
    tokio::spawn(async move {
        sleep(Duration::from_secs(3000)).await;
        far.write_all(b"x").await.unwrap();
    });
    assert_eq!(connection.read_u8().await.unwrap(), b'x');
}

#[tokio::test(start_paused = true)]
async fn a_peer_that_reads_nothing_for_too_long_loses_its_connection() {
    let (mut connection, mut far) = connection(&places(1));
    connection.connect_info().admit().unwrap();
    let start = Instant::now();
    // A slow reader keeps its connection.
    let reading = tokio::spawn(async move {
        for _ in 0..5 {
            sleep(Duration::from_secs(20)).await;
            far.read_u8().await.unwrap();
        }
        far
    });
    let error = connection.write_all(&[0; 1000]).await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    assert!(start.elapsed() >= Duration::from_secs(130), "{:?}", start.elapsed());
    drop(reading.await);
}

#[tokio::test]
async fn strangers_make_room_for_others_and_known_peers_stay() {
    let places = places(2);
    let (mut known, mut known_far) = connection(&places);
    known.connect_info().admit().unwrap();
    let (mut oldest, _oldest_far) = connection(&places);
    let _others: Vec<_> = (0..ROOM.n_places).map(|_| connection(&places)).collect();
    let error = oldest.read_u8().await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    known_far.write_all(b"x").await.unwrap();
    assert_eq!(known.read_u8().await.unwrap(), b'x');
}

#[tokio::test]
async fn one_known_connection_too_many_is_refused_until_another_ends() {
    let places = places(1);
    let (first, _first_far) = connection(&places);
    let (second, _second_far) = connection(&places);
    first.connect_info().admit().unwrap();
    first.connect_info().admit().unwrap();
    assert!(second.connect_info().admit().is_err());
    drop(first);
    second.connect_info().admit().unwrap();
}

#[tokio::test(start_paused = true)]
async fn one_known_connection_too_many_may_end_the_one_with_the_oldest_request() {
    let places = Places::new(limits(Known::EndsAnother(Room { n_places: 2, ..ROOM })));
    let (mut first, _first_far) = connection(&places);
    let (second, _second_far) = connection(&places);
    let (third, _third_far) = connection(&places);
    first.peer().admit().unwrap();
    second.peer().admit().unwrap();
    assert!(third.peer().admit().is_err(), "both have asked just now");
    sleep(ROOM.heard_grace).await;
    second.peer().admit().unwrap();
    third.peer().admit().unwrap();
    assert_eq!(first.read_u8().await.unwrap_err().kind(), io::ErrorKind::TimedOut);
}

#[tokio::test(start_paused = true)]
async fn a_flood_waits_until_the_strangers_had_time_to_introduce_themselves() {
    let places = places(1);
    let mut strangers: Vec<_> = (0..ROOM.n_places).map(|_| connection(&places)).collect();
    let start = Instant::now();
    places.wait_for_one().await;
    assert!(start.elapsed() >= ROOM.silent_grace);
    // A stranger that leaves or is admitted ends the wait earlier.
    strangers.extend([connection(&places)]);
    strangers.truncate(ROOM.n_places);
    strangers[1].0.connect_info().admit().unwrap();
    places.wait_for_one().await;
}

/// A server that answers `/` with a word, and never answers other requests.
async fn server(tls: Option<Arc<rustls::ServerConfig>>) -> SocketAddr {
    let listener = bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let address = listener.local_addr().unwrap();
    let answer = |request: Request<Incoming>, peer: Peer| async move {
        peer.admitted().await;
        if request.uri().path() != "/" {
            std::future::pending::<Infallible>().await;
        }
        Response::new(Full::new(Bytes::from_static(b"word")))
    };
    let http = HttpLimits {
        headers_time: Duration::from_secs(10),
        headers_len: 16 << 10,
        n_headers: 64,
        keep_alive: true,
    };
    let limits = (limits(Known::EndsAnother(ROOM)), http);
    tokio::spawn(serve_http(listener, limits, tls, answer, CancellationToken::new()));
    address
}

/// Opens more connections than there are places. Each sends these bytes and then nothing.
async fn flood(address: SocketAddr, bytes: &[u8]) -> Vec<TcpStream> {
    let mut streams = Vec::new();
    for _ in 0..4 * ROOM.n_places {
        let mut stream = TcpStream::connect(address).await.unwrap();
        // The server may have ended it already.
        let _ = stream.write_all(bytes).await;
        streams.push(stream);
    }
    streams
}

async fn ask<IO: AsyncReadWrite>(mut stream: IO) -> String {
    let request = b"GET / HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n";
    stream.write_all(request).await.unwrap();
    let mut answer = String::new();
    timeout(Duration::from_secs(10), stream.read_to_string(&mut answer)).await.unwrap().unwrap();
    answer
}

trait AsyncReadWrite: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin {}
impl<T: tokio::io::AsyncRead + tokio::io::AsyncWrite + Unpin> AsyncReadWrite for T {}

#[tokio::test]
async fn connections_that_are_idle_slow_or_never_answered_keep_nobody_out() {
    for bytes in
        ["", "GET / HT", "GET / HTTP/1.1\r\nx: y\r\n", "GET /never HTTP/1.1\r\nhost: x\r\n\r\n"]
    {
        let address = server(None).await;
        let _open = flood(address, bytes.as_bytes()).await;
        let answer = ask(TcpStream::connect(address).await.unwrap()).await;
        assert!(answer.ends_with("word"), "{bytes}: {answer}");
    }
}

#[tokio::test]
async fn half_open_handshakes_keep_nobody_out() {
    let key = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let [certificate, private] = ["certificate.pem", "key.pem"].map(|name| dir.path().join(name));
    std::fs::write(&certificate, key.cert.pem()).unwrap();
    std::fs::write(&private, key.signing_key.serialize_pem()).unwrap();
    let identity = crate::Identity::read(&certificate, &private).unwrap();
    let tls = Arc::new(crate::server_tls(&identity).unwrap());
    let mut client = crate::pinned(&identity).unwrap();
    client.alpn_protocols.clear();
    let connector = tokio_rustls::TlsConnector::from(Arc::new(client));
    for bytes in [&b""[..], b"\x16\x03\x01\x02\x00\x01"] {
        let address = server(Some(Arc::clone(&tls))).await;
        let _open = flood(address, bytes).await;
        let name = "localhost".try_into().unwrap();
        let stream = TcpStream::connect(address).await.unwrap();
        let stream =
            timeout(Duration::from_secs(10), connector.connect(name, stream)).await.unwrap();
        assert!(ask(stream.unwrap()).await.ends_with("word"));
    }
}
