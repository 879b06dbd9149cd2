//! Objects that move while the shutter is open: frames that show their motion have them in no static structure.

use std::sync::Arc;

use glam::DVec3;

use super::{CompiledScene, Item, Items, relative_boxes};
use crate::bvh::{self, BuildQuality};
use crate::cancel::{Cancelled, IsCancelled};
use crate::scene::Motion;

/// The item that a motion is of.
pub(crate) fn moving_item(items: &Items, motion: &Motion) -> u32 {
    items.index_of(match *motion {
        Motion::Model { model, .. } => Item::Model(model as usize),
        Motion::Sphere { sphere, .. } => Item::Sphere(sphere as usize),
    })
}

/// A scene with a tree over its items without those that move; `None` if none moves. `boxes` are those of all items.
pub(super) fn without_moving(
    compiled: &CompiledScene,
    boxes: &[(DVec3, DVec3)],
    cancelled: &IsCancelled<'_>,
) -> Result<Option<Arc<CompiledScene>>, Cancelled> {
    if !compiled.features.motion {
        return Ok(None);
    }
    let scene = &compiled.scene;
    let items = Items::of(scene);
    let mut moving = vec![false; boxes.len()];
    for motion in scene.motions.iter().filter(|motion| motion.moves(scene)) {
        moving[moving_item(&items, motion) as usize] = true;
    }
    let still: Vec<u32> = items.range().filter(|&item| !moving[item as usize]).collect();
    let of_still: Vec<(DVec3, DVec3)> = still.iter().map(|&item| boxes[item as usize]).collect();
    let relative = relative_boxes(&of_still, compiled.bounds);
    let mut tree = bvh::build_wide(&relative, 1, BuildQuality::Default, cancelled)?;
    for item in tree.blocks.iter_mut().flatten() {
        *item = still[*item as usize];
    }
    Ok(Some(Arc::new(CompiledScene { tree, ..compiled.clone() })))
}
