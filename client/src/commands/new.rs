//! `swarmctl new`: an experiment of the user's own, copied from an example.

use std::path::{Path, PathBuf};

use clap::Args;
use model::group;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    error::Error,
    examples::{self, Example},
    output_file::Overwrite,
    progress::Progress,
};

/// Write a first experiment file and the script of its task.
///
/// NAME.json evolves without changes. NAME.star defines the fitness, in a language that
/// looks like Python. After you change either file, check it with `swarmctl validate`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct NewArgs {
    /// Name of the experiment, and of its files in this directory: letters, digits, - and _.
    #[arg(value_parser = name)]
    name: String,
    /// The task to start from.
    #[arg(long, value_name = "EXAMPLE", default_value = "dispersion", value_parser = examples::parser())]
    task: &'static Example,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl new spread
  swarmctl new hunters --task predator";

/// The comments on the parts of an experiment file.
const PARTS: [(&str, &str); 4] = [
    ("task", "The fitness: the functions of this script."),
    ("topology", "The network of every robot, from stimuli to outputs."),
    ("algorithm", "The algorithm: more generations or individuals take longer."),
    ("world", "The arena: its objects, their positions, sensors and actuators."),
];

/// A name that is valid for files and for experiments.
fn name(text: &str) -> Result<String, String> {
    match group::check_name(text) {
        Ok(()) if !text.is_empty() && !text.starts_with('-') => Ok(text.to_owned()),
        _ => Err(
            "a name has letters, digits, - and _, at least one of them a letter, such as my-task"
                .into(),
        ),
    }
}

impl Example {
    /// The experiment file under another name, with a comment for each part.
    fn config_named(&self, name: &str) -> String {
        let mut lines = vec![
            format!("// {}.", self.about),
            "// Lengths are cm, angles radians, times steps. Every key: docs/keys.md, or".into(),
            "// in an editor that completes: swarmctl schema > experiment.schema.json".into(),
        ];
        for line in self.config.lines() {
            let trimmed = line.trim_start();
            let indent = &line[..line.len() - trimmed.len()];
            let is_part = |key: &str| trimmed.starts_with(&format!("\"{key}\": {{"));
            if let Some((_, what)) = PARTS.iter().find(|(key, _)| is_part(key)) {
                lines.push(format!("{indent}// {what}"));
            }
            lines.push(line.to_owned());
        }
        let own = lines.join("\n") + "\n";
        let named = |key: &str, value: &str| format!("\"{key}\": \"{value}\"");
        own.replacen(&named("name", self.name), &named("name", name), 1).replacen(
            &named("script", &format!("{}.star", self.name)),
            &named("script", &format!("{name}.star")),
            1,
        )
    }

    /// The script, with a comment below its first line.
    fn script_to_change(&self) -> Option<String> {
        let (first, rest) = self.script?.split_once('\n')?;
        let hint = "# docs/tasks.md lists the values and functions of scripts.";
        Some(format!("{first}\n\n{hint}\n{rest}"))
    }
}

/// The written files.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Written<'a> {
    /// Name of the experiment.
    name: &'a str,
    /// Name of the example.
    task: &'a str,
    /// Paths of the written files; the experiment file is the first.
    files: Vec<PathBuf>,
}

/// Writes the files into this directory.
pub fn new(args: &NewArgs, progress: &mut Progress) -> Result<(), Error> {
    new_in(Path::new("."), args, progress)
}

