//! Distribution of a large asset to all workers, chunk by chunk over links with bandwidth and latency: from the
//! master alone, or by chain replication between workers, as the real [`AssetRouting`] decides.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfarm_farm::{AssetRouting, AssetSource};
use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, PEER_TIMEOUT};
use rayfarm_scheduler::WorkerId;
use serde::Serialize;

use super::clock::SECOND;
use super::link::{Lane, bytes};
use super::rng::Rng;

const ASSET: AssetId = AssetId([1; 32]);
/// All workers request the asset within this time, in nanoseconds.
const SPREAD: u64 = SECOND / 20;
/// Events at most: chunk by chunk, far more than 4096 workers with 2 GiB would run for hours.
const MAX_STEPS: u64 = 500_000_000;

/// Simulated distribution: workers, links and one asset.
#[derive(Clone, Debug)]
pub struct DistributionSetup {
    /// Workers that request the asset.
    pub workers: u32,
    /// Size of the asset.
    pub asset_bytes: u64,
    /// Whether workers serve the asset to other workers.
    pub relay: bool,
    /// Bits per second of every link, in each direction.
    pub link_bits: f64,
    /// Round trip time in nanoseconds.
    pub round_trip: u64,
    /// Workers that exit meanwhile.
    pub exits: u32,
    /// Workers that hang meanwhile, with their connections open.
    pub hangs: u32,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Result of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distribution {
    /// Time until the last live worker has the asset, in seconds.
    pub seconds: f64,
    /// Bytes that the master sent, in sizes of the asset.
    pub master_copies: f64,
    /// Live workers with the whole asset.
    pub workers: u32,
}

/// State of a receiving worker.
#[derive(Clone, Debug)]
struct Node {
    source: AssetSource,
    /// Chunks that it has.
    chunks: u64,
    /// Chunks that its present source has sent or is sending.
    sent: u64,
    /// Whether a chunk is in the source's lane: the next one waits for it.
    sending: bool,
    /// Whether its present source has sent anything: a request and a reply come first.
    begun: bool,
    /// Number of its present source: chunks of earlier sources are void.
    generation: u32,
    alive: bool,
    hanging: bool,
    up: Lane,
    down: Lane,
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Request(WorkerId),
    /// A chunk has left its source.
    ChunkSent(WorkerId, u32),
    /// A chunk has arrived.
    ChunkReceived(WorkerId, u32),
    /// A worker's source has sent nothing for too long.
    SourceTimeout(WorkerId, u32),
    Exit(WorkerId),
    Hang(WorkerId),
}

#[derive(Debug)]
struct Net {
    setup: DistributionSetup,
    now: u64,
    queue: BTreeMap<(u64, u64), Event>,
    scheduled: u64,
    routing: AssetRouting,
    nodes: BTreeMap<WorkerId, Node>,
    master_up: Lane,
    master_chunks: u64,
    chunks: u64,
}

/// Simulates until every live worker has the asset.
pub fn distribute(setup: &DistributionSetup) -> Distribution {
    let mut net = Net::new(setup.clone());
    for _ in 0..MAX_STEPS {
        let Some(((at, _), event)) = net.queue.pop_first() else { break };
        net.now = at;
        net.dispatch(event);
        if net.is_over() {
            break;
        }
    }
    net.result()
}

impl Net {
    fn new(setup: DistributionSetup) -> Self {
        let chunks = setup.asset_bytes.div_ceil(MAX_CHUNK_BYTES as u64).max(1);
        let mut net = Self {
            now: 0,
            queue: BTreeMap::new(),
            scheduled: 0,
            routing: AssetRouting::default(),
            nodes: BTreeMap::new(),
            master_up: Lane::default(),
            master_chunks: 0,
            chunks,
            setup,
        };
        net.schedule_all();
        net
    }

    fn schedule_all(&mut self) {
        let mut rng = Rng::new(self.setup.seed);
        let ids: Vec<WorkerId> = (1..=u64::from(self.setup.workers)).map(WorkerId).collect();
        for &id in &ids {
            if self.setup.relay {
                self.routing.add_peer_server(id);
            }
            self.schedule(rng.below(SPREAD), Event::Request(id));
        }
        // Faults come while a worker could fetch the whole asset over a link of its own.
        let whole = (self.setup.asset_bytes as f64 / self.bytes_per_second() * SECOND as f64) as u64;
        let mut victims = ids;
        rng.shuffle(&mut victims);
        let (exits, hangs) = (self.setup.exits as usize, self.setup.hangs as usize);
        for (index, id) in victims.into_iter().take(exits + hangs).enumerate() {
            let event = if index < exits { Event::Exit(id) } else { Event::Hang(id) };
            self.schedule(SPREAD + rng.below(whole), event);
        }
    }

    fn schedule(&mut self, at: u64, event: Event) {
        self.scheduled += 1;
        self.queue.insert((at.max(self.now), self.scheduled), event);
    }

    fn bytes_per_second(&self) -> f64 {
        self.setup.link_bits / 8.0 * bytes::PAYLOAD_SHARE
    }

