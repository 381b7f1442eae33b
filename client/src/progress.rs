//! Output of a command: a progress bar on a terminal, lines elsewhere, or JSON lines.
//! Results go to standard output, remarks to standard error.

use std::{
    collections::VecDeque,
    io::{self, IsTerminal as _, Write},
    time::Duration,
};

use indicatif::{FormattedDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use swarm_proto::v1::{Experiment, GenerationSummary};
use swarm_telemetry::{escape, escape_lines};

use crate::{
    args::OutputFormat,
    error::Error,
    json,
    table::{self, Screen, Table},
    text,
};

/// Generations over which the estimate of the remaining time averages.
const ETA_WINDOW: usize = 20;

/// The outputs of a command, and the progress bar.
pub struct Progress {
    format: OutputFormat,
    stdout: Box<dyn Write + Send>,
    screen: Screen,
    /// Whether a bar can be shown.
    has_terminal: bool,
    /// Hidden unless an experiment is followed on a terminal.
    bar: ProgressBar,
    experiment_id: u64,
    generations: u64,
    /// The latest generations' durations.
    durations_ms: VecDeque<u64>,
}

impl Progress {
    /// Prints to this process's standard output.
    pub fn new(format: OutputFormat) -> Self {
        let has_terminal = io::stdout().is_terminal() && io::stderr().is_terminal();
        let screen = Screen::of_stdout();
        Self { has_terminal, screen, ..Self::to(format, Box::new(io::stdout())) }
    }

    /// Prints to a writer that is not a terminal.
    pub fn to(format: OutputFormat, stdout: Box<dyn Write + Send>) -> Self {
        Self {
            format,
            stdout,
            screen: Screen::default(),
            has_terminal: false,
            bar: ProgressBar::hidden(),
            experiment_id: 0,
            generations: 0,
            durations_ms: VecDeque::new(),
        }
    }

    /// Whether standard output is for programs.
    pub fn is_json(&self) -> bool {
        self.format == OutputFormat::Json
    }

    /// What standard output is shown on.
    pub fn screen(&self) -> Screen {
        self.screen
    }

    /// Prints records in the chosen format. `empty` is printed for people if there are
    /// no records.
    pub fn print_table(
        &mut self,
        table: &Table,
        csv_keys: &[&str],
        records: &[impl Serialize],
        empty: &str,
    ) -> Result<(), Error> {
        let text = match self.format {
            OutputFormat::Json => return self.print(&json::document(&records)),
            // For programs, to the byte.
            OutputFormat::Csv => table::csv(csv_keys, records),
            OutputFormat::Table | OutputFormat::Wide if records.is_empty() => empty.to_owned(),
            // Their cells are escaped; what is left are colours.
            OutputFormat::Table => table.to_text(self.screen),
            OutputFormat::Wide => table.to_wide_text(self.screen),
        };
        self.write(&text)
    }

    /// A line, or several, on standard output. Nothing in it moves the cursor or changes
    /// the direction of text, whoever has chosen it.
    pub fn print(&mut self, text: &str) -> Result<(), Error> {
        self.write(&escape_lines(text))
    }

    fn write(&mut self, text: &str) -> Result<(), Error> {
        let Self { bar, stdout, .. } = self;
        bar.suspend(|| writeln!(stdout, "{text}").and_then(|()| stdout.flush()))
            .map_err(Error::from_stdout)
    }

    /// A remark on standard error.
    pub fn remark(&self, text: &str) {
        // If standard error is closed there is no place left to report to.
        let _ = self.stderr()().write_all(format!("{}\n", escape_lines(text)).as_bytes());
    }

    /// Makes writers to standard error that hide the bar while they write.
    pub fn stderr(&self) -> impl Fn() -> BesideBar + Send + Sync + 'static {
        let bar = self.bar.clone();
        move || BesideBar(bar.clone())
    }

    /// Shows the bar of an experiment, if there is a terminal.
    pub fn begin(&mut self, experiment: &Experiment) {
        self.experiment_id = experiment.id;
        self.generations = experiment.generations;
        if self.has_terminal && !self.is_json() {
            let style = ProgressStyle::with_template("{prefix} {bar:24} {pos}/{len}  {msg}")
                .expect("the template is valid");
            self.bar.set_style(style);
            self.bar.set_length(experiment.generations);
            self.bar.set_prefix(escape(&experiment.name).into_owned());
            self.bar.set_message("waiting for the first generation");
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.tick();
        }
    }

    /// Shows a generation.
    pub fn generation(&mut self, summary: &GenerationSummary) -> Result<(), Error> {
        self.durations_ms.truncate(ETA_WINDOW - 1);
        self.durations_ms.push_front(summary.duration_ms);
        match self.format {
            OutputFormat::Json => {
                self.print(&json::line(&json::GenerationLine::new(self.experiment_id, summary)))
            }
            _ if self.has_terminal => {
                let done = summary.generation + 1;
                let eta = remaining(&self.durations_ms, self.generations.saturating_sub(done));
                let fitness = text::fitness(summary);
                self.bar.set_position(done);
                self.bar.set_message(format!("{fitness}  ETA {}", FormattedDuration(eta)));
                Ok(())
            }
            _ => self.print(&text::generation(summary, self.generations)),
        }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Time that `generations` more will take if they are as fast as the latest ones.
fn remaining(durations_ms: &VecDeque<u64>, generations: u64) -> Duration {
    let mean_ms = durations_ms.iter().sum::<u64>() as f64 / durations_ms.len().max(1) as f64;
    Duration::from_secs((mean_ms * generations as f64 / 1000.0).round() as u64)
}

/// Standard error, beside a bar that may be shown there.
pub struct BesideBar(ProgressBar);

impl Write for BesideBar {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.suspend(|| io::stderr().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

#[cfg(test)]
pub mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    /// Standard output that a test can read.
    #[derive(Debug, Clone, Default)]
    pub struct Captured(Arc<Mutex<Vec<u8>>>);

    impl Captured {
        pub fn progress(&self, format: OutputFormat) -> Progress {
            Progress::to(format, Box::new(self.clone()))
        }

        pub fn lines(&self) -> Vec<String> {
            let text = String::from_utf8(self.0.lock().unwrap().clone()).unwrap();
            text.lines().map(str::to_owned).collect()
        }
    }

    impl Write for Captured {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Standard output whose reader has gone, as with `| head`.
    struct Closed;

    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::BrokenPipe.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn without_a_terminal_each_generation_is_a_line() {
        let captured = Captured::default();
        let mut progress = captured.progress(OutputFormat::Table);
        progress.begin(&Experiment { id: 1, generations: 2, ..Experiment::default() });
        for generation in 0..2 {
            progress.generation(&GenerationSummary { generation, ..Default::default() }).unwrap();
        }
        let lines = captured.lines();
        assert_eq!(lines.len(), 2);
        assert!(lines[1].starts_with("2/2  generation 1  "), "{lines:?}");
    }

    #[test]
    fn the_rest_takes_as_long_as_the_latest_generations() {
        assert_eq!(remaining(&[1500, 2500].into(), 10), Duration::from_secs(20));
        assert_eq!(remaining(&VecDeque::new(), 10), Duration::ZERO);
        let mut progress = Captured::default().progress(OutputFormat::Json);
        for duration_ms in 0..100 {
            progress.generation(&GenerationSummary { duration_ms, ..Default::default() }).unwrap();
        }
        assert_eq!(progress.durations_ms.len(), ETA_WINDOW);
        assert_eq!(progress.durations_ms.front(), Some(&99));
    }

    #[test]
    fn a_closed_pipe_ends_the_output_quietly() {
        let mut progress = Progress::to(OutputFormat::Table, Box::new(Closed));
        assert!(matches!(progress.print("x"), Err(Error::OutputClosed)));
    }
}
