//! The program that may write to a database, as its lock file names it.

use std::{
    fmt,
    fs::File,
    io::{Read as _, Seek as _, SeekFrom},
};

use crate::text::printable;

/// Longest text in a lock file, bytes.
const HOLDER_LEN_MAX: u64 = 512;

/// The program that may write to a database.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// Its process id, if known.
    pub process: Option<u32>,
    /// Its address for clients, if it is a coordinator.
    pub address: Option<String>,
}

impl Holder {
    /// Reads the holder from a lock file.
    pub(super) fn named(file: &File) -> Self {
        let mut text = String::new();
        let mut file = file;
        // An unreadable file names no holder.
        let _ = file.seek(SeekFrom::Start(0));
        let _ = file.take(HOLDER_LEN_MAX).read_to_string(&mut text);
        let mut lines = text.lines();
        Self {
            process: lines.next().and_then(|line| line.parse().ok()),
            address: lines.next().filter(|line| !line.is_empty()).map(printable),
        }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.address, self.process) {
            (Some(address), _) => write!(f, "the coordinator at {address}"),
            (None, Some(process)) => write!(f, "process {process}"),
            (None, None) => f.write_str("another program"),
        }
    }
}
