//! Measured settings: combinations of knobs, named by the slugs of the table of knobs.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobValue};
use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings, RenderScale, SceneFeatures, Setting};

/// Names of all measured settings: each knob alone, then combinations towards speed, then towards quality. A name consists of
/// the slugs of the changed values.
const NAMES: [&str; 69] = [
    PLAIN,
    "fast-exponent",
    "diffuse",
    "nearest",
    "bilinear",
    "trilinear",
    "no-shadows",
    "shadow-samples-9",
    "shadow-samples-4",
    "shadow-samples-1",
    "hard-terminator",
    "contribution-0-01",
    "contribution-0-03",
    "contribution-0-1",
    "depth-3",
    "depth-2",
    "depth-1",
    "depth-0",
    "reduced-colors",
    "diffuse+no-shadows",
    "depth-1+shadow-samples-4",
    "scale-1-2+depth-1",
    "scale-1-2+shadow-samples-4",
    "scale-3-4",
    "scale-3-4+no-shadows",
    "scale-3-4+diffuse",
    "scale-3-4+diffuse+no-shadows",
    "scale-1-2",
    "scale-1-2+no-shadows",
    "scale-1-2+diffuse",
    "scale-1-2+diffuse+no-shadows",
    "scale-1-3",
    "scale-1-3+diffuse",
    "scale-1-3+no-shadows",
    "scale-1-4",
    "scale-1-4+diffuse",
    "scale-1-4+no-shadows",
    "scale-3-4+reduced-colors",
    "scale-1-2+reduced-colors",
    "scale-1-4+reduced-colors",
    "scale-1-2+samples-4",
    "scale-3-4+samples-4",
    "samples-4",
    "samples-4+fast-exponent",
    "samples-4+adaptive",
    "samples-9",
    "samples-9+adaptive",
    "samples-16",
    "samples-16+adaptive",
    "depth-5",
    "independent",
    "no-roulette",
    "clamp-10",
    "clamp-1",
    "samples-2",
    "samples-8",
    "samples-32",
    "samples-32+independent",
    "samples-32+no-roulette",
    "samples-32+clamp-10",
    "samples-32+depth-3",
    "samples-128",
    "samples-2+independent",
    "samples-8+independent",
    "samples-128+independent",
    "samples-2+denoised",
    "samples-8+denoised",
    "samples-32+denoised",
    "samples-128+denoised",
];

/// Name of the setting without changed knobs: one sample per pixel, full quality.
const PLAIN: &str = "samples-1";

/// Part of the names of settings whose pictures have their noise filtered, which is no knob of the tracer.
const DENOISED: &str = "denoised";

/// A setting with its name in tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredSetting {
    /// Name of lower-case letters, digits, `-` and `+`, so that it can be a file name.
    pub(crate) name: &'static str,
    /// Upper limits of the knobs of both integrators.
    limit: Setting,
    /// The value of a knob that reduces nothing, which no limit changes.
    switched: Option<&'static KnobValue>,
    /// Whether the noise of the picture is filtered.
    denoised: bool,
}

impl MeasuredSetting {
    /// Settings in which every changed knob can change the picture of `view` in a scene with these features. Where a number of the
    /// view is that low already, a setting that lowers it is one of the others, and is left out.
    pub(crate) fn applicable(features: &SceneFeatures, view: &FrameView) -> Vec<Self> {
        let features = features.shown_by(view.quality.shading);
        let mut found: Vec<Self> = Vec::new();
        let changes_picture = |measured: &Self| {
            let limit = measured.limit_of(view);
            let is_possible = !measured.denoised || view.integrator != Integrator::Direct;
            is_possible && limit.without_idle(&features) == limit && has_listed_samples(&limit)
        };
        for measured in all().filter(changes_picture) {
            let request = measured.applied_to(view);
            let is_same =
                |other: &Self| other.denoised == measured.denoised && other.applied_to(view) == request;
            if !found.iter().any(is_same) {
                found.push(measured);
            }
        }
        found
    }

    /// The setting without changed knobs.
    pub(crate) fn plain() -> Self {
        let paths = Integrator::Path(PathSettings::DEFAULT);
        let limit = Setting { samples: 1, ..Setting::full_with(paths) };
        Self { name: PLAIN, limit, switched: None, denoised: false }
    }

    /// Whether the noise of the picture is filtered.
    pub(crate) fn is_denoised(&self) -> bool {
        self.denoised
    }

    /// The limits of the knobs of a view's integrator.
    fn limit_of(&self, view: &FrameView) -> Setting {
        Setting { integrator: self.limit.integrator.changed_to(view.integrator), ..self.limit }
    }

    /// The setting of a name, as in tables.
    pub(crate) fn named(name: &str) -> Option<Self> {
        all().find(|measured| measured.name == name)
    }

    /// The request for a picture of `view` under this setting. Knobs of `view` are reset, except those that full quality keeps:
    /// dither, which loses nothing, the kind of a picture without light, and numbers such as the depth, which the setting lowers.
    pub(crate) fn applied_to(&self, view: &FrameView) -> ViewRequest {
        let full = view.setting(RenderScale::Full).restored();
        let mut setting = full.at_most(&self.limit);
        if let Some(value) = self.switched {
            value.apply(&mut setting);
        }
        ViewRequest { view: view.with_setting(&setting), scale: setting.scale }
    }
}

