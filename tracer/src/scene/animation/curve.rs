//! Smooth curves through values at times: piecewise cubic polynomials whose velocity is continuous.
//!
//! Made of additions, multiplications and divisions only, so that every platform has the same curve, bit for bit.

use glam::DVec3;

/// How a curve passes between its keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene) enum Shape {
    /// A Catmull-Rom spline over uneven times: the velocity at a key is that of the parabola through it and its two neighbours
    /// (Barry and Goldman 1988). It may leave the range of its keys, as the path of a thrown ball does. Where two keys in a row are
    /// equal, it rests.
    Round,
    /// A monotone cubic in each component (Steffen 1990): it never leaves the range of two keys in a row.
    Within,
}

/// A curve through values at times. Before the first key it has the first value, after the last key the last.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) struct Curve {
    shape: Shape,
    keys: Vec<Key>,
}

/// A value at a time, in seconds, and the velocity there, per second.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    time: f64,
    value: DVec3,
    slope: DVec3,
}

impl Curve {
    /// The curve through values at times, which ascend; `None` without a value.
    pub(in crate::scene) fn new(shape: Shape, values: &[(f64, DVec3)]) -> Option<Self> {
        let slope = |at: usize| match shape {
            Shape::Round => round_slope(values, at),
            Shape::Within => within_slope(values, at),
        };
        let key = |(at, &(time, value)): (usize, &(f64, DVec3))| Key { time, value, slope: slope(at) };
        let keys: Vec<Key> = values.iter().enumerate().map(key).collect();
        (!keys.is_empty()).then_some(Self { shape, keys })
    }

    /// The value at a time, in seconds. At the time of a key it is the key's own, bit for bit.
    pub(in crate::scene) fn at(&self, time: f64) -> DVec3 {
        let next = self.keys.partition_point(|key| key.time <= time);
        let before = next.checked_sub(1).and_then(|last| self.keys.get(last));
        match (before, self.keys.get(next)) {
            (Some(a), Some(b)) => self.between(a, b, time),
            (Some(only), None) | (None, Some(only)) => only.value,
            (None, None) => DVec3::ZERO,
        }
    }

    /// The cubic Hermite polynomial between two keys.
    fn between(&self, a: &Key, b: &Key, time: f64) -> DVec3 {
        let step = b.time - a.time;
        let u = (time - a.time) / step;
        let v = 1.0 - u;
        // Differences to the nearer values, so that equal keys have exactly their value in between.
        let moved = (b.value - a.value) * (u * u * (3.0 - 2.0 * u));
        let value = a.value + moved + (a.slope * v - b.slope * u) * (u * v * step);
        match self.shape {
            Shape::Round => value,
            // Rounding may leave the range by a digit.
            Shape::Within => value.clamp(a.value.min(b.value), a.value.max(b.value)),
        }
    }
}

/// The mean velocity from a key to the next one, and the time in between.
fn chord(values: &[(f64, DVec3)], at: usize) -> Option<(DVec3, f64)> {
    let (&(start, from), &(end, to)) = values.get(at).zip(values.get(at + 1))?;
    Some(((to - from) / (end - start), end - start))
}

/// The chords before and after a key.
type Chords = (Option<(DVec3, f64)>, Option<(DVec3, f64)>);

fn chords(values: &[(f64, DVec3)], at: usize) -> Chords {
    (at.checked_sub(1).and_then(|before| chord(values, before)), chord(values, at))
}

/// The velocity at a key of the parabola through it and its neighbours; at an end, through it and the two next to it.
fn parabola_slope(values: &[(f64, DVec3)], at: usize) -> DVec3 {
    match chords(values, at) {
        (Some((before, left)), Some((after, right))) => (before * right + after * left) / (left + right),
        (None, Some((first, step))) => {
            chord(values, at + 1).map_or(first, |(next, far)| first + (first - next) * (step / (step + far)))
        }
        (Some((last, step)), None) => at
            .checked_sub(2)
            .and_then(|before| chord(values, before))
            .map_or(last, |(next, far)| last + (last - next) * (step / (step + far))),
        (None, None) => DVec3::ZERO,
    }
}

fn round_slope(values: &[(f64, DVec3)], at: usize) -> DVec3 {
    let (before, after) = chords(values, at);
    let rests = |chord: Option<(DVec3, f64)>| chord.is_some_and(|(velocity, _)| velocity == DVec3::ZERO);
    if rests(before) || rests(after) { DVec3::ZERO } else { parabola_slope(values, at) }
}

