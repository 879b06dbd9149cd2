//! Options of light: the integrator, the lens, and how light becomes colours.

use clap::Args;
use rayfarm_tracer::scene::{
    CameraKind, FrameView, Integrator, Lens, PathSettings, RenderScale, ToneCurve, ToneMapping,
};

use super::values::{distance, exposure, noise, one_of, radius};

/// Integrator, lens, exposure and tone; each overrides the scene file.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct LightArgs {
    /// How light is computed: direct, without noise; or path, with all that bounces.
    #[arg(long, value_name = "direct|path", value_parser = one_of(&Integrator::WORDS))]
    pub(crate) integrator: Option<Integrator>,
    /// Random numbers of paths: another N, another noise.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u32>,
    /// End the paths of a pixel when its estimated relative error is below E, or, in the window and in passes, those of the picture; 0 is
    /// never.
    #[arg(long, value_name = "E", value_parser = noise)]
    pub(crate) max_noise: Option<f32>,
    /// Radius of the lens in world units, for paths; 0 is a pinhole.
    #[arg(long, value_name = "RADIUS", value_parser = radius)]
    pub(crate) aperture: Option<f64>,
    /// Distance of the sharp plane along the camera's axis; by default that of the point that it looks at.
    #[arg(long, value_name = "DISTANCE", value_parser = distance)]
    pub(crate) focus_distance: Option<f64>,
    /// Exposure of the display in stops: each doubles the light.
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = exposure)]
    pub(crate) exposure: Option<f32>,
    /// Curve from light to the colours of the display.
    #[arg(long, value_name = "srgb|agx|aces|neutral", value_parser = one_of(&ToneCurve::WORDS))]
    pub(crate) tone: Option<ToneCurve>,
}

impl LightArgs {
    /// The view of the command line, with that of the scene file as default. A view that changes to another integrator has its
    /// default numbers of samples and bounces in place of those of the former one.
    pub(crate) fn over(&self, scene: FrameView) -> FrameView {
        let requested = self.integrator.unwrap_or(scene.integrator);
        let setting = scene.setting(RenderScale::Full).changed_to(requested);
        let integrator = match setting.integrator {
            Integrator::Direct => Integrator::Direct,
            Integrator::Path(settings) => Integrator::Path(PathSettings {
                seed: self.seed.unwrap_or(settings.seed),
                max_noise: self.max_noise.unwrap_or(settings.max_noise),
                ..settings
            }),
        };
        FrameView {
            integrator,
            lens: Lens {
                aperture: self.aperture.unwrap_or(scene.lens.aperture),
                focus_distance: self.focus_distance.or(scene.lens.focus_distance),
            },
            tone: ToneMapping {
                exposure: self.exposure.unwrap_or(scene.tone.exposure),
                curve: self.tone.unwrap_or(scene.tone.curve),
            },
            ..scene.with_setting(&setting)
        }
    }

    /// Options that have no effect on a view, each with the reason.
    pub(crate) fn idle_on(&self, view: &FrameView) -> Vec<(&'static str, &'static str)> {
        let direct = view.integrator == Integrator::Direct;
        let of_lens = if direct {
            Some("with the direct integrator")
        } else {
            let pinhole = matches!(view.camera.kind, CameraKind::Pinhole { .. });
            (!pinhole).then_some("on a camera that is not a pinhole")
        };
        let of_paths = direct.then_some("with the direct integrator");
        let of_focus = of_lens.or((view.lens.aperture == 0.0).then_some("without an aperture"));
        [
            (self.seed.is_some(), "seed", of_paths),
            (self.max_noise.is_some(), "max-noise", of_paths),
            (self.aperture.is_some(), "aperture", of_lens),
            (self.focus_distance.is_some(), "focus-distance", of_focus),
        ]
        .into_iter()
        .filter_map(|(given, option, reason)| Some((option, reason.filter(|_| given)?)))
        .collect()
    }
}
