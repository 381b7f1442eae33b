//! The program `coordinator`.

use std::process::ExitCode;

fn main() -> ExitCode {
    coordinator::program::main(std::env::args_os())
}
