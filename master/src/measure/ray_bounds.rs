//! Upper bounds of the rays that follow from one ray of the camera.

use rayfarm_tracer::scene::{Light, Quality, Scene, SceneFeatures};
use rayfarm_tracer::{CompiledScene, RayCounts};

/// Largest numbers of rays that follow from one ray of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RayBounds {
    /// Shadow rays, from the first surface and from those of secondary rays.
    pub(crate) shadow: u64,
    /// Reflected and transmitted rays.
    pub(crate) secondary: u64,
}

impl RayBounds {
    /// Bounds for a scene at a quality. Not every ray hits a surface, not every surface bounces, and not every surface faces every
    /// light: the real numbers are lower.
    pub(crate) fn of(scene: &CompiledScene, quality: &Quality) -> Self {
        let features = scene.features().at(quality);
        let secondary = secondary(&features, quality.max_depth);
        let of_surface = shadow(scene.scene(), &features, quality);
        Self { shadow: of_surface.saturating_mul(1 + secondary), secondary }
    }
}

/// Secondary rays of one ray of the camera. Each surface reflects one ray; where materials transmit, it transmits another one.
fn secondary(features: &SceneFeatures, max_depth: u8) -> u64 {
    let most = u64::from(RayCounts::MAX_SECONDARY);
    if !features.bounces {
        return 0;
    }
    let from_one: u64 = if features.transparent { 2 } else { 1 };
    let generations = (1..=u32::from(max_depth)).map(|generation| from_one.saturating_pow(generation));
    generations.fold(0, |sum: u64, rays| sum.saturating_add(rays)).min(most)
}

/// Shadow rays of one surface point.
fn shadow(scene: &Scene, features: &SceneFeatures, quality: &Quality) -> u64 {
    if !features.shadows {
        return 0;
    }
    let points = |light: &Light| {
        let soft = light.radius > 0.0;
        if soft { u64::from(light.shadow_samples_at(&scene.render.quality, quality)) } else { 1 }
    };
    scene.lights.iter().filter(|light| light.shadows).map(points).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generations_double_where_surfaces_transmit_up_to_the_limit_of_a_sample() {
        let mirrors = SceneFeatures { bounces: true, ..SceneFeatures::default() };
        let glass = SceneFeatures { transparent: true, ..mirrors };
        for (features, depth, rays) in [
            (SceneFeatures::default(), 64, 0),
            (mirrors, 0, 0),
            (mirrors, 5, 5),
            (mirrors, 64, 64),
            (glass, 1, 2),
            (glass, 5, 2 + 4 + 8 + 16 + 32),
            (glass, 8, 510),
            (glass, 9, 1022),
            (glass, 64, 1024),
        ] {
            assert_eq!(secondary(&features, depth), rays, "{features:?}, depth {depth}");
        }
    }
}
