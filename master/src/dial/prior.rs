//! What the knobs cost and lose on the project's scenes: the ladder where a scene has no table of its own.
//!
//! Costs multiply and losses add up, knob by knob. That is rough, and good enough to begin with: what the costs really are is
//! learnt from the frames. Losses are FLIP at 1024x768 against the same picture without the loss: medians of the room, the camera on
//! its stage and a million triangles of busts. They differ by a factor of four: without shadows, the room is another room.

use rayfarm_tracer::scene::{ExponentPrecision, RenderScale, Scene, Shading};

use super::ladder::{Ladder, Rung};
use super::setting::Setting;
use crate::wanted::WantedPicture;

/// What turning one knob leaves of the time, and the mean FLIP error that it adds.
#[derive(Clone, Copy, Debug)]
struct Effect {
    cost: f64,
    loss: f64,
}

const NONE: Effect = Effect { cost: 1.0, loss: 0.0 };
/// Costs are taken to be the share of the pixels, and a tenth of the rest.
const SCALES: [(RenderScale, Effect); 3] = [
    (RenderScale::Full, NONE),
    (RenderScale::ThreeQuarters, Effect { cost: 0.61, loss: 0.020 }),
    (RenderScale::Half, Effect { cost: 0.33, loss: 0.027 }),
];
/// Shadows and highlights add 79 and 1.6 per cent to a frame's time: `commands/explain/features.rs`.
const NO_SHADOWS: Effect = Effect { cost: 0.56, loss: 0.101 };
/// The loss is that of the busts: in the other two no highlight is to be seen.
const DIFFUSE: Effect = Effect { cost: 0.98, loss: 0.025 };
/// Not measured, and next to nothing.
const FAST_EXPONENT: Effect = Effect { cost: 0.995, loss: 0.001 };
/// Of a pixel's time, what does not depend on its samples.
const PER_PIXEL: f64 = 0.05;
/// The error of one sample a pixel beside very many; that of n is taken to be smaller by the root of n. From 16 to 1 it is 0.012.
const ONE_SAMPLE: f64 = 0.016;

/// The ladder for pictures of a scene.
pub(crate) fn ladder(scene: &Scene, wanted: &WantedPicture) -> Ladder {
    let settings = SCALES.iter().flat_map(|&(scale, _)| {
        sample_counts(wanted.view.samples).flat_map(move |samples| {
            [true, false].into_iter().flat_map(move |shadows| {
                let terms = [
                    (Shading::Full, ExponentPrecision::Exact),
                    (Shading::Full, ExponentPrecision::Fast),
                    (Shading::Diffuse, ExponentPrecision::Exact),
                ];
                terms.map(|(shading, exponent)| Setting {
                    samples,
                    scale,
                    shadows,
                    shading,
                    exponent,
                    ..Setting::FULL
                })
            })
        })
    });
    Ladder::of(settings.map(|setting| rung(setting.for_scene(scene), wanted)))
}

/// Square numbers up to what is asked for.
fn sample_counts(most: u32) -> impl Iterator<Item = u32> + Clone {
    (1..=most.isqrt()).map(|side| side * side)
}

/// What is expected of a setting. A knob that is turned down already makes no difference.
fn rung(setting: Setting, wanted: &WantedPicture) -> Rung {
    let picture = setting.applied(wanted);
    let (full, quality) = (wanted.view.quality, picture.view.quality);
    let scale = |wanted: &WantedPicture| {
        SCALES.iter().find(|(scale, _)| *scale == wanted.scale).map_or(NONE, |(_, effect)| *effect)
    };
    let (before, after) = (scale(wanted), scale(&picture));
    let (samples, fewer) = (f64::from(wanted.view.samples), f64::from(picture.view.samples));
    let effects = [
        Effect { cost: after.cost / before.cost, loss: after.loss - before.loss },
        Effect {
            cost: (PER_PIXEL + fewer) / (PER_PIXEL + samples),
            loss: ONE_SAMPLE * (1.0 / fewer.sqrt() - 1.0 / samples.sqrt()),
        },
        if quality.shadows == full.shadows { NONE } else { NO_SHADOWS },
        if quality.shading == full.shading { NONE } else { DIFFUSE },
        if quality.exponent == full.exponent { NONE } else { FAST_EXPONENT },
    ];
    Rung {
        setting,
        cost: effects.iter().map(|effect| effect.cost).product(),
        loss: effects.iter().map(|effect| effect.loss).sum(),
    }
}
