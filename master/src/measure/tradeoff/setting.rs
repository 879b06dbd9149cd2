//! Settings: named combinations of quality knobs.
//!
//! A new knob is a constant, and a line for each setting that changes it.

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::scene::{
    ColorDepth, ExponentPrecision, Filter, FrameView, Quality, RenderScale, Shading,
};

use crate::viewer::view_request::ViewRequest;

/// Features of a scene that knobs depend on: a knob for an absent feature does not apply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SceneFeatures {
    /// A material has a highlight.
    pub(crate) specular: bool,
    /// The precision of an exponent changes the picture.
    pub(crate) powers: bool,
    /// A texture is filtered.
    pub(crate) filtered: bool,
    /// A light casts shadows.
    pub(crate) shadows: bool,
}

impl SceneFeatures {
    /// Features of this scene.
    pub(crate) fn of(scene: &CompiledScene) -> Self {
        let (features, data) = (scene.features(), scene.scene());
        Self {
            specular: features.specular,
            powers: data.materials.iter().any(|m| m.is_specular() && !m.has_squared_highlight()),
            filtered: features.textured && data.textures.iter().any(|map| map.filter != Filter::Nearest),
            shadows: data.lights.iter().any(|light| light.shadows),
        }
    }
}

/// A position of a knob other than full quality at one sample per pixel.
#[derive(Clone, Copy, Debug)]
struct Knob {
    name: &'static str,
    /// Whether it can change the picture of a scene with these features.
    matters: fn(SceneFeatures) -> bool,
    apply: fn(&mut ViewRequest),
}

/// A setting: some knobs changed, the others at full quality.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    knobs: &'static [Knob],
}

/// For knobs that apply to every scene.
const fn always(_: SceneFeatures) -> bool {
    true
}

const SAMPLES_4: Knob = Knob { name: "samples-4", matters: always, apply: |p| p.view.samples = 4 };
const SAMPLES_9: Knob = Knob { name: "samples-9", matters: always, apply: |p| p.view.samples = 9 };
const SAMPLES_16: Knob = Knob { name: "samples-16", matters: always, apply: |p| p.view.samples = 16 };
const ADAPTIVE: Knob = Knob { name: "adaptive", matters: always, apply: |p| p.view.quality.adaptive = true };
const HALF: Knob = Knob { name: "scale-1-2", matters: always, apply: |p| p.scale = RenderScale::Half };
const THREE_QUARTERS: Knob =
    Knob { name: "scale-3-4", matters: always, apply: |p| p.scale = RenderScale::ThreeQuarters };
const THIRD: Knob = Knob { name: "scale-1-3", matters: always, apply: |p| p.scale = RenderScale::Third };
const QUARTER: Knob = Knob { name: "scale-1-4", matters: always, apply: |p| p.scale = RenderScale::Quarter };
const NO_SHADOWS: Knob = Knob {
    name: "no-shadows",
    matters: |features| features.shadows,
    apply: |p| p.view.quality.shadows = false,
};
const DIFFUSE: Knob = Knob {
    name: "diffuse",
    matters: |features| features.specular,
    apply: |p| p.view.quality.shading = Shading::Diffuse,
};
const FAST: Knob = Knob {
    name: "fast-exponent",
    matters: |features| features.powers,
    apply: |p| p.view.quality.exponent = ExponentPrecision::Fast,
};
const NEAREST: Knob = Knob {
    name: "nearest",
    matters: |features| features.filtered,
    apply: |p| p.view.quality.filter = Some(Filter::Nearest),
};
const REDUCED: Knob =
    Knob { name: "reduced-colors", matters: always, apply: |p| p.view.quality.colors = ColorDepth::Reduced };

/// All settings: each knob alone, then combinations towards speed, then towards quality.
const SETTINGS: &[Setting] = &[
    Setting::plain(),
    Setting { knobs: &[FAST] },
    Setting { knobs: &[DIFFUSE] },
    Setting { knobs: &[NEAREST] },
    Setting { knobs: &[NO_SHADOWS] },
    Setting { knobs: &[REDUCED] },
    Setting { knobs: &[DIFFUSE, NO_SHADOWS] },
    Setting { knobs: &[THREE_QUARTERS] },
    Setting { knobs: &[THREE_QUARTERS, NO_SHADOWS] },
    Setting { knobs: &[THREE_QUARTERS, DIFFUSE] },
    Setting { knobs: &[THREE_QUARTERS, DIFFUSE, NO_SHADOWS] },
    Setting { knobs: &[HALF] },
    Setting { knobs: &[HALF, NO_SHADOWS] },
    Setting { knobs: &[HALF, DIFFUSE] },
    Setting { knobs: &[HALF, DIFFUSE, NO_SHADOWS] },
    Setting { knobs: &[THIRD] },
    Setting { knobs: &[THIRD, DIFFUSE] },
    Setting { knobs: &[THIRD, NO_SHADOWS] },
    Setting { knobs: &[QUARTER] },
    Setting { knobs: &[QUARTER, DIFFUSE] },
    Setting { knobs: &[QUARTER, NO_SHADOWS] },
    Setting { knobs: &[THREE_QUARTERS, REDUCED] },
    Setting { knobs: &[HALF, REDUCED] },
    Setting { knobs: &[QUARTER, REDUCED] },
    Setting { knobs: &[HALF, SAMPLES_4] },
    Setting { knobs: &[THREE_QUARTERS, SAMPLES_4] },
    Setting { knobs: &[SAMPLES_4] },
    Setting { knobs: &[SAMPLES_4, FAST] },
    Setting { knobs: &[SAMPLES_4, ADAPTIVE] },
    Setting { knobs: &[SAMPLES_9] },
    Setting { knobs: &[SAMPLES_9, ADAPTIVE] },
    Setting { knobs: &[SAMPLES_16] },
    Setting { knobs: &[SAMPLES_16, ADAPTIVE] },
];

