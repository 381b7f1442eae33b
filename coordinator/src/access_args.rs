//! The options that say who may connect, and the files that they name.

use std::path::PathBuf;

use clap::builder::FalseyValueParser;
use coordinator::{Access, AccessError, Tls, Tokens};
use swarm_transport::{Identity, PemError, Token, TokenError, certificates};

const CLIENT_TOKEN: &str = "SWARM_CLIENT_TOKEN";
const WORKER_TOKEN: &str = "SWARM_WORKER_TOKEN";

/// Who may connect.
#[derive(Debug, clap::Args)]
pub struct AccessArgs {
    /// File of the token that clients have to send; or put the token itself into
    /// SWARM_CLIENT_TOKEN.
    #[arg(long, value_name = "FILE", env = "SWARM_CLIENT_TOKEN_FILE")]
    client_token_file: Option<PathBuf>,
    /// File of the token that workers have to send; or put the token itself into
    /// SWARM_WORKER_TOKEN.
    #[arg(long, value_name = "FILE", env = "SWARM_WORKER_TOKEN_FILE")]
    worker_token_file: Option<PathBuf>,
    /// PEM file of the coordinator's certificate, and of those between it and its
    /// authority: serve TLS only.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_CERT", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// PEM file of the certificate's private key.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_KEY", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// PEM file of authorities: clients and workers need a certificate of one of
    /// them, beside their token.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_CLIENT_CA", requires = "tls_cert")]
    tls_client_ca: Option<PathBuf>,
    /// Serve a network without TLS: every member of it is trusted.
    #[arg(long, env = "SWARM_PLAINTEXT", value_parser = FalseyValueParser::new())]
    plaintext: bool,
}

/// Why access cannot be what the options say.
#[derive(Debug, thiserror::Error)]
pub enum AccessInputError {
    /// A token.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A certificate or key.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// The tokens together.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// One role would need no token.
    #[error("there is a {present} token but no {absent} token; give both or none")]
    OneToken {
        /// Whose there is.
        present: &'static str,
        /// Whose there is not.
        absent: &'static str,
    },
}

impl AccessArgs {
    /// Reads all files.
    pub fn load(&self) -> Result<Access, AccessInputError> {
        let client = Token::load(self.client_token_file.as_deref(), CLIENT_TOKEN)?;
        let worker = Token::load(self.worker_token_file.as_deref(), WORKER_TOKEN)?;
        let tokens = match (client, worker) {
            (Some(client), Some(worker)) => Some(Tokens::new(client, worker)?),
            (None, None) => None,
            (Some(_), None) => {
                return Err(AccessInputError::OneToken { present: "client", absent: "worker" });
            }
            (None, Some(_)) => {
                return Err(AccessInputError::OneToken { present: "worker", absent: "client" });
            }
        };
        Ok(Access { tokens, tls: self.load_tls()?, plaintext: self.plaintext })
    }

    /// Reads the files of TLS.
    pub fn load_tls(&self) -> Result<Option<Tls>, PemError> {
        let (Some(certificate), Some(key)) = (&self.tls_cert, &self.tls_key) else {
            return Ok(None);
        };
        Ok(Some(Tls {
            identity: Identity::read(certificate, key)?,
            client_authorities: self.tls_client_ca.as_deref().map(certificates).transpose()?,
        }))
    }
}
