//! The page on `coordinator` and `worker` has their own help texts.

use std::{fmt::Write, process::Command};

use harness::binary;

use super::expect_page;

const PAGE: &str = "docs/programs.md";

#[test]
fn the_page_on_programs_has_their_help() {
    let mut expected = String::from(
        "# Options of coordinator and worker\n\nA test compares this page with the programs; \
         `UPDATE_DOCS=1 cargo test -p fleet-tests\n--test documents programs::` writes it.\n",
    );
    for program in ["coordinator", "worker"] {
        // Clears the environment, because its variables would appear as defaults of options.
        let output = Command::new(binary(program))
            .arg("--help")
            .env_clear()
            .env("COLUMNS", "80")
            .output()
            .unwrap();
        let help = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
        let help = lines.join("\n");
        write!(expected, "\n## {program}\n\n```text\n{}\n```\n", help.trim_end()).unwrap();
    }
    expect_page(PAGE, &expected);
}
