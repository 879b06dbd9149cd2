use super::*;

fn other(host: u8) -> IpAddr {
    IpAddr::from([10, 0, 0, host])
}

fn is_closed(place: &Place) -> bool {
    place.closed.is_cancelled()
}

#[test]
fn a_silent_connection_gives_way_to_a_newer_one_of_its_host() {
    let admission = Admission::default();
    let first: Vec<Place> = (0..MAX_PENDING_OF_HOST).map(|_| admission.enter(other(1)).unwrap()).collect();
    first[0].has_sent();
    let newest = admission.enter(other(1)).unwrap();
    assert!(!is_closed(&first[0]) && is_closed(&first[1]) && !is_closed(&newest));
    assert_eq!(admission.pending(), MAX_PENDING_OF_HOST);
    drop((first, newest));
    assert_eq!(admission.pending(), 0);
}

#[test]
fn a_host_with_many_silent_connections_closes_none_of_another_host() {
    let admission = Admission::default();
    let honest = admission.enter(other(1)).unwrap();
    let flood: Vec<Place> = (0..1000).map(|_| admission.enter(other(2)).unwrap()).collect();
    assert!(!is_closed(&honest));
    assert_eq!(flood.iter().filter(|place| !is_closed(place)).count(), MAX_PENDING_OF_HOST);
}

#[test]
fn many_hosts_with_silent_connections_keep_no_newcomer_out() {
    let admission = Admission::default();
    let flood: Vec<Place> = (2..250).filter_map(|host| admission.enter(other(host))).collect();
    assert_eq!(flood.len(), 248);
    assert_eq!(admission.pending(), MAX_PENDING);
    let honest = admission.enter(other(1)).unwrap();
    honest.has_sent();
    let more: Vec<Place> = (2..250).filter_map(|host| admission.enter(other(host))).collect();
    assert_eq!(more.len(), 248);
    assert!(!is_closed(&honest), "a connection that has sent something stays for a second");
}

#[test]
fn connections_that_send_and_then_wait_give_way_after_a_second() {
    let admission = Admission::default();
    let start = Instant::now();
    let slow: Vec<Place> =
        (0..MAX_PENDING_OF_HOST).map(|_| admission.enter_at(other(1), start).unwrap()).collect();
    slow.iter().for_each(Place::has_sent);
    assert!(admission.enter_at(other(1), start + SLOW / 2).is_none());
    assert!(admission.enter_at(other(1), start + SLOW).is_some());
    assert!(is_closed(&slow[0]) && !is_closed(&slow[1]));
}

#[test]
fn this_machine_has_places_of_its_own() {
    let admission = Admission::default();
    let here = IpAddr::from([127, 0, 0, 1]);
    let flood: Vec<Place> = (0..200).filter_map(|host| admission.enter(other(host))).collect();
    let local: Vec<Place> = (0..MAX_PENDING_HERE).map(|_| admission.enter(here).unwrap()).collect();
    assert!(local.iter().all(|place| !is_closed(place)));
    assert!(flood.iter().filter(|place| !is_closed(place)).count() == MAX_PENDING);
}
