//! Workers steered from the window: which one is selected, and what a key does to it.

use super::input::Happened;
use crate::app::control::KICKED;
use crate::farm::{FarmControl, FarmStatus, UnknownWorker, WorkerState, WorkerStatus};

/// The panel of workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Steering {
    /// Whether the panel is shown. Only then are workers selected and sent away: what cannot be seen is not hit.
    pub(super) shown: bool,
    pub(super) selected: Option<u64>,
}

/// What a key asks of the farm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    Pause(Vec<u64>),
    Resume(Vec<u64>),
    Drain(u64),
    Kick(u64),
    BringBack,
}

impl Steering {
    /// Takes note of the keys. What they ask of the farm, in order.
    pub(super) fn step(&mut self, keys: &Happened, status: &FarmStatus) -> Vec<Wish> {
        self.shown ^= keys.toggle_accounts;
        if keys.select_next > 0 {
            self.shown = true;
            (0..keys.select_next).for_each(|_| self.select_next(status));
        }
        let here = |id: &u64| status.workers.iter().any(|worker| worker.id == *id);
        self.selected = self.selected.filter(here).filter(|_| self.shown);
        let mut wishes = Vec::new();
        if keys.toggle_pause {
            wishes.extend(self.toggle_pause(status));
        }
        wishes.extend(self.selected.filter(|_| keys.let_go).map(Wish::Drain));
        wishes.extend(self.selected.filter(|_| keys.kick).map(Wish::Kick));
        wishes.extend(keys.bring_back.then_some(Wish::BringBack));
        wishes
    }

    /// The first worker, then the one after it, ..., then none.
    fn select_next(&mut self, status: &FarmStatus) {
        let mut ids = status.workers.iter().map(|worker| worker.id);
        self.selected = match self.selected {
            None => ids.next(),
            Some(selected) => ids.find(|&id| id > selected),
        };
    }

    /// The selected worker, or else all: work again if all of them pause, else pause.
    fn toggle_pause(&self, status: &FarmStatus) -> Option<Wish> {
        let meant = status.workers.iter().filter(|worker| self.selected.is_none_or(|id| id == worker.id));
        let (paused, others): (Vec<_>, Vec<_>) =
            meant.partition(|worker| worker.state == WorkerState::Paused);
        let ids = |workers: Vec<&WorkerStatus>| workers.iter().map(|worker| worker.id).collect();
        match (paused.is_empty(), others.is_empty()) {
            (true, true) => None,
            (false, true) => Some(Wish::Resume(ids(paused))),
            (_, false) => Some(Wish::Pause(ids(others))),
        }
    }
}

/// Whether there are workers, and nobody may render.
pub(super) fn all_paused(status: &FarmStatus) -> bool {
    !status.workers.is_empty() && status.workers.iter().all(|worker| worker.state == WorkerState::Paused)
}

impl Wish {
    /// Does it.
    pub(super) fn perform(&self, farm: &FarmControl) {
        let each = |ids: &[u64], act: fn(&FarmControl, u64) -> Result<(), UnknownWorker>| {
            for &id in ids {
                // A worker that has left meanwhile needs nothing.
                let _ = act(farm, id);
            }
        };
        match self {
            Self::Pause(ids) => each(ids, FarmControl::pause),
            Self::Resume(ids) => each(ids, FarmControl::resume),
            Self::Drain(id) => each(&[*id], FarmControl::drain),
            Self::Kick(id) => each(&[*id], |farm, id| farm.kick(id, KICKED)),
            Self::BringBack => farm.bring_back(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(states: &[WorkerState]) -> FarmStatus {
        let worker = |(index, &state): (usize, &WorkerState)| WorkerStatus {
            id: index as u64 + 1,
            name: "w".into(),
            local: false,
            address: ([127, 0, 0, 1], 9).into(),
            threads: 1,
            segments_done: 0,
            speed: 0.0,
            state,
            trouble: None,
        };
        FarmStatus { workers: states.iter().enumerate().map(worker).collect(), ..FarmStatus::default() }
    }

    const WORKING: WorkerState = WorkerState::Working;
    const PAUSED: WorkerState = WorkerState::Paused;

    fn keys(change: impl Fn(&mut Happened)) -> Happened {
        let mut keys = Happened::default();
        change(&mut keys);
        keys
    }

    #[test]
    fn tab_goes_round_and_opens_the_panel() {
        let mut steering = Steering::default();
        let tab = keys(|keys| keys.select_next = 1);
        let status = status(&[WORKING; 2]);
        for selected in [Some(1), Some(2), None, Some(1)] {
            assert_eq!(steering.step(&tab, &status), []);
            assert_eq!((steering.shown, steering.selected), (true, selected));
        }
    }

    #[test]
    fn only_a_selected_worker_in_sight_is_sent_away() {
        let mut steering = Steering::default();
        let away = keys(|keys| (keys.let_go, keys.kick) = (true, true));
        let status = status(&[WORKING; 2]);
        assert_eq!(steering.step(&away, &status), []);
        steering.step(&keys(|keys| keys.select_next = 2), &status);
        assert_eq!(steering.step(&away, &status), [Wish::Drain(2), Wish::Kick(2)]);
        steering.step(&keys(|keys| keys.toggle_accounts = true), &status);
        assert_eq!(steering.step(&away, &status), []);
    }

    #[test]
    fn workers_are_brought_back_though_none_is_there_or_in_sight() {
        let mut steering = Steering::default();
        let back = keys(|keys| keys.bring_back = true);
        assert!(back.steers());
        assert_eq!(steering.step(&back, &status(&[])), [Wish::BringBack]);
    }

    #[test]
    fn a_pause_of_all_is_told_from_an_empty_farm() {
        assert!(all_paused(&status(&[PAUSED, PAUSED])));
        assert!(!all_paused(&status(&[PAUSED, WORKING])) && !all_paused(&status(&[])));
    }

    #[test]
    fn who_has_left_is_not_selected() {
        let mut steering = Steering { shown: true, selected: Some(2) };
        steering.step(&Happened::default(), &status(&[WORKING]));
        assert_eq!(steering.selected, None);
    }

    #[test]
    fn pause_is_for_the_selected_worker_or_for_all() {
        let pause = keys(|keys| keys.toggle_pause = true);
        let mut all = Steering::default();
        assert_eq!(all.step(&pause, &status(&[WORKING, PAUSED])), [Wish::Pause(vec![1])]);
        assert_eq!(all.step(&pause, &status(&[PAUSED, PAUSED])), [Wish::Resume(vec![1, 2])]);
        assert_eq!(all.step(&pause, &status(&[])), []);
        let mut one = Steering { shown: true, selected: Some(2) };
        assert_eq!(one.step(&pause, &status(&[WORKING, PAUSED])), [Wish::Resume(vec![2])]);
    }
}
