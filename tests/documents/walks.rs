//! The outputs on pages are those of the programs.
//!
//! A walk goes through the blocks of a page from top to bottom, in a directory of its own. A
//! block marked `console` has commands, each after `$ `, and below each its output: all of
//! standard output, and the lines of standard error that help the reader. A line `...` stands for
//! any lines. A block with `title="NAME"` is written to that file. Other blocks are not run.
//! Equal means equal to the last digit, except for times, speeds, dates, ports, and the size and
//! digest of archives, which contain times. The version of the database's schema may differ, too.
//!
//! `UPDATE_DOCS=1 cargo test -p fleet-tests --test documents walks` writes the present output
//! into the pages: read the difference before you commit it.

use std::{
    env, fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::Command,
};

use harness::{Outcome, binary, workspace_file};
use regex_lite::Regex;
use tempfile::TempDir;

/// A line that stands for any number of lines.
const ANY_LINES: &str = "...";

/// A command with the output that the page shows.
#[derive(Debug, PartialEq, Eq)]
struct Step {
    command: String,
    /// Lines of the page with the output.
    output: std::ops::Range<usize>,
}

/// A part of a walk.
#[derive(Debug, PartialEq, Eq)]
enum Part {
    Step(Step),
    File { name: String, text: String },
}

/// The parts of a page.
fn parts(lines: &[String]) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let indent = lines[at].len() - lines[at].trim_start().len();
        let Some(info) = lines[at].trim_start().strip_prefix("```") else {
            at += 1;
            continue;
        };
        let begin = at + 1;
        let is_end = |line: &String| line.trim() == "```";
        let end = begin + lines[begin..].iter().position(is_end).expect("blocks end");
        if info == "console" {
            parts.extend(steps(&lines[..end], begin).into_iter().map(Part::Step));
        } else if let Some((_, title)) = info.split_once("title=\"") {
            let name = title.trim_end_matches('"').to_owned();
            let block = lines[begin..end].iter();
            let text =
                block.map(|line| format!("{}\n", line.get(indent..).unwrap_or(""))).collect();
            parts.push(Part::File { name, text });
        }
        at = end + 1;
    }
    parts
}

/// The commands of a block from a line on.
fn steps(lines: &[String], mut at: usize) -> Vec<Step> {
    let is_command = |line: &String| line.trim_start().starts_with("$ ");
    let mut steps = Vec::new();
    while at < lines.len() {
        let mut command = lines[at].trim_start().strip_prefix("$ ").expect("a command").to_owned();
        at += 1;
        while command.ends_with('\\') {
            command.push('\n');
            command.push_str(&lines[at]);
            at += 1;
        }
        let length = lines[at..].iter().position(is_command).unwrap_or(lines.len() - at);
        steps.push(Step { command, output: at..at + length });
        at += length;
    }
    steps
}

/// Replaces the parts of texts that differ between any two runs.
struct Normaliser(Vec<(Regex, &'static str)>);

impl Normaliser {
    fn new() -> Self {
        let rules = [
            (r"\b[0-9][0-9.,e+]* episodes/s", "SPEED"),
            (r"\b\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?Z?", "DATE"),
            (r"\b\d+(\.\d+)? ?(ns|µs|ms|s|min|h|d)\b", "TIME"),
            (r"\b\d+ bytes, SHA-256 [0-9a-f]{64}", "SHA-256"),
            (r"SHA-256 [0-9a-f]{64}", "SHA-256"),
            (r"schema version \d+", "schema"),
            // The program prints the ETA only while much work remains.
            (r" +ETA \d\d:\d\d:\d\d", ""),
            (r"127\.0\.0\.1:\d+", "ADDRESS"),
            // The widths of rules and columns depend on the widest time.
            (r"[ \t]+", " "),
            ("─+", "─"),
        ];
        Self(rules.map(|(from, to)| (Regex::new(from).unwrap(), to)).into())
    }

    fn apply(&self, line: &str) -> String {
        let mut line = line.trim().to_owned();
        for (from, to) in &self.0 {
            line = from.replace_all(&line, *to).into_owned();
        }
        line
    }

    /// Whether lines of a page consist of the whole output and of any of the remarks, in their
    /// order.
    fn agree(&self, shown: &[String], output: &[String], remarks: &[String]) -> bool {
        let apply = |lines: &[String]| -> Vec<String> {
            lines.iter().map(|line| self.apply(line)).collect()
        };
        consist(&apply(shown), &apply(output), &apply(remarks))
    }
}

/// [`Normaliser::agree`] for lines that are normalised.
fn consist(shown: &[String], output: &[String], remarks: &[String]) -> bool {
    let Some((line, rest)) = shown.split_first() else { return output.is_empty() };
    if line == ANY_LINES {
        return (0..=output.len()).any(|n| consist(rest, &output[n..], remarks));
    }
    if output.first() == Some(line) && consist(rest, &output[1..], remarks) {
        return true;
    }
    let remark = remarks.iter().position(|remark| remark == line);
    remark.is_some_and(|at| consist(rest, output, &remarks[at + 1..]))
}

/// An output in the form of the page: it keeps as many lines before and after `...` as the page.
fn abridged(shown: &[String], output: Vec<String>) -> Vec<String> {
    let is_any = |line: &String| line.trim() == ANY_LINES;
    let Some(before) = shown.iter().position(is_any) else { return output };
    let after = shown.len() - 1 - shown.iter().rposition(is_any).expect("there is one");
    if before + after >= output.len() {
        return output;
    }
    let (first, last) = (&output[..before], &output[output.len() - after..]);
    [first, &[ANY_LINES.to_owned()], last].concat()
}

/// The directory of a walk, and the environment of its commands.
struct Walk {
    directory: TempDir,
}

impl Walk {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        for name in ["configs", "results"] {
            symlink(workspace_file(name), directory.path().join(name)).unwrap();
        }
        Self { directory }
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.directory.path().join(name), text).unwrap();
    }

    /// Runs a command as a shell would, with the programs of this build and without the settings
    /// of the person who runs the test.
    fn run(&self, command: &str) -> Outcome {
        let programs = binary("swarmctl");
        let programs = programs.parent().expect("a directory");
        let path = env::var_os("PATH").unwrap_or_default();
        let paths = [programs.to_owned()].into_iter().chain(env::split_paths(&path));
        let mut shell = Command::new("bash");
        for (name, _) in env::vars_os() {
            if name.to_string_lossy().starts_with("SWARM_") {
                shell.env_remove(&name);
            }
        }
        shell
            .args(["-c", command])
            .current_dir(self.directory.path())
            .env("PATH", env::join_paths(paths).unwrap())
            .env("XDG_CONFIG_HOME", self.directory.path())
            // Keeps commands from reaching a coordinator that happens to run on this machine.
            .env("SWARM_DATA_DIR", "./swarm-data");
        Outcome::of_command(&mut shell)
    }
}

