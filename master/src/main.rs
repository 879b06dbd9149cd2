//! The master of rayfarm: a scene on the screen, rendered by all the machines of a room.

use std::process::ExitCode;

fn main() -> ExitCode {
    rayfarm_master::main_with_args(std::env::args_os())
}
