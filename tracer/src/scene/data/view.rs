//! What a frame shows and at which size: camera, background, picture size and sampling.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{Integrator, Lens, PixelFormat, Quality, RenderScale, Scene, Setting, ToneMapping};

/// Picture size and sampling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How light is computed.
    pub integrator: Integrator,
    /// Rays per pixel: with direct light a square number, n * n on a regular grid; any number of paths.
    pub samples: u32,
    /// Quality knobs.
    pub quality: Quality,
    /// Share of width and height that is rendered.
    pub scale: RenderScale,
    /// How light becomes colours.
    pub tone: ToneMapping,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 1024,
            height: 768,
            integrator: Integrator::Direct,
            samples: 1,
            quality: Quality::default(),
            scale: RenderScale::Full,
            tone: ToneMapping::default(),
        }
    }
}

impl RenderSettings {
    /// The default settings with an integrator.
    pub fn with_integrator(integrator: Integrator) -> Self {
        let usual = Self::default();
        let quality = Quality { max_depth: integrator.usual_depth(), ..usual.quality };
        Self { integrator, samples: integrator.usual_samples(), quality, ..usual }
    }

    /// Integrator, sample count, scale and knobs.
    pub fn setting(&self) -> Setting {
        let Self { integrator, samples, scale, quality, .. } = *self;
        Setting { integrator, samples, scale, quality }
    }

    /// The same with another setting.
    #[must_use]
    pub fn with_setting(self, Setting { integrator, samples, scale, quality }: Setting) -> Self {
        Self { integrator, samples, scale, quality, ..self }
    }
}

/// A camera. `look_at` differs from `position`, and `up` is not parallel to the view direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Projection of points to the picture.
    pub kind: CameraKind,
    /// World position.
    pub position: DVec3,
    /// The point at the centre of the picture; the centre of orbits.
    pub look_at: DVec3,
    /// Up direction in the picture; any length, not necessarily perpendicular to the view direction.
    pub up: DVec3,
    /// Field of view in degrees: of a pinhole camera along its [`FovAxis`], inside (0, 180); of a fisheye camera the full angle of
    /// its circle, in (0, 360]. An orthographic camera has none.
    pub fov: f64,
    /// Divides the view plane's size. A fisheye camera has no view plane.
    pub zoom: f64,
}

/// The kinds of camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum CameraKind {
    /// All rays start at the position, through the pixels of a view plane.
    Pinhole {
        /// The side of the picture that the field of view spans.
        fov_axis: FovAxis,
    },
    /// All rays are parallel to the view direction, and start on the plane through the position across it.
    Orthographic {
        /// Height of the picture in world units, before the zoom.
        view_height: f64,
    },
    /// All rays start at the position, at an angle to the view direction of r fov / 2 (equidistant), where r is the distance from the
    /// picture's centre in units of half its smaller side. Pixels with r > 1 show the background.
    Fisheye,
}

impl Default for Camera {
    /// At the origin, towards -Z.
    fn default() -> Self {
        Self {
            kind: CameraKind::PINHOLE,
            position: DVec3::ZERO,
            look_at: DVec3::NEG_Z,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
        }
    }
}

impl CameraKind {
    /// A pinhole camera with a vertical field of view.
    pub const PINHOLE: Self = Self::Pinhole { fov_axis: FovAxis::Vertical };
}

/// The side of a picture that a field of view spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FovAxis {
    /// From the top to the bottom.
    Vertical,
    /// From the left to the right.
    Horizontal,
}

impl FovAxis {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 2] =
        [("vertical", Self::Vertical), ("horizontal", Self::Horizontal)];
}

/// Radiance of rays that hit nothing, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Background {
    /// A constant colour.
    Color(Vec3),
    /// From `bottom` (a ray straight down, -Y) to `top` (straight up), linear in (d.y + 1) / 2 of the unit direction d.
    Gradient {
        /// Colour at d.y = -1.
        bottom: Vec3,
        /// Colour at d.y = +1.
        top: Vec3,
    },
    /// A picture all around.
    Sky(Sky),
}

/// A sky: a picture all around the scene, infinitely far away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Picture of the sky.
    pub picture: SkyPicture,
    /// Degrees by which the sky is rotated about +Y, in the sense of [`crate::scene::Model::rotate`].
    pub rotate: f64,
    /// Factor of its radiance.
    pub strength: f32,
}

/// The picture of a sky; textures are indices into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SkyPicture {
    /// Equirectangular: a ray with unit direction d sees u = 1/2 + atan2(d.x, -d.z) / 2 pi from the left and acos(d.y) / pi from the
    /// top.
    Panorama(u32),
    /// The six faces of a cube, +X, -X, +Y, -Y, +Z, -Z, laid out by OpenGL's table of cube map faces.
    Cubemap([u32; 6]),
}

/// The part of a frame that changes while the scene stays the same: under 256 bytes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameView {
    /// Camera of this frame.
    pub camera: Camera,
    /// The camera's lens.
    pub lens: Lens,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How light is computed.
    pub integrator: Integrator,
    /// Rays per pixel: with direct light a square number; any number of paths.
    pub samples: u32,
    /// Number of the first sample of each pixel. Only paths begin later than at 0: a pass of a picture has the samples from this one.
    pub first_sample: u32,
    /// Degrees by which every model is rotated about the +Y axis through its own origin, after its own rotation.
    pub spin: f64,
    /// Quality knobs.
    pub quality: Quality,
    /// How light becomes colours.
    pub tone: ToneMapping,
    /// Format of the rendered pixels.
    pub format: PixelFormat,
}

