//! The settings: positions of the tracer's knobs, alone and together, by name.
//!
//! A new knob is a line among the knobs, and a line for each setting that turns it.

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::scene::FrameView;

/// What a scene asks for: whatever it does not, no knob needs to leave out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Asked {
    /// Something has a highlight.
    pub(crate) specular: bool,
    /// Something has a texture.
    pub(crate) textured: bool,
    /// A light casts shadows.
    pub(crate) shadows: bool,
}

impl Asked {
    /// What this scene asks for.
    pub(crate) fn of(scene: &CompiledScene) -> Self {
        let features = scene.features();
        Self {
            specular: features.specular,
            textured: features.textured,
            shadows: scene.scene().lights.iter().any(|light| light.shadows),
        }
    }
}

/// A position of a knob other than the one for full quality at one sample a pixel.
#[derive(Clone, Copy, Debug)]
struct Knob {
    name: &'static str,
    /// Whether the picture can change by it.
    matters: fn(Asked) -> bool,
    turn: fn(&mut FrameView),
}

/// A way to render: some knobs turned, the others left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    knobs: &'static [Knob],
}

const SAMPLES_4: Knob = Knob { name: "samples-4", matters: |_| true, turn: |view| view.samples = 4 };
const SAMPLES_9: Knob = Knob { name: "samples-9", matters: |_| true, turn: |view| view.samples = 9 };
const SAMPLES_16: Knob = Knob { name: "samples-16", matters: |_| true, turn: |view| view.samples = 16 };

/// All settings worth having of some scene.
const SETTINGS: &[Setting] = &[
    Setting::plain(),
    Setting { knobs: &[SAMPLES_4] },
    Setting { knobs: &[SAMPLES_9] },
    Setting { knobs: &[SAMPLES_16] },
];

/// The name of the setting that turns nothing: one sample, full quality.
const PLAIN: &str = "samples-1";

impl Setting {
    /// Those whose pictures can differ where a scene asks for so much.
    pub(crate) fn worth_having(asked: Asked) -> Vec<Self> {
        let worth = |setting: &&Self| setting.knobs.iter().all(|knob| (knob.matters)(asked));
        SETTINGS.iter().filter(worth).copied().collect()
    }

    /// The one that turns nothing.
    pub(crate) const fn plain() -> Self {
        Self { knobs: &[] }
    }

    /// The setting of that name, as tables have it.
    pub(crate) fn named(name: &str) -> Option<Self> {
        SETTINGS.iter().find(|setting| setting.name() == name).copied()
    }

    /// Its name: small letters, digits, `-` and `+`, so that it can be a file's name.
    pub(crate) fn name(&self) -> String {
        if self.knobs.is_empty() {
            return PLAIN.to_owned();
        }
        let names: Vec<&str> = self.knobs.iter().map(|knob| knob.name).collect();
        names.join("+")
    }

    /// What is rendered of a frame under this setting.
    pub(crate) fn applied_to(&self, view: &FrameView) -> FrameView {
        let mut turned = FrameView { samples: 1, ..*view };
        for knob in self.knobs {
            (knob.turn)(&mut turned);
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const NOTHING: Asked = Asked { specular: false, textured: false, shadows: false };
    const EVERYTHING: Asked = Asked { specular: true, textured: true, shadows: true };

    #[test]
    fn names_are_unique_fit_for_files_and_lead_back() {
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
    fn a_scene_that_asks_for_everything_has_all_settings() {
        assert_eq!(Setting::worth_having(EVERYTHING).len(), SETTINGS.len());
        assert!(Setting::worth_having(NOTHING).iter().any(|setting| setting.name() == PLAIN));
    }

    #[test]
    fn every_setting_is_another_view_of_the_same_camera() {
        let view = crate::test_scene::view();
        let views: Vec<FrameView> = SETTINGS.iter().map(|setting| setting.applied_to(&view)).collect();
        for (index, turned) in views.iter().enumerate() {
            assert!(turned.validate().is_ok() && turned.camera == view.camera);
            assert!(!views[..index].contains(turned), "{}", SETTINGS[index].name());
        }
    }
}
