//! Files that commands write: whole or not at all, and replacing existing files only with
//! `--force`.

use std::{
    fs::{self, File, Metadata, Permissions},
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};

use clap::Args;
use model::store;
use tempfile::{Builder, NamedTempFile, TempDir};

use crate::{
    error::{Code, Error},
    interrupt::Unfinished,
};

/// The name of a file or directory until it is complete.
const UNFINISHED: &str = ".unfinished-";

/// Whether a command may replace existing files: one option of all commands that write files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Args)]
pub struct Overwrite {
    /// Replace an existing file or directory, instead of refusing to.
    #[arg(long)]
    pub force: bool,
}

impl Overwrite {
    /// Replaces files that the program itself has written.
    pub const OWN: Self = Self { force: true };

    /// Refuses a file that may not be replaced, or whose directory is missing, before a long
    /// computation.
    pub fn check(self, path: &Path) -> Result<(), Error> {
        match parent(path) {
            parent if parent.is_dir() => self.may_replace(path),
            parent => {
                let missing = format!("there is no directory {}", parent.display());
                Err(unwritable(path, &io::Error::other(missing)))
            }
        }
    }

    fn may_replace(self, path: &Path) -> Result<(), Error> {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => {
                Err(unwritable(path, &io::Error::other("it is a directory; name a file")))
            }
            Ok(found) if found.is_file() && !self.force => Err(exists(path)),
            _ => Ok(()),
        }
    }

    /// Begins a file, which appears only when finished.
    pub fn begin(self, path: &Path) -> Result<OutputFile, Error> {
        self.check(path)?;
        let failed = |error: io::Error| unwritable(path, &error);
        let found = fs::metadata(path).ok();
        let target = match &found {
            // A device or a pipe is written directly: it has no neighbouring file, and holds
            // no data to lose.
            Some(found) if !found.is_file() => {
                Target::Stream(File::options().write(true).open(path).map_err(failed)?)
            }
            _ => {
                // Replaces the target of a link, not the link.
                let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
                let (file, unfinished) =
                    Unfinished::make(|| unfinished(&place, found.as_ref()), |file| file.path())
                        .map_err(failed)?;
                Target::Beside { file, place, unfinished }
            }
        };
        Ok(OutputFile { path: path.to_owned(), target, overwrite: self })
    }

    /// Writes a file.
    pub fn write(self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        let mut file = self.begin(path)?;
        file.write_all(bytes).map_err(|error| unwritable(path, &error))?;
        file.finish()
    }

    /// Like [`Self::check`], for files of these names in a directory.
    pub fn check_files(self, to: &Path, names: &[&str]) -> Result<(), Error> {
        if fs::metadata(to).is_ok_and(|found| !found.is_dir()) {
            return Err(unwritable(to, &io::Error::other("it is a file; name a directory")));
        }
        names.iter().try_for_each(|name| self.may_replace(&to.join(name)))
    }

    /// Begins files of a directory, which appear in it only when all are finished.
    pub fn begin_files(self, to: &Path, names: &[&str]) -> Result<OutputFiles, Error> {
        self.check_files(to, names)?;
        let failed = |error: io::Error| unwritable(to, &error);
        let parent = if to.is_dir() { to } else { parent(to) };
        let unfinished = fs::create_dir_all(parent).and_then(|()| unfinished_directory(parent));
        let (directory, unfinished) = unfinished.map_err(failed)?;
        Ok(OutputFiles { to: to.to_owned(), directory, overwrite: self, _unfinished: unfinished })
    }

    /// Makes a data directory. With `--force`, it replaces an existing one that no program uses.
    pub fn data_directory<T>(
        self,
        from: &Path,
        to: &Path,
        make: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        if !self.force || !store::is_in(to) {
            return make(to);
        }
        let failed = |error: io::Error| unwritable(to, &error);
        let is_same = fs::canonicalize(from).ok() == fs::canonicalize(to).ok();
        if is_same {
            return Err(failed(io::Error::other("it is the directory that the command reads")));
        }
        if let Some(holder) = store::holder(to) {
            return Err(failed(io::Error::other(format!("{holder} uses it"))));
        }
        let (aside, unfinished) = unfinished_directory(parent(to)).map_err(failed)?;
        let [new, old] = ["new", "old"].map(|name| aside.path().join(name));
        let made = make(&new)?;
        // From here on, `aside` may have the only copy of the replaced directory, so a signal must
        // not remove it.
        drop(unfinished);
        if store::is_in(&new) {
            fs::rename(to, &old).map_err(failed)?;
            if let Err(error) = fs::rename(&new, to) {
                let Err(back) = fs::rename(&old, to) else { return Err(failed(error)) };
                // Otherwise the earlier directory would be removed with `aside`.
                let kept = aside.keep().join("old");
                let what = format!("{back}; the earlier directory is in {}", kept.display());
                return Err(failed(io::Error::other(what)));
            }
        }
        Ok(made)
    }
}

