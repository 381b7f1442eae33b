//! Reading untrusted files, up to the size limit of their kind.

use std::{
    fs::File,
    io::{self, ErrorKind, Read},
    path::Path,
};

/// Size limit of a file with a genotype, such as a champion file, bytes: more than a million
/// genes.
pub const GENOTYPE_BYTES: usize = 32 << 20;
/// Size limit of a table of generations, bytes.
pub const TABLE_BYTES: usize = 256 << 20;
/// Size limit of the settings, bytes.
pub const SETTINGS_BYTES: usize = 64 << 10;

/// The text of a file, up to a size limit in bytes; `-` is standard input.
pub fn read_text(path: &Path, max_bytes: usize) -> io::Result<String> {
    let mut bytes = Vec::new();
    let file: Box<dyn Read> =
        if is_stdin(path) { Box::new(io::stdin()) } else { Box::new(File::open(path)?) };
    file.take(max_bytes as u64 + 1).read_to_end(&mut bytes)?;
    let invalid = |what: String| io::Error::new(ErrorKind::InvalidData, what);
    if bytes.len() > max_bytes {
        return Err(invalid(format!("it has more than {} KiB", max_bytes / 1024)));
    }
    let mut text = String::from_utf8(bytes).map_err(|error| {
        invalid(format!("it is no text: byte {} is not UTF-8", error.utf8_error().valid_up_to()))
    })?;
    // Some editors begin a file with a byte order mark.
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

/// Whether a path stands for standard input.
pub fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_an_end_is_refused_once_it_is_too_long() {
        let endless = read_text("/dev/zero".as_ref(), 4096).unwrap_err();
        assert_eq!(endless.to_string(), "it has more than 4 KiB");
        let directory = tempfile::tempdir().unwrap();
        let marked = directory.path().join("marked");
        std::fs::write(&marked, "\u{feff}{}").unwrap();
        assert_eq!(read_text(&marked, 4096).unwrap(), "{}");
        let missing = read_text("/nowhere/at/all".as_ref(), 4096).unwrap_err();
        assert_eq!(missing.kind(), ErrorKind::NotFound);
    }
}
