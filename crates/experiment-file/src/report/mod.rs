//! Collects the problems of a file, and finds the place of each. Both the reader and the checks
//! write to it.

mod names;
mod path;

use std::cell::RefCell;
use std::fmt::{self, Write as _};

use jsonc_parser::ast::Value;
use jsonc_parser::common::Ranged as _;

pub use names::suggestion;
pub(crate) use names::{check_name, unknown_name};
pub(crate) use path::Path;
use path::Segment;

use crate::{ConfigError, Problem, limits};

/// Text of the file, fit for a message: one line, of bounded length.
pub(crate) struct Excerpt<'a>(pub(crate) &'a str);

impl fmt::Display for Excerpt<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, c) in self.0.chars().enumerate() {
            if i == limits::NAME_CHARS {
                return f.write_char('…');
            }
            if c.is_control() {
                write!(f, "{}", c.escape_default())?;
            } else {
                f.write_char(c)?;
            }
        }
        Ok(())
    }
}

/// The text of a problem, or a function that makes it. A function is called only if there is room,
/// which saves costly texts.
pub(crate) trait Message {
    fn text(self) -> String;
}

impl Message for &str {
    fn text(self) -> String {
        self.to_owned()
    }
}

impl Message for String {
    fn text(self) -> String {
        self
    }
}

impl<F: FnOnce() -> String> Message for F {
    fn text(self) -> String {
        self()
    }
}

/// The problems and warnings of a file.
pub(crate) struct Report<'a> {
    root: &'a Value<'a>,
    text: &'a str,
    remarks: RefCell<Remarks>,
}

#[derive(Default)]
struct Remarks {
    problems: Vec<Located>,
    warnings: Vec<Located>,
    /// Problems beyond [`limits::PROBLEMS`].
    n_omitted: usize,
    /// Places whose value is a placeholder for an unreadable value.
    broken: Vec<Path>,
}

struct Located {
    offset: usize,
    problem: Problem,
}

impl<'a> Report<'a> {
    pub(crate) fn new(text: &'a str, root: &'a Value<'a>) -> Self {
        Self { root, text, remarks: RefCell::default() }
    }

    /// Reports a problem at `path`, and marks the place as broken.
    pub(crate) fn problem(&self, path: &Path, message: impl Message) {
        if self.has_room() {
            let (shown, offset) = self.locate(path);
            self.add(&shown, offset, message.text());
            self.remarks.borrow_mut().broken.push(path.clone());
        }
    }

    /// Reports a problem of the text at `offset`, which belongs to `path`.
    pub(crate) fn problem_at(&self, path: &Path, offset: usize, message: impl Message) {
        if self.has_room() {
            self.add(path, offset, message.text());
        }
    }

    /// Reports a conflict of `path` with `others`, unless one of these places is broken and may be
    /// the cause.
    pub(crate) fn conflict(&self, path: &Path, others: &[&Path], message: impl Message) {
        let follows = {
            let remarks = self.remarks.borrow();
            let mut places = others.iter().copied().chain([path]);
            places.any(|place| remarks.broken.iter().any(|broken| broken.overlaps(place)))
        };
        if !follows && self.has_room() {
            let (shown, offset) = self.locate(path);
            self.add(&shown, offset, message.text());
        }
    }

    /// Reports a key that is accepted and ignored.
    pub(crate) fn warning(&self, path: &Path, message: impl Message) {
        if self.remarks.borrow().warnings.len() < limits::PROBLEMS {
            let (shown, offset) = self.locate(path);
            let remark = self.remark(&shown, offset, message.text());
            self.remarks.borrow_mut().warnings.push(remark);
        }
    }

    /// Whether every problem so far is listed, so that all broken places are
    /// known.
    pub(crate) fn is_complete(&self) -> bool {
        self.remarks.borrow().n_omitted == 0
    }

    /// The warnings, or the problems, each in the order of the file.
    pub(crate) fn finish(self) -> Result<Vec<Problem>, ConfigError> {
        fn in_order(mut remarks: Vec<Located>) -> Vec<Problem> {
            remarks.sort_by_key(|remark| remark.offset);
            remarks.into_iter().map(|remark| remark.problem).collect()
        }
        let Remarks { problems, warnings, n_omitted, .. } = self.remarks.into_inner();
        if problems.is_empty() {
            return Ok(in_order(warnings));
        }
        let mut problems = in_order(problems);
        if n_omitted > 0 {
            let message = format!("and {n_omitted} more problems");
            problems.push(Problem { path: String::new(), line: None, message });
        }
        Err(ConfigError { problems })
    }

    /// Counts the problem if there is no room to list it.
    fn has_room(&self) -> bool {
        let mut remarks = self.remarks.borrow_mut();
        let has_room = remarks.problems.len() < limits::PROBLEMS;
        remarks.n_omitted += usize::from(!has_room);
        has_room
    }

    fn add(&self, path: &Path, offset: usize, message: String) {
        let remark = self.remark(path, offset, message);
        self.remarks.borrow_mut().problems.push(remark);
    }

    fn remark(&self, path: &Path, offset: usize, message: String) -> Located {
        let newlines = self.text.as_bytes()[..offset].iter().filter(|&&byte| byte == b'\n');
        let line = Some(1 + newlines.count());
        Located { offset, problem: Problem { path: path.to_string(), line, message } }
    }

    /// The deepest part of `path` that the file has, and its offset.
    fn locate(&self, path: &Path) -> (Path, usize) {
        let mut value = self.root;
        let mut located = (Path::default(), value.range().start);
        for segment in path.segments() {
            let inner = match (segment, value) {
                (Segment::Key(key), Value::Object(object)) => {
                    let property = object.properties.iter().find(|p| p.name.as_str() == key);
                    property.map(|property| (property.range.start, &property.value))
                }
                (&Segment::Index(index), Value::Array(array)) => {
                    array.elements.get(index).map(|element| (element.range().start, element))
                }
                _ => None,
            };
            let Some((offset, inner)) = inner else {
                break;
            };
            located = (located.0.join(segment.clone()), offset);
            value = inner;
        }
        located
    }
}
