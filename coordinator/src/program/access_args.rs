//! The options for tokens and TLS; reads the files that they name.

use std::path::PathBuf;

use clap::builder::FalseyValueParser;
use swarm_transport::{Expiries, Identity, PemError, Token, TokenError, certificates};

use crate::{Access, AccessError, Tls, Tokens};

const CLIENT_TOKEN: &str = "SWARM_CLIENT_TOKEN";
const WORKER_TOKEN: &str = "SWARM_WORKER_TOKEN";

/// Tokens and TLS.
#[derive(Debug, clap::Args)]
pub struct AccessArgs {
    /// File with the token that clients must send; alternatively SWARM_CLIENT_TOKEN holds
    /// the token itself.
    #[arg(long, value_name = "FILE", env = "SWARM_CLIENT_TOKEN_FILE")]
    client_token_file: Option<PathBuf>,
    /// File with the token that workers must send; alternatively SWARM_WORKER_TOKEN holds
    /// the token itself.
    #[arg(long, value_name = "FILE", env = "SWARM_WORKER_TOKEN_FILE")]
    worker_token_file: Option<PathBuf>,
    /// PEM file of the coordinator's certificate and any intermediate certificates; with
    /// it the coordinator serves TLS only.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_CERT", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// PEM file of the certificate's private key.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_KEY", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// PEM file of authorities; with it clients and workers must have a certificate signed
    /// by one of them, in addition to their token.
    #[arg(long, value_name = "FILE", env = "SWARM_TLS_CLIENT_CA", requires = "tls_cert")]
    tls_client_ca: Option<PathBuf>,
    /// Listen on a network without TLS; use this only if every member of it is trusted.
    #[arg(long, env = "SWARM_PLAINTEXT", value_parser = FalseyValueParser::new())]
    plaintext: bool,
}

/// Why the options for tokens and TLS cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum AccessInputError {
    /// A token is not valid.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A certificate or key file is not valid.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// The two tokens are the same.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// Only one of the two tokens is given.
    #[error("there is a {present} token but no {absent} token; give both or none")]
    OneToken {
        /// The role whose token is given.
        present: &'static str,
        /// The role whose token is missing.
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

    /// When the certificates in these files expire.
    pub fn expiries(&self) -> Expiries {
        Expiries::from_files(self.tls_cert.as_deref(), self.tls_client_ca.as_deref())
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
