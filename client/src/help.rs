//! The pages of `--help`: commands in groups by what somebody wants to do, and the options of the
//! connection on request alone. Manual pages and completions have all options anyway.

use std::{env, ffi::OsString};

use clap::{ArgMatches, Command, CommandFactory as _, error::Error};

use crate::args::{Args, EXAMPLES, MORE};

/// The option that shows everything.
const ALL: &str = "--help-all";
/// Longest lines of help.
pub const WIDTH_MAX: usize = 100;
/// Heading of the options that only `--help-all` shows.
pub const CONNECTION: &str = "Where experiments are";
/// Commands that work on a directory and on nothing else, or begin one: they show its option.
const ON_A_DIRECTORY: [&str; 4] = ["backup", "doctor", "run", "web"];

/// The commands, by what somebody wants to do.
const GROUPS: [(&str, &[&str]); 8] = [
    ("Evolve", &["run", "submit", "fork", "extend", "retry"]),
    ("Look", &["list", "watch", "wait", "logs", "history", "explain", "plot", "replay", "web"]),
    ("Compare and measure", &["compare", "evaluate", "simulate", "individual", "lineage", "bench"]),
    ("Control", &["pause", "resume", "priority", "cancel"]),
    (
        "Keep and share",
        &[
            "get", "label", "archive", "prune", "delete", "export", "verify", "import", "backup",
            "doctor",
        ],
    ),
    ("Fleet", &["workers", "fleet"]),
    ("Experiment files", &["examples", "new", "validate", "schema"]),
    ("Tools", &["completions", "man", "help"]),
];

/// What pages of help show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Extent {
    /// What most people need.
    Ordinary,
    /// All options.
    Everything,
}

/// Reads the command line of this process.
pub fn matches() -> Result<ArgMatches, Error> {
    matches_of(env::args_os().collect(), None)
}

/// Reads a command line; its help has the width of the terminal, or another.
fn matches_of(line: Vec<OsString>, width: Option<usize>) -> Result<ArgMatches, Error> {
    let line = with_words_of_help(line);
    let mut options = line.iter().take_while(|word| *word != "--");
    let extent =
        if options.any(|word| word == ALL) { Extent::Everything } else { Extent::Ordinary };
    definition(extent, width).try_get_matches_from(line)
}

/// `help COMMAND --all` is `COMMAND --help-all`.
fn with_words_of_help(line: Vec<OsString>) -> Vec<OsString> {
    let is_all = |word: &OsString| word == "--all" || word == ALL;
    if line.get(1).is_none_or(|word| word != "help") || !line.iter().any(is_all) {
        return line;
    }
    let words = line.into_iter().enumerate();
    let kept = words.filter(|(i, word)| *i != 1 && !is_all(word)).map(|(_, word)| word);
    kept.chain([ALL.into()]).collect()
}

/// The definition of the command line, whose pages of help show so much.
fn definition(extent: Extent, width: Option<usize>) -> Command {
    let mut definition = Args::command();
    if let Some(width) = width {
        definition = definition.term_width(width);
    }
    definition.build();
    let commands = grouped(&definition, width);
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{commands}\n{{all-args}}{{after-help}}"
    );
    definition
        .mut_subcommands(|command| of_extent(command, extent).hide(true))
        .mut_args(|arg| shown(arg, "", extent))
        .override_usage("swarmctl [OPTIONS] <COMMAND>")
        .help_template(template)
        .after_help(EXAMPLES)
        .after_long_help(format!("{EXAMPLES}\n\n{MORE}"))
}

/// A command, and those below it, with as many options in its help.
fn of_extent(command: Command, extent: Extent) -> Command {
    let name = command.get_name().to_owned();
    command
        .mut_subcommands(|command| of_extent(command, extent))
        .mut_args(|arg| shown(arg, &name, extent))
}

/// An option of a command, hidden if it is one of the connection's.
fn shown(arg: clap::Arg, command: &str, extent: Extent) -> clap::Arg {
    let is_subject = arg.get_id() == "data_dir" && ON_A_DIRECTORY.contains(&command);
    let is_hidden = arg.is_hide_set()
        || extent == Extent::Ordinary && arg.get_help_heading() == Some(CONNECTION) && !is_subject;
    // A negative number is a value that an option refuses, and no option of that name.
    let is_value = arg.get_action().takes_values();
    arg.hide(is_hidden).allow_negative_numbers(is_value)
}

/// The definition of the command line, as it is read.
#[cfg(test)]
pub fn definition_for_tests() -> Command {
    definition(Extent::Ordinary, None)
}

/// The list of commands, group by group, in lines of the width.
fn grouped(definition: &Command, width: Option<usize>) -> String {
    let entry = |name: &&'static str| {
        let command = definition.find_subcommand(name)?;
        let mut about = command.get_about().map(ToString::to_string).unwrap_or_default();
        for alias in command.get_visible_aliases() {
            about += &format!(" [alias: {alias}]");
        }
        Some(Command::new(*name).about(about))
    };
    // One list, so that all groups have columns of one width.
    let names = GROUPS.iter().flat_map(|(_, names)| *names);
    let entries = names.filter_map(entry).enumerate().map(|(i, command)| command.display_order(i));
    let mut list = Command::new("list")
        .subcommands(entries)
        .disable_help_subcommand(true)
        .max_term_width(WIDTH_MAX)
        .help_template("{subcommands}");
    if let Some(width) = width {
        list = list.term_width(width);
    }
    let (header, literal) = (*list.get_styles().get_header(), *list.get_styles().get_literal());
    let mut list = list.render_help().ansi().to_string();
    for (heading, names) in GROUPS {
        let first = format!("  {literal}{}{literal:#}", names[0]);
        list = list.replacen(&first, &format!("\n{header}{heading}:{header:#}\n{first}"), 1);
    }
    list.trim_end().to_owned() + "\n"
}

#[cfg(test)]
pub mod tests;
