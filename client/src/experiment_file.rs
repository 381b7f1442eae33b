//! Experiment files on their way to the coordinator, which is who judges them.

use std::{
    fs::File,
    io::{self, Read as _},
    path::PathBuf,
};

use swarm_proto::v1::SubmitExperimentRequest;

use crate::{
    args::ExperimentArgs,
    error::{Error, prefix_lines},
};

/// Largest file that is read.
const BYTES_MAX: u64 = 1 << 20;

/// Longest default name that the protocol carries.
const NAME_BYTES_MAX: usize = 128;

/// The text of an experiment file.
#[derive(Debug)]
pub struct ExperimentFile {
    path: PathBuf,
    text: String,
}

impl ExperimentFile {
    /// Reads a file of UTF-8 text of at most 1 MiB.
    pub fn read(path: &std::path::Path) -> Result<Self, Error> {
        let problem =
            |what: String| Error::Input(format!("cannot read {}: {what}", path.display()));
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(BYTES_MAX + 1).read_to_end(&mut bytes))
            .map_err(|error: io::Error| problem(error.to_string()))?;
        if bytes.len() as u64 > BYTES_MAX {
            return Err(problem("an experiment file has at most 1 MiB".into()));
        }
        let text = String::from_utf8(bytes).map_err(|error| problem(error.to_string()))?;
        Ok(Self { path: path.into(), text })
    }

    /// The request to submit it; `request_id` makes it safe to repeat.
    pub fn request(&self, args: &ExperimentArgs, request_id: String) -> SubmitExperimentRequest {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let fits = |(start, c): &(usize, char)| start + c.len_utf8() <= NAME_BYTES_MAX;
        let name = stem.char_indices().take_while(fits).map(|(_, c)| c).collect();
        SubmitExperimentRequest {
            request_id,
            config_json: self.text.clone(),
            default_name: name,
            seed: args.seed,
            generations: args.generations,
            resume_unfinished: false,
        }
    }

    /// A refusal of this file says so.
    pub fn blame(&self, error: Error) -> Error {
        match error {
            Error::Input(problems) => Error::Config { file: self.path.clone(), problems },
            error => error,
        }
    }

    /// Warnings about this file, one per line.
    pub fn warnings(&self, warnings: &[String]) -> Option<String> {
        let text = warnings.join("\n");
        let prefix = format!("warning: {}", self.path.display());
        (!text.is_empty()).then(|| prefix_lines(&text, &prefix))
    }
}

/// An id that nobody else chooses.
pub fn random_request_id(kind: &str) -> String {
    format!("{kind}-{:032x}", rand::random::<u128>())
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;

    fn args(config: &Path) -> ExperimentArgs {
        ExperimentArgs { config: config.into(), generations: Some(3), seed: None }
    }

    #[test]
    fn a_request_carries_the_file_as_it_is_and_its_stem() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("leader.selection.json");
        fs::write(&path, "{ \"seed\": 1 } // ü").unwrap();
        let request = ExperimentFile::read(&path).unwrap().request(&args(&path), "id".into());
        assert_eq!(request.config_json, "{ \"seed\": 1 } // ü");
        assert_eq!(request.default_name, "leader.selection");
        assert_eq!((request.generations, request.seed), (Some(3), None));
    }

    #[test]
    fn a_long_file_name_gives_a_shorter_default_name() {
        let file = ExperimentFile {
            path: format!("x{}.json", "ü".repeat(100)).into(),
            text: String::new(),
        };
        let request = file.request(&args(&file.path), String::new());
        assert_eq!(request.default_name, format!("x{}", "ü".repeat(63)));
    }

    #[test]
    fn what_cannot_be_an_experiment_file_is_an_input_error() {
        let dir = tempfile::tempdir().unwrap();
        let missing = dir.path().join("missing");
        let binary = dir.path().join("binary");
        fs::write(&binary, [0xff]).unwrap();
        let huge = dir.path().join("huge");
        fs::write(&huge, vec![b' '; (1 << 20) + 1]).unwrap();
        for path in [dir.path(), &missing, &binary, &huge] {
            let error = ExperimentFile::read(path).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(&path.display().to_string()), "{error}");
        }
        let largest = dir.path().join("largest");
        fs::write(&largest, vec![b' '; 1 << 20]).unwrap();
        assert!(ExperimentFile::read(&largest).is_ok());
    }

    #[test]
    fn request_ids_differ() {
        assert_ne!(random_request_id("run"), random_request_id("run"));
    }

    #[test]
    fn warnings_name_the_file() {
        let file = ExperimentFile { path: "a.json".into(), text: String::new() };
        assert_eq!(file.warnings(&[]), None);
        let warnings = ["line 1: x".to_owned(), "y".to_owned()];
        let expected = "warning: a.json: line 1: x\nwarning: a.json: y";
        assert_eq!(file.warnings(&warnings).as_deref(), Some(expected));
    }
}
