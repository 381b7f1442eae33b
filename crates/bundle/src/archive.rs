//! The archive: writes a bundle as bytes, and reads one back. The input may be hostile.

use std::io::{Cursor, Read as _, Write as _};

use serde::Deserialize;
use sha2::{Digest as _, Sha256};
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter, write::SimpleFileOptions};

use super::{
    Bundle, BundleError, FORMAT,
    description::{self, DESCRIPTION},
    directory, files,
};

/// Largest size of a bundle, bytes.
pub const LEN_MAX: u64 = 192 << 20;

/// Largest size of its unpacked files together, bytes.
pub const UNPACKED_LEN_MAX: u64 = 256 << 20;

/// A file of a bundle.
#[derive(Debug, Clone)]
pub struct File {
    /// Its name.
    pub name: &'static str,
    /// Its description, for people.
    pub about: &'static str,
    /// Its media type.
    pub encoding: &'static str,
    /// Its largest size, bytes.
    pub len_max: u64,
    /// Its content.
    pub content: Vec<u8>,
}

impl File {
    /// SHA-256 of its content, hexadecimal.
    pub fn sha256(&self) -> String {
        sha256(&self.content)
    }
}

/// SHA-256 of a file, hexadecimal.
pub fn sha256(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Bundle {
    /// The bundle as a ZIP archive; every call returns the same bytes.
    ///
    /// # Errors
    ///
    /// If the bundle exceeds a limit of [`read`](Self::read).
    pub fn to_bytes(&self) -> Result<Vec<u8>, BundleError> {
        let files = self.to_files();
        let description = description::describe(self, &files);
        let described = (DESCRIPTION, description.as_bytes());
        let contents = files.iter().map(|file| (file.name, &*file.content));
        let contents = std::iter::once(described).chain(contents);
        if contents.clone().map(|(_, content)| content.len() as u64).sum::<u64>() > UNPACKED_LEN_MAX
        {
            return Err(BundleError::UnpackedTooLong);
        }
        let bytes = pack(contents)?;
        check_len(bytes.len() as u64)?;
        Ok(bytes)
    }

    /// Reads a bundle. Reading proves only that the files have the digests in the bundle's
    /// description.
    ///
    /// # Errors
    ///
    /// If the bytes are not a bundle, exceed a limit, or have the format of another version.
    pub fn read(bytes: &[u8]) -> Result<Self, BundleError> {
        check_len(bytes.len() as u64)?;
        let mut contents = unpack(bytes, UNPACKED_LEN_MAX)?;
        let mut take = |name: &'static str| {
            let place = contents.iter().position(|(found, _)| found == name);
            let place = place.ok_or(BundleError::MissingFile(name))?;
            Ok(contents.swap_remove(place).1)
        };
        let description = take(DESCRIPTION)?;
        let mut files = files::all();
        for file in &mut files {
            file.content = take(file.name)?;
        }
        if let Some((extra, _)) = contents.first() {
            return Err(BundleError::ExtraFile(printable(extra)));
        }
        check_version(&files[0])?;
        description::check(&description, &files)?;
        Self::from_files(files)
    }
}

/// Files as a ZIP archive; the same files always become the same bytes.
///
/// # Errors
///
/// If there is a name twice.
pub fn pack<'a>(
    files: impl IntoIterator<Item = (&'a str, &'a [u8])>,
) -> Result<Vec<u8>, BundleError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let mut put = |name: &str, content: &[u8]| {
        archive.start_file(name, options)?;
        archive.write_all(content)?;
        Ok::<_, zip::result::ZipError>(())
    };
    let unwritable = |error: zip::result::ZipError| BundleError::Archive(error.to_string());
    for (name, content) in files {
        put(name, content).map_err(unwritable)?;
    }
    Ok(archive.finish().map_err(unwritable)?.into_inner())
}

/// Checks the length of a bundle.
fn check_len(len: u64) -> Result<(), BundleError> {
    if len > LEN_MAX { Err(BundleError::TooLong { len }) } else { Ok(()) }
}

/// Unpacks all files, each with its name. `room`: largest size of all files together, bytes.
///
/// # Errors
///
/// If the bytes are not a ZIP archive, if a file occurs twice, or if the files exceed `room`.
pub fn unpack(bytes: &[u8], mut room: u64) -> Result<Vec<(String, Vec<u8>)>, BundleError> {
    let damaged = |error: &dyn std::fmt::Display| BundleError::Archive(error.to_string());
    let n_entries = directory::check(bytes).map_err(|what| damaged(&what))?;
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    // If several files have the same name, the library takes the last one, and other programs take
    // another.
    if n_entries != archive.len() {
        return Err(damaged(&"it contains a file twice"));
    }
    let description = (DESCRIPTION, description::LEN_MAX);
    let known: Vec<(&str, u64)> =
        files::all().iter().map(|file| (file.name, file.len_max)).chain([description]).collect();
    let mut contents: Vec<(String, Vec<u8>)> = Vec::new();
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|error| damaged(&error))?;
        let name = entry.name().map_err(|error| damaged(&error))?.into_owned();
        let Some(&(file, len_max)) = known.iter().find(|(known, _)| *known == name) else {
            return Err(BundleError::ExtraFile(printable(&name)));
        };
        // The stated length may be wrong; if it is right, the buffer never grows.
        let most = room.min(len_max);
        let stated = entry.size();
        let mut content = Vec::with_capacity(stated.min(most) as usize);
        entry.take(most + 1).read_to_end(&mut content).map_err(|error| damaged(&error))?;
        let len = content.len() as u64;
        if len > len_max {
            return Err(BundleError::FileTooLong { file, len_max });
        }
        room = room.checked_sub(len).ok_or(BundleError::UnpackedTooLong)?;
        if len != stated {
            return Err(damaged(&format!("`{file}` has {len} bytes, not {stated}")));
        }
        contents.push((name, content));
    }
    Ok(contents)
}

/// Checks that this program can read the manifest's version, before it reads the other files.
fn check_version(manifest: &File) -> Result<(), BundleError> {
    #[derive(Deserialize)]
    struct Versions {
        format: u32,
        program: String,
        simulation: String,
    }
    let Versions { format, program, simulation } = serde_json::from_slice(&manifest.content)
        .map_err(|error| BundleError::malformed(manifest.name, &error))?;
    let (program, simulation) = (printable(&program), printable(&simulation));
    if format != FORMAT {
        return Err(BundleError::Format { found: format, program });
    }
    if simulation != sim_core::FINGERPRINT {
        return Err(BundleError::Simulation { simulation, program });
    }
    Ok(())
}

/// Text from a stranger as one short line.
pub fn printable(text: &str) -> String {
    text.chars().take(200).flat_map(char::escape_debug).collect()
}
