//! Warns of certificates of this program before they expire.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use rustls::pki_types::{CertificateDer, pem::PemObject as _};
use tokio::time::sleep;
use tracing::warn;
use x509_parser::parse_x509_certificate;

use crate::tls_diagnosis::date;

/// Warnings begin this long before a certificate expires.
const NOTICE: Duration = Duration::from_hours(14 * 24);
/// Time between two checks.
const INTERVAL: Duration = Duration::from_hours(24);

/// The expiry dates of the certificates in a program's files.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Expiries(Vec<Expiry>);

/// The expiry date of the certificates in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expiry {
    path: PathBuf,
    /// The last second in which the certificate is valid, since 1970.
    at: u64,
}

impl Expiries {
    /// The expiry dates of a certificate chain and of authorities. A chain expires with its first
    /// certificate, authorities with their last one. Ignores unreadable files, which other code
    /// reports.
    pub fn from_files(chain: Option<&Path>, authorities: Option<&Path>) -> Self {
        let chain = chain.and_then(|path| Some((path, ends(path).into_iter().min()?)));
        let authorities = authorities.and_then(|path| Some((path, ends(path).into_iter().max()?)));
        let found = chain.into_iter().chain(authorities);
        Self(found.map(|(path, at)| Expiry { path: path.to_owned(), at }).collect())
    }

    /// The files whose certificates have expired at this time, or will expire soon.
    pub fn near(&self, now: SystemTime) -> impl Iterator<Item = &Expiry> {
        let soon = seconds(now + NOTICE);
        self.0.iter().filter(move |expiry| expiry.at < soon)
    }

    /// Logs certificates that will expire soon, now and every day.
    pub async fn watch(self, clock: impl Fn() -> SystemTime) {
        while !self.0.is_empty() {
            let now = clock();
            for expiry in self.near(now) {
                warn!("{}", expiry.text(now));
            }
            sleep(INTERVAL).await;
        }
    }
}

impl Expiry {
    /// The warning at this time.
    pub fn text(&self, now: SystemTime) -> String {
        let (path, at) = (self.path.display(), date(self.at));
        let now = seconds(now);
        if self.at < now {
            return format!(
                "the certificate in {path} expired on {at}: connections are refused; make another \
                 one, as docs/security.md says"
            );
        }
        let left = match (self.at - now) / (24 * 60 * 60) {
            0 => "in less than a day".to_owned(),
            1 => "in one day".to_owned(),
            days => format!("in {days} days"),
        };
        format!(
            "the certificate in {path} expires on {at}, {left}; make another one, as \
             docs/security.md says, and start the programs that use it again"
        )
    }
}

fn seconds(at: SystemTime) -> u64 {
    at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// The ends of all certificates in a PEM file, in seconds since 1970.
fn ends(path: &Path) -> Vec<u64> {
    let pem = fs::read(path).unwrap_or_default();
    let certificates = CertificateDer::pem_slice_iter(&pem).filter_map(Result::ok);
    let end = |der: CertificateDer<'_>| {
        let (_, certificate) = parse_x509_certificate(&der).ok()?;
        u64::try_from(certificate.validity().not_after.timestamp()).ok()
    };
    certificates.filter_map(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rcgen::{CertificateParams, KeyPair, date_time_ymd};

    /// 2026-03-15, 12:00 UTC.
    const NOW: u64 = 1_773_576_000;

    fn at(seconds: u64) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)
    }

    /// A file with certificates that end at the beginning of these days of 2026.
    fn file(directory: &Path, name: &str, ends: &[(u8, u8)]) -> PathBuf {
        let mut pem = String::new();
        for &(month, day) in ends {
            let mut params = CertificateParams::new(["localhost".to_owned()]).unwrap();
            params.not_before = date_time_ymd(2025, 1, 1);
            params.not_after = date_time_ymd(2026, month, day);
            let key = KeyPair::generate().unwrap();
            pem += &params.self_signed(&key).unwrap().pem();
        }
        let path = directory.join(name);
        fs::write(&path, pem).unwrap();
        path
    }

    fn texts(expiries: &Expiries) -> Vec<String> {
        expiries.near(at(NOW)).map(|expiry| expiry.text(at(NOW))).collect()
    }

    #[test]
    fn a_certificate_is_reported_in_its_last_two_weeks() {
        let directory = tempfile::tempdir().unwrap();
        let said = |month, day| {
            let path = file(directory.path(), "own.pem", &[(month, day)]);
            texts(&Expiries::from_files(Some(&path), None)).join("\n")
        };
        assert_eq!(said(3, 30), "");
        assert!(said(3, 29).contains("own.pem expires on 2026-03-29T00:00:00Z, in 13 days; "));
        assert!(said(3, 17).contains(", in one day; "), "{}", said(3, 17));
        assert!(said(3, 16).contains(", in less than a day; "));
        assert!(said(3, 1).contains("own.pem expired on 2026-03-01T00:00:00Z: "));
    }

    #[test]
    fn a_chain_expires_with_its_first_certificate_and_authorities_with_their_last() {
        let directory = tempfile::tempdir().unwrap();
        let path = file(directory.path(), "both.pem", &[(3, 20), (9, 1)]);
        assert_eq!(texts(&Expiries::from_files(Some(&path), None)).len(), 1);
        assert_eq!(texts(&Expiries::from_files(None, Some(&path))), [""; 0]);
        let path = file(directory.path(), "both.pem", &[(3, 20), (3, 21)]);
        let text = &texts(&Expiries::from_files(None, Some(&path)))[0];
        assert!(text.contains("2026-03-21T"), "{text}");
    }

    #[test]
    fn a_file_without_certificates_causes_no_warning() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("none.pem");
        assert_eq!(Expiries::from_files(Some(&path), Some(&path)), Expiries::default());
        fs::write(&path, "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n").unwrap();
        assert_eq!(Expiries::from_files(Some(&path), None), Expiries::default());
    }
}
