//! Kinds of files of this program, for messages about a file of an unexpected kind.

use std::{
    fs::{self, File},
    io::Read as _,
    path::Path,
};

use model::store;
use serde_json::Value;

use crate::{
    input::{GENOTYPE_BYTES, is_stdin, read_text},
    text::shell_command,
};

/// The beginning of the message about a file of another kind.
pub const OTHER: &str = "it is ";
/// Bytes that suffice to recognise files that are not JSON.
const HEAD_LEN: u64 = 512;

/// The kind of a file or a directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Experiment,
    Script,
    /// A champion, or another genotype in an object.
    Champion,
    Generation,
    Genes,
    History,
    Dynamics,
    List,
    Workers,
    Trace,
    /// A file of an evaluation.
    Evaluation,
    EvaluationDirectory,
    Bundle,
    Database,
    DataDirectory,
    Settings,
    Schema,
    Figure,
    Replay,
}

/// First lines of tables of this program.
const TABLES: [(&str, Kind); 7] = [
    ("experiment,generation,best,", Kind::History),
    ("experiment,generation,mean_step,", Kind::Dynamics),
    ("id,name,state,", Kind::List),
    ("id,name,", Kind::Workers),
    ("trial,step,robot,", Kind::Trace),
    ("condition,step,metric,", Kind::Evaluation),
    ("condition,trial,metric,", Kind::Evaluation),
];

/// First bytes of other files.
const BEGINNINGS: [(&[u8], Kind); 6] = [
    (b"PK\x03\x04", Kind::Bundle),
    (b"SQLite format 3\0", Kind::Database),
    (b"\x89PNG", Kind::Figure),
    (b"<svg", Kind::Figure),
    (b"<?xml", Kind::Figure),
    (b"<!doctype html>", Kind::Replay),
];

/// Kinds of JSON by keys that all files of a kind have, the most specific first.
const OBJECTS: [(&[&str], Kind); 9] = [
    (&["topology"], Kind::Experiment),
    (&["algorithm"], Kind::Experiment),
    (&["world"], Kind::Experiment),
    (&["genotype"], Kind::Champion),
    (&["generation", "individuals"], Kind::Generation),
    (&["genotype_digest", "conditions"], Kind::Evaluation),
    (&["$schema", "properties"], Kind::Schema),
    (&["coordinator"], Kind::Settings),
    (&["token-file"], Kind::Settings),
];

impl Kind {
    /// The kind of the file at a path; none if it is not of this program.
    pub fn of_path(path: &Path) -> Option<Self> {
        if is_stdin(path) {
            return None;
        }
        let found = fs::metadata(path).ok()?;
        if found.is_dir() {
            let is_evaluation = path.join("steps.csv").is_file();
            let is_data = store::is_in(path).then_some(Self::DataDirectory);
            return is_data.or(is_evaluation.then_some(Self::EvaluationDirectory));
        }
        // Reading a pipe or a device would consume its data.
        if !found.is_file() {
            return None;
        }
        if path.extension().is_some_and(|ending| ending == "star") {
            return Some(Self::Script);
        }
        let mut head = Vec::new();
        File::open(path).ok()?.take(HEAD_LEN).read_to_end(&mut head).ok()?;
        let begins = |start: &[u8]| {
            head.get(..start.len()).is_some_and(|head| head.eq_ignore_ascii_case(start))
        };
        let known = BEGINNINGS.iter().find(|(start, _)| begins(start));
        let table =
            || TABLES.iter().find(|(start, _)| begins(start.as_bytes())).map(|(_, kind)| *kind);
        known.map(|(_, kind)| *kind).or_else(table).or_else(|| Self::of_json(path))
    }

    fn of_json(path: &Path) -> Option<Self> {
        let text = read_text(path, GENOTYPE_BYTES).ok()?;
        match serde_json::from_str(&experiment_file::plain(&text)).ok()? {
            Value::Array(genes) => {
                let is_genes = !genes.is_empty() && genes.iter().all(Value::is_number);
                is_genes.then_some(Self::Genes)
            }
            Value::Object(file) => {
                let has = |keys: &&[&str]| keys.iter().all(|key| file.contains_key(*key));
                OBJECTS.iter().find(|(keys, _)| has(keys)).map(|(_, kind)| *kind)
            }
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Experiment => "an experiment file",
            Self::Script => "the script of a task",
            Self::Champion => "a champion file",
            Self::Generation => "a generation of individuals",
            Self::Genes => "a list of genes",
            Self::History => "the history of a run",
            Self::Dynamics => "a table of the movement of evolution",
            Self::List => "a list of experiments",
            Self::Workers => "a list of workers",
            Self::Trace => "the trace of a simulation",
            Self::Evaluation => "a file of an evaluation",
            Self::EvaluationDirectory => "the directory of an evaluation",
            Self::Bundle => "a bundle",
            Self::Database => "the database of a data directory",
            Self::DataDirectory => "a data directory",
            Self::Settings => "a settings file",
            Self::Schema => "the schema of experiment files",
            Self::Figure => "a figure",
            Self::Replay => "a page for a browser",
        }
    }