/// All measured settings.
fn all() -> impl Iterator<Item = MeasuredSetting> {
    NAMES.into_iter().filter_map(parsed)
}

/// The setting with the values of all slugs of a name; `None` for an unknown slug.
fn parsed(name: &'static str) -> Option<MeasuredSetting> {
    let mut measured = MeasuredSetting { name, ..MeasuredSetting::plain() };
    for slug in name.split('+') {
        if slug == DENOISED {
            measured.denoised = true;
            continue;
        }
        let (knob, value) = value_with(slug)?;
        if knob.reduces {
            value.apply(&mut measured.limit);
        } else {
            measured.switched = Some(value);
        }
    }
    Some(measured)
}

fn value_with(slug: &str) -> Option<(&'static Knob, &'static KnobValue)> {
    let values = KNOBS.iter().flat_map(|knob| knob.values.iter().map(move |value| (knob, value)));
    values.into_iter().find(|(_, value)| value.slug == Some(slug))
}

/// Whether the integrator of a setting is measured with its number of samples.
fn has_listed_samples(setting: &Setting) -> bool {
    let samples = Knob::named("samples");
    samples.is_some_and(|knob| knob.values_with(setting.integrator).any(|value| value.is_of(setting)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rayfarm_tracer::scene::{Quality, Sampler, Shading};

    use super::*;

    const NOTHING: SceneFeatures = SceneFeatures {
        specular: false,
        powers: false,
        textured: false,
        filtered: false,
        vertex_colors: false,
        emissive: false,
        unlit: false,
        cut_out: false,
        smooth: false,
        shadows: false,
        bounces: false,
        transparent: false,
        absorbing: false,
        shadowless: false,
        soft_shadows: false,
        checkered: false,
        normal_mapped: false,
        metallic_roughness: false,
        rough_textured: false,
        volumes: false,
        motion: false,
    };
    const EVERYTHING: SceneFeatures = SceneFeatures {
        specular: true,
        powers: true,
        textured: true,
        filtered: true,
        smooth: true,
        shadows: true,
        soft_shadows: true,
        bounces: true,
        ..NOTHING
    };

    #[test]
    fn names_are_unique_file_names_and_parse_back() {
        let names: BTreeSet<&str> = NAMES.into();
        assert_eq!(names.len(), NAMES.len());
        for name in names {
            assert!(
                name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-+".contains(c)),
                "{name}"
            );
            assert_eq!(MeasuredSetting::named(name).unwrap().name, name);
        }
        assert!(MeasuredSetting::named("samples-5").is_none());
    }

    #[test]
    fn every_knob_that_reduces_accuracy_is_measured() {
        for knob in KNOBS.iter().filter(|knob| knob.reduces) {
            let plain = knob.value_of(&MeasuredSetting::plain().limit);
            let is_changed = |measured: MeasuredSetting| !plain.is_of(&measured.limit);
            assert!(all().any(is_changed), "no measured setting changes {}", knob.name);
        }
    }

    /// The view of the tests, rendered by paths.
    fn path_view() -> FrameView {
        let paths = Integrator::Path(PathSettings { seed: 5, ..PathSettings::DEFAULT });
        let quality = Quality { max_depth: 8, ..Quality::default() };
        FrameView { integrator: paths, quality, ..rayfarm_farm::testing::test_scene::view() }
    }

    #[test]
    fn a_scene_with_all_features_has_all_settings_of_both_integrators() {
        let view = rayfarm_farm::testing::test_scene::view();
        let names = |view: &FrameView| -> BTreeSet<&str> {
            MeasuredSetting::applicable(&EVERYTHING, view).iter().map(|setting| setting.name).collect()
        };
        let (direct, paths) = (names(&view), names(&path_view()));
        assert_eq!(&direct | &paths, NAMES.into());
        let of_both = &direct & &paths;
        for name in ["adaptive", "shadow", "terminator", "exponent", "contribution", "diffuse", "samples-9"] {
            assert!(!paths.iter().any(|found| found.contains(name)), "{name}: {paths:?}");
        }
        for name in [
            "independent",
            "roulette",
            "clamp",
            "samples-2",
            "samples-8",
            "samples-128",
            "depth-5",
            "denoised",
        ] {
            assert!(!direct.iter().any(|found| found.contains(name)), "{name}: {direct:?}");
            assert!(paths.iter().any(|found| found.contains(name)), "{name}: {paths:?}");
        }
        for name in [PLAIN, "samples-16", "scale-1-2", "reduced-colors", "depth-1", "nearest"] {
            assert!(of_both.contains(name), "{name}: {of_both:?}");
        }
        let bare = MeasuredSetting::applicable(&NOTHING, &view);
        assert!(bare.iter().any(|setting| setting.name == PLAIN));
    }

    #[test]
    fn a_scene_without_highlights_shadows_or_textures_has_no_knobs_for_them() {
        let names = |features| {
            let settings = MeasuredSetting::applicable(&features, &rayfarm_farm::testing::test_scene::view());
            settings.iter().map(|setting| setting.name).collect::<Vec<_>>()
        };
        let bare = names(NOTHING);
        for word in
            ["diffuse", "exponent", "shadow", "linear", "nearest", "depth", "contribution", "terminator"]
        {
            assert!(!bare.iter().any(|name| name.contains(word)), "{bare:?}");
        }
        for name in [PLAIN, "scale-1-2", "samples-16", "reduced-colors"] {
            assert!(bare.contains(&name), "{bare:?}");
        }
        assert!(names(SceneFeatures { shadows: true, ..NOTHING }).contains(&"scale-1-2+no-shadows"));
    }

    #[test]
    fn every_setting_gives_a_different_request_for_the_same_camera() {
        let view = rayfarm_farm::testing::test_scene::view();
        let turned =
            FrameView { samples: 25, quality: Quality { shadows: false, ..Quality::default() }, ..view };
        for turned in [turned, FrameView { samples: 25, ..path_view() }] {
            let settings = MeasuredSetting::applicable(&EVERYTHING, &turned);
            let pictures: Vec<(ViewRequest, bool)> =
                settings.iter().map(|setting| (setting.applied_to(&turned), setting.denoised)).collect();
            for (index, (picture, denoised)) in pictures.iter().enumerate() {
                assert_eq!(picture.rendered().validate(), Ok(()), "{}", settings[index].name);
                assert_eq!(picture.view.camera, view.camera);
                assert!(!pictures[..index].contains(&(*picture, *denoised)), "{}", settings[index].name);
            }
            let quality = Quality { shadows: true, ..turned.quality };
            let plain = FrameView { samples: 1, quality, ..turned };
            assert_eq!(pictures[0].0.view, plain, "knobs of the view are reset");
        }
    }

    #[test]
    fn settings_of_paths_change_what_their_names_say() {
        let view = path_view();
        let paths = |name| {
            let request = MeasuredSetting::named(name).unwrap().applied_to(&view);
            (request.view.samples, *request.view.integrator.path().unwrap())
        };
        let own = *view.integrator.path().unwrap();
        assert_eq!(paths(PLAIN), (1, own));
        assert_eq!(paths("samples-32+no-roulette"), (32, PathSettings { roulette: false, ..own }));
        assert_eq!(paths("clamp-10"), (1, PathSettings { clamp_indirect: 10.0, ..own }));
        let independent = PathSettings { sampler: Sampler::Independent, ..own };
        assert_eq!(paths("samples-32+independent"), (32, independent));
        let [plain, denoised] =
            ["samples-32", "samples-32+denoised"].map(|name| MeasuredSetting::named(name).unwrap());
        assert_eq!(plain.applied_to(&view), denoised.applied_to(&view));
        assert!(denoised.is_denoised() && !plain.is_denoised());
    }

    #[test]
    fn full_quality_has_the_numbers_of_the_view() {
        let own = Quality {
            max_depth: 2,
            min_contribution: 0.02,
            shadow_samples: 6,
            shadows: false,
            smooth_terminator: false,
            ..Quality::default()
        };
        let view = FrameView { quality: own, ..rayfarm_farm::testing::test_scene::view() };
        let full = Quality { shadows: true, smooth_terminator: true, ..own };
        assert_eq!(MeasuredSetting::plain().applied_to(&view).view.quality, full);
        let named = |name| MeasuredSetting::named(name).unwrap().applied_to(&view).view.quality;
        assert_eq!(named("depth-1+shadow-samples-4"), Quality { max_depth: 1, shadow_samples: 4, ..full });
        assert_eq!((named("depth-3"), named("contribution-0-01")), (full, full), "no number is raised");
        let names: Vec<_> =
            MeasuredSetting::applicable(&EVERYTHING, &view).iter().map(|setting| setting.name).collect();
        for (name, is_measured) in [
            ("depth-3", false),
            ("depth-2", false),
            ("depth-1", true),
            ("contribution-0-01", false),
            ("contribution-0-03", true),
            ("shadow-samples-9", false),
            ("shadow-samples-4", true),
        ] {
            assert_eq!(names.contains(&name), is_measured, "{name}");
        }
    }

    #[test]
    fn pictures_without_light_are_measured_as_they_are() {
        let quality = Quality { shading: Shading::Normals, ..Quality::default() };
        let view = FrameView { quality, ..rayfarm_farm::testing::test_scene::view() };
        let settings = MeasuredSetting::applicable(&EVERYTHING, &view);
        assert!(settings.iter().all(|one| one.applied_to(&view).view.quality.shading == Shading::Normals));
        let names: Vec<_> = settings.iter().map(|setting| setting.name).collect();
        for word in
            ["diffuse", "exponent", "shadow", "linear", "nearest", "depth", "contribution", "terminator"]
        {
            assert!(!names.iter().any(|name| name.contains(word)), "{names:?}");
        }
        assert!(names.contains(&"scale-1-2") && names.contains(&"samples-4+adaptive"));
    }
}
