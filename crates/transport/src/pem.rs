//! Reads certificates and keys from PEM files.

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
};

use tonic::transport;

/// A certificate chain and its private key. `Debug` does not show it.
#[derive(Clone)]
pub struct Identity {
    chain: Vec<u8>,
    key: Vec<u8>,
}

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PemError {
    /// It cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It lacks the required section.
    #[error("{} holds no {what} in PEM form", path.display())]
    Absent {
        /// The file.
        path: PathBuf,
        /// The required section.
        what: &'static str,
    },
}

impl Identity {
    /// Reads a certificate chain and its key.
    ///
    /// # Errors
    ///
    /// If a file cannot be read, or lacks its section.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, PemError> {
        let chain = read(certificate, "CERTIFICATE-----", "certificate")?;
        let key = read(key, "PRIVATE KEY-----", "private key")?;
        Ok(Self { chain, key })
    }

    /// The identity for tonic.
    pub fn to_tonic(&self) -> transport::Identity {
        transport::Identity::from_pem(&self.chain, &self.key)
    }

    /// The certificate and its intermediate certificates, in PEM form.
    pub(crate) fn chain(&self) -> &[u8] {
        &self.chain
    }

    /// Its private key, in PEM form.
    pub(crate) fn key(&self) -> &[u8] {
        &self.key
    }
}

impl fmt::Debug for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Identity(..)")
    }
}

/// Reads the certificates of authorities.
///
/// # Errors
///
/// If the file cannot be read, or has no certificate.
pub fn certificates(path: &Path) -> Result<transport::Certificate, PemError> {
    read(path, "CERTIFICATE-----", "certificate").map(transport::Certificate::from_pem)
}

/// Reads a file that must have a section of the given label. The transport would silently read a
/// file without one as an empty list.
fn read(path: &Path, label: &str, what: &'static str) -> Result<Vec<u8>, PemError> {
    let bytes =
        fs::read(path).map_err(|source| PemError::File { path: path.to_owned(), source })?;
    let has_section = String::from_utf8_lossy(&bytes)
        .lines()
        .any(|line| line.starts_with("-----BEGIN ") && line.trim_end().ends_with(label));
    if !has_section {
        return Err(PemError::Absent { path: path.to_owned(), what });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_lacks_its_section_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.pem");
        fs::write(&path, "-----BEGIN PRIVATE KEY-----\n").unwrap();
        let error = certificates(&path).unwrap_err().to_string();
        assert!(error.contains("a.pem") && error.contains("no certificate"), "{error}");
        let error = certificates(&directory.path().join("b.pem")).unwrap_err().to_string();
        assert!(error.contains("b.pem"), "{error}");
        fs::write(&path, "-----BEGIN CERTIFICATE-----\n").unwrap();
        assert!(certificates(&path).is_ok());
        let error = Identity::read(&path, &path).unwrap_err().to_string();
        assert!(error.contains("no private key"), "{error}");
    }
}
