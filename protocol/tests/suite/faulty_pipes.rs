//! Sessions over pipes that split the bytes into pieces, delay them, and close at any point. The receiver gets a prefix of
//! what was sent, in order, and every session ends.
//!
//! Time is virtual, and a seed determines everything. This replays one seed:
//!
//! ```text
//! RAYFARM_SEED=N cargo test -p rayfarm-protocol --test suite faulty_pipes
//! ```

use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::message::Message;
use rayfarm_protocol::session::{Receiver, Sender, spawn};
use rayfarm_protocol::{AssetId, FrameId, Reconnect, ToMaster, ToWorker};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex, split};
use tokio::time::{sleep, timeout};

use crate::common::{lease, pixels};

/// Number of seeds per run.
const SEEDS: u64 = 300;

/// Time limit of a test in virtual time: more than all deadlines of a session together.
const TEST_LIMIT: Duration = Duration::from_secs(3600);

/// The generator SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone)]
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound.max(1)
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

/// Faults of one direction of a pipe.
#[derive(Clone)]
struct Faults {
    random: Random,
    /// Number of bytes after which the pipe closes.
    closes_after: u64,
    /// Longest delay of a piece, in milliseconds.
    delay_ms: u64,
    /// Longest piece, in bytes.
    piece_bytes: u64,
}

impl Faults {
    fn new(random: &mut Random, capacity: u64, closes: bool) -> Self {
        let closes_after = if closes { random.below(60_000) } else { u64::MAX };
        let widest = [3, 40, 5000, 100_000][random.below(4) as usize];
        let piece_bytes = (1 + random.below(widest)).min(capacity);
        // Delays of many small pieces add up to more than the deadline of a message, which closes the pipe.
        let is_slow = random.one_in(2) && (closes || piece_bytes > 1000);
        let delay_ms = if is_slow { random.below(300) } else { 0 };
        Self { random: Random(random.next()), closes_after, delay_ms, piece_bytes }
    }

    /// Forwards bytes until one end closes, or until `closes_after` bytes have passed.
    async fn forward(mut self, mut from: ReadHalf<DuplexStream>, mut to: WriteHalf<DuplexStream>) {
        let mut buffer = vec![0; self.piece_bytes as usize];
        while self.closes_after > 0 {
            let most = (1 + self.random.below(self.piece_bytes)).min(self.closes_after) as usize;
            let Ok(read @ 1..) = from.read(&mut buffer[..most]).await else { break };
            if self.delay_ms > 0 && self.random.one_in(4) {
                sleep(Duration::from_millis(self.random.below(self.delay_ms))).await;
            }
            if to.write_all(&buffer[..read]).await.is_err() {
                break;
            }
            self.closes_after -= read as u64;
        }
        let _ = to.shutdown().await;
    }
}

/// Makes the two ends of a connection whose two directions have faults.
fn connect(random: &mut Random, closes: bool) -> (DuplexStream, DuplexStream) {
    let capacity = 1 + random.below(3000);
    let (ours, near) = duplex(capacity as usize);
    let (far, theirs) = duplex(capacity as usize);
    let ((near_read, near_write), (far_read, far_write)) = (split(near), split(far));
    let (there, back) = (Faults::new(random, capacity, closes), Faults::new(random, capacity, closes));
    tokio::spawn(async move {
        let (there, back) = (there.forward(near_read, far_write), back.forward(far_read, near_write));
        if closes {
            // The end of one direction closes both.
            tokio::select! { () = there => {}, () = back => {} }
        } else {
            tokio::join!(there, back);
        }
    });
    (ours, theirs)
}

fn to_worker(random: &mut Random, n: u64) -> ToWorker {
    match random.below(4) {
        0 => ToWorker::Ping { nonce: n },
        1 => ToWorker::Segment(lease(n as u32)),
        2 => ToWorker::Cancel { before: FrameId(n) },
        _ => {
            let bytes = Bytes::from(vec![n as u8; 1 + random.below(9000) as usize]);
            ToWorker::AssetChunk { id: AssetId([1; 32]), offset: n, bytes }
        }
    }
}

fn to_master(random: &mut Random, n: u64) -> ToMaster {
    match random.below(3) {
        0 => ToMaster::Pong { nonce: n, progressed: false },
        1 => ToMaster::NeedAsset {
            id: AssetId([n as u8; 32]),
            offset: u64::from(n as u8),
            again: n.is_multiple_of(2),
        },
        _ => pixels(n as u32, random.below(9000) as usize),
    }
}

