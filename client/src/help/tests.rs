//! The commands and options of the pages of help, and their width.

use std::collections::BTreeSet;

use clap::error::ErrorKind;
use clap_complete::Shell;

use super::*;

/// The help that a command line prints.
pub fn printed(line: &str, width: usize) -> String {
    let line = line.split(' ').map(OsString::from).collect();
    let error = matches_of(line, Some(width)).unwrap_err();
    let is_help = ErrorKind::DisplayHelp == error.kind();
    assert!(is_help || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand);
    error.to_string()
}

/// The names of all commands that are not hidden.
fn names() -> Vec<String> {
    let mut definition = Args::command();
    definition.build();
    let shown = definition.get_subcommands().filter(|command| !command.is_hide_set());
    shown.map(|command| command.get_name().to_owned()).collect()
}

#[test]
fn every_command_is_in_one_group() {
    let grouped: Vec<String> = GROUPS.iter().flat_map(Group::names).collect();
    let distinct: BTreeSet<&str> = grouped.iter().map(String::as_str).collect();
    assert_eq!(distinct.len(), grouped.len(), "a command is in two groups");
    let names = names();
    assert_eq!(distinct, names.iter().map(String::as_str).collect());
    for page in ["swarmctl --help", "swarmctl -h", "swarmctl help", "swarmctl"] {
        let page = printed(page, 80);
        for name in &names {
            assert!(page.lines().any(|line| line.starts_with(&format!("  {name} "))), "{name}");
        }
        for Group { heading, .. } in GROUPS {
            assert!(page.contains(&format!("\n\n{heading}:\n")), "{heading}");
        }
        assert!(!page.contains("\nCommands:"), "{page}");
        assert!(!page.contains("referee"), "{page}");
    }
}

#[test]
fn only_help_all_shows_options_of_the_connection() {
    for name in names().iter().filter(|name| *name != "help") {
        let shows = |line: String, option: &str| printed(&line, 80).contains(option);
        for option in ["--coordinator <", "--token-file <", "--tls-ca <", "--plaintext"] {
            for ordinary in ["--help", "-h"] {
                assert!(!shows(format!("swarmctl {name} {ordinary}"), option), "{name}");
            }
            assert!(!shows(format!("swarmctl help {name}"), option), "{name}");
            assert!(shows(format!("swarmctl {name} --help-all"), option), "{name}");
            assert!(shows(format!("swarmctl help {name} --all"), option), "{name}");
        }
        let is_about_it = ON_A_DIRECTORY.contains(&&**name);
        assert_eq!(shows(format!("swarmctl {name} -h"), "--data-dir <"), is_about_it, "{name}");
        assert!(shows(format!("swarmctl {name} -h"), "--help-all"), "{name}");
    }
    assert!(!printed("swarmctl --help", 80).contains("--tls-ca"));
    assert!(printed("swarmctl --help-all", 80).contains("--tls-ca"));
    assert!(printed("swarmctl help --all", 80).contains("--tls-ca"));
}

#[test]
fn the_first_page_fits_the_terminal() {
    for width in [40, 80] {
        for line in ["swarmctl", "swarmctl --help", "swarmctl --help-all"] {
            for line in printed(line, width).lines() {
                assert!(line.chars().count() <= width, "{width}: {line}");
            }
        }
    }
}

#[test]
fn manual_pages_and_completions_have_all_options() {
    let mut script = Vec::new();
    clap_complete::generate(Shell::Bash, &mut Args::command(), "swarmctl", &mut script);
    let mut page = Vec::new();
    clap_mangen::Man::new(Args::command()).render(&mut page).unwrap();
    for text in [script, page] {
        let text = String::from_utf8(text).unwrap().replace("\\-", "-");
        for option in ["--tls-ca", "--token-file", "--data-dir", "--help-all"] {
            assert!(text.contains(option), "{option}");
        }
    }
}
