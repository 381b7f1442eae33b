//! The output on real terminals of any width, and without a terminal.

use harness::Terminal;

use crate::data_directory::DataDirectory;

const ESCAPE: char = '\u{1b}';

/// Commands whose answers are for people, and fit every terminal.
const FOR_PEOPLE: [&str; 23] = [
    "list",
    "list --state running",
    "history 1",
    "history 1 --dynamics",
    "logs 1",
    "explain 1",
    "explain",
    "workers",
    "watch 1",
    "wait 1",
    "label 1 user=ada",
    "compare 1",
    "compare swarm-data/leader_selection_snes-1.champion.json history-1.csv",
    "simulate 1@0/3",
    "evaluate 1 --trials 2 --robots 5,8 --to evaluation --force",
    "plot 1 --to plot.svg --force",
    "plot history.csv --to plot.svg --force",
    "export 1 --to bundle.zip --force",
    "verify bundle.zip",
    "validate experiment.json",
    "doctor",
    "run experiment.json",
    "delete 1 --dry-run",
];

/// The visible text, without colours; a move of the cursor begins another line.
fn seen(line: &str) -> String {
    let mut seen = String::new();
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        if c != ESCAPE {
            seen.push(c);
        } else if chars.next() == Some('[') {
            let end = chars.find(|c| ('@'..='~').contains(c));
            seen.extend(end.filter(|end| *end != 'm').map(|_| '\n'));
        }
    }
    seen
}

fn directory() -> DataDirectory {
    let directory = DataDirectory::new();
    std::fs::copy(directory.path().join("history.csv"), directory.path().join("history-1.csv"))
        .unwrap();
    directory
}

fn terminal(directory: &DataDirectory, columns: usize) -> Option<Terminal> {
    let terminal = Terminal::find(directory.path(), columns)?;
    Some(terminal.with("SWARM_DATA_DIR", "swarm-data").with("SWARM_CONFIG", ""))
}

#[test]
fn no_answer_is_wider_than_the_terminal_or_shows_escape_codes() {
    let directory = directory();
    let mut problems = Vec::new();
    for columns in [40, 80, 200] {
        let Some(terminal) = terminal(&directory, columns) else { return };
        for command in FOR_PEOPLE {
            let shown = terminal.swarmctl(command, "");
            if shown.code != Some(0) || shown.stdout.contains("\\u001b") {
                problems.push(format!("{command}, {columns}: {shown:#?}"));
            }
            for line in seen(&shown.stdout).split(['\n', '\r']) {
                // Text for copying, such as commands and digests, is never wrapped.
                let is_whole = line.trim_start().starts_with("-> ") || !line.trim().contains(' ');
                if !is_whole && line.trim_end().chars().count() > columns {
                    problems.push(format!("{command}, {columns}: {line}"));
                }
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn no_error_is_wider_than_the_terminal() {
    let directory = directory();
    let Some(terminal) = terminal(&directory, 40) else { return };
    for command in ["plot 1 --to history.csv", "history 4711", "verify history.csv"] {
        let shown = terminal.swarmctl(command, "");
        let text = seen(&shown.stdout);
        assert!(shown.code != Some(0) && text.contains("error: "), "{command}: {shown:#?}");
        let widths = text.split(['\n', '\r']).map(|line| line.trim_end().chars().count());
        assert!(widths.max() <= Some(40), "{command}: {text}");
    }
    let piped = terminal.swarmctl("plot 1 --to history.csv 2>&1 | cat", "").stdout;
    assert!(piped.lines().any(|line| line.chars().count() > 40), "{piped}");
}

#[test]
fn colours_do_not_move_columns_and_appear_only_on_terminals_or_on_request() {
    let directory = directory();
    let Some(terminal) = terminal(&directory, 80) else { return };
    let tables = ["list", "history 1", "compare 1", "simulate 1@0/3"];
    for command in tables {
        let coloured = terminal.swarmctl(command, "").expect_success().stdout;
        assert!(coloured.contains("\u{1b}[1m"), "{command} has no colours: {coloured}");
        for (name, value) in [("NO_COLOR", "1"), ("TERM", "dumb"), ("CLICOLOR", "0")] {
            let plain = terminal.clone().with(name, value).swarmctl(command, "");
            let plain = plain.expect_success().stdout;
            assert!(!plain.contains(ESCAPE), "{command}, {name}: {plain}");
            if name == "NO_COLOR" {
                assert_eq!(seen(&coloured), plain, "{command}");
            }
        }
        for pipe in ["cat", "head -40"] {
            let piped = terminal.swarmctl(&format!("{command} 2>&1 | {pipe}"), "").stdout;
            assert!(!piped.contains(ESCAPE), "{command} | {pipe}: {piped}");
        }
        let forced = terminal.clone().with("CLICOLOR_FORCE", "1");
        let forced = forced.swarmctl(&format!("{command} | cat"), "").stdout;
        assert!(forced.contains("\u{1b}[1m"), "{command} has no colours: {forced}");
        // Programs get no colours, even if these are forced.
        let json = terminal.clone().with("CLICOLOR_FORCE", "1");
        let json = json.swarmctl(&format!("{command} --output json"), "").stdout;
        assert!(!json.contains(ESCAPE), "{command}: {json}");
    }
}

#[test]
fn a_group_is_deleted_only_if_somebody_types_yes() {
    let directory = directory();
    directory.swarmctl("run experiment.json --seeds 0..1 --group pair").expect_success();
    let Some(terminal) = terminal(&directory, 80) else { return };
    let count = || {
        let listed = directory.swarmctl("list pair --output csv").stdout;
        listed.lines().count() - 1
    };
    for typed in ["no\n", "\n", "yess\n", ""] {
        let asked = terminal.swarmctl("delete pair", typed);
        assert_eq!(asked.code, Some(2), "{typed:?}: {asked:#?}");
        let question = "delete 2 experiments? This cannot be undone. Type yes to go on:";
        assert!(asked.stdout.contains(question), "{typed:?}: {}", asked.stdout);
        assert!(asked.stdout.contains("nothing was done"), "{typed:?}: {}", asked.stdout);
        assert_eq!(count(), 2, "{typed:?}");
    }
    let done = terminal.swarmctl("delete pair", "yes\n").expect_success();
    assert!(!done.stdout.contains("error"), "{}", done.stdout);
    let rest = directory.swarmctl("list --output csv").expect_success().stdout;
    assert_eq!(rest.lines().count(), 2, "experiment 1, outside the group, is left: {rest}");
}
