//! The dial as a command line asks for it.

use rayfarm_tracer::scene::Scene;

use crate::cli::{DialArgs, ErrorArgs};
use crate::dial::{Dial, Ladder, prior_ladder};
use crate::wanted::WantedPicture;

/// What a window shall show when it rests, and the dial for when it moves. With a rate to hold, the largest error is for
/// moving pictures; without one, for all.
pub(super) fn turned(
    args: &DialArgs,
    scene: &Scene,
    wanted: WantedPicture,
    animated: bool,
) -> (WantedPicture, Option<Dial>) {
    match args.target_fps {
        Some(rate) => (wanted, Some(Dial::new(ladder(&args.error, scene, &wanted), rate, animated))),
        None => (within(&args.error, scene, wanted), None),
    }
}

/// The picture at the fastest setting that loses no more than is allowed.
pub(super) fn within(args: &ErrorArgs, scene: &Scene, wanted: WantedPicture) -> WantedPicture {
    match args.max_error {
        Some(_) => ladder(args, scene, &wanted).cheapest().applied(&wanted),
        None => wanted,
    }
}

fn ladder(args: &ErrorArgs, scene: &Scene, wanted: &WantedPicture) -> Ladder {
    let ladder = prior_ladder(scene, wanted);
    match args.max_error {
        Some(most) => ladder.up_to(most),
        None => ladder,
    }
}
