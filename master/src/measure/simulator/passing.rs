//! How long a large asset takes to all workers, chunk by chunk over links with bandwidth and latency: from the master
//! alone, or passed on from worker to worker as the real [`Chains`] say.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, PEER_PATIENCE};
use serde::Serialize;

use super::SECOND;
use super::dice::Dice;
use super::link::{Lane, bytes};
use crate::chains::{Chains, Source};
use crate::scheduler::WorkerId;

const ASSET: AssetId = AssetId([1; 32]);
/// Workers ask within this time of each other.
const SPREAD: u64 = SECOND / 20;
/// Steps at most: far more than 4096 workers with 2 GiB would need chunk by chunk would run for hours.
const MAX_STEPS: u64 = 500_000_000;

/// What is simulated.
#[derive(Clone, Debug)]
pub struct PassingSetup {
    /// Workers that want the asset at about the same time.
    pub workers: u32,
    /// Its bytes.
    pub asset_bytes: u64,
    /// Whether they pass it on.
    pub pass_on: bool,
    /// Bits a second of every link, in each direction.
    pub link_bits: f64,
    /// Round trip, in nanoseconds.
    pub round_trip: u64,
    /// Workers that die meanwhile.
    pub deaths: u32,
    /// Workers that stand still meanwhile, without closing a connection.
    pub hangs: u32,
    /// What everything random follows from.
    pub seed: u64,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Passed {
    /// Until the last of those who live has it.
    pub seconds: f64,
    /// Bytes that the master has sent, over the asset's.
    pub master_copies: f64,
    /// Workers that have it.
    pub workers: u32,
}

/// One that receives.
#[derive(Clone, Debug)]
struct Node {
    source: Source,
    /// Chunks that are here.
    chunks: u64,
    /// Chunks that were sent to it by its present source, or are being sent.
    sent: u64,
    /// Whether one of these is in the source's lane: the next one waits for it.
    sending: bool,
    /// Whether its present source has begun: a question and an answer come first.
    begun: bool,
    /// Counts its sources: what was sent by earlier ones comes to nothing.
    turn: u32,
    alive: bool,
    hanging: bool,
    up: Lane,
    down: Lane,
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Asks(WorkerId),
    /// A chunk has left its source.
    Left(WorkerId, u32),
    /// A chunk is here.
    Arrives(WorkerId, u32),
    /// A worker notices that nothing comes from its source any more.
    Gives(WorkerId, u32),
    Dies(WorkerId),
    Hangs(WorkerId),
}

#[derive(Debug)]
struct Net {
    setup: PassingSetup,
    now: u64,
    agenda: BTreeMap<(u64, u64), Step>,
    planned: u64,
    chains: Chains,
    nodes: BTreeMap<WorkerId, Node>,
    master_up: Lane,
    master_chunks: u64,
    chunks: u64,
}

/// Simulates until every worker that lives has the asset.
pub fn pass(setup: &PassingSetup) -> Passed {
    let mut net = Net::new(setup.clone());
    for _ in 0..MAX_STEPS {
        let Some(((at, _), step)) = net.agenda.pop_first() else { break };
        net.now = at;
        net.step(step);
        if net.is_over() {
            break;
        }
    }
    net.passed()
}

impl Net {
    fn new(setup: PassingSetup) -> Self {
        let chunks = setup.asset_bytes.div_ceil(MAX_CHUNK_BYTES as u64).max(1);
        let mut net = Self {
            now: 0,
            agenda: BTreeMap::new(),
            planned: 0,
            chains: Chains::default(),
            nodes: BTreeMap::new(),
            master_up: Lane::default(),
            master_chunks: 0,
            chunks,
            setup,
        };
        net.plan_all();
        net
    }

    fn plan_all(&mut self) {
        let mut dice = Dice::new(self.setup.seed);
        let ids: Vec<WorkerId> = (1..=u64::from(self.setup.workers)).map(WorkerId).collect();
        for &id in &ids {
            if self.setup.pass_on {
                self.chains.shares(id);
            }
            self.plan(dice.roll(SPREAD), Step::Asks(id));
        }
        // While a worker could have the whole asset from a link of its own.
        let whole = (self.setup.asset_bytes as f64 / self.bytes_per_second() * SECOND as f64) as u64;
        let mut victims = ids;
        dice.shuffle(&mut victims);
        let (deaths, hangs) = (self.setup.deaths as usize, self.setup.hangs as usize);
        for (index, id) in victims.into_iter().take(deaths + hangs).enumerate() {
            let step = if index < deaths { Step::Dies(id) } else { Step::Hangs(id) };
            self.plan(SPREAD + dice.roll(whole), step);
        }
    }

    fn plan(&mut self, at: u64, step: Step) {
        self.planned += 1;
        self.agenda.insert((at.max(self.now), self.planned), step);
    }

    fn bytes_per_second(&self) -> f64 {
        self.setup.link_bits / 8.0 * bytes::PAYLOAD_SHARE
    }

