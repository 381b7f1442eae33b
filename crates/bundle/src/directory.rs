//! The directory at the end of a ZIP archive, looked at before a library goes through it.
//!
//! A library makes hundreds of bytes of each entry, takes the number of entries from the archive,
//! and looks for another directory further ahead where it does not like the last one. So what it
//! is shown has one short directory, which it likes.

use std::io::Cursor;

use zip::ZipArchive;

/// Bytes of the last record of an archive without a comment.
const RECORD_LEN: usize = 22;

/// How it begins.
const RECORD_MARK: &[u8] = b"PK\x05\x06";

/// Most bytes of a directory; that of a bundle has some 600.
const LEN_MAX: usize = 16 << 10;

/// The number of entries of an archive that a library can go through in little memory.
pub fn check(bytes: &[u8]) -> Result<usize, String> {
    let no_record = "no record of an archive is at its end";
    let (ahead, record) = bytes.split_last_chunk::<RECORD_LEN>().ok_or(no_record)?;
    if !record.starts_with(RECORD_MARK) {
        return Err(format!("{no_record}, or something follows it"));
    }
    let u16_at = |at: usize| usize::from(u16::from_le_bytes([record[at], record[at + 1]]));
    let u32_at = |at: usize| u16_at(at) + (u16_at(at + 2) << 16);
    let (n_entries, len, start) = (u16_at(10), u32_at(12), u32_at(16));
    if len > LEN_MAX {
        return Err(format!(
            "its directory has {len} bytes, and that of a bundle at most {LEN_MAX}"
        ));
    }
    if start + len != ahead.len() {
        return Err("its directory is not where its last record says".to_owned());
    }
    let mut alone = bytes[start..].to_vec();
    let marks = alone.windows(RECORD_MARK.len()).filter(|bytes| *bytes == RECORD_MARK);
    if marks.count() != 1 {
        return Err("it has several last records".to_owned());
    }
    // It begins with the directory, and its record has to say so.
    let at = len + 16;
    alone[at..at + 4].fill(0);
    let archive = ZipArchive::new(Cursor::new(alone)).map_err(|error| error.to_string())?;
    if archive.len() > n_entries {
        return Err("its last record is not the one that counts".to_owned());
    }
    Ok(n_entries)
}
