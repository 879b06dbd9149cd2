//! Quality of a run: the fixed setting or the quality controller that the command line requests.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use rayfarm_farm::ViewRequest;

use super::source::Source;
use crate::app::cli::{ErrorArgs, QualityControlArgs};
use crate::error::CommandError;
use crate::measure::tradeoff::ladder::ladder as measured_ladder;
use crate::measure::tradeoff::table::Table;
use crate::viewer::film::passes::while_moving;
use crate::viewer::quality_controller::{Ladder, QualityController, prior_ladder};

/// Request of a view at rest, and the quality controller for its motion. With a rate to hold, the largest error applies to
/// moving pictures; without one, to all.
///
/// # Errors
/// A table that cannot be used.
pub(super) fn view_quality(
    args: &QualityControlArgs,
    source: &Source,
    wanted: ViewRequest,
    animated: bool,
) -> Result<(ViewRequest, Option<QualityController>), CommandError> {
    Ok(match args.target_fps {
        Some(rate) => {
            let ladder = ladder(&args.error, source, &while_moving(&wanted))?;
            (wanted, Some(QualityController::new(ladder, rate, animated)))
        }
        None => (within_error(&args.error, source, wanted)?, None),
    })
}

/// Request at the fastest setting within the largest error.
///
/// # Errors
/// A table that cannot be used.
pub(super) fn within_error(
    args: &ErrorArgs,
    source: &Source,
    wanted: ViewRequest,
) -> Result<ViewRequest, CommandError> {
    Ok(match args.max_error {
        Some(_) => wanted.at_most(&ladder(args, source, &wanted)?.cheapest()),
        None if args.front.is_some() => {
            let what = "--front is for --max-error, and in view for --target-fps; give one of them as well";
            return Err(CommandError::WrongInput(what.to_owned()));
        }
        None => wanted,
    })
}

fn ladder(args: &ErrorArgs, source: &Source, wanted: &ViewRequest) -> Result<Ladder, CommandError> {
    let ladder = match &args.front {
        Some(path) => {
            let table = Table::read(path).map_err(CommandError::wrong_input)?;
            if table.scene != source.name {
                let (path, of, name) = (path.display(), &table.scene, &source.name);
                tracing::warn!("{path} was measured on {of}, not on {name}: costs and losses may differ");
            }
            let refuse = |problem| CommandError::WrongInput(format!("{}: {problem}", path.display()));
            measured_ladder(&table, wanted).map_err(refuse)?
        }
        None => own_ladder(source, wanted).unwrap_or_else(|| prior_ladder(&source.scene, wanted)),
    };
    Ok(match args.max_error {
        Some(most) => ladder.up_to(most),
        None => ladder,
    })
}

/// The ladder of the table in the scene's folder, if there is a usable one. The log has the reason for which one is unusable.
fn own_ladder(source: &Source, wanted: &ViewRequest) -> Option<Ladder> {
    let path = table_places(&source.path).into_iter().find(|path| path.is_file())?;
    let ladder = Table::read(&path).map_err(|error| error.to_string()).and_then(|table| {
        let ladder = if table.scene == source.name {
            measured_ladder(&table, wanted)
        } else {
            Err(format!("was measured on {}, not on {}", table.scene, source.name))
        };
        ladder.map_err(|problem| format!("{}: {problem}", path.display()))
    });
    match ladder {
        Ok(ladder) => {
            tracing::info!("costs and losses of settings are taken from {}", path.display());
            Some(ladder)
        }
        Err(problem) => {
            tracing::warn!("{problem}; costs and losses are medians over other scenes instead");
            None
        }
    }
}

/// Paths of the table of a scene: `SCENE.tradeoff.csv` in its folder, with or without the extension of the scene's name, or
/// `tradeoff/SCENE.csv` below it.
fn table_places(scene: &Path) -> Vec<PathBuf> {
    let folder = scene.parent().unwrap_or(Path::new(""));
    let named = |name: Option<&OsStr>, suffix: &str| {
        let mut name = name.unwrap_or_default().to_owned();
        name.push(suffix);
        name
    };
    let (whole, stem) = (scene.file_name(), scene.file_stem());
    let same_folder =
        [named(stem, ".tradeoff.csv"), named(whole, ".tradeoff.csv")].map(|name| folder.join(name));
    let below = [named(stem, ".csv"), named(whole, ".csv")].map(|name| folder.join("tradeoff").join(name));
    same_folder.into_iter().chain(below).collect()
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{FrameView, RenderScale};

    use crate::app::cli::ModelArgs;

    use super::*;
    use crate::viewer::quality_controller::Origin;

    const ROOM: &str = include_str!("../../../../models/tradeoff/room.csv");
    const SCENE: &str = "
        render = { width = 32, height = 24 }
        camera = { position = [0, 0, 4], look_at = [0, 0, 0] }
        sphere = [{ center = [0, 0, 0], radius = 1, material = 'red' }]
        material = { red = { diffuse = [0.8, 0.1, 0.1] } }
    ";

    /// Origin of a scene's ladder, with these files in its folder.
    fn origin(scene: &str, files: &[(&str, String)], front: Option<&str>, samples: u32) -> Origin {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("tradeoff")).unwrap();
        std::fs::write(folder.path().join(scene), SCENE).unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let source = Source::load(&folder.path().join(scene), ModelArgs::default(), None).unwrap();
        let view = FrameView { samples, ..FrameView::of(&source.scene) };
        let wanted = ViewRequest { view, scale: RenderScale::Full };
        let front = front.map(|name| folder.path().join(name));
        ladder(&ErrorArgs { max_error: None, front }, &source, &wanted).unwrap().origin()
    }

    fn table_of(scene: &str) -> String {
        ROOM.replace("room.toml", scene)
    }

    #[test]
    fn the_table_in_the_scenes_folder_is_used() {
        for place in ["a.tradeoff.csv", "a.toml.tradeoff.csv", "tradeoff/a.csv", "tradeoff/a.toml.csv"] {
            let found = origin("a.toml", &[(place, table_of("a.toml"))], None, 1);
            assert_eq!(found, Origin::Measured, "{place}");
        }
        assert_eq!(origin("a.toml", &[("b.tradeoff.csv", table_of("a.toml"))], None, 1), Origin::General);
    }

    #[test]
    fn the_general_ladder_replaces_an_unusable_table() {
        let other = [("a.tradeoff.csv", table_of("b.toml"))];
        assert_eq!(origin("a.toml", &other, None, 1), Origin::General);
        let broken = [("a.tradeoff.csv", "no table".to_owned())];
        assert_eq!(origin("a.toml", &broken, None, 1), Origin::General);
        let own = [("a.tradeoff.csv", table_of("a.toml"))];
        assert_eq!(origin("a.toml", &own, None, 25), Origin::General, "25 samples were not measured");
    }

    #[test]
    fn a_table_of_the_command_line_has_priority() {
        let files = [("a.tradeoff.csv", "no table".to_owned()), ("mine.csv", table_of("a.toml"))];
        assert_eq!(origin("a.toml", &files, Some("mine.csv"), 1), Origin::Measured);
    }
}
