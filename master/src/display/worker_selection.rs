//! Selection of workers in the window, and the commands of keys to them.

use rayfarm_farm::{FarmStatus, WorkerState, WorkerStatus};

use super::input::InputEvents;
use crate::viewer::WorkerCommand;

/// State of the panel of workers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct WorkerSelection {
    /// Whether the panel is shown. Only then can workers be selected, drained and kicked.
    pub(super) shown: bool,
    /// Number of the selected worker.
    pub(super) selected: Option<u64>,
}

impl WorkerSelection {
    /// Applies keys. Returns their commands, in order.
    pub(super) fn apply(&mut self, keys: &InputEvents, status: &FarmStatus) -> Vec<WorkerCommand> {
        self.shown ^= keys.toggle_accounts;
        if keys.select_next > 0 {
            self.shown = true;
            (0..keys.select_next).for_each(|_| self.select_next(status));
        }
        let is_connected = |id: &u64| status.workers.iter().any(|worker| worker.id == *id);
        self.selected = self.selected.filter(is_connected).filter(|_| self.shown);
        let mut commands = Vec::new();
        if keys.toggle_pause {
            commands.extend(self.toggle_pause(status));
        }
        commands.extend(self.selected.filter(|_| keys.drain).map(WorkerCommand::Drain));
        commands.extend(self.selected.filter(|_| keys.kick).map(WorkerCommand::Kick));
        commands.extend(keys.bring_back.then_some(WorkerCommand::BringBack));
        commands
    }

    /// Selects the first worker, then each next one, then none.
    fn select_next(&mut self, status: &FarmStatus) {
        let mut ids = status.workers.iter().map(|worker| worker.id);
        self.selected = match self.selected {
            None => ids.next(),
            Some(selected) => ids.find(|&id| id > selected),
        };
    }

    /// Resumes the selected worker, or else all, if all of them are paused; pauses them otherwise.
    fn toggle_pause(&self, status: &FarmStatus) -> Option<WorkerCommand> {
        let targets = status.workers.iter().filter(|worker| self.selected.is_none_or(|id| id == worker.id));
        let (paused, others): (Vec<_>, Vec<_>) =
            targets.partition(|worker| worker.state == WorkerState::Paused);
        let ids = |workers: Vec<&WorkerStatus>| workers.iter().map(|worker| worker.id).collect();
        match (paused.is_empty(), others.is_empty()) {
            (true, true) => None,
            (false, true) => Some(WorkerCommand::Resume(ids(paused))),
            (_, false) => Some(WorkerCommand::Pause(ids(others))),
        }
    }
}

/// Whether workers are connected and all of them are paused.
pub(super) fn all_paused(status: &FarmStatus) -> bool {
    !status.workers.is_empty() && status.workers.iter().all(|worker| worker.state == WorkerState::Paused)
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
            last_failure: None,
        };
        FarmStatus { workers: states.iter().enumerate().map(worker).collect(), ..FarmStatus::default() }
    }

    const WORKING: WorkerState = WorkerState::Working;
    const PAUSED: WorkerState = WorkerState::Paused;

    fn keys(change: impl Fn(&mut InputEvents)) -> InputEvents {
        let mut keys = InputEvents::default();
        change(&mut keys);
        keys
    }

    #[test]
    fn tab_cycles_through_the_workers_and_shows_the_panel() {
        let mut selection = WorkerSelection::default();
        let tab = keys(|keys| keys.select_next = 1);
        let status = status(&[WORKING; 2]);
        for selected in [Some(1), Some(2), None, Some(1)] {
            assert_eq!(selection.apply(&tab, &status), []);
            assert_eq!((selection.shown, selection.selected), (true, selected));
        }
    }

    #[test]
    fn only_a_selected_worker_on_a_shown_panel_is_drained_or_kicked() {
        let mut selection = WorkerSelection::default();
        let both = keys(|keys| (keys.drain, keys.kick) = (true, true));
        let status = status(&[WORKING; 2]);
        assert_eq!(selection.apply(&both, &status), []);
        selection.apply(&keys(|keys| keys.select_next = 2), &status);
        assert_eq!(selection.apply(&both, &status), [WorkerCommand::Drain(2), WorkerCommand::Kick(2)]);
        selection.apply(&keys(|keys| keys.toggle_accounts = true), &status);
        assert_eq!(selection.apply(&both, &status), []);
    }

    #[test]
    fn workers_are_brought_back_without_workers_and_without_the_panel() {
        let mut selection = WorkerSelection::default();
        let back = keys(|keys| keys.bring_back = true);
        assert!(back.concerns_workers());
        assert_eq!(selection.apply(&back, &status(&[])), [WorkerCommand::BringBack]);
    }

    #[test]
    fn a_farm_without_workers_is_not_paused() {
        assert!(all_paused(&status(&[PAUSED, PAUSED])));
        assert!(!all_paused(&status(&[PAUSED, WORKING])) && !all_paused(&status(&[])));
    }

    #[test]
    fn a_disconnected_worker_is_not_selected() {
        let mut selection = WorkerSelection { shown: true, selected: Some(2) };
        selection.apply(&InputEvents::default(), &status(&[WORKING]));
        assert_eq!(selection.selected, None);
    }

    #[test]
    fn pause_is_for_the_selected_worker_or_for_all() {
        let pause = keys(|keys| keys.toggle_pause = true);
        let mut all = WorkerSelection::default();
        assert_eq!(all.apply(&pause, &status(&[WORKING, PAUSED])), [WorkerCommand::Pause(vec![1])]);
        assert_eq!(all.apply(&pause, &status(&[PAUSED, PAUSED])), [WorkerCommand::Resume(vec![1, 2])]);
        assert_eq!(all.apply(&pause, &status(&[])), []);
        let mut one = WorkerSelection { shown: true, selected: Some(2) };
        assert_eq!(one.apply(&pause, &status(&[WORKING, PAUSED])), [WorkerCommand::Resume(vec![2])]);
    }
}
