//! The files of an evaluation. The tables have one row per condition, step or trial,
//! and measure.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use super::{
    conditions::Condition,
    measured::Measured,
    statistics::{Quartiles, mean},
    summary::time_mean,
};
use crate::error::Error;

/// The names of the files.
const NAMES: [&str; 3] = ["steps.csv", "trials.csv", "summary.json"];

/// The files while they are written: beside those that they replace, so that an
/// evaluation that is interrupted leaves everything as it was.
pub struct Results {
    to: PathBuf,
    /// Removed, with what is in it, when this is dropped.
    unfinished: TempDir,
}

impl Results {
    /// Refuses a directory that cannot be written, and, unless they are to be
    /// replaced, one that has such files.
    pub fn begin(to: &Path, replace: bool) -> Result<Self, Error> {
        if !replace && let Some(name) = NAMES.iter().find(|name| to.join(name).exists()) {
            return Err(Error::Input(format!(
                "{} has a {name} already; choose another directory, or replace it with --replace",
                to.display()
            )));
        }
        let parent = if to.is_dir() { Some(to) } else { to.parent() };
        let parent = parent.filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let unfinished = fs::create_dir_all(parent)
            .and_then(|()| tempfile::Builder::new().prefix(".unfinished-").tempdir_in(parent));
        let unfinished = unfinished.map_err(|error| unwritable(to, &error))?;
        Ok(Self { to: to.into(), unfinished })
    }

    /// Writes steps.csv: statistics over the trials in every `every`-th step and the last
    /// one, with six significant digits.
    pub fn write_steps(
        &self,
        conditions: &[Condition],
        measured: &[Measured],
        every: u32,
    ) -> Result<(), Error> {
        let header = ["condition", "step", "metric", "n", "median", "q1", "q3", "mean"];
        let mut rows = Vec::new();
        for (condition, measured) in conditions.iter().zip(measured) {
            let last = measured.n_steps - 1;
            let steps = (0..=last).filter(|&step| step % every as usize == 0 || step == last);
            for step in steps {
                for (metric, name) in measured.metrics.iter().enumerate() {
                    let values = measured.at_step(step, metric);
                    let (Some(mean), Some(quartiles)) =
                        (mean(&values), Quartiles::of(values.clone()))
                    else {
                        continue;
                    };
                    let Quartiles { median, q1, q3 } = quartiles;
                    let mut row = vec![
                        condition.name.clone(),
                        step.to_string(),
                        name.clone(),
                        values.len().to_string(),
                    ];
                    row.extend([median, q1, q3, mean].map(six_digits));
                    rows.push(row);
                }
            }
        }
        self.write_table("steps.csv", &header, &rows)
    }

    /// Writes trials.csv: per trial its fitness, and the mean over the steps and the last
    /// value of each measure, with every digit.
    pub fn write_trials(
        &self,
        conditions: &[Condition],
        measured: &[Measured],
    ) -> Result<(), Error> {
        let header = ["condition", "trial", "metric", "time_mean", "end"];
        let mut rows = Vec::new();
        for (condition, measured) in conditions.iter().zip(measured) {
            for (index, trial) in measured.trials.iter().enumerate() {
                let mut push = |metric: &str, mean: f64, end: String| {
                    let (condition, trial) = (condition.name.clone(), index.to_string());
                    rows.push(vec![condition, trial, metric.to_owned(), mean.to_string(), end]);
                };
                push("fitness", trial.fitness, String::new());
                for (metric, name) in measured.metrics.iter().enumerate() {
                    let Some(mean) = time_mean(measured, index, metric) else { continue };
                    let end = measured.course(index, metric).last().filter(|end| !end.is_nan());
                    push(name, mean, end.map_or_else(String::new, |end| end.to_string()));
                }
            }
        }
        self.write_table("trials.csv", &header, &rows)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, text: &str) -> Result<(), Error> {
        fs::write(self.unfinished.path().join(name), text)
            .map_err(|error| unwritable(&self.to.join(name), &error))
    }

    fn write_table(&self, name: &str, header: &[&str], rows: &[Vec<String>]) -> Result<(), Error> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let written = table
            .write_record(header)
            .and_then(|()| rows.iter().try_for_each(|row| table.write_record(row)))
            .map_err(|error| Error::Internal(error.to_string()));
        written?;
        let bytes = table.into_inner().map_err(|error| Error::Internal(error.to_string()))?;
        self.write(name, &String::from_utf8_lossy(&bytes))
    }

    /// Puts the files where they belong.
    pub fn finish(self) -> Result<(), Error> {
        let Self { to, unfinished } = self;
        fs::create_dir_all(&to).map_err(|error| unwritable(&to, &error))?;
        for name in NAMES {
            let path = to.join(name);
            fs::rename(unfinished.path().join(name), &path)
                .map_err(|error| unwritable(&path, &error))?;
        }
        Ok(())
    }
}

fn unwritable(path: &Path, error: &io::Error) -> Error {
    Error::Input(format!("cannot write {}: {error}", path.display()))
}

/// The shortest number that agrees in six significant digits.
fn six_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().expect("a number was just written");
    // Rust writes no exponents: nothing here is so small that this matters.
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_evaluation_replaces_another_only_if_told_to_and_when_it_is_complete() {
        let dir = tempfile::tempdir().unwrap();
        let to = dir.path().join("a/b");
        let write = |replace, text: &str| {
            let results = Results::begin(&to, replace)?;
            NAMES.iter().try_for_each(|name| results.write(name, text))?;
            Ok::<_, Error>(results)
        };
        write(false, "unfinished").unwrap();
        assert!(!to.exists());
        write(false, "first").unwrap().finish().unwrap();
        assert_eq!(write(false, "second").err().unwrap().exit_code(), 2);
        write(true, "second").unwrap();
        assert_eq!(fs::read_to_string(to.join("trials.csv")).unwrap(), "first");
        write(true, "third").unwrap().finish().unwrap();
        assert_eq!(fs::read_to_string(to.join("trials.csv")).unwrap(), "third");
        assert_eq!(fs::read_dir(&to).unwrap().count(), NAMES.len());
    }

    #[test]
    fn six_digits_are_kept() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (2.0 / 3.0, "0.666667"),
            (123_456.789, "123457"),
            (-0.000_123_456_7, "-0.000123457"),
        ] {
            assert_eq!(six_digits(value), text);
        }
    }
}