/// Name of the setting without changed knobs: one sample per pixel, full quality.
const PLAIN: &str = "samples-1";

impl Setting {
    /// Settings that can change the picture of a scene with these features.
    pub(crate) fn applicable(features: SceneFeatures) -> Vec<Self> {
        let applies = |setting: &&Self| setting.knobs.iter().all(|knob| (knob.matters)(features));
        SETTINGS.iter().filter(applies).copied().collect()
    }

    /// The setting without changed knobs.
    pub(crate) const fn plain() -> Self {
        Self { knobs: &[] }
    }

    /// The setting of a name, as in tables.
    pub(crate) fn named(name: &str) -> Option<Self> {
        SETTINGS.iter().find(|setting| setting.name() == name).copied()
    }

    /// Name of lower-case letters, digits, `-` and `+`, so that it can be a file name.
    pub(crate) fn name(&self) -> String {
        if self.knobs.is_empty() {
            return PLAIN.to_owned();
        }
        let names: Vec<&str> = self.knobs.iter().map(|knob| knob.name).collect();
        names.join("+")
    }

    /// The request for a picture of `view` under this setting. Knobs of `view` are reset, except dither, which
    /// loses nothing.
    pub(crate) fn applied_to(&self, view: &FrameView) -> ViewRequest {
        let quality = Quality { dither: view.quality.dither, ..Quality::default() };
        let view = FrameView { samples: 1, quality, ..*view };
        let mut picture = ViewRequest { view, scale: RenderScale::Full };
        for knob in self.knobs {
            (knob.apply)(&mut picture);
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const NOTHING: SceneFeatures =
        SceneFeatures { specular: false, powers: false, filtered: false, shadows: false };
    const EVERYTHING: SceneFeatures =
        SceneFeatures { specular: true, powers: true, filtered: true, shadows: true };

    #[test]
    fn names_are_unique_file_names_and_parse_back() {
        let names: BTreeSet<String> = SETTINGS.iter().map(Setting::name).collect();
        assert_eq!(names.len(), SETTINGS.len());
        for name in names {
            assert!(
                name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-+".contains(c)),
                "{name}"
            );
            assert_eq!(Setting::named(&name).unwrap().name(), name);
        }
        assert!(Setting::named("samples-5").is_none());
    }

    #[test]
    fn a_scene_with_all_features_has_all_settings() {
        assert_eq!(Setting::applicable(EVERYTHING).len(), SETTINGS.len());
        assert!(Setting::applicable(NOTHING).iter().any(|setting| setting.name() == PLAIN));
    }

    #[test]
    fn a_scene_without_highlights_shadows_or_textures_has_no_knobs_for_them() {
        let names: Vec<String> = Setting::applicable(NOTHING).iter().map(Setting::name).collect();
        for word in ["diffuse", "exponent", "shadows", "nearest"] {
            assert!(!names.iter().any(|name| name.contains(word)), "{names:?}");
        }
        for name in [PLAIN, "scale-1-2", "samples-16", "reduced-colors"] {
            assert!(names.iter().any(|known| known == name), "{names:?}");
        }
        let shadows = Setting::applicable(SceneFeatures { shadows: true, ..NOTHING });
        assert!(shadows.iter().any(|setting| setting.name() == "scale-1-2+no-shadows"));
    }

    #[test]
    fn every_setting_gives_a_different_request_for_the_same_camera() {
        let view = crate::test_scene::view();
        let turned =
            FrameView { samples: 25, quality: Quality { shadows: false, ..Quality::default() }, ..view };
        let pictures: Vec<ViewRequest> = SETTINGS.iter().map(|setting| setting.applied_to(&turned)).collect();
        for (index, picture) in pictures.iter().enumerate() {
            assert!(picture.rendered().validate().is_ok() && picture.view.camera == view.camera);
            assert!(!pictures[..index].contains(picture), "{}", SETTINGS[index].name());
        }
        assert_eq!(pictures[0].view, FrameView { samples: 1, ..view }, "knobs of the view are reset");
    }
}
