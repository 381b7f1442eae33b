//! Every command that writes files, and its effect on existing ones.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::data_directory::DataDirectory;

/// A command, and a file that it writes; or the directory, if the command chooses the name.
const WRITERS: [(&str, &str); 14] = [
    ("plot 1 --to plot.svg", "plot.svg"),
    ("plot history.csv --to plot.png", "plot.png"),
    ("compare 1 --to compare.svg", "compare.svg"),
    ("export 1 --to bundle.zip", "bundle.zip"),
    ("export 1 --tensorboard events", "events"),
    ("replay 1@0/3 --to replay.png", "replay.png"),
    ("replay 1 --to replay.html", "replay.html"),
    ("replay 1", "replay-1.html"),
    ("simulate 1@0/3 --trace trace.csv", "trace.csv"),
    ("evaluate 1 --trials 2 --to evaluation", "evaluation/summary.json"),
    ("new mine", "mine.json"),
    ("man pages", "pages/swarmctl-list.1"),
    ("backup copy", "copy"),
    ("doctor --recover recovered", "recovered"),
];

/// All files below a path, with their contents.
fn files(path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    if path.is_file() {
        return vec![(path.to_owned(), fs::read(path).unwrap())];
    }
    let mut entries: Vec<PathBuf> =
        fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    entries.iter().flat_map(|path| files(path)).collect()
}

#[test]
fn no_command_overwrites_a_file_without_force() {
    let directory = DataDirectory::new();
    for (line, file) in WRITERS {
        let path = directory.path().join(file);
        directory.swarmctl(line).expect_success();
        let written = files(&path);
        assert!(
            !written.is_empty() && written.iter().all(|(_, bytes)| !bytes.is_empty()),
            "{line}"
        );
        let precious: Vec<u8> = b"precious".to_vec();
        // Keeps a written data directory, because `--force` replaces only such a directory.
        let is_data_directory = written.iter().any(|(path, _)| path.ends_with("swarmevo.sqlite3"));
        if !is_data_directory {
            written.iter().for_each(|(path, _)| fs::write(path, &precious).unwrap());
        }
        let before = files(&path);
        let refused = directory.swarmctl(line);
        assert_eq!(refused.code, Some(2), "{line}: {refused:#?}");
        assert_eq!(refused.stderr.lines().count(), 1, "{line}: {}", refused.stderr);
        for part in ["exists already", "--force", file.split('/').next().unwrap()] {
            assert!(refused.stderr.contains(part), "{line}: {}", refused.stderr);
        }
        assert!(files(&path) == before, "{line} has changed something");

        let forced = directory.swarmctl(&format!("{line} --force")).expect_success();
        assert!(!forced.stderr.contains("error"), "{line}: {}", forced.stderr);
        let names = |files: &[(PathBuf, _)]| -> Vec<PathBuf> {
            files.iter().map(|(path, _)| path.clone()).collect()
        };
        let after = files(&path);
        assert_eq!(names(&after), names(&written), "{line}");
        assert!(after.iter().all(|(_, bytes)| *bytes != precious), "{line}");
    }
    let left = fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name());
    let left: Vec<String> = left.map(|name| name.to_string_lossy().into_owned()).collect();
    assert!(left.iter().all(|name| !name.starts_with(".unfinished")), "{left:?}");
}

#[test]
fn force_replaces_data_directories_that_nobody_uses_and_nothing_else() {
    let directory = DataDirectory::new();
    fs::create_dir(directory.path().join("thesis")).unwrap();
    fs::write(directory.path().join("thesis/chapter.tex"), "precious").unwrap();
    for line in ["backup thesis --force", "doctor --recover thesis --force"] {
        let refused = directory.swarmctl(line);
        assert_eq!(refused.code, Some(2), "{line}: {refused:#?}");
    }
    assert_eq!(files(&directory.path().join("thesis")).len(), 1);
    let itself = directory.swarmctl("backup swarm-data --force");
    assert_eq!(itself.code, Some(2), "{itself:#?}");
    assert!(itself.stderr.contains("the directory that the command reads"), "{}", itself.stderr);
    directory.swarmctl("history 1").expect_success();
}

#[test]
fn the_champion_file_of_run_is_brought_up_to_date() {
    let directory = DataDirectory::new();
    let kept = files(&directory.path().join("swarm-data"));
    let is_champion = |path: &PathBuf| path.to_string_lossy().ends_with("-1.champion.json");
    let path = kept.into_iter().map(|(path, _)| path).find(is_champion).unwrap();
    let first = fs::read(&path).unwrap();
    fs::write(&path, "half a file").unwrap();
    directory.swarmctl("run experiment.json").expect_success();
    assert!(fs::read(&path).unwrap() == first);
}
