//! Access to the coordinator: tokens and encryption.

use std::{fmt, net::SocketAddr};

use swarm_transport::{Identity, Token, listening::TLS_HANDSHAKE_TIMEOUT};
use tonic::transport::{Certificate, ServerTlsConfig};

/// Access to the coordinator: tokens and encryption. The default has neither, and is for loopback
/// only.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// The tokens that peers must send, if any.
    pub tokens: Option<Tokens>,
    /// The configuration of TLS, if connections are encrypted.
    pub tls: Option<Tls>,
    /// Whether to serve a network without TLS.
    pub plaintext: bool,
}

/// One secret per role.
#[derive(Debug, Clone)]
pub struct Tokens {
    client: Token,
    worker: Token,
}

/// The rights of a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Submit, read, cancel.
    Client,
    /// Compute.
    Worker,
}

/// The coordinator's side of TLS.
#[derive(Debug, Clone)]
pub struct Tls {
    /// The coordinator's certificate and key.
    pub identity: Identity,
    /// If given, peers need a certificate from one of these authorities.
    pub client_authorities: Option<Certificate>,
}

/// Why access as configured is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Anybody on the network could use the coordinator.
    #[error(
        "refused to listen on {0}, which is not loopback, without tokens; pass \
         --client-token-file and --worker-token-file, and --tls-cert and --tls-key (or \
         --plaintext on a network whose every member you trust)"
    )]
    NoTokens(SocketAddr),
    /// Anybody on the network could read the tokens.
    #[error(
        "refused to listen on {0}, which is not loopback, without TLS; pass --tls-cert and \
         --tls-key, or --plaintext on a network whose every member you trust"
    )]
    NoTls(SocketAddr),
    /// A worker could act as a client.
    #[error("the client token and the worker token are the same; make two")]
    SameTokens,
}

impl Access {
    /// Whether a coordinator with this access may listen there.
    pub fn check(&self, listen: SocketAddr) -> Result<(), AccessError> {
        if listen.ip().to_canonical().is_loopback() {
            return Ok(());
        }
        if self.tokens.is_none() {
            return Err(AccessError::NoTokens(listen));
        }
        if self.tls.is_none() && !self.plaintext {
            return Err(AccessError::NoTls(listen));
        }
        Ok(())
    }
}

impl Tokens {
    /// Two tokens that differ.
    pub fn new(client: Token, worker: Token) -> Result<Self, AccessError> {
        if client == worker {
            return Err(AccessError::SameTokens);
        }
        Ok(Self { client, worker })
    }

    /// The token of clients.
    pub fn client(&self) -> &Token {
        &self.client
    }

    /// The role of a token. Always compares both tokens, so that the time does not reveal a
    /// match.
    pub fn role_of(&self, presented: &[u8]) -> Option<Role> {
        let is_client = self.client.matches(presented);
        let is_worker = self.worker.matches(presented);
        match (is_client, is_worker) {
            (true, _) => Some(Role::Client),
            (_, true) => Some(Role::Worker),
            _ => None,
        }
    }
}

impl Tls {
    /// The configuration for the server.
    pub fn to_tonic(&self) -> ServerTlsConfig {
        let config = ServerTlsConfig::new()
            .identity(self.identity.to_tonic())
            .timeout(TLS_HANDSHAKE_TIMEOUT);
        match &self.client_authorities {
            Some(authorities) => config.client_ca_root(authorities.clone()),
            None => config,
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Client => "client",
            Self::Worker => "worker",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn token(letter: &str) -> Token {
        Token::parse(&letter.repeat(32)).unwrap()
    }

    fn tokens() -> Tokens {
        Tokens::new(token("c"), token("w")).unwrap()
    }

    fn check(listen: &str, access: &Access) -> Result<(), AccessError> {
        access.check(listen.parse().unwrap())
    }

    #[test]
    fn loopback_needs_nothing() {
        for listen in ["127.0.0.1:7700", "127.1.2.3:1", "[::1]:7700", "[::ffff:127.0.0.1]:1"] {
            assert_eq!(check(listen, &Access::default()), Ok(()), "{listen}");
        }
    }

    #[test]
    fn a_network_needs_tokens_and_tls_or_the_option_plaintext() {
        for listen in ["0.0.0.0:7700", "[::]:7700", "10.0.0.1:7700", "[::ffff:10.0.0.1]:1"] {
            let nothing = Access { plaintext: true, ..Access::default() };
            assert!(matches!(check(listen, &nothing), Err(AccessError::NoTokens(_))), "{listen}");
            let readable = Access { tokens: Some(tokens()), ..Access::default() };
            assert!(matches!(check(listen, &readable), Err(AccessError::NoTls(_))), "{listen}");
            let private = Access { plaintext: true, ..readable };
            assert_eq!(check(listen, &private), Ok(()), "{listen}");
        }
    }

    #[test]
    fn each_token_has_one_role() {
        let tokens = tokens();
        assert_eq!(tokens.role_of("c".repeat(32).as_bytes()), Some(Role::Client));
        assert_eq!(tokens.role_of("w".repeat(32).as_bytes()), Some(Role::Worker));
        assert_eq!(tokens.role_of("x".repeat(32).as_bytes()), None);
        assert_eq!(tokens.role_of(b""), None);
        assert_eq!(Tokens::new(token("a"), token("a")).unwrap_err(), AccessError::SameTokens);
    }
}
