//! What the window says of workers that were kicked, and of the way back.

use crate::farm::BannedWorker;

/// Names that are listed at most.
const MAX_NAMES: usize = 4;
/// Characters of a name that are shown.
const MAX_NAME: usize = 24;

/// Which workers are kept out.
pub(super) fn told(kicked: &[BannedWorker]) -> String {
    let cut = |worker: &BannedWorker| worker.name.chars().take(MAX_NAME).collect::<String>();
    let mut list = kicked.iter().take(MAX_NAMES).map(cut).collect::<Vec<_>>().join(", ");
    if kicked.len() > MAX_NAMES {
        list += &format!(" and {} more", kicked.len() - MAX_NAMES);
    }
    format!("Kicked and kept out: {list}")
}

/// What can be done where no worker is left. `ended`: whether workers of this machine have ended.
pub(super) fn way_back(kicked: &[BannedWorker], ended: bool) -> Vec<String> {
    match (kicked.is_empty(), ended) {
        (false, _) => vec![told(kicked), String::new(), "B: bring back".to_owned()],
        (true, true) => vec![String::new(), "B: start this machine's workers again".to_owned()],
        (true, false) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> BannedWorker {
        BannedWorker { id: 1, name: name.to_owned(), address: None }
    }

    #[test]
    fn the_first_names_are_listed_and_the_rest_is_counted() {
        let kicked: Vec<BannedWorker> = (1..=6).map(|number| named(&format!("mill-{number}"))).collect();
        assert_eq!(told(&kicked[..1]), "Kicked and kept out: mill-1");
        assert_eq!(told(&kicked), "Kicked and kept out: mill-1, mill-2, mill-3, mill-4 and 2 more");
    }

    #[test]
    fn an_empty_farm_is_told_how_to_get_its_workers_back() {
        let kicked = way_back(&[named("local-1")], true);
        assert_eq!(kicked, ["Kicked and kept out: local-1", "", "B: bring back"]);
        assert_eq!(way_back(&[], true), ["", "B: start this machine's workers again"]);
        assert!(way_back(&[], false).is_empty(), "no worker was kicked");
    }
}
