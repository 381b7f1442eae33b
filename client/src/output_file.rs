//! Files that commands write: whole or not at all, and over nothing that exists unless `--force`
//! is given.

use std::{
    fs::{self, File, Metadata, Permissions},
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
};

use clap::Args;
use model::store;
use tempfile::{Builder, NamedTempFile, TempDir};

use crate::{error::Error, interrupt::Unfinished};

/// How a file or directory is called until it is complete.
const UNFINISHED: &str = ".unfinished-";

/// Whether a command may write over what exists: one option in all commands that write files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Args)]
pub struct Overwrite {
    /// Replace what exists already; without this option that is refused.
    #[arg(long)]
    pub force: bool,
}

impl Overwrite {
    /// Replaces what the program itself has written before.
    pub const OWN: Self = Self { force: true };

    /// Refuses a file that may not be written over, or has no place, so that nothing is computed
    /// in vain.
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

    /// Begins a file, which appears when it is finished.
    pub fn begin(self, path: &Path) -> Result<OutputFile, Error> {
        self.check(path)?;
        let failed = |error: io::Error| unwritable(path, &error);
        let found = fs::metadata(path).ok();
        let target = match &found {
            // A device or a pipe has no place beside it, and keeps nothing that could be lost.
            Some(found) if !found.is_file() => {
                Target::Stream(File::options().write(true).open(path).map_err(failed)?)
            }
            _ => {
                // What a link leads to is replaced, and not the link.
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

    /// Refuses a directory for files of these names, as [`Self::check`] a file.
    pub fn check_files(self, to: &Path, names: &[&str]) -> Result<(), Error> {
        if fs::metadata(to).is_ok_and(|found| !found.is_dir()) {
            return Err(unwritable(to, &io::Error::other("it is a file; name a directory")));
        }
        names.iter().try_for_each(|name| self.may_replace(&to.join(name)))
    }

    /// Begins files of a directory, which appear in it when all of them are finished.
    pub fn begin_files(self, to: &Path, names: &[&str]) -> Result<OutputFiles, Error> {
        self.check_files(to, names)?;
        let failed = |error: io::Error| unwritable(to, &error);
        let parent = if to.is_dir() { to } else { parent(to) };
        let unfinished = fs::create_dir_all(parent).and_then(|()| unfinished_directory(parent));
        let (directory, unfinished) = unfinished.map_err(failed)?;
        Ok(OutputFiles { to: to.to_owned(), directory, overwrite: self, _unfinished: unfinished })
    }

    /// Has a data directory made; one that exists, and that no program uses, is replaced by it if
    /// that is wanted.
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
            return Err(failed(io::Error::other("it is the directory that is read")));
        }
        if let Some(holder) = store::holder(to) {
            return Err(failed(io::Error::other(format!("{holder} uses it"))));
        }
        let (aside, unfinished) = unfinished_directory(parent(to)).map_err(failed)?;
        let [new, old] = ["new", "old"].map(|name| aside.path().join(name));
        let made = make(&new)?;
        // From here on, the only copy of what is replaced may be there.
        drop(unfinished);
        if store::is_in(&new) {
            fs::rename(to, &old).map_err(failed)?;
            if let Err(error) = fs::rename(&new, to) {
                let Err(back) = fs::rename(&old, to) else { return Err(failed(error)) };
                // It would be removed with the directory that it is in.
                let kept = aside.keep().join("old");
                let what = format!("{back}; what was there is in {}", kept.display());
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
    /// A file beside its place, removed if it is not finished.
    Beside { file: NamedTempFile, place: PathBuf, unfinished: Unfinished },
    /// What is written as it is.
    Stream(File),
}

impl OutputFile {
    /// Puts the file where it belongs.
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
            // Somebody else made it meanwhile.
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

/// The files of a directory while they are written; removed if they are not finished.
#[derive(Debug)]
pub struct OutputFiles {
    to: PathBuf,
    directory: TempDir,
    overwrite: Overwrite,
    _unfinished: Unfinished,
}

impl OutputFiles {
    /// Where they are while they are written.
    pub fn unfinished(&self) -> &Path {
        self.directory.path()
    }

    /// Writes one of them.
    pub fn write(&self, name: &str, text: &str) -> Result<(), Error> {
        fs::write(self.unfinished().join(name), text)
            .map_err(|error| unwritable(&self.to.join(name), &error))
    }

    /// Puts all that were written where they belong; none if one may not be written over.
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

/// The error that something may not be written over.
pub fn exists(path: &Path) -> Error {
    Error::Input(format!(
        "{} exists already; choose another name, or replace it with --force",
        path.display()
    ))
}

/// The error that something cannot be written.
pub fn unwritable(path: &Path, error: &io::Error) -> Error {
    // The name of a file that is unfinished says nothing to anybody.
    let is_plain = error.get_ref().is_none() || error.kind() == ErrorKind::Other;
    let cause = if is_plain { error.to_string() } else { error.kind().to_string() };
    Error::Input(format!("cannot write {}: {cause}", path.display()))
}

/// The directory that something is in.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|directory| !directory.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file beside its place, with the permissions of the one that it replaces, or of any new one.
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

/// A directory for what is not finished.
fn unfinished_directory(parent: &Path) -> io::Result<(TempDir, Unfinished)> {
    Unfinished::make(
        || Builder::new().prefix(UNFINISHED).tempdir_in(parent),
        |directory| directory.path(),
    )
}

/// The permissions of a file that nobody says more of: the system takes the user's mask off.
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
