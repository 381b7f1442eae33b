//! Lines on standard error while a bar is shown there.

use std::io::{self, Write};

use indicatif::ProgressBar;

/// Standard error, beside a bar that may be shown there.
pub struct BesideBar(pub(super) ProgressBar);

impl Write for BesideBar {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.suspend(|| io::stderr().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}
