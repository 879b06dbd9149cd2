//! The scenes of a farm: the current one, and those whose assets a worker may still request.

use std::collections::BTreeSet;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use super::Assets;
use crate::farm_scene::FarmScene;

/// Most scenes that are kept although no frame shows them. A worker may request the scene of a frame that has just been
/// superseded, and undoing a change shows the previous scene again.
const MAX_RECENT: usize = 8;

/// The scenes of a farm. New frames show the current one. Former scenes are kept while frames show them, and the last
/// [`MAX_RECENT`] longer. Scenes share the bytes of the meshes and textures that they have in common.
#[derive(Debug)]
pub(crate) struct SceneTable(RwLock<Scenes>);

#[derive(Debug)]
struct Scenes {
    current: Arc<Assets>,
    /// Former scenes, the last one first.
    former: Vec<Arc<Assets>>,
    /// Number of times that the scene was replaced.
    replaced: u64,
}

impl SceneTable {
    /// The table of one scene.
    pub(crate) fn new(assets: Arc<Assets>) -> Self {
        Self(RwLock::new(Scenes { current: assets, former: Vec::new(), replaced: 0 }))
    }

    /// Makes a scene the current one. Keeps the former scenes in `shown` and the last [`MAX_RECENT`].
    pub(crate) fn replace(&self, assets: Arc<Assets>, shown: &BTreeSet<AssetId>) {
        let mut scenes = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let id = assets.scene();
        let before = std::mem::replace(&mut scenes.current, assets);
        scenes.former.insert(0, before);
        scenes.former.retain(|former| former.scene() != id);
        let mut recent = 0;
        scenes.former.retain(|former| {
            recent += 1;
            recent <= MAX_RECENT || shown.contains(&former.scene())
        });
        scenes.replaced += 1;
    }

    /// The hash of the current scene's body.
    pub(crate) fn current(&self) -> AssetId {
        self.read().current.scene()
    }

    /// Number of times that the scene was replaced.
    pub(crate) fn times_replaced(&self) -> u64 {
        self.read().replaced
    }

    /// The bytes of an asset; `None` if it is no asset of a scene in the table.
    pub(crate) fn get(&self, id: AssetId) -> Option<Bytes> {
        let scenes = self.read();
        scenes.all().find_map(|assets| assets.get(id))
    }

    /// Whether an asset is of a scene in the table.
    pub(crate) fn has(&self, id: AssetId) -> bool {
        self.get(id).is_some()
    }

    /// The scene of a body in the table.
    pub(crate) fn scene(&self, id: AssetId) -> Option<Arc<FarmScene>> {
        let scenes = self.read();
        scenes.all().find(|assets| assets.scene() == id).map(|assets| assets.drawn().clone())
    }

    fn read(&self) -> RwLockReadGuard<'_, Scenes> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Scenes {
    fn all(&self) -> impl Iterator<Item = &Arc<Assets>> {
        std::iter::once(&self.current).chain(&self.former)
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{Scene, Sphere};

    use super::*;
    use crate::testing::test_scene;

    /// The assets of a scene that differs from those of other numbers.
    fn assets(number: u32) -> Arc<Assets> {
        let sphere = Sphere {
            center: glam::DVec3::X * f64::from(number),
            radius: 1.0,
            material: 0,
            inside_out: false,
            uv_rotate: glam::DVec3::ZERO,
        };
        let scene = Scene { spheres: vec![sphere], ..test_scene::scene() };
        Arc::new(Assets::new(FarmScene { scene, meshes: Vec::new(), textures: Vec::new() }).unwrap())
    }

    fn id(number: u32) -> AssetId {
        assets(number).scene()
    }

    #[test]
    fn scenes_that_are_shown_remain_and_the_last_few() {
        let table = SceneTable::new(assets(0));
        let shown = BTreeSet::from([id(0)]);
        let last = 3 * MAX_RECENT as u32;
        (1..=last).for_each(|number| table.replace(assets(number), &shown));
        assert_eq!((table.current(), table.times_replaced()), (id(last), u64::from(last)));
        assert!(table.has(id(0)), "a frame shows it");
        let recent = last - MAX_RECENT as u32;
        for number in 1..=last {
            assert_eq!(table.has(id(number)), number >= recent, "scene {number} of {last}");
        }
        table.replace(assets(last + 1), &BTreeSet::new());
        assert!(!table.has(id(0)), "no frame shows it any more");
    }

    #[test]
    fn a_scene_that_returns_is_in_the_table_once() {
        let table = SceneTable::new(assets(0));
        for _ in 0..20 {
            table.replace(assets(1), &BTreeSet::new());
            table.replace(assets(0), &BTreeSet::new());
        }
        assert_eq!(table.current(), id(0));
        assert_eq!(table.read().all().count(), 2);
        let sphere = |id| table.scene(id).unwrap().scene.spheres[0].center.x;
        assert_eq!((sphere(id(0)), sphere(id(1))), (0.0, 1.0));
        assert!(table.scene(id(2)).is_none() && !table.has(id(2)));
    }
}
