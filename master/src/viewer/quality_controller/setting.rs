//! Settings of the knobs: upper limits that a rung applies to a request.

use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Scene, Shading};

use crate::viewer::view_request::ViewRequest;

/// Bytes of a pixel with reduced colours, as a part of those with full ones: two thirds, and less after compression; the mean
/// of the measured scenes.
const REDUCED_BYTES: f64 = 0.6;

/// Size of a picture on the wire, in pixels of full colours.
pub(crate) fn bytes(request: &ViewRequest) -> f64 {
    let colors = match request.view.quality.colors {
        ColorDepth::Exact => 1.0,
        ColorDepth::Reduced => REDUCED_BYTES,
    };
    colors * request.scale.factor().powi(2) * f64::from(request.view.width) * f64::from(request.view.height)
}

/// Upper limits of the knobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Setting {
    /// Largest number of rays per pixel.
    pub(crate) samples: u32,
    /// Largest scale.
    pub(crate) scale: RenderScale,
    /// Whether shadows are allowed.
    pub(crate) shadows: bool,
    /// Most terms of the shading.
    pub(crate) shading: Shading,
    /// Best precision of the specular exponent.
    pub(crate) exponent: ExponentPrecision,
    /// Whether all samples are traced only where neighbours differ.
    pub(crate) adaptive: bool,
    /// Whether textures are sampled at the nearest texel.
    pub(crate) nearest: bool,
    /// Largest colour depth.
    pub(crate) colors: ColorDepth,
}

impl Setting {
    /// The setting that changes no request.
    pub(crate) const FULL: Self = Self {
        samples: u32::MAX,
        scale: RenderScale::Full,
        shadows: true,
        shading: Shading::Full,
        exponent: ExponentPrecision::Exact,
        adaptive: false,
        nearest: false,
        colors: ColorDepth::Exact,
    };

    /// The setting that turns the full request into this one.
    pub(crate) fn of(request: &ViewRequest) -> Self {
        let Quality { adaptive, shadows, shading, filter, exponent, colors, dither: _ } =
            request.view.quality;
        let (samples, scale) = (request.view.samples, request.scale);
        let nearest = filter == Some(Filter::Nearest);
        Self { samples, scale, shadows, shading, exponent, adaptive, nearest, colors }
    }

    /// The request at this setting. No knob is raised.
    pub(crate) fn applied(&self, wanted: &ViewRequest) -> ViewRequest {
        let mut request = *wanted;
        request.scale = wanted.scale.min(self.scale);
        request.view.samples = wanted.view.samples.min(self.samples);
        let quality = &mut request.view.quality;
        quality.shadows &= self.shadows;
        if self.shading == Shading::Diffuse {
            quality.shading = Shading::Diffuse;
        }
        if self.exponent == ExponentPrecision::Fast {
            quality.exponent = ExponentPrecision::Fast;
        }
        quality.adaptive |= self.adaptive;
        if self.nearest {
            quality.filter = Some(Filter::Nearest);
        }
        if self.colors == ColorDepth::Reduced {
            quality.colors = ColorDepth::Reduced;
        }
        request
    }

    /// The setting without limits that do not matter to a scene: without lights that cast shadows, for instance, pixels and
    /// times are the same with shadows on or off.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Self {
        let shadows = scene.lights.iter().any(|light| light.shadows);
        let mut shining = scene.materials.iter().filter(|material| material.is_specular()).peekable();
        let specular = shining.peek().is_some();
        let powers = shining.any(|material| !material.has_squared_highlight());
        let mut setting = *self;
        setting.shadows |= !shadows;
        // Without the specular term, its precision does not matter.
        if !specular {
            setting.shading = Shading::Full;
        }
        if !powers || setting.shading == Shading::Diffuse {
            setting.exponent = ExponentPrecision::Exact;
        }
        setting
    }
}
