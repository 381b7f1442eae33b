//! The treatment of existing and of unfinished files.

use super::*;

const UNASKED: Overwrite = Overwrite { force: false };
const FORCED: Overwrite = Overwrite { force: true };

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_str().unwrap().to_owned()).collect();
    names.sort();
    names
}

#[test]
fn an_existing_file_is_replaced_only_on_request() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.svg");
    UNASKED.write(&path, b"first").unwrap();
    let error = UNASKED.write(&path, b"second").unwrap_err();
    let expected = format!(
        "{} exists already; choose another name, or replace it with --force",
        path.display()
    );
    assert_eq!((error.exit_code(), error.to_string()), (2, expected));
    assert_eq!(fs::read_to_string(&path).unwrap(), "first");
    FORCED.write(&path, b"third").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "third");
    assert_eq!(names(dir.path()), ["a.svg"]);
}

#[test]
fn a_file_appears_when_finished_and_an_earlier_one_stays() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.csv");
    let mut file = UNASKED.begin(&path).unwrap();
    file.write_all(b"half").unwrap();
    assert!(!path.exists());
    drop(file);
    assert!(names(dir.path()).is_empty(), "what is not finished is removed");
    let late = UNASKED.begin(&path).unwrap();
    UNASKED.write(&path, b"first").unwrap();
    assert!(late.finish().unwrap_err().to_string().contains("exists already"));
    assert_eq!(fs::read_to_string(&path).unwrap(), "first");
}

#[test]
fn files_and_directories_are_distinguished_and_a_missing_directory_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "").unwrap();
    for overwrite in [UNASKED, FORCED] {
        let error = overwrite.write(dir.path(), b"").unwrap_err().to_string();
        assert!(error.contains("is a directory"), "{error}");
        let nowhere = overwrite.write(&dir.path().join("no/a"), b"").unwrap_err().to_string();
        assert!(nowhere.contains("there is no directory"), "{nowhere}");
        let error = overwrite.begin_files(&file, &["a"]).unwrap_err().to_string();
        assert!(error.contains("is a file"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn devices_links_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    UNASKED.write(Path::new("/dev/null"), b"x").unwrap();
    let dir = tempfile::tempdir().unwrap();
    let (path, link) = (dir.path().join("a"), dir.path().join("link"));
    fs::write(&path, "old").unwrap();
    fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
    symlink(&path, &link).unwrap();
    assert!(UNASKED.write(&link, b"new").is_err());
    FORCED.write(&link, b"new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
}

#[test]
fn files_of_a_directory_appear_together() {
    let dir = tempfile::tempdir().unwrap();
    let to = dir.path().join("a/b");
    let write = |overwrite: Overwrite, text: &str| {
        let files = overwrite.begin_files(&to, &["one", "two"])?;
        ["one", "two"].iter().try_for_each(|name| files.write(name, text))?;
        Ok::<_, Error>(files)
    };
    write(UNASKED, "unfinished").unwrap();
    assert!(!to.exists());
    write(UNASKED, "first").unwrap().finish().unwrap();
    assert_eq!(write(UNASKED, "second").unwrap_err().exit_code(), 2);
    write(FORCED, "second").unwrap();
    assert_eq!(fs::read_to_string(to.join("two")).unwrap(), "first");
    write(FORCED, "third").unwrap().finish().unwrap();
    assert_eq!(fs::read_to_string(to.join("two")).unwrap(), "third");
    assert_eq!(names(&to), ["one", "two"]);
}
