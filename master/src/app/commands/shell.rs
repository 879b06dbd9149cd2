//! `completions` and `man`: descriptions of the command lines for shells and for `man`, made from their definitions.

use std::fs;
use std::io::{self, Write};

use clap::ValueEnum;

use crate::app::cli::{CompletionsArgs, ManArgs, Program};
use crate::error::CommandError;

/// Prints a script of completions on standard output.
///
/// # Errors
/// Standard output that cannot be written.
pub(super) fn completions(args: CompletionsArgs) -> Result<(), CommandError> {
    io::stdout()
        .write_all(&script(args))
        .map_err(|error| CommandError::failed(format!("cannot write the script: {error}")))
}

fn script(args: CompletionsArgs) -> Vec<u8> {
    let mut command_line = args.program.command_line();
    let name = command_line.get_name().to_owned();
    // Into memory first: `generate` panics where its output cannot be written.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command_line, name, &mut script);
    script
}

/// Writes a manual page of section 1 for each program, and one for each command.
///
/// # Errors
/// A folder that cannot be written.
pub(super) fn man(args: &ManArgs) -> Result<(), CommandError> {
    let write = || {
        fs::create_dir_all(&args.folder)?;
        Program::value_variants()
            .iter()
            .try_for_each(|program| clap_mangen::generate_to(program.command_line(), &args.folder))
    };
    write().map_err(|error| CommandError::failed(format!("{}: {error}", args.folder.display())))
}

#[cfg(test)]
mod tests {
    use clap_complete::Shell;

    use super::*;

    #[test]
    fn every_shell_gets_a_script_that_names_the_options() {
        for shell in Shell::value_variants() {
            for (program, option) in [(Program::Master, "crease-angle"), (Program::Worker, "cache-limit")] {
                let script = String::from_utf8(script(CompletionsArgs { shell: *shell, program })).unwrap();
                assert!(script.contains(option), "{shell}, {program:?}: {script}");
            }
        }
    }

    #[test]
    fn there_is_a_page_for_each_program_and_command() {
        let folder = tempfile::tempdir().unwrap();
        man(&ManArgs { folder: folder.path().join("man1") }).unwrap();
        for (page, text) in [
            ("rayfarm-master.1", "check\\-numerics"),
            ("rayfarm-master-render.1", "wait\\-for\\-workers"),
            ("rayfarm-worker.1", "cache\\-limit"),
        ] {
            let page = fs::read_to_string(folder.path().join("man1").join(page)).unwrap();
            assert!(page.contains(text), "{page}");
        }
    }
}
