//! The format in which a command prints its answer.

use clap::ValueEnum;

/// Format of standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// For people: tables fit the terminal; NO_COLOR turns colours off.
    #[value(alias = "text")]
    Table,
    /// Like table, but with all columns at full width.
    Wide,
    /// For programs: `run`, `watch` and `submit --watch` print one
    /// object per line, the other commands one document.
    Json,
    /// For spreadsheets: `list`, `history` and `workers` only.
    Csv,
}
