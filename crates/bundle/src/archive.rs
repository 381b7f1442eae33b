//! The archive: a bundle to bytes and back. What is read may be anything.

use std::io::{Cursor, Read as _, Write as _};

use serde::Deserialize;
use sha2::{Digest as _, Sha256};
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter, write::SimpleFileOptions};

use super::{
    Bundle, BundleError, FORMAT,
    description::{self, DESCRIPTION},
    directory, files,
};

/// Most bytes of a bundle.
pub const LEN_MAX: u64 = 192 << 20;

/// Most bytes of what is in it.
pub const UNPACKED_LEN_MAX: u64 = 256 << 20;

/// A file of a bundle.
#[derive(Debug, Clone)]
pub struct File {
    /// Its name.
    pub name: &'static str,
    /// What it is, for people.
    pub about: &'static str,
    /// Its media type.
    pub encoding: &'static str,
    /// Most bytes of it.
    pub len_max: u64,
    /// Its content.
    pub content: Vec<u8>,
}

impl File {
    /// SHA-256 of its content, hexadecimal.
    pub fn sha256(&self) -> String {
        Sha256::digest(&self.content).iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Bundle {
    /// As bytes; the same ones at every call.
    pub fn to_bytes(&self) -> Result<Vec<u8>, BundleError> {
        let files = self.to_files();
        let description = description::describe(self, &files);
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
        put(DESCRIPTION, description.as_bytes()).map_err(unwritable)?;
        let mut n_bytes = description.len() as u64;
        for file in &files {
            n_bytes += file.content.len() as u64;
            put(file.name, &file.content).map_err(unwritable)?;
        }
        if n_bytes > UNPACKED_LEN_MAX {
            return Err(BundleError::UnpackedTooLong);
        }
        let bytes = archive.finish().map_err(unwritable)?.into_inner();
        check_len(bytes.len() as u64)?;
        Ok(bytes)
    }

    /// Takes a bundle apart. Nothing in it has been proven yet, but that the files are those
    /// that it describes.
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

/// That a length is one of a bundle.
fn check_len(len: u64) -> Result<(), BundleError> {
    if len > LEN_MAX { Err(BundleError::TooLong { len }) } else { Ok(()) }
}

/// All files by their names. `room`: most bytes of them all together.
pub fn unpack(bytes: &[u8], mut room: u64) -> Result<Vec<(String, Vec<u8>)>, BundleError> {
    let damaged = |error: &dyn std::fmt::Display| BundleError::Archive(error.to_string());
    let n_entries = directory::check(bytes).map_err(|what| damaged(&what))?;
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    // Of several files of a name the library takes the last, and other programs another.
    if n_entries != archive.len() {
        return Err(damaged(&"a file is in it twice"));
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
        // What the archive says of its length may be a lie; if it is none, nothing grows.
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
            return Err(damaged(&format!("`{file}` has {len} bytes, and not {stated}")));
        }
        contents.push((name, content));
    }
    Ok(contents)
}

/// That the manifest is of a version that this program can check, which its other files may
/// not be like.
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

/// Foreign text in one short line.
pub fn printable(text: &str) -> String {
    text.chars().take(200).flat_map(char::escape_debug).collect()
}
