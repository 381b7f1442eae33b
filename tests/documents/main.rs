//! What documents state agrees with what is in the sources. Needs no fleet.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod logs;
mod reliability;
mod versions;
