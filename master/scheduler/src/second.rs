//! Draws the second renderer of a segment with the secret key of the run, when its pixels arrive.
//!
//! Colluding workers confirm each other's wrong pixels. So the second rendering goes to another host, where one is
//! ready; the host is drawn, and no worker can request it; and a share of the segments goes to the master, which detects
//! collusion of the whole farm. Each host counts once, however many workers it runs.

use std::collections::BTreeMap;

use super::verification::{MAX_FOR_MASTER, Renderer, SecondRenderer, Stage};
use super::{FrameId, HostId, Scheduler, WorkerId};

/// The master's share of the second renderings, in per cent.
const MASTER_PERCENT: u8 = 25;
/// Weight of a host of average speed. Weights range from a quarter to twice of it, so that a host with a false speed
/// cannot attract all second renderings.
const MEAN_WEIGHT: f64 = 16.0;

impl Scheduler {
    /// Draws the second renderer of a segment, other than `except`. `None`: there is none, and the segment is not verified.
    pub(super) fn draw_second_renderer(
        &mut self,
        first: Renderer,
        except: Option<WorkerId>,
    ) -> Option<SecondRenderer> {
        // Without a share to verify, the master has no arbiter.
        let has_arbiter = self.verifications.counts.percent > 0;
        let for_master = has_arbiter && self.verifications.rng.chance(MASTER_PERCENT);
        if for_master && self.verifications.waiting_for_master() < MAX_FOR_MASTER {
            return Some(SecondRenderer::Master);
        }
        let drawn = self.draw_worker(first, except).map(SecondRenderer::Worker);
        drawn.or_else(|| has_arbiter.then_some(SecondRenderer::Master))
    }

    fn draw_worker(&mut self, first: Renderer, except: Option<WorkerId>) -> Option<WorkerId> {
        let now = self.handled_at;
        // Untrusted workers do not confirm each other where a trusted one can render.
        let only_trusted = !first.trusted && self.standings.has_trusted();
        let able = self.workers.iter().filter(|(id, worker)| {
            **id != first.worker
                && Some(**id) != except
                && !self.standings.is_excluded(worker)
                && if only_trusted { worker.vouches(now) } else { worker.is_ready(now) }
        });
        let mut hosts: BTreeMap<HostId, (Option<f64>, Vec<WorkerId>)> = BTreeMap::new();
        for (&id, worker) in able {
            let (speed, ids) = hosts.entry(worker.host).or_default();
            *speed = worker.speed.value().into_iter().chain(*speed).reduce(f64::max);
            ids.push(id);
        }
        // Workers of one host may collude.
        if hosts.keys().any(|known| *known != first.host) {
            hosts.remove(&first.host);
        }
        let speeds: Vec<f64> = hosts.values().filter_map(|(speed, _)| *speed).collect();
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let weight = |speed: f64| (MEAN_WEIGHT * speed / mean).clamp(MEAN_WEIGHT / 4.0, MEAN_WEIGHT * 2.0);
        let weights: Vec<u64> =
            hosts.values().map(|(speed, _)| speed.map_or(MEAN_WEIGHT, weight).max(1.0) as u64).collect();
        let drawn = self.verifications.rng.pick_weighted(&weights)?;
        let (_, ids) = hosts.into_values().nth(drawn)?;
        let among = self.verifications.rng.pick_weighted(&vec![1; ids.len()])?;
        ids.get(among).copied()
    }

    /// Draws new second renderers for verifications that wait for a worker which gets no leases at present.
    pub(super) fn redraw_second_renderers(&mut self, id: WorkerId) {
        let waits = |stage| stage == Stage::Waiting(SecondRenderer::Worker(id));
        let waiting = self.verifications.pending.iter().filter(|(_, pending)| waits(pending.stage));
        let keys: Vec<_> = waiting.map(|(&key, _)| key).collect();
        keys.into_iter().for_each(|key| self.redraw_second_renderer(key, id));
    }

    /// Draws a new second renderer for a verification whose lease was revoked.
    pub(super) fn reopen_verification(&mut self, id: WorkerId, key: (FrameId, u32)) {
        let pending = self.verifications.pending.get(&key);
        if pending.is_some_and(|pending| pending.stage == Stage::Leased(id)) {
            self.redraw_second_renderer(key, id);
        }
    }

    fn redraw_second_renderer(&mut self, key: (FrameId, u32), except: WorkerId) {
        let Some(first) = self.verifications.pending.get(&key).map(|pending| pending.first) else { return };
        match (self.draw_second_renderer(first, Some(except)), self.verifications.pending.get_mut(&key)) {
            (Some(second), Some(pending)) => pending.stage = Stage::Waiting(second),
            _ => self.close_verification(key),
        }
    }
}
