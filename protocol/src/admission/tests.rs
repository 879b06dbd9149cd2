use super::*;

const LIMITS: AdmissionLimits = AdmissionLimits { unknown: 64, known: 16, here: 32, of_host: 8 };
const MAX_PENDING: usize = LIMITS.unknown;
const MAX_PENDING_HERE: usize = LIMITS.here;
const MAX_PENDING_OF_HOST: usize = LIMITS.of_host;

fn other(host: u8) -> IpAddr {
    IpAddr::from([10, 0, 0, host])
}

fn is_closed(place: &Place) -> bool {
    place.closed.is_cancelled()
}

#[test]
fn a_silent_connection_gives_way_to_a_newer_one_of_its_host() {
    let admission = Admission::new(LIMITS);
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
    let admission = Admission::new(LIMITS);
    let honest = admission.enter(other(1)).unwrap();
    let flood: Vec<Place> = (0..1000).map(|_| admission.enter(other(2)).unwrap()).collect();
    assert!(!is_closed(&honest));
    assert_eq!(flood.iter().filter(|place| !is_closed(place)).count(), MAX_PENDING_OF_HOST);
}

#[test]
fn many_hosts_with_silent_connections_keep_no_newcomer_out() {
    let admission = Admission::new(LIMITS);
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
    let admission = Admission::new(LIMITS);
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
    let admission = Admission::new(LIMITS);
    let here = IpAddr::from([127, 0, 0, 1]);
    let flood: Vec<Place> = (0..200).filter_map(|host| admission.enter(other(host))).collect();
    let local: Vec<Place> = (0..MAX_PENDING_HERE).map(|_| admission.enter(here).unwrap()).collect();
    assert!(local.iter().all(|place| !is_closed(place)));
    assert!(flood.iter().filter(|place| !is_closed(place)).count() == MAX_PENDING);
}

#[test]
fn known_hosts_have_places_of_their_own() {
    let admission = Admission::new(LIMITS);
    let start = Instant::now();
    let slow: Vec<Place> =
        (2..250).filter_map(|host| admission.enter_at(other(host), start)).inspect(Place::has_sent).collect();
    assert_eq!(slow.len(), MAX_PENDING, "connections that send are not closed within a second");
    assert!(admission.enter_at(other(1), start).is_none());
    admission.add_known(other(1));
    let known: Vec<Place> = (0..8).filter_map(|_| admission.enter_at(other(1), start)).collect();
    assert_eq!(known.len(), 8);
    assert!(known.iter().all(|place| !is_closed(place)));
}

#[test]
fn refused_connections_are_counted() {
    let admission = Admission::new(LIMITS);
    let flood: Vec<Place> = (0..1000).filter_map(|_| admission.enter(other(2))).collect();
    assert_eq!((flood.len(), admission.refused()), (1000, 1000 - MAX_PENDING_OF_HOST as u64));
    flood.iter().for_each(Place::has_sent);
    assert!(admission.enter(other(2)).is_none());
    assert_eq!(admission.refused(), 1001 - MAX_PENDING_OF_HOST as u64);
}
