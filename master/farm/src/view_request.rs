//! Requested pictures.

use rayfarm_tracer::image::{self, ImageError, RgbImage};
use rayfarm_tracer::scene::{FrameView, RenderScale, Setting};

/// A requested picture, and the scale at which the farm renders it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRequest {
    /// Camera, knobs of the tracer, and the size in which the picture is delivered.
    pub view: FrameView,
    /// Rendered pixels per delivered pixel, along a side.
    pub scale: RenderScale,
}

impl From<FrameView> for ViewRequest {
    /// The request for a view at its full size.
    fn from(view: FrameView) -> Self {
        Self { view, scale: RenderScale::Full }
    }
}

impl ViewRequest {
    /// Integrator, sample count, scale and knobs.
    pub fn setting(&self) -> Setting {
        self.view.setting(self.scale)
    }

    /// The request with upper limits of its knobs. No knob is raised.
    #[must_use]
    pub fn at_most(&self, limit: &Setting) -> Self {
        let setting = self.setting().at_most(limit);
        Self { view: self.view.with_setting(&setting), scale: setting.scale }
    }

    /// The view that the farm renders.
    pub fn rendered(&self) -> FrameView {
        self.view.at(&self.setting())
    }

    /// Resizes a rendered picture to the size in which it is delivered.
    ///
    /// # Errors
    /// A picture whose bytes do not fit its size.
    pub fn delivered(&self, rendered: RgbImage) -> Result<RgbImage, ImageError> {
        image::resize(rendered, self.view.width, self.view.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::test_scene;

    #[test]
    fn a_view_alone_is_requested_at_its_full_size() {
        assert_eq!(ViewRequest::from(test_scene::view()).rendered(), test_scene::view());
    }

    #[test]
    fn a_picture_is_rendered_at_its_scale_and_delivered_in_its_size() {
        let request = ViewRequest { scale: RenderScale::Half, ..test_scene::view().into() };
        let (rendered, view) = (request.rendered(), request.view);
        assert_eq!((rendered.width, rendered.height), (view.width / 2, view.height / 2));
        assert_eq!(FrameView { width: view.width, height: view.height, ..rendered }, view);
        let picture = RgbImage::new(rendered.width, rendered.height);
        assert_eq!(request.delivered(picture).unwrap(), RgbImage::new(view.width, view.height));
    }

    #[test]
    fn a_limit_lowers_knobs_and_scale() {
        let request = ViewRequest::from(FrameView { samples: 9, ..test_scene::view() });
        let limit = Setting { samples: 4, scale: RenderScale::Half, ..Setting::FULL };
        assert_eq!(request.at_most(&limit).setting(), Setting { quality: request.view.quality, ..limit });
        assert_eq!(request.at_most(&Setting::FULL), request);
    }
}
