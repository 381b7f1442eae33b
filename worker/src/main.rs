//! The program `worker`.

use std::process::ExitCode;

fn main() -> ExitCode {
    worker::program::main(std::env::args_os())
}