fn within_slope(values: &[(f64, DVec3)], at: usize) -> DVec3 {
    let parabola = parabola_slope(values, at);
    let limited = |before: f64, after: f64, parabola: f64| {
        let sense = before.signum() + after.signum();
        if before == 0.0 || after == 0.0 {
            return 0.0;
        }
        sense * before.abs().min(after.abs()).min(0.5 * parabola.abs())
    };
    // At an end: not against the chord, and at most twice as steep.
    let ending = |chord: f64, parabola: f64| match parabola * chord > 0.0 {
        true => chord.signum() * parabola.abs().min(2.0 * chord.abs()),
        false => 0.0,
    };
    let each = |of: &dyn Fn(usize) -> f64| DVec3::new(of(0), of(1), of(2));
    match chords(values, at) {
        (Some((before, _)), Some((after, _))) => each(&|i| limited(before[i], after[i], parabola[i])),
        (None, Some((chord, _))) | (Some((chord, _)), None) => each(&|i| ending(chord[i], parabola[i])),
        (None, None) => DVec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SHAPES: [Shape; 2] = [Shape::Round, Shape::Within];

    fn along_x(shape: Shape, values: &[(f64, f64)]) -> Curve {
        let values: Vec<_> = values.iter().map(|&(time, x)| (time, DVec3::X * x)).collect();
        Curve::new(shape, &values).unwrap()
    }

    #[test]
    fn keys_have_their_values_and_ends_are_held() {
        for shape in SHAPES {
            let curve = along_x(shape, &[(0.1, 3.3), (0.7, -1.7), (2.5, 8.1), (2.6, 0.3)]);
            for (time, x) in [(-9.0, 3.3), (0.1, 3.3), (0.7, -1.7), (2.5, 8.1), (2.6, 0.3), (1e9, 0.3)] {
                assert_eq!(curve.at(time).x, x, "{shape:?} at {time}");
            }
        }
    }

    #[test]
    fn two_keys_are_joined_by_a_line_and_one_is_held() {
        for shape in SHAPES {
            let curve = along_x(shape, &[(1.0, 2.0), (3.0, 6.0)]);
            for quarter in 0..=8 {
                let time = 1.0 + f64::from(quarter) * 0.25;
                assert!((curve.at(time).x - 2.0 * time).abs() < 1e-12, "{shape:?} at {time}");
            }
        }
        assert_eq!(along_x(Shape::Round, &[(1.0, 2.0)]).at(5.0).x, 2.0);
        assert_eq!(Curve::new(Shape::Round, &[]), None);
    }

    #[test]
    fn a_parabola_is_followed_exactly_over_uneven_times() {
        let height = |time: f64| 3.0 + 2.0 * time - 0.5 * time * time;
        let keys: Vec<_> = [0.0, 0.4, 1.0, 2.5, 3.5].into_iter().map(|time| (time, height(time))).collect();
        let curve = along_x(Shape::Round, &keys);
        for step in 0..=70 {
            let time = f64::from(step) * 0.05;
            assert!((curve.at(time).x - height(time)).abs() < 1e-12, "at {time}");
        }
    }

    #[test]
    fn equal_keys_in_a_row_rest() {
        for shape in SHAPES {
            let curve = along_x(shape, &[(0.0, 0.0), (1.0, 0.1), (2.0, 0.1), (3.0, 5.0)]);
            for step in 0..=10 {
                assert_eq!(curve.at(1.0 + f64::from(step) * 0.1).x, 0.1, "{shape:?}");
            }
        }
    }

    fn ascending() -> impl Strategy<Value = Vec<(f64, DVec3)>> {
        let value = (-9.0..9.0f64, -9.0..9.0f64, -9.0..9.0f64).prop_map(|(x, y, z)| DVec3::new(x, y, z));
        proptest::collection::vec((0.01..3.0f64, value), 2..9).prop_map(|steps| {
            let mut time = 0.0;
            let at = |(step, value): (f64, DVec3)| {
                time += step;
                (time, value)
            };
            steps.into_iter().map(at).collect()
        })
    }

    proptest! {
        #[test]
        fn the_velocity_is_continuous(keys in ascending()) {
            for shape in SHAPES {
                let curve = Curve::new(shape, &keys).unwrap();
                let fastest = curve.keys.windows(2).map(|pair| {
                    let chord = (pair[1].value - pair[0].value).length() / (pair[1].time - pair[0].time);
                    (chord + pair[0].slope.length() + pair[1].slope.length()) / (pair[1].time - pair[0].time)
                });
                // The second derivative is at most 12 of these; a step in the velocity would not shrink with `dt`.
                let bound = 12.0 * fastest.fold(0.0, f64::max);
                for &(time, value) in &keys[1..keys.len() - 1] {
                    let dt = 1e-5;
                    let (before, after) = (value - curve.at(time - dt), curve.at(time + dt) - value);
                    let step = (after - before).length() / dt;
                    prop_assert!(step <= bound * 2.0 * dt + 1e-6, "{shape:?}: {step} at {time}");
                }
            }
        }

        #[test]
        fn curves_within_stay_in_the_range_of_two_keys(keys in ascending(), part in 0.0..1.0f64) {
            let curve = Curve::new(Shape::Within, &keys).unwrap();
            for pair in keys.windows(2) {
                let value = curve.at(pair[0].0 + (pair[1].0 - pair[0].0) * part);
                let (low, high) = (pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1));
                prop_assert!(value.cmpge(low).all() && value.cmple(high).all());
            }
        }
    }
}
