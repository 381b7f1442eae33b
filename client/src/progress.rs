//! Output of a command: a progress bar on a terminal, lines elsewhere, or JSON lines.
//! Results go to standard output, remarks to standard error.

mod answers;
mod beside_bar;
mod followed;

use std::{
    collections::BTreeMap,
    io::{self, IsTerminal as _, Write},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use console::measure_text_width;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use schemars::JsonSchema;
use serde::Serialize;
use swarm_telemetry::{escape, escape_lines};

use crate::{
    clock,
    error::Error,
    output_format::OutputFormat,
    place::Place,
    settings::Settings,
    table::{self, Screen, Table},
    text, waiting,
};

pub use beside_bar::BesideBar;

use self::followed::Followed;

/// Without a bar, the interval between reports on long work.
const STEP_PAUSE: Duration = Duration::from_secs(10);
/// Narrower terminals show only numbers, without a bar and a name.
const BAR_SCREEN_WIDTH: usize = 70;
/// The bar with the spaces around it.
const BAR_WIDTH: usize = 26;

/// The outputs of a command, and the progress bar.
pub struct Progress {
    pub format: OutputFormat,
    stdout: Box<dyn Write + Send>,
    /// The reason why standard output is closed, if it is.
    unwritten: Unwritten,
    /// The reaction to a closed standard output.
    when_closed: WhenClosed,
    screen: Screen,
    /// Characters per line of remarks; none if they go to no terminal.
    remark_width: Option<usize>,
    /// Whether to leave out remarks.
    is_silent: bool,
    /// Whether to print everything about followed experiments.
    is_verbose: bool,
    /// Whether a bar can be shown.
    has_terminal: bool,
    /// Hidden unless an experiment is followed on a terminal.
    bar: ProgressBar,
    /// The followed experiments, by number.
    followed: BTreeMap<u64, Followed>,
    /// Without a bar: the time of the next report, and the work done at the last one.
    next_word: Option<(Instant, u64)>,
}

/// A part of an answer for people. Only tables have colours, which are added on printing, after
/// the cells are escaped.
#[derive(Debug, Clone)]
pub enum Part {
    /// Lines of text.
    Text(String),
    /// A table, as wide as the terminal.
    Table(Table),
}

impl Part {
    /// Lines of text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }
}

/// The reaction of a command when the reader of standard output closes it, like `| head`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WhenClosed {
    /// It finishes its work without printing more.
    GoOn,
    /// The reader has gone; the work continues.
    HasGone,
    /// It ends, because printing is its only work.
    End,
}

/// The reason why standard output is incomplete, if it is.
#[derive(Debug, Clone, Default)]
pub struct Unwritten(Arc<Mutex<Option<Error>>>);

impl Unwritten {
    /// The error of a command that has succeeded except for its output.
    pub fn end(self) -> Result<(), Error> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }
}

impl Progress {
    /// Prints to this process's standard output.
    pub fn new(format: OutputFormat) -> Self {
        let has_terminal = io::stdout().is_terminal() && io::stderr().is_terminal();
        let screen = Screen::of_stdout();
        let remark_width = table::stderr_width();
        Self { has_terminal, screen, remark_width, ..Self::to(format, Box::new(io::stdout())) }
    }

    /// Prints to a writer that is not a terminal.
    pub fn to(format: OutputFormat, stdout: Box<dyn Write + Send>) -> Self {
        Self {
            format,
            stdout,
            unwritten: Unwritten::default(),
            when_closed: WhenClosed::GoOn,
            screen: Screen::default(),
            remark_width: None,
            is_silent: false,
            is_verbose: false,
            has_terminal: false,
            bar: ProgressBar::hidden(),
            followed: BTreeMap::new(),
            next_word: None,
        }
    }

    /// Sets whether to print everything about followed experiments, or only the
    /// essential.
    pub fn with_details(self, is_verbose: bool) -> Self {
        Self { is_verbose, ..self }
    }

    /// Whether to print everything about followed experiments.
    pub fn is_verbose(&self) -> bool {
        self.is_verbose
    }

    /// The handle that tells at the end whether standard output is complete.
    pub fn unwritten(&self) -> Unwritten {
        self.unwritten.clone()
    }

    /// Leaves out remarks.
    pub fn silent(self) -> Self {
        Self { is_silent: true, ..self }
    }

    /// Ends the command, instead of continuing, when the reader of standard output goes.
    pub fn end_with_reader(&mut self) {
        self.when_closed = WhenClosed::End;
    }

    /// Whether standard output is for programs.
    pub fn is_json(&self) -> bool {
        self.format == OutputFormat::Json
    }

    /// Prints records in the chosen format. `empty` is printed for people if there are
    /// no records.
    pub fn print_table(
        &mut self,
        table: &Table,
        csv_keys: &[&str],
        records: &[impl Serialize + JsonSchema],
        empty: &str,
    ) -> Result<(), Error> {
        let text = match self.format {
            OutputFormat::Json => return self.print_document(&records),
            // For programs, to the byte.
            OutputFormat::Csv => table::csv(csv_keys, records),
            OutputFormat::Table | OutputFormat::Wide if records.is_empty() => {
                return self.print(empty);
            }
            // Cells are already escaped; only colours remain.
            OutputFormat::Table => table.to_text(self.screen),
            OutputFormat::Wide => table.to_wide_text(self.screen),
        };
        self.write(&text)
    }

    /// A line, or several, on standard output.
    pub fn print(&mut self, text: &str) -> Result<(), Error> {
        self.write(&self.shown(text))
    }

