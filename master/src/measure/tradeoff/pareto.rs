//! Pareto front of choices that have a cost and an error each.

/// Indices of the points that no other point dominates, by ascending first coordinate. A point dominates another if
/// it is nowhere greater and somewhere less, so equal points are on the front together. Points with NaN are never
/// on the front.
pub(crate) fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|i| is_number(points[*i])).collect();
    order.sort_by(|a, b| compare(points[*a], points[*b]).then(a.cmp(b)));
    let mut found: Vec<usize> = Vec::new();
    for index in order {
        let last = found.last().map(|last| points[*last]);
        // Earlier points are not greater in the first coordinate, so the second one decides.
        if last.is_none_or(|last| points[index].1 < last.1 || points[index] == last) {
            found.push(index);
        }
    }
    found
}

fn is_number((a, b): (f64, f64)) -> bool {
    !a.is_nan() && !b.is_nan()
}

fn compare(a: (f64, f64), b: (f64, f64)) -> std::cmp::Ordering {
    // NaN is excluded; zeroes of different sign are equal.
    a.partial_cmp(&b).unwrap_or(std::cmp::Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn dominates(a: (f64, f64), b: (f64, f64)) -> bool {
        a.0 <= b.0 && a.1 <= b.1 && a != b
    }

    #[test]
    fn a_single_point_is_the_front() {
        assert!(front(&[]).is_empty());
        assert_eq!(front(&[(3.0, 4.0)]), [0]);
        assert_eq!(front(&[(f64::NAN, 0.0), (1.0, f64::NAN), (2.0, 2.0)]), [2]);
    }

    #[test]
    fn equal_points_are_on_the_front_together() {
        assert_eq!(front(&[(1.0, 2.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0), (3.0, 1.0)]), [0, 2, 1, 4]);
        assert_eq!(front(&[(0.0, 1.0), (-0.0, 0.5)]), [1]);
    }

    proptest! {
        /// Few different values, so that there are ties.
        #[test]
        fn exactly_the_undominated_points_are_on_the_front(
            points in prop::collection::vec((0..7_i8, 0..7_i8).prop_map(|(a, b)| (f64::from(a), f64::from(b))), 0..30),
        ) {
            let found = front(&points);
            for (index, point) in points.iter().enumerate() {
                let dominated = points.iter().any(|other| dominates(*other, *point));
                prop_assert_eq!(found.contains(&index), !dominated, "{} of {:?}: {:?}", index, points, found);
            }
            let costs: Vec<f64> = found.iter().map(|index| points[*index].0).collect();
            prop_assert!(costs.is_sorted(), "{:?}", costs);
        }
    }
}
