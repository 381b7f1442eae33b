//! The server's configuration of TLS, for servers other than tonic's.

use std::sync::Arc;

use rustls::{
    ServerConfig,
    crypto::ring,
    pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject as _},
};

use crate::{Identity, PinError};

/// The configuration of a server with this identity that speaks HTTP/1.1 and requires no client
/// certificate.
pub fn server_tls(identity: &Identity) -> Result<ServerConfig, PinError> {
    let chain = CertificateDer::pem_slice_iter(identity.chain()).collect::<Result<_, _>>()?;
    let key = PrivateKeyDer::from_pem_slice(identity.key())?;
    let mut config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()?
        .with_no_client_auth()
        .with_single_cert(chain, key)?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(config)
}