    /// Text and tables for people, one below the other.
    pub fn print_parts(&mut self, parts: &[Part]) -> Result<(), Error> {
        let shown = parts.iter().map(|part| match part {
            Part::Text(text) => self.shown(text),
            Part::Table(table) if self.format == OutputFormat::Wide => {
                table.to_wide_text(self.screen)
            }
            Part::Table(table) => table.to_text(self.screen),
        });
        let shown: Vec<String> = shown.collect();
        self.write(&shown.join("\n"))
    }

    /// Text as it is printed: it cannot move the cursor or change the direction of text, even
    /// if its author is untrusted.
    fn shown(&self, text: &str) -> String {
        let text = escape_lines(text);
        match self.screen.width.filter(|_| self.format == OutputFormat::Table) {
            Some(width) => text::wrapped(&text, width),
            None => text.into_owned(),
        }
    }

    fn write(&mut self, text: &str) -> Result<(), Error> {
        if self.when_closed == WhenClosed::HasGone {
            return Ok(());
        }
        let Self { bar, stdout, .. } = self;
        let written = bar.suspend(|| writeln!(stdout, "{text}").and_then(|()| stdout.flush()));
        match written.map_err(Error::from_stdout) {
            Err(Error::OutputClosed) if self.when_closed == WhenClosed::GoOn => {
                self.when_closed = WhenClosed::HasGone;
                self.remark("standard output is closed; the command continues without it");
                Ok(())
            }
            // A full disk ends no computation; the error comes at the end.
            Err(error) if self.when_closed == WhenClosed::GoOn => {
                self.when_closed = WhenClosed::HasGone;
                *self.unwritten.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                Ok(())
            }
            written => written,
        }
    }

    /// A remark on standard error.
    pub fn remark(&self, text: &str) {
        if self.is_silent {
            return;
        }
        let text = text::fitting(text, self.remark_width);
        // If standard error is closed, no place for reports is left.
        let _ = self.stderr()().write_all(format!("{}\n", escape_lines(&text)).as_bytes());
    }

    /// Prints the place, unless the user has named it.
    pub fn found(&self, place: &Place) {
        match place {
            Place::Directory { path, is_found: true } => self.remark(&text::found(path)),
            Place::Directory { .. } => {}
            Place::Coordinator(settings) => self.expiring(settings),
        }
    }

    /// Warns about certificates of the connection that expire soon.
    pub fn expiring(&self, settings: &Settings) {
        let now = clock::today();
        for expiry in settings.credentials.expiries().near(now) {
            self.remark(&format!("warning: {}", expiry.text(now)));
        }
    }

    /// Makes writers to standard error that hide the bar while they write.
    pub fn stderr(&self) -> impl Fn() -> BesideBar + Send + Sync + 'static {
        let bar = self.bar.clone();
        move || BesideBar(bar.clone())
    }

    /// Shows the bar, and as much of a message beside it as fits.
    fn show_bar(&self, name: String, length: u64, message: &str) {
        let template = match self.screen.width {
            Some(..BAR_SCREEN_WIDTH) => "{pos}/{len}  {msg}",
            _ if name.is_empty() => "{bar:24} {pos}/{len}  {msg}",
            _ => "{prefix} {bar:24} {pos}/{len}  {msg}",
        };
        let style = ProgressStyle::with_template(template).expect("the template is valid");
        self.bar.set_style(style);
        self.bar.set_length(length);
        self.bar.set_prefix(name);
        self.bar.set_message(text::cut(message, self.message_room()));
        // Shows a removed bar again, with its new texts.
        if self.bar.is_finished() {
            self.bar.reset();
        }
        // A new target would draw below the output of the previous one.
        if self.bar.is_hidden() {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.tick();
    }

    /// Shows the progress of long work: in a bar, or in occasional lines.
    pub fn step(&mut self, n_done: u64, n_all: u64, what: &str) {
        if let Some(line) = self.word(clock::now(), n_done, n_all, what) {
            return self.remark(&line);
        }
        // A bar of a single step would only flash.
        if self.has_terminal && !self.is_json() && n_all > 1 {
            self.show_bar(String::new(), n_all, &escape(what));
            self.bar.set_position(n_done);
        }
    }

    /// The line about a step, if there is no bar and a report is due.
    fn word(&mut self, now: Instant, n_done: u64, n_all: u64, what: &str) -> Option<String> {
        if self.has_terminal && !self.is_json() {
            return None;
        }
        // Less progress than before means that new work has begun.
        let planned = self.next_word.filter(|&(_, n_before)| n_before <= n_done);
        let next = planned.map_or(now + waiting::SILENCE_MAX, |(next, _)| next);
        let is_due = now >= next;
        self.next_word = Some((if is_due { now + STEP_PAUSE } else { next }, n_done));
        is_due.then(|| format!("{n_done}/{n_all} {what}"))
    }

    /// Shows the first of these texts beside the bar, as many as fit.
    fn set_message(&self, parts: &[String]) {
        self.bar.set_message(fitting(parts, self.message_room()));
    }

    /// Free columns beside the bar and the numbers of generations.
    fn message_room(&self) -> usize {
        let Some(width) = self.screen.width else { return usize::MAX };
        let numbers = format!("{0}/{0}  ", self.bar.length().unwrap_or_default()).len();
        let bar = match width {
            ..BAR_SCREEN_WIDTH => 0,
            _ => measure_text_width(&self.bar.prefix()) + BAR_WIDTH,
        };
        width.saturating_sub(numbers + bar + 1)
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// The first of these texts, as many as fit.
fn fitting(parts: &[String], room: usize) -> String {
    let mut message = String::new();
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let separator = if message.is_empty() { "" } else { "  " };
        if measure_text_width(&message) + separator.len() + measure_text_width(part) > room {
            break;
        }
        message += separator;
        message += part;
    }
    message
}

#[cfg(test)]
pub mod tests;
