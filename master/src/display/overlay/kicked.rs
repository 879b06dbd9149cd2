//! Text about kicked workers, and how to bring them back.

use rayfarm_farm::BannedWorker;

/// Largest number of names in the list.
const MAX_NAMES: usize = 4;
/// Characters of a name in the list.
const MAX_NAME: usize = 24;

/// List of the kicked workers.
pub(super) fn list(kicked: &[BannedWorker]) -> String {
    let cut = |worker: &BannedWorker| worker.name.chars().take(MAX_NAME).collect::<String>();
    let mut list = kicked.iter().take(MAX_NAMES).map(cut).collect::<Vec<_>>().join(", ");
    if kicked.len() > MAX_NAMES {
        list += &format!(" and {} more", kicked.len() - MAX_NAMES);
    }
    format!("Kicked: {list}")
}

/// Remedies where no worker is left. `ended`: whether workers of this machine have ended.
pub(super) fn remedies(kicked: &[BannedWorker], ended: bool) -> Vec<String> {
    match (kicked.is_empty(), ended) {
        (false, _) => vec![list(kicked), String::new(), "B: bring back".to_owned()],
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
        assert_eq!(list(&kicked[..1]), "Kicked: mill-1");
        assert_eq!(list(&kicked), "Kicked: mill-1, mill-2, mill-3, mill-4 and 2 more");
    }

    #[test]
    fn an_empty_farm_shows_how_to_bring_its_workers_back() {
        let kicked = remedies(&[named("local-1")], true);
        assert_eq!(kicked, ["Kicked: local-1", "", "B: bring back"]);
        assert_eq!(remedies(&[], true), ["", "B: start this machine's workers again"]);
        assert!(remedies(&[], false).is_empty(), "no worker was kicked");
    }
}
