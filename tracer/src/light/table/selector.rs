//! The sources that sixteen points select.

use super::samples::Selected;
use super::select::Choice;
use super::tree::{LightTree, Receiver};
use super::{LightTable, Receivers, Selection};
use crate::simd::{LANES, Lanes, Simd, each_bit};

/// Many sources.
#[derive(Clone, Debug)]
pub(super) struct Many {
    pub tree: LightTree,
    /// Probabilities of the tree, against the sources outside of it: where those with an extent are selected from, and where all are.
    pub shares: [f32; 2],
}

impl LightTable {
    /// Whether sources are selected by a tree.
    pub(crate) fn has_tree(&self) -> bool {
        self.many.is_some()
    }

    /// Selects a source for each point, by a number in [0, 1) each.
    #[inline(always)]
    pub(super) fn select<S: Simd>(
        &self,
        simd: S,
        receivers: &Receivers<S>,
        selection: Selection,
        numbers: [f32; LANES],
    ) -> Selected {
        let choice = self.choice(selection);
        if let Some(many) = &self.many {
            return many.select(simd, receivers, selection, numbers, choice);
        }
        let mut selected = Selected::none();
        if choice.is_empty() {
            return selected;
        }
        for lane in each_bit(receivers.lanes) {
            let source = choice.select(numbers[lane]);
            selected.set(lane, source, choice.probability(source));
        }
        selected
    }

    /// Probability that a source outside of the tree is selected.
    pub(super) fn share_outside(&self, selection: Selection) -> f32 {
        self.many.as_ref().map_or(1.0, |many| 1.0 - many.share(selection))
    }

    /// Probabilities of the sources outside of the tree among each other.
    pub(super) fn choice(&self, selection: Selection) -> &Choice {
        match selection {
            Selection::Extended => &self.extended,
            Selection::All => &self.all,
        }
    }
}

impl Many {
    fn share(&self, selection: Selection) -> f32 {
        match selection {
            Selection::Extended => self.shares[0],
            Selection::All => self.shares[1],
        }
    }

    /// Selects a source in the tree, or one outside of it.
    #[inline(never)]
    fn select<S: Simd>(
        &self,
        simd: S,
        receivers: &Receivers<S>,
        selection: Selection,
        mut numbers: [f32; LANES],
        outside: &Choice,
    ) -> Selected {
        let share = self.share(selection);
        let below_one = 1.0 - f32::EPSILON / 2.0;
        let mut in_tree = 0;
        for lane in each_bit(receivers.lanes) {
            let number = numbers[lane];
            if number < share {
                in_tree |= 1 << lane;
                numbers[lane] = (number / share).min(below_one);
            } else {
                numbers[lane] = ((number - share) / (1.0 - share)).min(below_one);
            }
        }
        let mut selected = self.tree.select(simd, receivers, selection, &numbers, in_tree);
        for lane in each_bit(selected.lanes) {
            selected.probability.0[lane] *= share;
        }
        if !outside.is_empty() {
            for lane in each_bit(receivers.lanes & !in_tree) {
                let source = outside.select(numbers[lane]);
                selected.set(lane, source, outside.probability(source) * (1.0 - share));
            }
        }
        selected
    }

    /// The probabilities with which points select sources of the tree.
    #[inline(never)]
    pub(super) fn probabilities<S: Simd>(
        &self,
        simd: S,
        selection: Selection,
        sources: &[u32; LANES],
        receivers: &dyn Fn(usize) -> Receiver,
        lanes: u32,
    ) -> Lanes {
        let mut probabilities = self.tree.probabilities(simd, selection, sources, receivers, lanes);
        for lane in each_bit(lanes) {
            probabilities.0[lane] *= self.share(selection);
        }
        probabilities
    }
}