/// Runs the commands of a page. Returns the differences from the page, or, with `UPDATE_DOCS`,
/// writes the outputs to the page.
fn walk(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).unwrap();
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let (walk, normaliser) = (Walk::new(), Normaliser::new());
    let mut differences = Vec::new();
    let mut updated = lines.clone();
    let parts = parts(&lines);
    assert!(parts.iter().any(|part| matches!(part, Part::Step(_))), "{}", page.display());
    // Number of lines that the page has gained so far.
    let mut shift = 0_isize;
    for part in parts {
        let Step { command, output: place } = match part {
            Part::File { name, text } => {
                walk.write(&name, &text);
                continue;
            }
            Part::Step(step) => step,
        };
        let shown = &lines[place.clone()];
        let outcome = walk.run(&command);
        let lines_of = |text: &str| text.lines().map(str::to_owned).collect::<Vec<String>>();
        let (output, remarks) = (lines_of(&outcome.stdout), lines_of(&outcome.stderr));
        // Commands that fail say so in a line of the page.
        let is_failure = outcome.code != Some(0);
        let shows_failure = remarks.last().is_some_and(|last| shown.contains(last));
        if (!is_failure || shows_failure) && normaliser.agree(shown, &output, &remarks) {
            continue;
        }
        let new = abridged(shown, [output, remarks].concat());
        let begin = place.start.checked_add_signed(shift).unwrap();
        shift += isize::try_from(new.len()).unwrap() - isize::try_from(shown.len()).unwrap();
        updated.splice(begin..begin + shown.len(), new.clone());
        differences.push(format!(
            "$ {command}\nthe page shows:\n{}\nthe program ends with {:?} and prints:\n{}",
            shown.join("\n"),
            outcome.code,
            new.join("\n")
        ));
    }
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(page, updated.join("\n") + "\n").unwrap();
        return Vec::new();
    }
    differences
}

fn assert_true(pages: &[&str]) {
    for page in pages {
        let page: PathBuf = workspace_file(page);
        let differences = walk(&page);
        assert!(
            differences.is_empty(),
            "{}: {} commands; UPDATE_DOCS=1 writes what they print today\n\n{}",
            page.display(),
            differences.len(),
            differences.join("\n\n")
        );
    }
}

#[test]
fn the_tutorial_shows_what_its_commands_print() {
    assert_true(&["docs/tutorial.md"]);
}

#[test]
fn pages_show_what_their_commands_print() {
    assert_true(&[
        "README.md",
        "docs/evaluation.md",
        "docs/howto/compare.md",
        "docs/howto/publish.md",
        "docs/data.md",
        "docs/robots.md",
        "docs/tasks.md",
    ]);
}

fn agree(shown: &str, output: &str) -> bool {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<String>>();
    Normaliser::new().agree(&lines(shown), &lines(output), &lines("a remark\nanother"))
}

#[test]
fn only_times_speeds_and_other_chance_values_may_differ() {
    let output = "first\nmean 0.17  3.1 s  2595 episodes/s\nlast";
    assert!(agree(output, output));
    assert!(agree("first\nmean 0.17  12 ms  1 episodes/s\nlast", output));
    assert!(agree("a remark\nfirst\n...\nlast", output));
    assert!(agree("...", output));
    for wrong in [
        "first\nmean 0.18  3.1 s  2595 episodes/s\nlast",
        "first\nlast",
        "first\n...\nmore\nlast",
        "another\na remark\nfirst\n...\nlast",
        "",
    ] {
        assert!(!agree(wrong, output), "{wrong}");
    }
}
