//! The database's file: it has one writer at a time, is created completely or not at all, and
//! stays untouched if it is damaged.

use std::{
    fs::{self, File, TryLockError},
    io::{self, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
    thread,
    time::{Duration, SystemTime},
};

use rusqlite::{Connection, OpenFlags};

use super::{Holder, Result, StoreError, schema, write_ahead_log};

const DATABASE_FILE: &str = "swarmevo.sqlite3";
/// The name of a database until it is complete.
const UNFINISHED_FILE: &str = "swarmevo.sqlite3.new";
const LOCK_FILE: &str = "swarmevo.lock";
/// Longest time that an operation waits for another program that uses the database.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of attempts to lock: another program may hold the lock for a moment to test it.
const LOCK_ATTEMPTS: u32 = 10;
/// Pause between two attempts.
const LOCK_PAUSE: Duration = Duration::from_millis(20);

/// Fails if there is no database at `path`, or if it cannot be accessed.
pub fn must_exist(path: &Path) -> Result<()> {
    match fs::metadata(path) {
        Ok(found) if found.is_file() => Ok(()),
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            let directory = path.parent().unwrap_or(path);
            Err(StoreError::Directory { path: directory.to_owned(), source })
        }
        _ => Err(StoreError::NoDatabase { path: path.to_owned() }),
    }
}

/// The locks that keep other coordinators out until they are dropped.
#[derive(Debug)]
pub struct Locks {
    directory: File,
    _database: Option<File>,
}

impl Locks {
    /// Writes the holder's name into the lock file. The lock also works without a name.
    pub fn announce(&self, address: Option<&str>) {
        let text = format!("{}\n{}\n", std::process::id(), address.unwrap_or_default());
        let mut file = &self.directory;
        let written = file
            .set_len(0)
            .and_then(|()| file.seek(SeekFrom::Start(0)))
            .and_then(|_| file.write_all(text.as_bytes()));
        drop(written);
    }
}

/// The program that may write to the database in a directory, if one runs now.
pub fn holder(directory: &Path) -> Option<Holder> {
    let is_locked = |file: &File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    let lock = File::open(directory.join(LOCK_FILE)).ok();
    if let Some(lock) = lock.filter(is_locked) {
        return Some(Holder::named(&lock));
    }
    let database = File::open(path_in(directory)).ok().filter(|_| cfg!(target_os = "linux"));
    database.filter(is_locked).map(|_| Holder { process: None, address: None })
}

/// The database of a data directory.
pub fn path_in(directory: &Path) -> PathBuf {
    directory.join(DATABASE_FILE)
}

/// The path of a database until it is complete.
pub fn unfinished_in(directory: &Path) -> PathBuf {
    directory.join(UNFINISHED_FILE)
}

/// Opens the database in `directory`, or creates it. Drop the connection before the locks.
pub fn open(directory: &Path) -> Result<(Connection, Locks)> {
    let unusable = |source| StoreError::Directory { path: directory.to_owned(), source };
    fs::create_dir_all(directory).map_err(unusable)?;
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    let file = options.open(directory.join(LOCK_FILE)).map_err(unusable)?;
    let lock = lock(file, directory)?;
    let path = path_in(directory);
    if !path.try_exists().map_err(unusable)? {
        create(directory, unusable)?;
    }
    let locks = Locks { directory: lock, _database: lock_database(&path, directory)? };
    locks.announce(None);
    check(&path)?;
    let mut connection = Connection::open(&path)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    write_ahead_log::configure(&connection)?;
    schema::migrate(&mut connection).map_err(|error| error.at(&path))?;
    Ok((connection, locks))
}

/// Locks the database itself, because a locked lock file can be deleted.
fn lock_database(path: &Path, directory: &Path) -> Result<Option<File>> {
    // On other systems, this lock may conflict with SQLite's own locks for readers.
    if !cfg!(target_os = "linux") {
        return Ok(None);
    }
    let unusable = |source| StoreError::Directory { path: directory.to_owned(), source };
    let file = File::open(path).map_err(unusable)?;
    lock(file, directory).map(Some)
}