/// A file while it is written.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: Target,
    overwrite: Overwrite,
}

#[derive(Debug)]
enum Target {
    /// A file beside its destination, removed unless finished.
    Beside { file: NamedTempFile, place: PathBuf, unfinished: Unfinished },
    /// A device or pipe, written directly.
    Stream(File),
}

impl OutputFile {
    /// Moves the file to its destination.
    pub fn finish(self) -> Result<(), Error> {
        let Self { path, target, overwrite } = self;
        let (file, place, _unfinished) = match target {
            Target::Stream(mut file) => {
                return file.flush().map_err(|error| unwritable(&path, &error));
            }
            Target::Beside { file, place, unfinished } => (file, place, unfinished),
        };
        file.as_file().sync_all().map_err(|error| unwritable(&path, &error))?;
        let moved = match overwrite.force {
            true => file.persist(&place),
            false => file.persist_noclobber(&place),
        };
        match moved.map_err(|error| error.error) {
            Ok(_) => Ok(()),
            // Another program created it meanwhile.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(exists(&path)),
            Err(error) => Err(unwritable(&path, &error)),
        }
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.target {
            Target::Beside { file, .. } => file.write(bytes),
            Target::Stream(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.target {
            Target::Beside { file, .. } => file.flush(),
            Target::Stream(file) => file.flush(),
        }
    }
}

/// The files of a directory while they are written; removed unless finished.
#[derive(Debug)]
pub struct OutputFiles {
    to: PathBuf,
    directory: TempDir,
    overwrite: Overwrite,
    _unfinished: Unfinished,
}

impl OutputFiles {
    /// The directory of the unfinished files.
    pub fn unfinished(&self) -> &Path {
        self.directory.path()
    }

    /// Writes one file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), Error> {
        fs::write(self.unfinished().join(name), content)
            .map_err(|error| unwritable(&self.to.join(name), &error))
    }

    /// Moves all written files to their destination; none of them if one may not be
    /// replaced.
    pub fn finish(self) -> Result<(), Error> {
        let Self { to, directory, overwrite, _unfinished } = self;
        let failed = |error: io::Error| unwritable(&to, &error);
        fs::create_dir_all(&to).map_err(failed)?;
        let entries =
            fs::read_dir(directory.path()).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let moves: Vec<(PathBuf, PathBuf)> = entries
            .map_err(failed)?
            .iter()
            .map(|entry| (entry.path(), to.join(entry.file_name())))
            .collect();
        moves.iter().try_for_each(|(_, place)| overwrite.check(place))?;
        moves.iter().try_for_each(|(from, place)| {
            fs::rename(from, place).map_err(|error| unwritable(place, &error))
        })
    }
}

/// The error that a file exists.
pub fn exists(path: &Path) -> Error {
    let path = path.display();
    let message = format!("{path} exists already; choose another name, or replace it with --force");
    Error::at(Code::FileExists, path, message)
}

/// The error that a file cannot be written.
pub fn unwritable(path: &Path, error: &io::Error) -> Error {
    // The name of an unfinished file would not help the user.
    let is_plain = error.get_ref().is_none() || error.kind() == ErrorKind::Other;
    let cause = if is_plain { error.to_string() } else { error.kind().to_string() };
    let path = path.display();
    Error::at(Code::UnwritableFile, &path, format!("cannot write {path}: {cause}"))
}

/// The directory of a path.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|directory| !directory.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file beside its destination, with the permissions of the replaced file, or of a new one.
fn unfinished(place: &Path, replaced: Option<&Metadata>) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(UNFINISHED);
    if let Some(permissions) = anybodys() {
        builder.permissions(permissions);
    }
    let file = builder.tempfile_in(parent(place))?;
    if let Some(found) = replaced {
        file.as_file().set_permissions(found.permissions())?;
    }
    Ok(file)
}

/// A directory for unfinished files.
fn unfinished_directory(parent: &Path) -> io::Result<(TempDir, Unfinished)> {
    Unfinished::make(
        || Builder::new().prefix(UNFINISHED).tempdir_in(parent),
        |directory| directory.path(),
    )
}

/// The default permissions of a file: the system applies the user's mask.
#[cfg(unix)]
fn anybodys() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt as _;
    Some(Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn anybodys() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests;
