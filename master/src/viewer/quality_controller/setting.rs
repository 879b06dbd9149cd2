//! What a rung does to a picture: some knobs turned down, the others left where they are.

use rayfarm_tracer::scene::{ColorDepth, ExponentPrecision, Filter, Quality, RenderScale, Scene, Shading};

use crate::viewer::view_request::ViewRequest;

/// What reduced colours leave of the bytes: two of three, and less where both are compressed; in the mean of the figures in
/// the project's README.
const REDUCED_BYTES: f64 = 0.6;

/// What a picture's pixels come to on the wire, in pixels of full colours.
pub(super) fn bytes(picture: &ViewRequest) -> f64 {
    let colors = match picture.view.quality.colors {
        ColorDepth::Exact => 1.0,
        ColorDepth::Reduced => REDUCED_BYTES,
    };
    colors * picture.scale.factor().powi(2) * f64::from(picture.view.width) * f64::from(picture.view.height)
}

/// Positions that no knob stands above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Setting {
    /// Rays per pixel at most.
    pub(crate) samples: u32,
    /// The largest scale.
    pub(crate) scale: RenderScale,
    /// Whether shadows may be cast.
    pub(crate) shadows: bool,
    /// The most terms.
    pub(crate) shading: Shading,
    /// The best precision of the highlight's power.
    pub(crate) exponent: ExponentPrecision,
    /// Whether all samples are traced only where neighbours differ.
    pub(crate) adaptive: bool,
    /// Whether textures are looked up at the nearest texel.
    pub(crate) nearest: bool,
    /// The most colours.
    pub(crate) colors: ColorDepth,
}

impl Setting {
    /// Leaves every picture as it is.
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

    /// The one that makes this of the full picture.
    pub(crate) fn of(picture: &ViewRequest) -> Self {
        let Quality { adaptive, shadows, shading, filter, exponent, colors, dither: _ } =
            picture.view.quality;
        let (samples, scale) = (picture.view.samples, picture.scale);
        let nearest = filter == Some(Filter::Nearest);
        Self { samples, scale, shadows, shading, exponent, adaptive, nearest, colors }
    }

    /// The picture at this setting. No knob is turned up.
    pub(crate) fn applied(&self, wanted: &ViewRequest) -> ViewRequest {
        let mut picture = *wanted;
        picture.scale = wanted.scale.min(self.scale);
        picture.view.samples = wanted.view.samples.min(self.samples);
        let quality = &mut picture.view.quality;
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
        picture
    }

    /// This without what makes no difference to pictures of a scene: the same pixels would come, and no sooner.
    pub(crate) fn for_scene(&self, scene: &Scene) -> Self {
        let shadows = scene.lights.iter().any(|light| light.shadows);
        let mut shining = scene.materials.iter().filter(|material| material.is_specular()).peekable();
        let specular = shining.peek().is_some();
        let powers = shining.any(|material| !material.has_squared_highlight());
        let mut setting = *self;
        setting.shadows |= !shadows;
        // Without the term, its precision is nobody's business.
        if !specular {
            setting.shading = Shading::Full;
        }
        if !powers || setting.shading == Shading::Diffuse {
            setting.exponent = ExponentPrecision::Exact;
        }
        setting
    }
}
