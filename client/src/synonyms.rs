//! Names that people try for commands, and the matching commands.

use clap::{
    CommandFactory as _, Error,
    error::{ContextKind, ContextValue, ErrorKind},
};

use crate::{cli::Args, file_kind};

/// Other words, and the suggestions for them.
const SYNONYMS: [(&[&str], &str); 10] = [
    (&["stop", "kill", "abort", "end"], "`cancel` ends an experiment"),
    (&["remove", "rm", "purge"], "`delete` deletes an experiment that has ended"),
    (&["start", "launch", "evolve", "train"], "`run` evolves here, `submit` on a fleet"),
    (&["status", "ps", "show", "info"], "`list` has all experiments, `explain` one"),
    (&["tail", "follow", "attach"], "`watch` follows an experiment, `watch --events` all"),
    (&["best", "result", "results", "genotype"], "`champion` prints the best individual"),
    (
        &["check", "lint"],
        "`validate` checks experiment files, `verify` a bundle, `doctor` a database",
    ),
    (&["nodes", "cluster", "hosts"], "`workers` lists the workers"),
    (&["play", "trace", "view"], "`simulate` repeats trials, with `--trace` step by step"),
    (&["graph", "chart", "figure", "draw"], "`plot` draws the fitness of runs"),
];
/// Minimum similarity, in [0, 1], of a command that may have been mistyped.
const SIMILARITY_MIN: f64 = 0.85;

/// An error of the command line. For an unknown command, it suggests commands of the same
/// meaning instead of similar spelling.
pub fn with_suggestions(mut error: Error) -> Error {
    match error.kind() {
        ErrorKind::InvalidSubcommand => {}
        ErrorKind::ValueValidation => {
            if let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue)
                && let Some(tip) = file_kind::of_word(value)
            {
                error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
            return error;
        }
        ErrorKind::UnknownArgument => {
            if let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidArg)
                && word.starts_with('-')
                && word[1..].starts_with(|c: char| c.is_ascii_digit())
            {
                let tip = "a value that begins with - is joined to its option: --OPTION=VALUE";
                error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
            return error;
        }
        _ => return error,
    }
    let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand).cloned()
    else {
        return error;
    };
    error.remove(ContextKind::SuggestedSubcommand);
    error.remove(ContextKind::Suggested);
    if let Some((_, tip)) = SYNONYMS.iter().find(|(names, _)| names.contains(&&*name)) {
        let tips = ContextValue::StyledStrs(vec![(*tip).into()]);
        error.insert(ContextKind::Suggested, tips);
        return error;
    }
    let definition = Args::command();
    let commands = definition.get_subcommands().filter(|command| !command.is_hide_set());
    let names = commands.map(clap::Command::get_name);
    let similar = names.filter(|known| strsim::jaro_winkler(&name, known) > SIMILARITY_MIN);
    let similar: Vec<String> = similar.map(str::to_owned).collect();
    if !similar.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(similar));
    }
    error
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    fn answer(command: &str) -> String {
        with_suggestions(Args::try_parse_from(["swarmctl", command]).unwrap_err()).to_string()
    }

    #[test]
    fn other_words_lead_to_the_intended_command() {
        for (word, command) in [("stop", "`cancel`"), ("status", "`list`"), ("best", "`champion`")]
        {
            let answer = answer(word);
            assert!(answer.contains(command), "{answer}");
        }
    }

    #[test]
    fn a_file_in_the_place_of_an_experiment_is_recognised() {
        let file = crate::experiment_file::tests::quickstart();
        for line in [["watch", file.to_str().unwrap()], ["replay", file.to_str().unwrap()]] {
            let error = Args::try_parse_from(["swarmctl"].iter().chain(&line)).unwrap_err();
            let answer = with_suggestions(error).to_string();
            assert!(
                answer.contains("is an experiment file; use it with: swarmctl run"),
                "{answer}"
            );
        }
    }

    #[test]
    fn negative_numbers_are_refused_as_values() {
        for line in ["run a.json --seed -1", "simulate 1 --trials -3", "evaluate 1 --robots -3"] {
            let line = format!("swarmctl {line}");
            let error = crate::help::definition_for_tests().try_get_matches_from(line.split(' '));
            let answer = with_suggestions(error.unwrap_err()).to_string();
            assert!(answer.contains("invalid value '-"), "{answer}");
            assert!(!answer.contains("-- -"), "{answer}");
        }
        let error = Args::try_parse_from(["swarmctl", "run", "a.json", "--seeds", "-1..3"]);
        let answer = with_suggestions(error.unwrap_err()).to_string();
        assert!(answer.contains("--OPTION=VALUE") && !answer.contains("-- -"), "{answer}");
    }

    #[test]
    fn no_word_is_a_command() {
        let definition = Args::command();
        for word in SYNONYMS.iter().flat_map(|(words, _)| *words) {
            assert!(definition.find_subcommand(word).is_none(), "{word}");
        }
    }

    #[test]
    fn mistyped_commands_are_recognised() {
        for (typed, command) in
            [("sbumit", "submit"), ("valdate", "validate"), ("expalin", "explain")]
        {
            assert!(answer(typed).contains(&format!("'{command}'")), "{}", answer(typed));
        }
        assert!(!answer("xyzzy").contains("tip"));
    }
}
