//! The dial as a command line asks for it.

use super::source::Source;
use crate::cli::{DialArgs, ErrorArgs};
use crate::dial::{Dial, Ladder, measured_ladder, prior_ladder};
use crate::error::CommandError;
use crate::tradeoff::table::Table;
use crate::wanted::WantedPicture;

/// What a window shall show when it rests, and the dial for when it moves. With a rate to hold, the largest error is for
/// moving pictures; without one, for all.
///
/// # Errors
/// A table that cannot be used.
pub(super) fn turned(
    args: &DialArgs,
    source: &Source,
    wanted: WantedPicture,
    animated: bool,
) -> Result<(WantedPicture, Option<Dial>), CommandError> {
    Ok(match args.target_fps {
        Some(rate) => (wanted, Some(Dial::new(ladder(&args.error, source, &wanted)?, rate, animated))),
        None => (within(&args.error, source, wanted)?, None),
    })
}

/// The picture at the fastest setting that loses no more than is allowed.
///
/// # Errors
/// A table that cannot be used.
pub(super) fn within(
    args: &ErrorArgs,
    source: &Source,
    wanted: WantedPicture,
) -> Result<WantedPicture, CommandError> {
    Ok(match args.max_error {
        Some(_) => ladder(args, source, &wanted)?.cheapest().applied(&wanted),
        None if args.front.is_some() => {
            let what = "--front is for --max-error, and in view for --target-fps; give one of them as well";
            return Err(CommandError::WrongInput(what.to_owned()));
        }
        None => wanted,
    })
}

fn ladder(args: &ErrorArgs, source: &Source, wanted: &WantedPicture) -> Result<Ladder, CommandError> {
    let ladder = match &args.front {
        Some(path) => {
            let table = Table::read(path).map_err(CommandError::wrong_input)?;
            if table.scene != source.name {
                let (path, of, name) = (path.display(), &table.scene, &source.name);
                tracing::warn!(
                    "{path} was measured on {of}, not on {name}: what settings cost and lose may be other here"
                );
            }
            let told = |problem| CommandError::WrongInput(format!("{}: {problem}", path.display()));
            measured_ladder(&table, wanted).map_err(told)?
        }
        None => prior_ladder(&source.scene, wanted),
    };
    Ok(match args.max_error {
        Some(most) => ladder.up_to(most),
        None => ladder,
    })
}
