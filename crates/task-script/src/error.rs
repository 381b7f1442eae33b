//! Problems of scripts, with their place.

/// A problem of a script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {message}")]
pub struct ScriptError {
    /// The script's name.
    pub file: String,
    /// Line of its text, from 1.
    pub line: u32,
    /// The problem.
    pub message: String,
}

/// Most characters of a message that a script writes itself.
pub(crate) const MESSAGE_CHARS: usize = 200;

/// A problem without its file and, at first, without its line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault(Box<(Option<u32>, String)>);

/// A result, or a problem.
pub(crate) type Outcome<T> = Result<T, Fault>;

impl Fault {
    /// A problem of the text.
    pub(crate) fn new(line: u32, message: impl Into<String>) -> Self {
        Self(Box::new((Some(line), message.into())))
    }

    /// Sets the line of the problem, unless it has one already.
    pub(crate) fn at(mut self, line: u32) -> Self {
        self.0.0.get_or_insert(line);
        self
    }

    /// The problem with its place.
    pub(crate) fn into_error(self, file: &str) -> ScriptError {
        let (line, message) = *self.0;
        ScriptError { file: file.to_owned(), line: line.unwrap_or(0), message }
    }
}

impl From<String> for Fault {
    fn from(message: String) -> Self {
        Self(Box::new((None, message)))
    }
}

impl From<&str> for Fault {
    fn from(message: &str) -> Self {
        message.to_owned().into()
    }
}

/// A text, shortened for messages.
pub(crate) fn shortened(text: &str) -> String {
    text.chars().take(MESSAGE_CHARS).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
