//! Requested pictures.

use rayfarm_tracer::image::{self, ImageError, RgbImage};
use rayfarm_tracer::scene::{
    FrameView, Integrator, Lens, PixelFormat, Quality, RenderScale, Setting, Shading,
};

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
    /// Sample count, scale and knobs.
    pub fn setting(&self) -> Setting {
        self.view.setting(self.scale)
    }

    /// The request with upper limits of its knobs. No knob is raised.
    #[must_use]
    pub fn at_most(&self, limit: &Setting) -> Self {
        let Setting { samples, scale, quality } = self.setting().at_most(limit);
        Self { view: FrameView { samples, quality, ..self.view }, scale }
    }

    /// The view that the farm renders.
    pub fn rendered(&self) -> FrameView {
        self.view.at(&self.setting())
    }

    /// The request for an auxiliary picture of the same view: numbers of what the centre of each pixel shows, without light. See
    /// [`Shading`].
    #[must_use]
    pub fn auxiliary(&self, shading: Shading) -> Self {
        let view = FrameView {
            integrator: Integrator::Direct,
            lens: Lens::default(),
            samples: 1,
            first_sample: 0,
            quality: Quality { shading, ..self.view.quality },
            format: PixelFormat::Linear,
            ..self.view
        };
        Self { view, ..*self }
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
    fn an_auxiliary_picture_shows_the_same_view_without_light() {
        let lens = Lens { aperture: 0.5, focus_distance: None };
        let view = FrameView { samples: 64, first_sample: 3, lens, spin: 4.0, ..test_scene::view() };
        let auxiliary = ViewRequest::from(view).auxiliary(Shading::Depth);
        let FrameView { quality, format, samples, first_sample, lens, .. } = auxiliary.view;
        assert_eq!((quality.shading, format), (Shading::Depth, PixelFormat::Linear));
        assert_eq!((samples, first_sample, lens), (1, 0, Lens::default()));
        assert_eq!((auxiliary.view.camera, auxiliary.view.spin), (view.camera, view.spin));
        assert_eq!(auxiliary.view.validate(), Ok(()));
    }

    #[test]
    fn a_limit_lowers_knobs_and_scale() {
        let request = ViewRequest::from(FrameView { samples: 9, ..test_scene::view() });
        let limit = Setting { samples: 4, scale: RenderScale::Half, ..Setting::FULL };
        assert_eq!(request.at_most(&limit).setting(), Setting { quality: request.view.quality, ..limit });
        assert_eq!(request.at_most(&Setting::FULL), request);
    }
}
