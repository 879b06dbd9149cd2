//! `compile`: a model with its bounding volume hierarchy, as one file that loads fast.

use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use rayfarm_tracer::files::write_whole;
use rayfarm_tracer::mesh::{BuildQuality, CompileOptions};
use rayfarm_tracer::scene;

use crate::app::cli::{CompileArgs, Quality};
use crate::app::output::check_writable;
use crate::display::numbers::counted;
use crate::error::CommandError;

/// Reads a model, builds its hierarchy and writes both; prints the counts on standard output.
///
/// # Errors
/// A wrong model or output; a full disk.
pub(super) fn run(args: &CompileArgs) -> Result<(), CommandError> {
    check_writable(&args.output)?;
    refuse_the_model_itself(args)?;
    let options = CompileOptions { quality: build_quality(args.quality), ..CompileOptions::default() };
    let started = Instant::now();
    let folder = args.output.parent().unwrap_or(Path::new(""));
    let (mesh, warnings) =
        scene::compile_model_with(&args.model, folder, options, args.models.load_options(None))
            .map_err(CommandError::wrong_input)?;
    let seconds = started.elapsed().as_secs_f64();
    for warning in warnings {
        tracing::warn!("{warning}");
    }
    write_whole(&args.output, mesh.bytes())
        .map_err(|error| CommandError::Failed(format!("{}: {error}", args.output.display())))?;
    let line = format!(
        "{}: {}, {}, read and built in {seconds:.2} s",
        args.output.display(),
        counted(mesh.triangle_count() as u64, "triangle"),
        counted(mesh.bytes().len() as u64, "byte"),
    );
    writeln!(io::stdout().lock(), "{line}")
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}

fn build_quality(quality: Quality) -> BuildQuality {
    match quality {
        Quality::Fast => BuildQuality::Fast,
        Quality::Default => BuildQuality::Default,
        Quality::High => BuildQuality::High,
    }
}

/// Refuses to overwrite the model by its own compiled form.
fn refuse_the_model_itself(args: &CompileArgs) -> Result<(), CommandError> {
    let real = |path: &Path| path.canonicalize().ok();
    match (real(&args.model), real(&args.output)) {
        (Some(model), Some(output)) if model == output => Err(CommandError::WrongInput(format!(
            "{}: is the model itself; choose another name for the compiled one, as in {}",
            args.output.display(),
            args.output.with_extension("rfm").display()
        ))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::app::cli::ModelArgs;

    #[test]
    fn a_model_is_not_overwritten_by_its_own_compiled_form() {
        let folder = tempfile::tempdir().unwrap();
        let model = folder.path().join("a.obj");
        fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let output = folder.path().join(".").join("a.obj");
        let args = CompileArgs {
            model: model.clone(),
            output,
            quality: Quality::Default,
            models: ModelArgs::default(),
        };
        let message = run(&args).unwrap_err().to_string();
        assert!(message.contains("a.rfm"), "{message}");
        assert!(fs::read_to_string(&model).unwrap().starts_with("v 0 0 0"));
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("a.rfm");
        fs::create_dir_all(occupied.join("in the way")).unwrap();
        assert!(write_whole(&occupied, b"bytes").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
