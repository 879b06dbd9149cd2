//! Detection of motion and rest of the view. Pure: times are since any fixed moment, and grow.

use std::time::Duration;

/// Time without a change after which a camera is at rest. A held key changes it many times within that time, and the full
/// picture is to be complete half a second after the last change.
pub(crate) const REST_AFTER: Duration = Duration::from_millis(100);

/// State of the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// The view changes: the frame rate matters.
    Moving,
    /// The view is at rest: full quality matters.
    Resting,
}

/// Detector of motion and rest.
#[derive(Clone, Debug)]
pub(crate) struct Stillness {
    /// Whether something moves without input, so that the view never rests.
    animated: bool,
    /// Time of the last change of the camera, until it rests.
    changed_at: Option<Duration>,
    /// Whether a picture of the current camera has been completed.
    is_shown: bool,
}

impl Stillness {
    /// A view at rest, unless something moves without input.
    pub(crate) fn new(animated: bool) -> Self {
        Self { animated, changed_at: None, is_shown: true }
    }

    /// Records a change of the camera.
    pub(crate) fn changed(&mut self, now: Duration) {
        (self.changed_at, self.is_shown) = (Some(now), false);
    }

    /// Records a picture that was requested at `requested_at`.
    pub(crate) fn shown(&mut self, requested_at: Duration) {
        self.is_shown |= self.changed_at.is_none_or(|changed_at| changed_at <= requested_at);
    }

    /// State of the view from `now` on. A camera rests when it has not changed for [`REST_AFTER`] and a picture of its current
    /// position is complete, so that on a slow farm this picture does not have to wait for the full one.
    pub(crate) fn motion(&mut self, now: Duration) -> Motion {
        if self.is_shown && self.rests_at().is_some_and(|at| at <= now) {
            self.changed_at = None;
        }
        if self.animated || self.changed_at.is_some() { Motion::Moving } else { Motion::Resting }
    }

    /// Time at which the view will rest if the camera does not change any more; `None` where only a change or a picture can
    /// make a difference.
    pub(crate) fn rests_at(&self) -> Option<Duration> {
        self.changed_at.filter(|_| self.is_shown && !self.animated).map(|at| at + REST_AFTER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn an_untouched_camera_rests() {
        let mut stillness = Stillness::new(false);
        assert_eq!((stillness.motion(MS), stillness.rests_at()), (Motion::Resting, None));
    }

    #[test]
    fn the_view_moves_until_a_while_after_the_last_change() {
        let mut stillness = Stillness::new(false);
        for step in 0..20 {
            stillness.changed(MS * 90 * step);
            stillness.shown(MS * 90 * step);
            assert_eq!(stillness.motion(MS * (90 * step + 89)), Motion::Moving);
        }
        let last = MS * 90 * 19;
        assert_eq!(stillness.rests_at(), Some(last + REST_AFTER));
        assert_eq!(stillness.motion(last + REST_AFTER - MS), Motion::Moving);
        assert_eq!(stillness.motion(last + REST_AFTER), Motion::Resting);
        assert_eq!(stillness.rests_at(), None);
    }

    #[test]
    fn the_view_does_not_rest_before_a_picture_of_its_camera() {
        let mut stillness = Stillness::new(false);
        stillness.changed(MS * 50);
        stillness.shown(MS * 49);
        assert_eq!((stillness.motion(MS * 900), stillness.rests_at()), (Motion::Moving, None));
        stillness.shown(MS * 50);
        assert_eq!(stillness.motion(MS * 901), Motion::Resting);
    }

    #[test]
    fn an_animation_never_rests() {
        let mut stillness = Stillness::new(true);
        stillness.changed(MS);
        stillness.shown(MS);
        assert_eq!((stillness.motion(MS * 10_000), stillness.rests_at()), (Motion::Moving, None));
    }
}