fn new_in(directory: &Path, args: &NewArgs, progress: &mut Progress) -> Result<(), Error> {
    let NewArgs { name, task, overwrite } = args;
    let config = format!("{name}.json");
    let mut files = vec![(config.clone(), task.config_named(name))];
    if let Some(script) = task.script_to_change() {
        files.push((format!("{name}.star"), script));
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| &**name).collect();
    let unfinished = overwrite.begin_files(directory, &names)?;
    files.iter().try_for_each(|(name, text)| unfinished.write(name, text))?;
    unfinished.finish()?;
    let files: Vec<PathBuf> = files.into_iter().map(|(name, _)| name.into()).collect();
    if progress.is_json() {
        return progress.print_document(&Written { name, task: task.name, files });
    }
    let shown: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    progress.print(&format!(
        "written: {}\n{}\nnext:\n  swarmctl validate {config}\n  swarmctl run {config}\n  swarmctl replay {name}",
        shown.join(", "),
        task.about,
    ))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use clap::Parser as _;

    use super::*;
    use crate::{
        cli::Args,
        commands::{Command, tests::one_world::output},
        examples::EXAMPLES,
        experiment_file::{ExperimentFile, Overrides},
        output_format::OutputFormat,
        progress::tests::Captured,
    };

    fn args(words: &[&str]) -> Result<NewArgs, clap::Error> {
        let line = ["swarmctl", "new"].iter().chain(words);
        match Args::try_parse_from(line)?.command {
            Command::New(args) => Ok(args),
            other => panic!("{other:?}"),
        }
    }

    fn written(directory: &Path, words: &[&str]) -> Result<String, Error> {
        let captured = Captured::default();
        let args = args(words).unwrap();
        new_in(directory, &args, &mut captured.progress(OutputFormat::Table))?;
        Ok(captured.lines().join("\n"))
    }

    /// The mean fitness of the generations of a run of this file, with changes.
    async fn means(directory: &Path, name: &str, changes: &str) -> Vec<f64> {
        let path = directory.join(format!("{name}.json"));
        let data = directory.join(format!("{name}.data"));
        let at = ["--data-dir", data.to_str().unwrap()];
        // Judging takes most of the time of a short run.
        let run = format!(
            "run {} --set algorithm.judgement_trials=1;algorithm.champion_trials=1;{changes}",
            path.display()
        );
        let text = output(&run, &at).await;
        assert!(text.contains("completed after"), "{text}");
        let history = output("history 1 --output json", &at).await;
        let history: serde_json::Value = serde_json::from_str(&history).unwrap();
        let mean = |generation: &serde_json::Value| generation["mean"].as_f64().unwrap();
        history.as_array().unwrap().iter().map(mean).collect()
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn every_example_validates_without_a_warning_and_evolves() {
        let directory = tempfile::tempdir().unwrap();
        for template in &EXAMPLES {
            let own = format!("my_{}", template.name);
            let text = written(directory.path(), &[&own, "--task", template.name]).unwrap();
            assert!(text.contains(&format!("swarmctl replay {own}")), "{text}");
            let path = directory.path().join(format!("{own}.json"));
            let compiled = ExperimentFile::read(&path).unwrap().check(&Overrides::default());
            let compiled = compiled.unwrap();
            assert_eq!(compiled.warnings, [], "{own}");
            assert_eq!(compiled.config.name, own);
            let of_script = compiled.config.task.as_ref().map(|task| task.script.name.clone());
            assert_eq!(of_script, template.script.map(|_| format!("{own}.star")));
            // A generation of the thesis's experiments takes as long as a whole run of other
            // experiments.
            if compiled.config.algorithm.generations <= 120 {
                let changes = "algorithm.population_size=16;algorithm.generations=1";
                assert_eq!(means(directory.path(), &own, changes).await.len(), 1);
            }
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn the_default_template_improves_in_a_few_generations() {
        let directory = tempfile::tempdir().unwrap();
        written(directory.path(), &["spread"]).unwrap();
        let means = means(directory.path(), "spread", "algorithm.generations=8").await;
        assert!(means[7] > means[0] + 0.05, "{means:?}");
    }

    #[test]
    fn nothing_is_overwritten_and_nothing_is_left_behind() {
        let directory = tempfile::tempdir().unwrap();
        let star = directory.path().join("a.star");
        fs::write(&star, "mine").unwrap();
        let error = written(directory.path(), &["a"]).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("a.star exists already; "), "{error}");
        assert_eq!(fs::read_to_string(&star).unwrap(), "mine");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
        let error = written(&star, &["a"]).unwrap_err();
        assert!(error.to_string().starts_with("cannot write "), "{error}");
    }

    #[test]
    fn names_that_files_or_experiments_cannot_have_are_refused() {
        for name in ["", "a b", "a/b", "../a", "7", "a.json", "a\n", "-a", "--", "a\0"] {
            assert!(args(&[name]).is_err(), "{name}");
        }
        let error = args(&["a", "--task", "dispersal"]).unwrap_err().to_string();
        assert!(error.contains("dispersion"), "{error}");
    }
}
