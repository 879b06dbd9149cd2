//! Passes of a picture: ranges of samples, and their views.

use std::ops::Range;

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::PixelFormat;
use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings};

/// Samples of the longest passes. A long pass costs less per sample, and a short one shows its picture sooner.
const LONGEST: u32 = 16;

/// The pass that begins at a sample, of a picture of `samples` samples; `None` at its end. Passes end at 1, 2, 4, 8, 16, 32, 48 and so on
/// wherever they begin, so that a continued picture has the same passes as one without an interruption.
pub(crate) fn next(first: u32, samples: u32) -> Option<Range<u32>> {
    let end = match first {
        0..LONGEST => (first + 1).next_power_of_two(),
        _ => (first / LONGEST).saturating_add(1).saturating_mul(LONGEST),
    };
    (first < samples).then(|| first..end.min(samples))
}

/// Whether pictures of a view may be rendered in passes.
pub(crate) fn has_passes(view: &FrameView) -> bool {
    view.integrator != Integrator::Direct
}

/// The largest error at which a picture of a view has enough samples; `None` where only their number counts.
pub(crate) fn error_target(view: &FrameView) -> Option<f64> {
    view.integrator.path().map(|settings| f64::from(settings.max_noise)).filter(|noise| *noise > 0.0)
}

/// The view that is rendered for a pass: its samples, as sums. The error at which a picture ends is of the whole film.
pub(crate) fn pass(view: &FrameView, samples: Range<u32>) -> FrameView {
    FrameView {
        first_sample: samples.start,
        samples: samples.end.saturating_sub(samples.start),
        format: PixelFormat::Sums,
        integrator: without_target(view.integrator),
        ..*view
    }
}

/// The view whose picture is that of a film after a number of samples.
pub(crate) fn whole(view: &FrameView, samples: u32) -> FrameView {
    FrameView { first_sample: 0, samples, integrator: without_target(view.integrator), ..*view }
}

/// The request for a picture while its camera moves. Of paths it has one sample whatever the picture at rest has, so that the samples are
/// no rung of a quality controller.
pub(crate) fn while_moving(request: &ViewRequest) -> ViewRequest {
    match has_passes(&request.view) {
        true => ViewRequest { view: moving(&request.view), ..*request },
        false => *request,
    }
}

/// The view of a moving camera: one sample in the bytes of a display.
fn moving(view: &FrameView) -> FrameView {
    FrameView {
        first_sample: 0,
        samples: 1,
        format: PixelFormat::Rgb8,
        integrator: without_target(view.integrator),
        ..*view
    }
}

fn without_target(integrator: Integrator) -> Integrator {
    match integrator {
        Integrator::Direct => Integrator::Direct,
        Integrator::Path(settings) => Integrator::Path(PathSettings { max_noise: 0.0, ..settings }),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rayfarm_farm::testing::test_scene;

    use super::*;

    fn all(from: u32, samples: u32) -> Vec<Range<u32>> {
        std::iter::successors(next(from, samples), |pass| next(pass.end, samples)).collect()
    }

    #[test]
    fn passes_grow_to_sixteen_samples() {
        let lengths: Vec<u32> = all(0, 70).iter().map(ExactSizeIterator::len).map(|len| len as u32).collect();
        assert_eq!(lengths, [1, 1, 2, 4, 8, 16, 16, 16, 6]);
        assert_eq!(all(0, 1).as_slice(), std::slice::from_ref(&(0..1)));
        assert_eq!((next(5, 5), next(u32::MAX, u32::MAX)), (None, None));
        assert_eq!(next(u32::MAX - 1, u32::MAX), Some(u32::MAX - 1..u32::MAX));
    }

    #[test]
    fn a_view_that_moves_and_a_pass_have_no_error_at_which_they_end() {
        let integrator =
            Integrator::Path(PathSettings { max_noise: 0.02, seed: 7, ..PathSettings::default() });
        let view = FrameView { integrator, samples: 64, ..test_scene::view() };
        assert!(error_target(&view).is_some_and(|error| (error - 0.02).abs() < 1e-6));
        for one in [pass(&view, 4..8), moving(&view)] {
            assert_eq!(error_target(&one), None);
            assert_eq!(one.integrator.path().map(|settings| settings.seed), Some(7));
        }
        let FrameView { first_sample, samples, format, .. } = pass(&view, 4..8);
        assert_eq!((first_sample, samples, format), (4, 4, PixelFormat::Sums));
        assert!(has_passes(&view) && !has_passes(&test_scene::view()));
    }

    proptest! {
        #[test]
        fn passes_cover_all_samples_once_and_continue_in_the_same_way(
            samples in 1_u32..3000, stop in 0_u32..3000, from in 0_u32..3000,
        ) {
            let passes = all(0, samples);
            prop_assert_eq!(passes.iter().cloned().flatten().collect::<Vec<_>>(), (0..samples).collect::<Vec<_>>());
            // Continued from the end of a shorter picture.
            let (stop, from) = (stop.min(samples), from.min(samples));
            let first = all(0, stop).last().map_or(0, |last| last.end);
            let ends = |passes: Vec<Range<u32>>| passes.iter().map(|pass| pass.end).collect::<Vec<_>>();
            let later: Vec<u32> = ends(passes).into_iter().filter(|end| *end > first).collect();
            prop_assert_eq!(ends(all(first, samples)), later);
            prop_assert!(all(from, samples).iter().all(|pass| pass.len() <= LONGEST as usize && !pass.is_empty()));
        }
    }
}
