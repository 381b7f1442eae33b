//! The files of an evaluation. The tables have one row per condition, step or trial,
//! and measure.

use std::path::Path;

use super::{
    conditions::Condition,
    measured::Measured,
    statistics::{Quartiles, mean},
    summary::time_mean,
};
use crate::{
    error::Error,
    output_file::{OutputFiles, Overwrite},
};

/// The names of the files.
pub const NAMES: [&str; 3] = ["steps.csv", "trials.csv", "summary.json"];

/// The files while they are written: an interrupted evaluation leaves everything unchanged.
pub struct Results(OutputFiles);

impl Results {
    /// Refuses a directory that cannot be written, and, without `--force`, one that
    /// already has such files.
    pub fn begin(to: &Path, overwrite: Overwrite) -> Result<Self, Error> {
        Ok(Self(overwrite.begin_files(to, &NAMES)?))
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
                        (mean(&values), Quartiles::from_values(values.clone()))
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

    /// Writes trials.csv: for each trial the fitness, and the mean over the steps and the
    /// last value of each measure, with every digit.
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
        self.0.write(name, text)
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

    /// Moves the files to their destination.
    pub fn finish(self) -> Result<(), Error> {
        self.0.finish()
    }
}

/// The shortest number that agrees in six significant digits.
fn six_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().expect("a number was just written");
    // Rust writes no exponents; no value here is small enough to need one.
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

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
