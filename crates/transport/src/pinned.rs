//! TLS to a peer with a known certificate: the caller's own.

use std::sync::Arc;

use rustls::{
    ClientConfig, DigitallySignedStruct, Error, SignatureScheme,
    client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
    crypto::{CryptoProvider, ring, verify_tls12_signature, verify_tls13_signature},
    pki_types::{
        CertificateDer, PrivateKeyDer, ServerName, UnixTime,
        pem::{self, PemObject as _},
    },
};

use crate::Identity;

/// Why the configuration cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PinError {
    /// A PEM file is damaged.
    #[error("damaged PEM: {0}")]
    Pem(#[from] pem::Error),
    /// The certificate or the key is invalid, or they do not belong together.
    #[error(transparent)]
    Tls(#[from] Error),
}

/// The client's configuration for a server with exactly this identity; name, authority and expiry
/// do not matter. If the server requires a certificate, the client shows the same one.
///
/// # Errors
///
/// If the identity is damaged, or its parts do not belong together.
pub fn pinned(identity: &Identity) -> Result<ClientConfig, PinError> {
    let chain: Vec<_> =
        CertificateDer::pem_slice_iter(identity.chain()).collect::<Result<_, _>>()?;
    let key = PrivateKeyDer::from_pem_slice(identity.key())?;
    let provider = Arc::new(ring::default_provider());
    let expected = chain.first().cloned().ok_or(pem::Error::NoItemsFound)?;
    let pin = Arc::new(Pin { expected, provider: Arc::clone(&provider) });
    let mut config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()?
        .dangerous()
        .with_custom_certificate_verifier(pin)
        .with_client_auth_cert(chain, key)?;
    config.alpn_protocols = vec![b"h2".to_vec()];
    Ok(config)
}

/// Accepts exactly one certificate.
#[derive(Debug)]
struct Pin {
    expected: CertificateDer<'static>,
    provider: Arc<CryptoProvider>,
}

impl ServerCertVerifier for Pin {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        if *certificate == self.expected {
            Ok(ServerCertVerified::assertion())
        } else {
            Err(Error::General("the server shows another certificate".to_owned()))
        }
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let algorithms = &self.provider.signature_verification_algorithms;
        verify_tls12_signature(message, certificate, signature, algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let algorithms = &self.provider.signature_verification_algorithms;
        verify_tls13_signature(message, certificate, signature, algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider.signature_verification_algorithms.supported_schemes()
    }
}
