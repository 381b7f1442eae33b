//! The pages of `--help`: commands in groups by purpose, and the options of the connection on
//! request only. Manual pages and completions always have all options.

use std::{env, ffi::OsString};

use clap::{ArgMatches, Command, CommandFactory as _, Subcommand as _, error::Error};

use crate::{
    cli::{Args, EXAMPLES, WIDTH_MAX, more},
    commands::{
        control::Control, fleet::Fleet, individual::Measure, keep::Keep, look::Look, submit::Evolve,
    },
    settings::CONNECTION,
};

/// The option that shows all options.
const ALL: &str = "--help-all";
/// Commands that work only on a data directory, or create one: their help shows --data-dir.
const ON_A_DIRECTORY: [&str; 4] = ["backup", "doctor", "run", "web"];

/// Commands of one purpose: a family of requests, and the commands before and after it in the
/// help.
struct Group {
    heading: &'static str,
    before: &'static [&'static str],
    family: fn(Command) -> Command,
    after: &'static [&'static str],
}

/// All commands.
const GROUPS: [Group; 8] = [
    group("Evolve", &["run"], Evolve::augment_subcommands, &[]),
    group("Look", &[], Look::augment_subcommands, &["plot", "replay", "web"]),
    group(
        "Compare and measure",
        &["compare", "evaluate", "simulate"],
        Measure::augment_subcommands,
        &["bench"],
    ),
    group("Control", &[], Control::augment_subcommands, &[]),
    group(
        "Keep and share",
        &[],
        Keep::augment_subcommands,
        &["export-controller", "verify", "backup", "doctor"],
    ),
    group("Fleet", &[], Fleet::augment_subcommands, &[]),
    group("Experiment files", &["examples", "new", "validate", "schema"], no_family, &[]),
    group("Tools", &["completions", "man", "help"], no_family, &[]),
];

const fn group(
    heading: &'static str,
    before: &'static [&'static str],
    family: fn(Command) -> Command,
    after: &'static [&'static str],
) -> Group {
    Group { heading, before, family, after }
}

fn no_family(command: Command) -> Command {
    command
}

impl Group {
    /// The names of its commands, in the order of the help.
    fn names(&self) -> Vec<String> {
        let family = (self.family)(Command::new("family"));
        let of_family = family.get_subcommands().map(|command| command.get_name().to_owned());
        let [before, after] =
            [self.before, self.after].map(|names| names.iter().map(|name| (*name).to_owned()));
        before.chain(of_family).chain(after).collect()
    }
}

/// The options that a page of help shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Extent {
    /// The options that most people need.
    Ordinary,
    /// All options.
    Everything,
}

/// Reads the command line of this process.
pub fn matches() -> Result<ArgMatches, Error> {
    matches_of(env::args_os().collect(), None)
}

/// Reads a command line. `width`: the width of the help; none: that of the terminal.
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

/// The definition of the command line, with these options in its pages of help.
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
        .after_long_help(format!("{EXAMPLES}\n\n{}", more()))
}

/// A command and its subcommands, with these options in the help.
fn of_extent(command: Command, extent: Extent) -> Command {
    let name = command.get_name().to_owned();
    command
        .mut_subcommands(|command| of_extent(command, extent))
        .mut_args(|arg| shown(arg, &name, extent))
}

/// An option of a command, hidden if it configures the connection.
fn shown(arg: clap::Arg, command: &str, extent: Extent) -> clap::Arg {
    let is_subject = arg.get_id() == "data_dir" && ON_A_DIRECTORY.contains(&command);
    let is_hidden = arg.is_hide_set()
        || extent == Extent::Ordinary && arg.get_help_heading() == Some(CONNECTION) && !is_subject;
    // A negative number is an invalid value, not an unknown option.
    let is_value = arg.get_action().takes_values();
    arg.hide(is_hidden).allow_negative_numbers(is_value)
}

/// The definition of the command line for parsing.
#[cfg(test)]
pub fn definition_for_tests() -> Command {
    definition(Extent::Ordinary, None)
}

/// The list of commands, group by group, in lines of the width.
fn grouped(definition: &Command, width: Option<usize>) -> String {
    let groups: Vec<(&str, Vec<String>)> =
        GROUPS.iter().map(|group| (group.heading, group.names())).collect();
    let entry = |name: &String| definition.find_subcommand(name).cloned();
    // One list, so that the columns of all groups have one width.
    let names = groups.iter().flat_map(|(_, names)| names);
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
    for (heading, names) in &groups {
        let first = format!("  {literal}{}{literal:#}", names[0]);
        list = list.replacen(&first, &format!("\n{header}{heading}:{header:#}\n{first}"), 1);
    }
    list.trim_end().to_owned() + "\n"
}

#[cfg(test)]
pub mod tests;