    fn dispatch(&mut self, event: Event) {
        match event {
            Event::Request(id) => self.request(id, false),
            Event::ChunkSent(id, generation) => {
                if let Some(node) = self.nodes.get_mut(&id).filter(|node| node.generation == generation) {
                    node.sending = false;
                    self.send_next_chunk(id);
                }
            }
            Event::ChunkReceived(id, generation) => self.receive(id, generation),
            Event::SourceTimeout(id, generation) => {
                let waits =
                    self.nodes.get(&id).is_some_and(|n| n.alive && !n.hanging && n.generation == generation);
                if waits {
                    self.request(id, true);
                }
            }
            Event::Exit(id) => self.fail(id, false),
            Event::Hang(id) => self.fail(id, true),
        }
    }

    /// A worker requests the asset from the master and begins to receive from the source that the master names.
    fn request(&mut self, id: WorkerId, again: bool) {
        let now = Duration::from_nanos(self.now);
        let source = self.routing.route(now, id, ASSET, again, |_| true);
        let old = self.nodes.remove(&id);
        let (up, down, chunks, generation) = old.map_or((Lane::default(), Lane::default(), 0, 0), |node| {
            (node.up, node.down, node.chunks, node.generation + 1)
        });
        let node = Node {
            source,
            chunks,
            sent: chunks,
            sending: false,
            begun: false,
            generation,
            alive: true,
            hanging: false,
            up,
            down,
        };
        self.nodes.insert(id, node);
        self.send_next_chunk(id);
    }

    /// Puts the next chunk for a worker into its source's lane, if the source has it and the lane has none for that
    /// worker.
    fn send_next_chunk(&mut self, id: WorkerId) {
        let rate = self.bytes_per_second();
        let Some(&Node { source, sent, sending, begun, generation, alive, .. }) = self.nodes.get(&id) else {
            return;
        };
        let (has, begins) = match source {
            AssetSource::Master => (self.chunks, self.setup.round_trip),
            // One connection and one request more.
            AssetSource::Worker(of) => {
                let source_node = self.nodes.get(&of).filter(|node| node.alive && !node.hanging);
                (source_node.map_or(0, |node| node.chunks), 2 * self.setup.round_trip)
            }
        };
        if sending || !alive || sent >= has {
            return;
        }
        let begin = self.now + if begun { 0 } else { begins };
        let lane = match source {
            AssetSource::Master => {
                self.master_chunks += 1;
                Some(&mut self.master_up)
            }
            AssetSource::Worker(of) => self.nodes.get_mut(&of).map(|node| &mut node.up),
        };
        let Some(left) = lane.map(|lane| lane.pass(begin, MAX_CHUNK_BYTES as f64, rate)) else { return };
        let chunk_ns = (MAX_CHUNK_BYTES as f64 / rate * SECOND as f64) as u64;
        let Some(node) = self.nodes.get_mut(&id) else { return };
        (node.sent, node.sending, node.begun) = (sent + 1, true, true);
        // The first byte arrives a latency after it has left; both links then carry the chunk at once.
        let reaches = left.saturating_sub(chunk_ns) + self.setup.round_trip / 2;
        let arrives = node.down.pass(reaches, MAX_CHUNK_BYTES as f64, rate);
        self.schedule(left, Event::ChunkSent(id, generation));
        self.schedule(arrives, Event::ChunkReceived(id, generation));
    }

    fn receive(&mut self, id: WorkerId, generation: u32) {
        let node = self
            .nodes
            .get_mut(&id)
            .filter(|node| node.generation == generation && node.alive && !node.hanging);
        let Some(node) = node else { return };
        node.chunks += 1;
        if node.chunks == self.chunks {
            self.routing.complete(Duration::from_nanos(self.now), id, ASSET);
        }
        for receiver in self.receivers_of(id) {
            self.send_next_chunk(receiver);
        }
    }

    fn receivers_of(&self, of: WorkerId) -> Vec<WorkerId> {
        let receivers = self.nodes.iter().filter(|(_, node)| node.source == AssetSource::Worker(of));
        receivers.map(|(&id, _)| id).collect()
    }

    /// A worker exits or hangs. Its receivers notice a closed connection at once, and a hang after a timeout.
    fn fail(&mut self, id: WorkerId, hangs: bool) {
        let Some(node) = self.nodes.get_mut(&id) else { return };
        (node.alive, node.hanging) = (hangs, hangs);
        if !hangs {
            self.routing.remove_worker(id);
        }
        let after = if hangs { PEER_TIMEOUT.as_nanos() as u64 } else { self.setup.round_trip / 2 };
        for receiver in self.receivers_of(id) {
            let Some(node) = self.nodes.get(&receiver).filter(|node| node.chunks < self.chunks) else {
                continue;
            };
            let generation = node.generation;
            self.schedule(self.now + after, Event::SourceTimeout(receiver, generation));
        }
    }

    fn is_over(&self) -> bool {
        let requests = self.queue.values().any(|event| matches!(event, Event::Request(_)));
        !requests && self.live_nodes().all(|node| node.chunks == self.chunks)
    }

    fn live_nodes(&self) -> impl Iterator<Item = &Node> {
        self.nodes.values().filter(|node| node.alive && !node.hanging)
    }

    fn result(&self) -> Distribution {
        let whole = self.live_nodes().filter(|node| node.chunks == self.chunks).count();
        Distribution {
            seconds: self.now as f64 / SECOND as f64,
            master_copies: self.master_chunks as f64 / self.chunks as f64,
            workers: u32::try_from(whole).unwrap_or(u32::MAX),
        }
    }
}

#[cfg(test)]
mod tests;
