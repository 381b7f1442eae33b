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
    /// For programs: one document, or one object per line while a command follows something (run,
    /// watch, fleet, web, --watch).
    Json,
    /// For spreadsheets: tables only (front, history, list, repertoire, workers).
    Csv,
}
