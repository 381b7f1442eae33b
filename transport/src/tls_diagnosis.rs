//! Explains connections that fail because of TLS, or of the lack of it.

use std::{error::Error, io};

use rustls::{AlertDescription, CertificateError, Error as TlsError};
use tonic::{ConnectError, TimeoutExpired};

/// If an error is one of TLS: what is wrong and what to do about it.
pub fn tls_diagnosis(error: &(dyn Error + 'static)) -> Option<String> {
    let mut next = Some(error);
    while let Some(error) = next {
        // An io::Error shows what it wraps, but not as its source.
        let wrapped = error
            .downcast_ref::<io::Error>()
            .and_then(io::Error::get_ref)
            .and_then(|inner| inner.downcast_ref::<TlsError>());
        if let Some(tls) = wrapped.or_else(|| error.downcast_ref()) {
            return Some(explain(tls));
        }
        next = error.source();
    }
    None
}

/// Whether a connection was made and broke, which is all that is seen of it when
/// one side speaks TLS and the other does not, or when the coordinator does not
/// accept the certificate.
pub(crate) fn is_break(error: &(dyn Error + 'static)) -> bool {
    let mut next = error.source();
    let has_cause = next.is_some();
    while let Some(error) = next {
        if error.is::<ConnectError>() || error.is::<TimeoutExpired>() {
            return false;
        }
        next = error.source();
    }
    has_cause
}

fn explain(error: &TlsError) -> String {
    match error {
        // The latter: by one of the same name and another key.
        TlsError::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => "its certificate was signed by none of the authorities in --tls-ca".into(),
        TlsError::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
        ) => "its certificate is for another name; pass that with --tls-domain".into(),
        TlsError::InvalidCertificate(problem) => format!("its certificate is not valid: {problem}"),
        TlsError::InvalidMessage(_) => "it does not speak TLS; use http://".into(),
        TlsError::AlertReceived(
            AlertDescription::CertificateRequired | AlertDescription::HandshakeFailure,
        ) => "it wants a client certificate; pass --tls-cert and --tls-key".into(),
        TlsError::AlertReceived(
            alert @ (AlertDescription::UnknownCA
            | AlertDescription::BadCertificate
            | AlertDescription::CertificateExpired
            | AlertDescription::CertificateUnknown
            | AlertDescription::DecryptError),
        ) => format!("it does not accept the client certificate of --tls-cert ({alert:?})"),
        other => format!("TLS: {other}"),
    }
}