    /// The command that takes such a file, or another use of it.
    fn next_step(self, path: &Path) -> String {
        let command = |words: &[&str]| {
            let path = path.to_string_lossy();
            let words = words.iter().map(|word| word.replace("{}", &path));
            format!("use it with: {}", shell_command(words))
        };
        let directory = || {
            let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            directory.unwrap_or(Path::new(".")).to_string_lossy().into_owned()
        };
        match self {
            Self::Experiment => command(&["swarmctl", "run", "{}"]),
            Self::Script => "give the experiment file that names it".into(),
            Self::Champion | Self::Genes => {
                command(&["swarmctl", "replay", "--config", "EXPERIMENT.json", "--genotype", "{}"])
            }
            Self::Generation => "`swarmctl individual ID@G/I` prints one of them".into(),
            Self::History => command(&["swarmctl", "plot", "{}", "--to", "FIGURE.svg"]),
            Self::Evaluation => {
                let directory = directory();
                command(&["swarmctl", "plot", "--steps", &directory, "--to", "FIGURE.svg"])
            }
            Self::EvaluationDirectory => {
                command(&["swarmctl", "plot", "--steps", "{}", "--to", "FIGURE.svg"])
            }
            Self::Bundle => command(&["swarmctl", "import", "{}"]),
            Self::Database => command(&["swarmctl", "list", "--data-dir", &directory()]),
            Self::DataDirectory => command(&["swarmctl", "list", "--data-dir", "{}"]),
            Self::Settings => "name it with the variable SWARM_CONFIG".into(),
            Self::Dynamics | Self::List | Self::Workers | Self::Trace => {
                "this one is for other programs".into()
            }
            Self::Schema => "this one is for editors".into(),
            Self::Figure | Self::Replay => "this one is for people".into(),
        }
    }
}

/// Fails if a file is of a known kind that is not expected; passes unknown kinds. `expected`:
/// a name, such as "an experiment file".
pub fn expect(path: &Path, kinds: &[Kind], expected: &str) -> Result<(), String> {
    match Kind::of_path(path).filter(|kind| !kinds.contains(kind)) {
        None => Ok(()),
        Some(kind) => Err(format!(
            "{OTHER}{}, and {expected} is expected here; {}",
            kind.name(),
            kind.next_step(path)
        )),
    }
}

/// The kind of a word of the command line that names a file.
pub fn of_word(word: &str) -> Option<String> {
    let path = Path::new(word);
    let kind = Kind::of_path(path)?;
    Some(format!("`{word}` is {}; {}", kind.name(), kind.next_step(path)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment_file::tests::quickstart;

    #[test]
    fn files_are_known_by_their_contents() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        for (content, kind) in [
            (r#"{"world": 3}"#, Some(Kind::Experiment)),
            ("// mine\n{\"world\": 3,}", Some(Kind::Experiment)),
            (r#"{"seed": 3, "genotype": [1]}"#, Some(Kind::Champion)),
            ("[0.5, 1]", Some(Kind::Genes)),
            ("[]", None),
            ("experiment,generation,best,mean\n", Some(Kind::History)),
            ("trial,step,robot,object\n", Some(Kind::Trace)),
            ("PK\x03\x04...", Some(Kind::Bundle)),
            ("<!DOCTYPE html>", Some(Kind::Replay)),
            (r#"{"coordinator": "x"}"#, Some(Kind::Settings)),
            ("hello", None),
            ("", None),
        ] {
            fs::write(&path, content).unwrap();
            assert_eq!(Kind::of_path(&path), kind, "{content}");
        }
        assert_eq!(Kind::of_path(&quickstart()), Some(Kind::Experiment));
        assert_eq!(Kind::of_path(directory.path()), None);
        assert_eq!(Kind::of_path("-".as_ref()), None);
        assert_eq!(Kind::of_path("/dev/zero".as_ref()), None);
    }

    #[test]
    fn a_misplaced_file_is_one_line_with_a_next_step() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("it's.zip");
        fs::write(&path, "PK\x03\x04").unwrap();
        let error = expect(&path, &[Kind::History], "a history").unwrap_err();
        let expected =
            "it is a bundle, and a history is expected here; use it with: swarmctl import";
        assert!(error.contains(expected), "{error}");
        assert!(error.ends_with(r"it'\''s.zip'"), "for a shell: {error}");
        assert_eq!(expect(&path, &[Kind::Bundle], "a bundle"), Ok(()));
    }
}
