//! `rayfarm-worker`: a render node of rayfarm.

use std::process::ExitCode;

fn main() -> ExitCode {
    rayfarm_worker::cli::main_from(std::env::args_os())
}
