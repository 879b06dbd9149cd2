//! A source at random, by its power.

/// Probabilities of sources.
#[derive(Clone, Debug, Default)]
pub(super) struct Choice {
    /// Probability of each source.
    probability: Vec<f32>,
    /// Upper end of each source's part of [0, 1); the last one that may be selected ends at 1.
    ends: Vec<f32>,
}

impl Choice {
    /// Probabilities in proportion to the powers. Sources without power are not selected.
    pub(super) fn by_power(powers: &[f64]) -> Self {
        let total: f64 = powers.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Self::default();
        }
        let mut sum = 0.0;
        let mut ends: Vec<f32> = powers
            .iter()
            .map(|power| {
                sum += power;
                (sum / total) as f32
            })
            .collect();
        // Rounded sums: all from the last source with a power on end at 1.
        let last = powers.iter().rposition(|&power| power > 0.0).unwrap_or(0);
        ends[last..].fill(1.0);
        let starts = std::iter::once(0.0).chain(ends.iter().copied());
        let probability = starts.zip(&ends).map(|(start, end)| end - start).collect();
        Self { probability, ends }
    }

    /// Whether no source can be selected.
    pub(super) fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The source of a number in [0, 1).
    pub(super) fn select(&self, number: f32) -> u32 {
        let index = self.ends.partition_point(|&end| end <= number);
        index.min(self.ends.len().saturating_sub(1)) as u32
    }

    /// The source of a number in [0, 1), its probability, and the place of the number in its part, in [0, 1).
    pub(super) fn select_and_rescale(&self, number: f32) -> (u32, f32, f32) {
        let source = self.select(number);
        let start = (source as usize).checked_sub(1).and_then(|before| self.ends.get(before));
        let probability = self.probability(source);
        let within = if probability > 0.0 { (number - start.unwrap_or(&0.0)) / probability } else { 0.0 };
        (source, probability, within.clamp(0.0, 1.0 - f32::EPSILON / 2.0))
    }

    /// The probability of a source.
    pub(super) fn probability(&self, source: u32) -> f32 {
        self.probability.get(source as usize).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_selected_by_their_power() {
        let choice = Choice::by_power(&[1.0, 0.0, 2.0, 5.0, 0.0]);
        let mut counts = [0; 5];
        (0..8000).for_each(|i| counts[choice.select(i as f32 / 8000.0) as usize] += 1);
        assert_eq!(counts, [1000, 0, 2000, 5000, 0]);
        let sum: f32 = (0..5).map(|source| choice.probability(source)).sum();
        assert_eq!((sum, choice.probability(1)), (1.0, 0.0));
        assert_eq!(choice.select(1.0 - f32::EPSILON / 2.0), 3);
    }

    #[test]
    fn numbers_are_rescaled_within_the_part_of_a_source() {
        let choice = Choice::by_power(&[1.0, 0.0, 3.0]);
        assert_eq!(choice.select_and_rescale(0.125), (0, 0.25, 0.5));
        assert_eq!(choice.select_and_rescale(0.25), (2, 0.75, 0.0));
        let (source, probability, rest) = choice.select_and_rescale(1.0 - f32::EPSILON / 2.0);
        assert!((source, probability) == (2, 0.75) && rest > 0.99 && rest < 1.0);
    }

    #[test]
    fn without_power_nothing_is_selected() {
        assert!(Choice::by_power(&[]).is_empty() && Choice::by_power(&[0.0]).is_empty());
        assert!(Choice::by_power(&[f64::INFINITY]).is_empty());
        assert_eq!(Choice::default().probability(0), 0.0);
    }
}