async fn send_all<M: Message + Clone>(sender: &Sender<M>, messages: &[M], disconnect: Option<M>) {
    for message in messages.iter().cloned().chain(disconnect) {
        if sender.send(message).await.is_err() {
            return;
        }
    }
}

/// Receives up to `most` messages.
async fn receive_all<M: Message>(receiver: &mut Receiver<M>, most: usize) -> Vec<M> {
    let mut received = Vec::new();
    while received.len() < most {
        match receiver.recv().await {
            None => break,
            Some(Ok(message)) => received.push(message),
            Some(Err(_)) => {
                assert!(receiver.recv().await.is_none(), "a message follows an error");
                break;
            }
        }
    }
    received
}

/// Checks that each of the two queues delivers a prefix of its sent messages, in order.
fn check_order<M: Message + PartialEq + std::fmt::Debug>(
    sent: &[M],
    received: &[M],
    is_bulk: impl Fn(&M) -> bool,
) {
    for bulk in [false, true] {
        let of_queue = |messages: &[M]| -> Vec<usize> {
            let messages = messages.iter().filter(|message| is_bulk(message) == bulk);
            messages
                .map(|message| sent.iter().position(|known| known == message).unwrap_or(usize::MAX))
                .collect()
        };
        let (all, arrived) = (of_queue(sent), of_queue(received));
        assert!(all.starts_with(&arrived), "of {all:?} arrived {arrived:?}");
    }
}

async fn run_seed(seed: u64) {
    let mut random = Random(seed);
    let closes = !random.one_in(4);
    let (ours, theirs) = connect(&mut random, closes);
    let (master_out, mut master_in, _) = spawn::<_, ToWorker, ToMaster>(ours);
    let (worker_out, mut worker_in, _) = spawn::<_, ToMaster, ToWorker>(theirs);
    let count = 1 + random.below(30);
    let down: Vec<_> = (0..count).map(|n| to_worker(&mut random, n)).collect();
    let up: Vec<_> = (0..count).map(|n| to_master(&mut random, n)).collect();
    let last_down = ToWorker::Disconnect { reason: "end".into(), reconnect: Reconnect::Never };
    let last_up = ToMaster::Disconnect { reason: "end as well".into() };

    // A session reads for a short time only after its disconnect. On a pipe that does not close, all messages must
    // arrive, so the disconnects are sent after them.
    let (early_down, early_up) = (closes.then(|| last_down.clone()), closes.then(|| last_up.clone()));
    let most = if closes { usize::MAX } else { count as usize };
    let exchange = async {
        let exchanged = tokio::join!(
            send_all(&master_out, &down, early_down),
            send_all(&worker_out, &up, early_up),
            receive_all(&mut worker_in, most),
            receive_all(&mut master_in, most),
        );
        let (late_down, late_up) = (Some(last_down.clone()), Some(last_up.clone()));
        tokio::join!(send_all(&master_out, &[], late_down), send_all(&worker_out, &[], late_up));
        tokio::join!(receive_all(&mut worker_in, usize::MAX), receive_all(&mut master_in, usize::MAX));
        exchanged
    };
    let exchanged = timeout(TEST_LIMIT, exchange).await;
    let ((), (), mut received_down, mut received_up) =
        exchanged.unwrap_or_else(|_| panic!("the sessions did not end"));
    received_down.pop_if(|message| *message == last_down);
    received_up.pop_if(|message| *message == last_up);
    check_order(&down, &received_down, |message| matches!(message, ToWorker::AssetChunk { .. }));
    check_order(&up, &received_up, |message| matches!(message, ToMaster::Pixels { .. }));
    let all_arrived = (received_down.len(), received_up.len()) == (down.len(), up.len());
    assert!(closes || all_arrived, "messages were lost");
    timeout(TEST_LIMIT, async { tokio::join!(master_out.closed(), worker_out.closed()) }).await.unwrap();
}

#[test]
fn sessions_survive_faults_or_end() {
    let seeds = match std::env::var("RAYFARM_SEED") {
        Ok(seed) => vec![seed.parse().unwrap()],
        Err(_) => (0..SEEDS).collect(),
    };
    for seed in seeds {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
        let run = std::panic::AssertUnwindSafe(|| runtime.unwrap().block_on(run_seed(seed)));
        assert!(std::panic::catch_unwind(run).is_ok(), "RAYFARM_SEED={seed} replays it");
    }
}
