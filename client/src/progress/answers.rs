//! Answers for programs, whose types have schemas.

use schemars::JsonSchema;
use serde::Serialize;

use super::Progress;
#[cfg(test)]
use crate::commands::answers::tests::check;
use crate::{error::Error, json};

impl Progress {
    /// The answer of a command for programs, as one JSON document.
    pub fn print_document(&mut self, answer: &(impl Serialize + JsonSchema)) -> Result<(), Error> {
        #[cfg(test)]
        check(answer);
        self.print(&json::document(answer))
    }

    /// A part of the answer of a command for programs, as one line of JSON.
    pub fn print_line(&mut self, answer: &(impl Serialize + JsonSchema)) -> Result<(), Error> {
        #[cfg(test)]
        check(answer);
        self.print(&json::line(answer))
    }
}
