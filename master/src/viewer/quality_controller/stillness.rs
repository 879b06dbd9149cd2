//! Whether the picture moves. Pure: times are since any fixed moment, and grow.

use std::time::Duration;

/// A camera that has not changed for this long is at rest. Keys that are held change it many times in that time; the
/// rest of half a second is for the full picture.
pub(crate) const REST_AFTER: Duration = Duration::from_millis(100);

/// What a picture is asked for at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// The rate counts.
    Moving,
    /// The full picture counts.
    Resting,
}

/// Tells rest from motion.
#[derive(Clone, Debug)]
pub(crate) struct Stillness {
    /// Something moves by itself, so there is no rest.
    animated: bool,
    /// When the camera changed last, until it rests.
    changed_at: Option<Duration>,
    /// Whether a picture of the camera as it is now has come.
    is_shown: bool,
}

impl Stillness {
    /// A camera that rests, unless something moves by itself.
    pub(crate) fn new(animated: bool) -> Self {
        Self { animated, changed_at: None, is_shown: true }
    }

    /// The camera has changed.
    pub(crate) fn changed(&mut self, now: Duration) {
        (self.changed_at, self.is_shown) = (Some(now), false);
    }

    /// A picture has come that was asked for `asked_at`.
    pub(crate) fn shown(&mut self, asked_at: Duration) {
        self.is_shown |= self.changed_at.is_none_or(|changed_at| changed_at <= asked_at);
    }

    /// Moving, or at rest from `now` on. A camera rests when it has not changed for [`REST_AFTER`] and one picture shows
    /// where it has come to, so that nobody who has a slow farm waits for that until the full picture is there.
    pub(crate) fn motion(&mut self, now: Duration) -> Motion {
        if self.is_shown && self.rests_at().is_some_and(|at| at <= now) {
            self.changed_at = None;
        }
        if self.animated || self.changed_at.is_some() { Motion::Moving } else { Motion::Resting }
    }

    /// When it will rest if the camera does not change any more; `None` where nothing but a change or a picture can make
    /// a difference.
    pub(crate) fn rests_at(&self) -> Option<Duration> {
        self.changed_at.filter(|_| self.is_shown && !self.animated).map(|at| at + REST_AFTER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_camera_that_nobody_touches_rests() {
        let mut stillness = Stillness::new(false);
        assert_eq!((stillness.motion(MS), stillness.rests_at()), (Motion::Resting, None));
    }

    #[test]
    fn it_moves_from_a_change_until_a_while_after_the_last_one() {
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
    fn it_does_not_rest_before_a_picture_shows_where_it_is() {
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
