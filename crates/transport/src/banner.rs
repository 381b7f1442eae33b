//! The banner of a server that is not a coordinator.

use std::{io, time::Duration};

use tokio::{net::TcpStream, time::timeout};

/// Time limit of the connection and the answer.
const LIMIT: Duration = Duration::from_secs(1);
/// Number of bytes of the answer that are read.
const SHOWN_BYTES_MAX: usize = 60;
/// A server that speaks HTTP/1 answers this; a coordinator closes the connection.
const REQUEST: &[u8] = b"GET / HTTP/1.0\r\n\r\n";
/// The first bytes of a TLS alert.
const TLS_ALERT: &str = "\u{15}\u{3}";

/// A server's answer to a client that speaks neither TLS nor HTTP/2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Banner {
    /// A line of text, of at most 60 bytes.
    Line(String),
    /// A TLS alert: the server speaks TLS.
    Tls,
}

/// The banner of the server at `HOST:PORT`. `None` if no server answers, or if the answer is not
/// text, as with a coordinator, which speaks HTTP/2. Takes up to a second.
pub async fn banner(address: &str) -> Option<Banner> {
    let answer = timeout(LIMIT, answer(address)).await.ok()?.ok()?;
    if answer.starts_with(TLS_ALERT) {
        return Some(Banner::Tls);
    }
    let line = answer.lines().next().filter(|line| !line.trim().is_empty())?;
    // HTTP/2 and TLS begin with control characters.
    line.chars().all(|c| !c.is_control()).then(|| Banner::Line(line.to_owned()))
}

async fn answer(address: &str) -> io::Result<String> {
    let stream = TcpStream::connect(address).await?;
    stream.writable().await?;
    stream.try_write(REQUEST)?;
    let mut bytes = [0; SHOWN_BYTES_MAX];
    loop {
        stream.readable().await?;
        match stream.try_read(&mut bytes) {
            Ok(n_bytes) => return Ok(String::from_utf8_lossy(&bytes[..n_bytes]).into_owned()),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{io::Write as _, net::TcpListener, thread};

    use super::*;

    /// A service that sends this to every client.
    fn service(banner: &'static [u8]) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        thread::spawn(move || {
            for stream in listener.incoming() {
                // A client that has gone needs no answer.
                let _ = stream.and_then(|mut stream| stream.write_all(banner));
            }
        });
        address
    }

    #[tokio::test]
    async fn other_services_are_recognised_by_their_banner() {
        let http = service(b"HTTP/1.0 404 Not Found\r\nServer: x\r\n\r\n");
        let line = |text: &str| Some(Banner::Line(text.to_owned()));
        assert_eq!(banner(&http).await, line("HTTP/1.0 404 Not Found"));
        assert_eq!(banner(&service(b"220 mail ESMTP\r\n")).await, line("220 mail ESMTP"));
        assert_eq!(banner(&service(b"\x15\x03\x01\x00\x02\x02\x46")).await, Some(Banner::Tls));
        assert_eq!(banner(&service(b"")).await, None);
        assert_eq!(banner("127.0.0.1:1").await, None);
    }
}
