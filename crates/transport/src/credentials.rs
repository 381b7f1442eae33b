//! Credentials of a worker or client, and the authorities that it trusts.

use std::path::{Path, PathBuf};

use clap::builder::FalseyValueParser;
use tonic::transport::Certificate;

use crate::{Expiries, Identity, PemError, Token, TokenError, certificates};

/// Credentials of a worker or client, and the authorities that it trusts.
#[derive(Debug, Clone, Default)]
pub struct Credentials {
    /// Sent with every call.
    pub token: Option<Token>,
    /// Authorities; one of them must have signed the coordinator's certificate.
    pub authorities: Option<Certificate>,
    /// Client certificate, for a coordinator that requires one.
    pub identity: Option<Identity>,
    /// The name in the coordinator's certificate, if it differs from the address's host.
    pub domain: Option<String>,
    /// Whether the token may be sent unencrypted.
    pub plaintext: bool,
}

/// Why credentials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CredentialError {
    /// The token is not valid.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A certificate or key file is not valid.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// A certificate without a key, or a key without a certificate.
    #[error(
        "a certificate and its key go together: give both --tls-cert and --tls-key, or neither"
    )]
    HalfIdentity,
}

/// The options that worker and client share.
#[derive(Debug, Clone, Default, PartialEq, Eq, clap::Args)]
pub struct CredentialArgs {
    /// PEM file of the authorities that the coordinator's certificate is checked
    /// against; needed for https:// addresses.
    #[arg(long, global = true, value_name = "FILE", env = "SWARM_TLS_CA", hide_env_values = true)]
    pub tls_ca: Option<PathBuf>,
    /// PEM file of this program's certificate, for a coordinator that requires one.
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
    /// Send the token unencrypted to another machine; use this only if every member of
    /// that network is trusted.
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
    /// When the certificates in these files expire.
    pub fn expiries(&self) -> Expiries {
        Expiries::from_files(self.tls_cert.as_deref(), self.tls_ca.as_deref())
    }

    /// Reads all files. The token comes from a file or from an environment variable.
    ///
    /// # Errors
    ///
    /// If a file cannot be read or is invalid, or if options conflict.
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
