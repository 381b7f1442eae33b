//! What a worker or a client proves itself with, and whom it believes.

use std::path::{Path, PathBuf};

use clap::builder::FalseyValueParser;
use tonic::transport::Certificate;

use crate::{Identity, PemError, Token, TokenError, certificates};

/// What a worker or a client proves itself with, and whom it believes.
#[derive(Debug, Clone, Default)]
pub struct Credentials {
    /// Sent with every call.
    pub token: Option<Token>,
    /// Authorities one of which must have signed the coordinator's certificate.
    pub authorities: Option<Certificate>,
    /// Shown to a coordinator that asks for it.
    pub identity: Option<Identity>,
    /// The name in the coordinator's certificate, if it is not the address's.
    pub domain: Option<String>,
    /// Whether a token may travel unencrypted.
    pub plaintext: bool,
}

/// Why credentials are of no use.
#[derive(Debug, thiserror::Error)]
pub enum CredentialError {
    /// The token.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A certificate or key.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// Half an identity.
    #[error(
        "a certificate and its key go together: give both --tls-cert and --tls-key, or neither"
    )]
    HalfIdentity,
}

/// The options that a worker and a client have in common.
#[derive(Debug, Clone, Default, PartialEq, Eq, clap::Args)]
pub struct CredentialArgs {
    /// PEM file of the authorities that the coordinator's certificate is checked
    /// against; needed for https:// addresses.
    #[arg(long, global = true, value_name = "FILE", env = "SWARM_TLS_CA", hide_env_values = true)]
    pub tls_ca: Option<PathBuf>,
    /// PEM file of this program's certificate, for a coordinator that asks for one.
    #[arg(
        long,
        global = true,
        value_name = "FILE",
        env = "SWARM_TLS_CERT",
        hide_env_values = true
    )]
    pub tls_cert: Option<PathBuf>,
    /// PEM file of that certificate's private key.
    #[arg(long, global = true, value_name = "FILE", env = "SWARM_TLS_KEY", hide_env_values = true)]
    pub tls_key: Option<PathBuf>,
    /// Name in the coordinator's certificate [default: the host of its address]
    #[arg(
        long,
        global = true,
        value_name = "NAME",
        env = "SWARM_TLS_DOMAIN",
        hide_env_values = true
    )]
    pub tls_domain: Option<String>,
    /// Send the token unencrypted to another machine: every member of that network
    /// is trusted.
    #[arg(
        long,
        global = true,
        env = "SWARM_PLAINTEXT",
        hide_env_values = true,
        value_parser = FalseyValueParser::new()
    )]
    pub plaintext: bool,
}

impl CredentialArgs {
    /// Reads all files. The token is in a file or in an environment variable.
    pub fn load(
        &self,
        token_file: Option<&Path>,
        token_variable: &'static str,
    ) -> Result<Credentials, CredentialError> {
        let identity = match (&self.tls_cert, &self.tls_key) {
            (Some(certificate), Some(key)) => Some(Identity::read(certificate, key)?),
            (None, None) => None,
            _ => return Err(CredentialError::HalfIdentity),
        };
        Ok(Credentials {
            token: Token::load(token_file, token_variable)?,
            authorities: self.tls_ca.as_deref().map(certificates).transpose()?,
            identity,
            domain: self.tls_domain.clone(),
            plaintext: self.plaintext,
        })
    }
}
