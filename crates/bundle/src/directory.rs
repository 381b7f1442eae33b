//! Checks the directory at the end of a ZIP archive before a library reads the archive.
//!
//! The library allocates hundreds of bytes per entry, trusts the number of entries in the archive,
//! and searches backwards for another directory if the last directory is invalid. So this module
//! accepts only archives with a single short, valid directory.

use std::io::Cursor;

use zip::ZipArchive;

/// Length of the last record of an archive without a comment, bytes.
const RECORD_LEN: usize = 22;

/// The first bytes of that record.
const RECORD_MARK: &[u8] = b"PK\x05\x06";

/// Largest size of a directory, bytes. The directory of a bundle has some 600.
const LEN_MAX: usize = 16 << 10;

/// Checks an archive, and returns its number of entries.
///
/// # Errors
///
/// If the library could need much memory to read the archive.
pub fn check(bytes: &[u8]) -> Result<usize, String> {
    let no_record = "the last record of an archive is not at its end";
    let (ahead, record) = bytes.split_last_chunk::<RECORD_LEN>().ok_or(no_record)?;
    if !record.starts_with(RECORD_MARK) {
        return Err(format!("{no_record}, or something follows it"));
    }
    let u16_at = |at: usize| usize::from(u16::from_le_bytes([record[at], record[at + 1]]));
    let u32_at = |at: usize| u16_at(at) + (u16_at(at + 2) << 16);
    let (n_entries, len, start) = (u16_at(10), u32_at(12), u32_at(16));
    if len > LEN_MAX {
        return Err(format!("its directory has {len} bytes, the limit is {LEN_MAX}"));
    }
    if start + len != ahead.len() {
        return Err("its last record points to a place without a directory".to_owned());
    }
    let mut alone = bytes[start..].to_vec();
    let marks = alone.windows(RECORD_MARK.len()).filter(|bytes| *bytes == RECORD_MARK);
    if marks.count() != 1 {
        return Err("it has several last records".to_owned());
    }
    // The directory begins here, and the last record has to point to it.
    let at = len + 16;
    alone[at..at + 4].fill(0);
    let archive = ZipArchive::new(Cursor::new(alone)).map_err(|error| error.to_string())?;
    if archive.len() > n_entries {
        return Err("its last record counts too few files".to_owned());
    }
    Ok(n_entries)
}
