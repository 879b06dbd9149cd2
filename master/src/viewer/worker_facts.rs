//! Facts of workers as JSON, for control commands and pages.

use rayfarm_farm::{BannedWorker, WorkerStatus};
use serde_json::{Value, json};

/// A connected worker.
pub(crate) fn worker_facts(worker: &WorkerStatus) -> Value {
    json!({
        "id": worker.id,
        "name": worker.name,
        "local": worker.local,
        "address": worker.address.to_string(),
        "threads": worker.threads,
        "state": worker.state.to_string(),
        "segments_done": worker.segments_done,
        "rows_per_second": (worker.speed * 10.0).round() / 10.0,
        "trouble": worker.last_failure,
    })
}

/// A banned worker.
pub(crate) fn banned_facts(worker: &BannedWorker) -> Value {
    json!({ "id": worker.id, "name": worker.name, "address": worker.address.map(|address| address.to_string()) })
}