impl Default for FrameView {
    /// The view of [`Scene::default`].
    fn default() -> Self {
        Self::of(&Scene::default())
    }
}

impl FrameView {
    /// Samples along a side of a pixel: with direct light they are a regular grid, and paths have one random place at a time.
    pub fn grid(&self) -> u32 {
        match self.integrator {
            Integrator::Direct => self.samples.isqrt(),
            Integrator::Path(_) => 1,
        }
    }

    /// Whether the direct integrator samples adaptively: enabled, with more than one sample per pixel.
    pub fn is_adaptive(&self) -> bool {
        self.quality.adaptive && self.samples > 1 && self.integrator == Integrator::Direct
    }

    /// Whether materials are shown as by [`crate::material::Material::shown_directly`]: by the direct integrator, in pictures of light.
    pub(crate) fn shows_materials_directly(&self) -> bool {
        self.integrator == Integrator::Direct && self.quality.shading.is_light()
    }

    /// Whether pictures show the motion of objects while the shutter is open: those of light by the path integrator. All others show
    /// objects as they are when it opens.
    pub(crate) fn shows_motion(&self) -> bool {
        self.integrator.path().is_some() && self.quality.shading.is_light()
    }

    /// The frame that the scene requests, at full scale.
    pub fn of(scene: &Scene) -> Self {
        let RenderSettings { width, height, integrator, samples, quality, tone, .. } = scene.render;
        Self {
            camera: scene.camera,
            lens: scene.lens,
            width,
            height,
            integrator,
            samples,
            first_sample: 0,
            spin: 0.0,
            quality,
            tone,
            format: PixelFormat::Rgb8,
        }
    }

    /// Integrator, sample count and knobs, with the scale at which the view is rendered.
    pub fn setting(&self, scale: RenderScale) -> Setting {
        Setting { integrator: self.integrator, samples: self.samples, scale, quality: self.quality }
    }

    /// The view with the integrator, the sample count and the knobs of a setting, in its own size.
    #[must_use]
    pub fn with_setting(&self, setting: &Setting) -> Self {
        let Setting { integrator, samples, quality, .. } = *setting;
        Self { integrator, samples, quality, ..*self }
    }

    /// The view as it is rendered at a setting: [`FrameView::with_setting`], and the size at its scale.
    #[must_use]
    pub fn at(&self, setting: &Setting) -> Self {
        let (width, height) = (setting.scale.of(self.width), setting.scale.of(self.height));
        Self { width, height, ..self.with_setting(setting) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::PathSettings;
    use super::*;

    #[test]
    fn each_integrator_has_its_usual_depth_and_samples() {
        for ((_, integrator), numbers) in Integrator::WORDS.into_iter().zip([(5, 1), (8, 64)]) {
            let usual = RenderSettings::with_integrator(integrator);
            assert_eq!(usual.integrator, integrator);
            assert_eq!((usual.quality.max_depth, usual.samples), numbers);
        }
        assert_eq!(RenderSettings::with_integrator(Integrator::Direct), RenderSettings::default());
    }

    #[test]
    fn an_integrator_keeps_its_settings_unless_its_kind_changes() {
        let [(_, direct), (_, paths)] = Integrator::WORDS;
        let seeded = Integrator::Path(PathSettings { seed: 7, ..PathSettings::DEFAULT });
        assert_eq!(seeded.changed_to(paths), seeded);
        assert_eq!(direct.changed_to(paths), paths);
        assert_eq!(seeded.changed_to(direct), direct);
    }

    const CAMERA: Camera = Camera {
        position: DVec3::Z,
        look_at: DVec3::ZERO,
        up: DVec3::Y,
        fov: 40.0,
        zoom: 1.0,
        kind: crate::scene::CameraKind::PINHOLE,
    };

    #[test]
    fn settings_round_trip() {
        let integrator = Integrator::Path(PathSettings { roulette: false, ..PathSettings::DEFAULT });
        let settings =
            RenderSettings { samples: 9, scale: RenderScale::Third, integrator, ..RenderSettings::default() };
        assert_eq!(RenderSettings::default().with_setting(settings.setting()), settings);
        let setting =
            Setting { quality: Quality { adaptive: true, ..Quality::default() }, ..settings.setting() };
        assert_eq!(settings.with_setting(setting).setting(), setting);
    }

    #[test]
    fn a_view_has_the_size_samples_and_knobs_of_its_setting() {
        let view = FrameView {
            camera: CAMERA,
            width: 101,
            height: 60,
            samples: 1,
            spin: 5.0,
            quality: Quality::default(),
            ..FrameView::default()
        };
        let quality = Quality { adaptive: true, ..Quality::default() };
        let setting =
            Setting { integrator: Integrator::Direct, samples: 4, scale: RenderScale::Half, quality };
        let rendered = view.at(&setting);
        assert_eq!(view.with_setting(&setting), FrameView { samples: 4, quality, ..view });
        assert_eq!(rendered, FrameView { width: 51, height: 30, samples: 4, quality, ..view });
        assert!(rendered.is_adaptive() && !view.is_adaptive());
        assert!(!FrameView { samples: 1, ..rendered }.is_adaptive());
        let paths = Integrator::Path(PathSettings::DEFAULT);
        assert!(!rendered.at(&Setting { integrator: paths, ..setting }).is_adaptive());
        assert_eq!(rendered.setting(RenderScale::Half), setting);
    }
}
