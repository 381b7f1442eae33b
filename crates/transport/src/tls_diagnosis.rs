//! Explains connections that fail because of TLS, or without it.

use std::{error::Error, io};

use rustls::{AlertDescription, CertificateError, Error as TlsError};
use time::{OffsetDateTime, format_description::well_known::Rfc3339};
use tonic::{ConnectError, TimeoutExpired};

/// The cause and the next step, if an error comes from TLS.
pub fn tls_diagnosis(error: &(dyn Error + 'static)) -> Option<String> {
    let mut next = Some(error);
    while let Some(error) = next {
        // An io::Error displays the error that it wraps, but does not return it as its source.
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

/// Whether a connection was made and broke. There is no other sign if only one side speaks TLS,
/// or if the coordinator does not accept the certificate.
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

/// Formats seconds since 1970 as day and time for people.
pub(crate) fn date(seconds: u64) -> String {
    let seconds = i64::try_from(seconds).unwrap_or(i64::MAX);
    let known = OffsetDateTime::from_unix_timestamp(seconds).ok();
    let text = known.and_then(|at| at.format(&Rfc3339).ok());
    text.unwrap_or_else(|| format!("second {seconds} since 1970"))
}

fn explain(error: &TlsError) -> String {
    match error {
        // `BadSignature`: an authority of the same name has another key.
        TlsError::InvalidCertificate(
            CertificateError::UnknownIssuer | CertificateError::BadSignature,
        ) => "its certificate was signed by none of the authorities in --tls-ca".into(),
        TlsError::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
        ) => "its certificate is for another name; pass that with --tls-domain".into(),
        TlsError::InvalidCertificate(CertificateError::ExpiredContext { not_after, .. }) => {
            format!(
                "its certificate expired on {}; its operator needs to make a new one \
                 (docs/security.md), unless the clock of this machine is wrong",
                date(not_after.as_secs())
            )
        }
        TlsError::InvalidCertificate(CertificateError::NotValidYetContext {
            not_before, ..
        }) => format!(
            "its certificate is valid from {} on; is the clock of this machine right?",
            date(not_before.as_secs())
        ),
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rustls::pki_types::UnixTime;

    use super::*;

    #[test]
    fn an_expired_certificate_says_since_when() {
        let at = |seconds| UnixTime::since_unix_epoch(Duration::from_secs(seconds));
        let expired = CertificateError::ExpiredContext {
            time: at(1_764_057_600),
            not_after: at(1_735_689_600),
        };
        let text = tls_diagnosis(&TlsError::InvalidCertificate(expired)).unwrap();
        assert!(text.contains("expired on 2025-01-01T00:00:00Z;"), "{text}");
        let early = CertificateError::NotValidYetContext {
            time: at(1_735_689_600),
            not_before: at(1_764_057_600),
        };
        let text = tls_diagnosis(&TlsError::InvalidCertificate(early)).unwrap();
        assert!(text.contains("valid from 2025-11-25T08:00:00Z on"), "{text}");
    }
}
