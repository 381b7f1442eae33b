//! The problems of an experiment file.

use std::fmt;

/// One remark about an experiment file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The place, such as `world.objects.robotA.num_instances`; empty for the whole file.
    pub path: String,
    /// Line in the file, from 1; `None` if the text has no such place (a missing key has its
    /// parent's line).
    pub line: Option<usize>,
    /// The problem, and the allowed values.
    pub message: String,
}

impl Problem {
    /// A problem from its text, as another program printed it. The text of the result is the same,
    /// even if a part is not recognised.
    pub fn parse(text: &str) -> Self {
        let located = text.strip_prefix("line ").and_then(|rest| {
            let (line, rest) = rest.split_once(": ")?;
            Some((line.parse().ok().filter(|number: &usize| number.to_string() == line)?, rest))
        });
        let (line, rest) = located.map_or((None, text), |(line, rest)| (Some(line), rest));
        let is_path = |text: &str| {
            !text.is_empty() && !text.contains(|c: char| c.is_whitespace() || "`'\"".contains(c))
        };
        let (path, message) =
            rest.split_once(": ").filter(|(path, _)| is_path(path)).unwrap_or(("", rest));
        Self { path: path.to_owned(), line, message: message.to_owned() }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.message)
    }
}

/// Every problem of an experiment file; never empty. The caller has to fix the
/// input.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct ConfigError {
    /// In the order of the file.
    pub problems: Vec<Problem>,
}

impl fmt::Display for ConfigError {
    /// One problem per line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            problem.fmt(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_printed_problem_reads_back() {
        for (line, path, message) in [
            (Some(3), "world.objects.robotA.num_instances", "must be 1 or more, is 0"),
            (None, "task.script", "`a.star`: no such file"),
            (None, "", "cannot be read: No such file or directory"),
            (Some(1), "", "`x` is unknown: did you mean `y`?"),
        ] {
            let problem = Problem { path: path.into(), line, message: message.into() };
            assert_eq!(Problem::parse(&problem.to_string()), problem);
        }
        for text in ["line 03: x", "line 3", "", "a: b: c"] {
            assert_eq!(Problem::parse(text).to_string(), text);
        }
    }
}
