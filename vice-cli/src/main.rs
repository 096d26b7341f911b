//! The program `vice`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use vice_cli::{Itself, main_from};

fn main() -> ExitCode {
    ExitCode::from(main_from(std::env::args_os(), Itself::this_executable()))
}
