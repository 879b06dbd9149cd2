//! Who renders a segment the second time: drawn with the secret of the run, when its pixels are here.
//!
//! A worker that sends wrong pixels may have accomplices that confirm them. So the second rendering is another
//! machine's, where there is one; which one is drawn, and no worker can ask for it; and a share of the segments is
//! traced by the master, so that a farm of accomplices alone is found as well. Machines count once, however many workers
//! they run.

use std::collections::BTreeMap;

use super::audits::Stage;
use super::{FrameId, HostId, Scheduler, WorkerId};

/// The share of the second renderings that is the master's, in per cent.
const MASTER_PERCENT: u8 = 25;
/// Second renderings that wait for the master; of more, those with the lowest lots stay.
pub(super) const MAX_FOR_MASTER: usize = 8;
/// The weight of a host of average speed; slow and fast ones have a quarter and twice as much at the utmost, so that no
/// claim of speed attracts all second renderings.
const WEIGHT: f64 = 16.0;

/// Who renders a segment again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Second {
    /// A worker.
    Worker(WorkerId),
    /// The master itself.
    Master,
}

impl Scheduler {
    /// Draws who renders again what `first` has rendered on its host.
    pub(super) fn draw_second(&mut self, first: WorkerId, host: HostId, except: Option<WorkerId>) -> Second {
        let is_masters = self.audits.lots.hits(MASTER_PERCENT);
        if is_masters && self.audits.waiting_for_master() < MAX_FOR_MASTER {
            return Second::Master;
        }
        self.draw_worker(first, host, except).map_or(Second::Master, Second::Worker)
    }

    fn draw_worker(&mut self, first: WorkerId, host: HostId, except: Option<WorkerId>) -> Option<WorkerId> {
        let now = self.handled_at;
        let able = self
            .workers
            .iter()
            .filter(|(id, worker)| **id != first && Some(**id) != except && worker.is_ready(now));
        let mut hosts: BTreeMap<HostId, (Option<f64>, Vec<WorkerId>)> = BTreeMap::new();
        for (&id, worker) in able {
            let (speed, ids) = hosts.entry(worker.host).or_default();
            *speed = worker.speed.value().into_iter().chain(*speed).reduce(f64::max);
            ids.push(id);
        }
        // Accomplices of one machine would confirm each other.
        if hosts.keys().any(|known| *known != host) {
            hosts.remove(&host);
        }
        let speeds: Vec<f64> = hosts.values().filter_map(|(speed, _)| *speed).collect();
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let weight = |speed: f64| (WEIGHT * speed / mean).clamp(WEIGHT / 4.0, WEIGHT * 2.0);
        let weights: Vec<u64> =
            hosts.values().map(|(speed, _)| speed.map_or(WEIGHT, weight).max(1.0) as u64).collect();
        let drawn = self.audits.lots.pick(&weights)?;
        let (_, ids) = hosts.into_values().nth(drawn)?;
        let among = self.audits.lots.pick(&vec![1; ids.len()])?;
        ids.get(among).copied()
    }

    /// A worker renders nothing for now: what it was to render again is drawn anew.
    pub(super) fn draw_anew(&mut self, id: WorkerId) {
        let waits = |stage| stage == Stage::Waiting(Second::Worker(id));
        let keys: Vec<_> =
            self.audits.open.iter().filter(|(_, audit)| waits(audit.stage)).map(|(&key, _)| key).collect();
        keys.into_iter().for_each(|key| self.draw_anew_of(key, id));
    }

    /// A lease of a second rendering was taken from a worker: it is drawn anew.
    pub(super) fn reopen_audit(&mut self, id: WorkerId, key: (FrameId, u32)) {
        if self.audits.open.get(&key).is_some_and(|audit| audit.stage == Stage::Leased(id)) {
            self.draw_anew_of(key, id);
        }
    }

    fn draw_anew_of(&mut self, key: (FrameId, u32), except: WorkerId) {
        let Some((first, host)) = self.audits.open.get(&key).map(|audit| (audit.painter, audit.host)) else {
            return;
        };
        let second = self.draw_second(first, host, Some(except));
        if let Some(audit) = self.audits.open.get_mut(&key) {
            audit.stage = Stage::Waiting(second);
        }
    }
}
