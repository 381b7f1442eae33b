//! Parses addresses to listen on, as people write them.

use std::net::{SocketAddr, ToSocketAddrs as _};

/// The address of `HOST:PORT`. HOST is an IP address (IPv6 in brackets) or a name, such as
/// `localhost`. If a name has several addresses, the first IPv4 address counts, or else the first
/// IPv6 address.
///
/// # Errors
///
/// If the text is not such an address; the message has an example.
pub fn listen_address(text: &str) -> Result<SocketAddr, String> {
    if let Ok(address) = text.parse() {
        return Ok(address);
    }
    let expected = "expected HOST:PORT, such as 127.0.0.1:7700 or localhost:7700";
    let addresses: Vec<SocketAddr> =
        text.to_socket_addrs().map_err(|error| format!("{expected}; {error}"))?.collect();
    let first = addresses.iter().find(|address| address.is_ipv4()).or(addresses.first());
    first.copied().ok_or_else(|| format!("{expected}; the name has no address"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_addresses_or_names() {
        for (text, expected) in [
            ("127.0.0.1:7700", "127.0.0.1:7700"),
            ("localhost:7705", "127.0.0.1:7705"),
            ("[::]:1", "[::]:1"),
        ] {
            assert_eq!(listen_address(text).unwrap().to_string(), expected);
        }
    }

    #[test]
    fn an_invalid_address_is_answered_with_an_example() {
        for text in ["", "7700", ":7700", "localhost", "127.0.0.1", "127.0.0.1:70000"] {
            let message = listen_address(text).unwrap_err();
            assert!(message.contains("127.0.0.1:7700"), "{text}: {message}");
        }
    }
}
