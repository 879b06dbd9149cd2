//! A tile of rays, from what they see to their colours.

use super::RayCounts;
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::shade::{self, Colors};
use crate::simd::Simd;
use crate::stage::{Stage, Watch};
use crate::tile;
use crate::tile::visible::{EyeTile, Visible};

/// Room for a tile, kept from tile to tile; and whether the next one is still wanted.
pub(super) struct Scratch<'a> {
    cancelled: &'a dyn Fn() -> bool,
    visible: Visible,
    tile: tile::Scratch,
    shade: shade::Scratch,
}

impl<'a> Scratch<'a> {
    pub(super) fn new(frame: &PreparedFrame, cancelled: &'a dyn Fn() -> bool) -> Self {
        let (visible, tile) = (Visible::empty(), tile::Scratch::new());
        Self { cancelled, visible, tile, shade: shade::Scratch::new(frame) }
    }
}

/// Colours of the rays of a tile, in linear light. A function of its own on each level: whoever renders tiles calls the same
/// one, because it takes long to compile.
///
/// # Errors
/// [`Cancelled`]: the question is asked once a tile, before it is traced.
#[inline(never)]
pub(super) fn trace<'a, S: Simd, W: Watch>(
    simd: S,
    tile: &EyeTile<'_>,
    scratch: &'a mut Scratch<'_>,
    counts: &mut RayCounts,
    watch: &mut W,
) -> Result<&'a Colors, Cancelled> {
    if (scratch.cancelled)() {
        return Err(Cancelled);
    }
    watch.enter(Stage::Visible);
    for lanes in tile.live {
        counts.primary += u64::from(lanes.count_ones());
    }
    let Scratch { visible, tile: room, shade: shading, .. } = scratch;
    simd.vectorize(
        #[inline(always)]
        || {
            tile.find_visible(simd, visible, room);
            shade::shade(simd, tile, visible, shading, room, counts, watch);
        },
    );
    Ok(&shading.colors)
}
