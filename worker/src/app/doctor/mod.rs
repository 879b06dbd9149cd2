//! Checks whether this machine can join a farm, one after another, with advice where one fails.

mod advice;
mod link;
mod report;

use std::time::{Duration, Instant};

use rayfarm_protocol::{Hello, address, handshake};
use tokio::net::TcpStream;

pub(super) use self::report::Report;
use super::target::Target;
use crate::renderer::Renderer;
use crate::tracer::TracerRenderer;

/// Time limit of each connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Number of connections whose times are measured.
const CONNECTIONS: usize = 5;

/// Checks every master of the list, and the machine itself.
pub(super) async fn check(targets: Vec<Target>, report: &mut Report) {
    for target in &targets {
        check_master(target, report).await;
    }
    check_machine(report);
}

/// Checks name, port, version, key, token and round trip. Later checks are skipped after a failure.
async fn check_master(target: &Target, report: &mut Report) {
    let master = rayfarm_text::printable(&target.master);
    let addresses = match address::resolve(&target.master).await {
        Ok(addresses) => addresses,
        Err(error) => {
            let advice = "check the spelling, or use the numeric address of the master";
            return report.failed("name", &format!("{master}: {error}"), advice);
        }
    };
    let shown: Vec<String> = addresses.iter().map(ToString::to_string).collect();
    report.ok("name", &format!("{master} is {}", shown.join(", ")));

    let mut times = Vec::new();
    let mut stream = None;
    for _ in 0..CONNECTIONS {
        let begun = Instant::now();
        match tokio::time::timeout(CONNECT_TIMEOUT, TcpStream::connect(addresses.as_slice())).await {
            Ok(Ok(connected)) => {
                times.push(begun.elapsed());
                // The last connection is used; the others are closed before they count as workers.
                stream = Some(connected);
            }
            Ok(Err(error)) => {
                return report.failed("port", &error.to_string(), advice::of_connect(error.kind()));
            }
            Err(_) => {
                let why = format!("no answer within {} s", CONNECT_TIMEOUT.as_secs());
                return report.failed("port", &why, advice::of_connect(std::io::ErrorKind::TimedOut));
            }
        }
    }
    let Some(stream) = stream else { return };
    let round_trip = report::median(&mut times);
    report.ok("port", "it accepts connections");
    report.ok("round trip", &format!("{} (median of {CONNECTIONS} connections)", report::millis(round_trip)));
    check_session(target, stream, report).await;
}

/// Performs a handshake, and leaves the farm before a segment is leased.
async fn check_session(target: &Target, stream: TcpStream, report: &mut Report) {
    let hello = Hello {
        name: "doctor".to_owned(),
        threads: 1,
        simd: TracerRenderer.simd(),
        software: env!("CARGO_PKG_VERSION").to_owned(),
        tags: Vec::new(),
    };
    let begun = Instant::now();
    match handshake::as_worker(stream, &target.security, &hello).await {
        Ok((connection, _welcome)) => {
            let time = report::millis(begun.elapsed());
            report.ok("version", "both ends have the same version of the protocol");
            match target.security.key_hash() {
                Some(_) => report.ok("key and token", &format!("proved by both ends in {time}")),
                None => report.ok("key and token", &format!("none: not encrypted; handshake in {time}")),
            }
            link::leave(connection, report).await;
        }
        Err(error) => {
            let (check, advice) = advice::of_handshake(&error);
            report.failed(check, &error.to_string(), advice);
        }
    }
}

/// Reports the threads and the SIMD level of this machine, which cannot fail.
fn check_machine(report: &mut Report) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    report.ok("machine", &format!("{threads} threads, SIMD level {}", TracerRenderer.simd()));
    report.note("clock", "not compared: nothing depends on it");
    report.note("throughput", "not measured: the protocol has no message for it");
}
