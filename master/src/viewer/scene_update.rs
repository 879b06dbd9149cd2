//! A scene that replaces the shown one.

use std::sync::Arc;

use rayfarm_farm::{Assets, ViewRequest};
use rayfarm_tracer::scene::{Camera, FrameView, Scene};

/// A scene that replaces the shown one, with the settings of its file before and after the change.
#[derive(Clone, Debug)]
pub(crate) struct SceneUpdate {
    /// What workers receive.
    pub(crate) assets: Arc<Assets>,
    /// View of the former scene, as its file has it.
    before: ViewRequest,
    /// View of the new scene, as its file has it.
    after: ViewRequest,
}

/// The view that a scene has by itself.
pub(super) fn view_of(scene: &Scene) -> ViewRequest {
    ViewRequest { view: FrameView::of(scene), scale: scene.render.scale }
}

impl SceneUpdate {
    /// The change to a scene from one with the view `before`.
    pub(super) fn new(before: ViewRequest, assets: Arc<Assets>, after: ViewRequest) -> Self {
        Self { assets, before, after }
    }

    /// The camera of the new scene, if it is another one.
    pub(super) fn camera(&self) -> Option<Camera> {
        let camera = self.after.view.camera;
        (camera != self.before.view.camera).then_some(camera)
    }

    /// The shown view with the settings that differ between the files: what was set by options or keys remains otherwise, and
    /// so do camera and size.
    pub(super) fn applied(&self, shown: ViewRequest) -> ViewRequest {
        let (before, after) = (&self.before.view, &self.after.view);
        let mut view = shown.view;
        replace_if_changed(&mut view.integrator, &before.integrator, &after.integrator);
        replace_if_changed(&mut view.samples, &before.samples, &after.samples);
        replace_if_changed(&mut view.quality, &before.quality, &after.quality);
        replace_if_changed(&mut view.tone, &before.tone, &after.tone);
        replace_if_changed(&mut view.lens, &before.lens, &after.lens);
        let mut scale = shown.scale;
        replace_if_changed(&mut scale, &self.before.scale, &self.after.scale);
        match view.validate() {
            Ok(()) => ViewRequest { view, scale },
            // What was set before does not fit the new settings.
            Err(_) => {
                let FrameView { camera, width, height, .. } = shown.view;
                ViewRequest { view: FrameView { camera, width, height, ..*after }, ..self.after }
            }
        }
    }
}

impl PartialEq for SceneUpdate {
    fn eq(&self, other: &Self) -> bool {
        self.assets.scene() == other.assets.scene()
            && (self.before, self.after) == (other.before, other.after)
    }
}

fn replace_if_changed<T: PartialEq + Clone>(shown: &mut T, before: &T, after: &T) {
    if before != after {
        *shown = after.clone();
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_farm::FarmScene;
    use rayfarm_farm::testing::test_scene;
    use rayfarm_tracer::scene::{RenderScale, RenderSettings};

    use super::*;

    /// The update between two scenes with changed settings.
    fn update(change: impl Fn(&mut RenderSettings)) -> SceneUpdate {
        let before = test_scene::scene();
        let mut after = before.clone();
        change(&mut after.render);
        after.camera.fov += 1.0;
        let (before, view) = (view_of(&before), view_of(&after));
        let drawn = FarmScene { scene: after, meshes: Vec::new(), textures: Vec::new() };
        SceneUpdate::new(before, Arc::new(Assets::new(drawn).unwrap()), view)
    }

    #[test]
    fn settings_that_differ_between_the_files_replace_the_shown_ones_and_others_do_not() {
        let mut shown = view_of(&test_scene::scene());
        (shown.view.samples, shown.view.width, shown.view.quality.dither) = (9, 77, true);
        let update = update(|render| (render.tone.exposure, render.scale) = (2.0, RenderScale::Half));
        let applied = update.applied(shown);
        assert_eq!((applied.view.tone.exposure, applied.scale), (2.0, RenderScale::Half));
        assert_eq!((applied.view.samples, applied.view.width, applied.view.quality.dither), (9, 77, true));
        assert_eq!(applied.view.camera, shown.view.camera);
        assert_eq!(update.camera().unwrap().fov, shown.view.camera.fov + 1.0);
    }

    #[test]
    fn a_view_that_would_be_wrong_is_that_of_the_file() {
        let mut shown = view_of(&test_scene::scene());
        shown.view.samples = 9;
        let update = update(|render| render.samples = 5);
        assert!(update.after.view.validate().is_err(), "the test needs a wrong setting");
        shown.view.height = 11;
        assert_eq!(update.applied(shown).view.height, 11);
    }
}
