//! Measured settings: combinations of knobs, named by the slugs of the table of knobs.

use rayfarm_tracer::scene::knobs::{KNOBS, KnobValue};
use rayfarm_tracer::scene::{FrameView, RenderScale, SceneFeatures, Setting};

use crate::farm::ViewRequest;

/// Names of all measured settings: each knob alone, then combinations towards speed, then towards quality. A name consists of
/// the slugs of the changed values.
const NAMES: [&str; 49] = [
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
];

/// Name of the setting without changed knobs: one sample per pixel, full quality.
const PLAIN: &str = "samples-1";

/// A setting with its name in tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeasuredSetting {
    /// Name of lower-case letters, digits, `-` and `+`, so that it can be a file name.
    pub(crate) name: &'static str,
    setting: Setting,
}

impl MeasuredSetting {
    /// Settings in which every changed knob can change the picture of `view` in a scene with these features. Where a number of the
    /// view is that low already, a setting that lowers it is one of the others, and is left out.
    pub(crate) fn applicable(features: &SceneFeatures, view: &FrameView) -> Vec<Self> {
        let features = features.shown_by(view.quality.shading);
        let mut found: Vec<Self> = Vec::new();
        for measured in all().filter(|measured| measured.setting.without_idle(&features) == measured.setting)
        {
            let request = measured.applied_to(view);
            if !found.iter().any(|other| other.applied_to(view) == request) {
                found.push(measured);
            }
        }
        found
    }

    /// The setting without changed knobs.
    pub(crate) fn plain() -> Self {
        Self { name: PLAIN, setting: Setting { samples: 1, ..Setting::FULL } }
    }

    /// The setting of a name, as in tables.
    pub(crate) fn named(name: &str) -> Option<Self> {
        all().find(|measured| measured.name == name)
    }

    /// The request for a picture of `view` under this setting. Knobs of `view` are reset, except those that full quality keeps:
    /// dither, which loses nothing, the kind of a picture without light, and numbers such as the depth, which the setting lowers.
    pub(crate) fn applied_to(&self, view: &FrameView) -> ViewRequest {
        let full = view.setting(RenderScale::Full).restored();
        let Setting { samples, scale, quality } = full.at_most(&self.setting);
        ViewRequest { view: FrameView { samples, quality, ..*view }, scale }
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
        value_with(slug)?.apply(&mut measured.setting);
    }
    Some(measured)
}

fn value_with(slug: &str) -> Option<&'static KnobValue> {
    KNOBS.iter().flat_map(|knob| knob.values).find(|value| value.slug == Some(slug))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rayfarm_tracer::scene::{Quality, Shading};

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
        shadowless: false,
        soft_shadows: false,
        checkered: false,
        normal_mapped: false,
        metallic_roughness: false,
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
            let plain = knob.value_of(&MeasuredSetting::plain().setting);
            let is_changed = |measured: MeasuredSetting| !plain.is_of(&measured.setting);
            assert!(all().any(is_changed), "no measured setting changes {}", knob.name);
        }
    }

    #[test]
    fn a_scene_with_all_features_has_all_settings() {
        let view = crate::test_scene::view();
        assert_eq!(MeasuredSetting::applicable(&EVERYTHING, &view).len(), NAMES.len());
        assert!(MeasuredSetting::applicable(&NOTHING, &view).contains(&MeasuredSetting::plain()));
    }

    #[test]
    fn a_scene_without_highlights_shadows_or_textures_has_no_knobs_for_them() {
        let names = |features| {
            let settings = MeasuredSetting::applicable(&features, &crate::test_scene::view());
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
        let view = crate::test_scene::view();
        let turned =
            FrameView { samples: 25, quality: Quality { shadows: false, ..Quality::default() }, ..view };
        let pictures: Vec<ViewRequest> = all().map(|setting| setting.applied_to(&turned)).collect();
        for (index, picture) in pictures.iter().enumerate() {
            assert!(picture.rendered().validate().is_ok() && picture.view.camera == view.camera);
            assert!(!pictures[..index].contains(picture), "{}", NAMES[index]);
        }
        assert_eq!(pictures[0].view, FrameView { samples: 1, ..view }, "knobs of the view are reset");
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
        let view = FrameView { quality: own, ..crate::test_scene::view() };
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
        let view = FrameView { quality, ..crate::test_scene::view() };
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