/// Locks a file of the data directory, or returns that another program has it.
fn lock(file: File, directory: &Path) -> Result<File> {
    let path = directory.to_owned();
    for attempt in 1.. {
        match file.try_lock() {
            Ok(()) => break,
            Err(TryLockError::WouldBlock) if attempt < LOCK_ATTEMPTS => thread::sleep(LOCK_PAUSE),
            Err(TryLockError::WouldBlock) => {
                let lock = File::open(directory.join(LOCK_FILE)).ok();
                let holder = lock.map(|file| Holder::named(&file));
                return Err(StoreError::Locked { path, holder });
            }
            Err(TryLockError::Error(source)) => return Err(StoreError::Directory { path, source }),
        }
    }
    Ok(file)
}

/// Creates an empty database, under another name at first. So an empty file under the final name
/// is damage, and never the result of a kill at the first start.
fn create(directory: &Path, unusable: impl Fn(io::Error) -> StoreError) -> Result<()> {
    let unfinished = unfinished_in(directory);
    match fs::remove_file(&unfinished) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(unusable(error)),
        _ => {}
    }
    let mut connection = Connection::open(&unfinished)?;
    schema::migrate(&mut connection)?;
    connection.close().map_err(|(_, error)| error)?;
    publish(directory).map_err(unusable)
}

/// Refuses a database to which this program must not write. The check is read-only, so that every
/// byte stays for a repair.
fn check(path: &Path) -> Result<()> {
    let has_log = write_ahead_log::exists(path);
    let verdict = open_read_only(path).map_err(StoreError::from).and_then(|connection| {
        let version = schema::version(&connection)?;
        if version > schema::VERSION {
            return Err(StoreError::Newer { found: version, supported: schema::VERSION });
        }
        if version <= 0 {
            return Err(StoreError::Corrupt("it has no tables of experiments".to_owned()));
        }
        let soundness: String =
            connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        if soundness != "ok" {
            return Err(StoreError::Corrupt(soundness.replace('\n', " ")));
        }
        if !has_log && version >= schema::SEALED && write_ahead_log::is_missed(&connection)? {
            return Err(StoreError::WithoutLog { path: path.to_owned() });
        }
        Ok(())
    });
    verdict.map_err(|error| error.at(path))
}

/// The file of a database that no program uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AtRest {
    len: u64,
    modified: SystemTime,
}

impl AtRest {
    /// `None` if a program uses the database: then there is a log.
    pub fn look(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok().filter(|_| !write_ahead_log::exists(path))?;
        Some(Self { len: metadata.len(), modified: metadata.modified().ok()? })
    }
}

/// Opens a database for reading, even while another program uses it, and leaves no files beside
/// it.
pub fn open_read_only(path: &Path) -> rusqlite::Result<Connection> {
    open_read_only_as(path, AtRest::look(path))
}

/// As [`open_read_only`]. A connection to a database at rest reads that state of the file alone: it
/// is of no use once [`AtRest::of`] gives something else.
pub fn open_read_only_as(path: &Path, at_rest: Option<AtRest>) -> rusqlite::Result<Connection> {
    let mut flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = if at_rest.is_some() {
        // `immutable` keeps SQLite from creating a log.
        flags |= OpenFlags::SQLITE_OPEN_URI;
        Connection::open_with_flags(format!("{}?immutable=1", uri(path)), flags)?
    } else {
        Connection::open_with_flags(path, flags)?
    };
    connection.busy_timeout(BUSY_TIMEOUT)?;
    Ok(connection)
}

/// A path in the notation of SQLite's URIs.
fn uri(path: &Path) -> String {
    let mut uri = "file:".to_owned();
    for &byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'/' | b'.' | b'-' | b'_' | b'~' => uri.push(byte.into()),
            _ if byte.is_ascii_alphanumeric() => uri.push(byte.into()),
            _ => uri += &format!("%{byte:02X}"),
        }
    }
    uri
}

/// Renames the database at [`unfinished_in`], which is complete, to its final name.
pub fn publish(directory: &Path) -> io::Result<()> {
    let unfinished = unfinished_in(directory);
    File::open(&unfinished)?.sync_all()?;
    fs::rename(unfinished, path_in(directory))?;
    File::open(directory)?.sync_all()
}