    fn step(&mut self, step: Step) {
        match step {
            Step::Asks(id) => self.ask(id, false),
            Step::Left(id, turn) => {
                if let Some(node) = self.nodes.get_mut(&id).filter(|node| node.turn == turn) {
                    node.sending = false;
                    self.feed(id);
                }
            }
            Step::Arrives(id, turn) => self.arrive(id, turn),
            Step::Gives(id, turn) => {
                let waits = self.nodes.get(&id).is_some_and(|n| n.alive && !n.hanging && n.turn == turn);
                if waits {
                    self.ask(id, true);
                }
            }
            Step::Dies(id) => self.fall(id, false),
            Step::Hangs(id) => self.fall(id, true),
        }
    }

    /// A worker asks the master, and begins to receive from wherever it is told to.
    fn ask(&mut self, id: WorkerId, again: bool) {
        let now = Duration::from_nanos(self.now);
        let source = self.chains.wanted(now, id, ASSET, again, |_| true);
        let old = self.nodes.remove(&id);
        let (up, down, chunks, turn) = old.map_or((Lane::default(), Lane::default(), 0, 0), |node| {
            (node.up, node.down, node.chunks, node.turn + 1)
        });
        let node = Node {
            source,
            chunks,
            sent: chunks,
            sending: false,
            begun: false,
            turn,
            alive: true,
            hanging: false,
            up,
            down,
        };
        self.nodes.insert(id, node);
        self.feed(id);
    }

    /// Puts the next chunk for a worker into its source's lane, if the source has it and none is in there.
    fn feed(&mut self, id: WorkerId) {
        let rate = self.bytes_per_second();
        let Some(&Node { source, sent, sending, begun, turn, alive, .. }) = self.nodes.get(&id) else {
            return;
        };
        let (has, begins) = match source {
            Source::Master => (self.chunks, self.setup.round_trip),
            // A connection and a question more.
            Source::Worker(of) => {
                let there = self.nodes.get(&of).filter(|node| node.alive && !node.hanging);
                (there.map_or(0, |node| node.chunks), 2 * self.setup.round_trip)
            }
        };
        if sending || !alive || sent >= has {
            return;
        }
        let begin = self.now + if begun { 0 } else { begins };
        let lane = match source {
            Source::Master => {
                self.master_chunks += 1;
                Some(&mut self.master_up)
            }
            Source::Worker(of) => self.nodes.get_mut(&of).map(|node| &mut node.up),
        };
        let Some(left) = lane.map(|lane| lane.pass(begin, MAX_CHUNK_BYTES as f64, rate)) else { return };
        let chunk_ns = (MAX_CHUNK_BYTES as f64 / rate * SECOND as f64) as u64;
        let Some(node) = self.nodes.get_mut(&id) else { return };
        (node.sent, node.sending, node.begun) = (sent + 1, true, true);
        // Its first byte comes a latency after it has left; both links then carry it at once.
        let reaches = left.saturating_sub(chunk_ns) + self.setup.round_trip / 2;
        let arrives = node.down.pass(reaches, MAX_CHUNK_BYTES as f64, rate);
        self.plan(left, Step::Left(id, turn));
        self.plan(arrives, Step::Arrives(id, turn));
    }

    fn arrive(&mut self, id: WorkerId, turn: u32) {
        let node = self.nodes.get_mut(&id).filter(|node| node.turn == turn && node.alive && !node.hanging);
        let Some(node) = node else { return };
        node.chunks += 1;
        if node.chunks == self.chunks {
            self.chains.complete(Duration::from_nanos(self.now), id, ASSET);
        }
        for follower in self.followers(id) {
            self.feed(follower);
        }
    }

    fn followers(&self, of: WorkerId) -> Vec<WorkerId> {
        let follow = self.nodes.iter().filter(|(_, node)| node.source == Source::Worker(of));
        follow.map(|(&id, _)| id).collect()
    }

    /// A worker is gone, or stands still. Those who are told of the end of a connection notice at once, the others when they
    /// have waited for long enough.
    fn fall(&mut self, id: WorkerId, hangs: bool) {
        let Some(node) = self.nodes.get_mut(&id) else { return };
        (node.alive, node.hanging) = (hangs, hangs);
        if !hangs {
            self.chains.left(id);
        }
        let after = if hangs { PEER_PATIENCE.as_nanos() as u64 } else { self.setup.round_trip / 2 };
        for follower in self.followers(id) {
            let Some(node) = self.nodes.get(&follower).filter(|node| node.chunks < self.chunks) else {
                continue;
            };
            let turn = node.turn;
            self.plan(self.now + after, Step::Gives(follower, turn));
        }
    }

    fn is_over(&self) -> bool {
        let asks = self.agenda.values().any(|step| matches!(step, Step::Asks(_)));
        !asks && self.living().all(|node| node.chunks == self.chunks)
    }

    fn living(&self) -> impl Iterator<Item = &Node> {
        self.nodes.values().filter(|node| node.alive && !node.hanging)
    }

    fn passed(&self) -> Passed {
        let whole = self.living().filter(|node| node.chunks == self.chunks).count();
        Passed {
            seconds: self.now as f64 / SECOND as f64,
            master_copies: self.master_chunks as f64 / self.chunks as f64,
            workers: u32::try_from(whole).unwrap_or(u32::MAX),
        }
    }
}

#[cfg(test)]
mod tests;
