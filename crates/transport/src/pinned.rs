//! TLS to a peer whose certificate is known beforehand: one's own.

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

/// Why there is no such side of TLS.
#[derive(Debug, thiserror::Error)]
pub enum PinError {
    /// Something in a PEM file is damaged.
    #[error("damaged PEM: {0}")]
    Pem(#[from] pem::Error),
    /// The certificate and the key cannot be used, or not together.
    #[error(transparent)]
    Tls(#[from] Error),
}

/// The client's side of a connection to the server that has this very identity,
/// under whatever name, from whatever authority and whether or not it has expired.
/// Asked for a certificate, it shows the same one.
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

/// Believes one certificate.
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
            Err(Error::General("it shows another certificate".to_owned()))
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
