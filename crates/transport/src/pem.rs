//! Certificates and keys, from PEM files.

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

/// Why a file is of no use.
#[derive(Debug, thiserror::Error)]
pub enum PemError {
    /// It cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It holds something else.
    #[error("{} holds no {what} in PEM form", path.display())]
    Absent {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        what: &'static str,
    },
}

impl Identity {
    /// Reads a certificate chain and its key.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, PemError> {
        let chain = read(certificate, "CERTIFICATE-----", "certificate")?;
        let key = read(key, "PRIVATE KEY-----", "private key")?;
        Ok(Self { chain, key })
    }

    /// As the transport wants it.
    pub fn to_tonic(&self) -> transport::Identity {
        transport::Identity::from_pem(&self.chain, &self.key)
    }

    /// The certificate and those between it and its authority, in PEM form.
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
pub fn certificates(path: &Path) -> Result<transport::Certificate, PemError> {
    read(path, "CERTIFICATE-----", "certificate").map(transport::Certificate::from_pem)
}

/// Reads a file that has a section of the given label. The transport would take
/// a file without any for an empty list.
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
    fn a_file_without_what_it_should_hold_is_named() {
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
