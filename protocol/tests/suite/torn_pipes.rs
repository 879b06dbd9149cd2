//! Real sessions over pipes that tear messages into pieces, hold them back and close anywhere. What comes out is what
//! went in, in its order, up to some point; and every session ends.
//!
//! Time is virtual, and everything follows from a seed: `RAYFARM_SEED=N cargo test -p rayfarm-protocol --test suite torn_pipes`
//! plays one again.

use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::message::Message;
use rayfarm_protocol::session::{Receiver, Sender, spawn};
use rayfarm_protocol::{AssetId, FrameId, Reconnect, ToMaster, ToWorker};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf, duplex, split};
use tokio::time::{sleep, timeout};

use crate::common::{lease, pixels};

const SEEDS: u64 = 300;

/// Longer than every deadline of a session together, in virtual time.
const FOR_EVER: Duration = Duration::from_secs(3600);

/// SplitMix64 (Steele, Lea, Flood 2014).
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

/// What a pipe does to the bytes of one direction.
#[derive(Clone)]
struct Weather {
    random: Random,
    /// It closes after so many bytes.
    closes_after: u64,
    /// The longest time that a piece is held back.
    delay_ms: u64,
    /// The longest piece.
    piece: u64,
}

impl Weather {
    fn new(random: &mut Random, width: u64, closes: bool) -> Self {
        let closes_after = if closes { random.below(60_000) } else { u64::MAX };
        let widest = [3, 40, 5000, 100_000][random.below(4) as usize];
        let piece = (1 + random.below(widest)).min(width);
        // Small pieces that are all held back take longer than a message may: that is a way to close.
        let is_slow = random.one_in(2) && (closes || piece > 1000);
        let delay_ms = if is_slow { random.below(300) } else { 0 };
        Self { random: Random(random.next()), closes_after, delay_ms, piece }
    }

    /// Carries bytes until one end closes, or its own end has come.
    async fn carry(mut self, mut from: ReadHalf<DuplexStream>, mut to: WriteHalf<DuplexStream>) {
        let mut buffer = vec![0; self.piece as usize];
        while self.closes_after > 0 {
            let most = (1 + self.random.below(self.piece)).min(self.closes_after) as usize;
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

/// Two ends of a connection through the weather.
fn connect(random: &mut Random, closes: bool) -> (DuplexStream, DuplexStream) {
    let width = 1 + random.below(3000);
    let (ours, near) = duplex(width as usize);
    let (far, theirs) = duplex(width as usize);
    let ((near_read, near_write), (far_read, far_write)) = (split(near), split(far));
    // A connection that closes does so in both directions.
    let (there, back) = (Weather::new(random, width, closes), Weather::new(random, width, closes));
    tokio::spawn(async move {
        let (there, back) = (there.carry(near_read, far_write), back.carry(far_read, near_write));
        if closes {
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
        0 => ToMaster::Pong { nonce: n },
        1 => ToMaster::NeedAsset {
            id: AssetId([n as u8; 32]),
            offset: u64::from(n as u8),
            again: n.is_multiple_of(2),
        },
        _ => pixels(n as u32, random.below(9000) as usize),
    }
}

async fn say<M: Message + Clone>(sender: &Sender<M>, messages: &[M], goodbye: Option<M>) {
    for message in messages.iter().cloned().chain(goodbye) {
        if sender.send(message).await.is_err() {
            return;
        }
    }
}

/// What arrives, up to so many messages.
async fn hear<M: Message>(receiver: &mut Receiver<M>, most: usize) -> Vec<M> {
    let mut heard = Vec::new();
    while heard.len() < most {
        match receiver.recv().await {
            None => break,
            Some(Ok(message)) => heard.push(message),
            Some(Err(_)) => {
                assert!(receiver.recv().await.is_none(), "something came after an error");
                break;
            }
        }
    }
    heard
}

/// Each of the two queues keeps its order, and of each a beginning arrives: `sent` without its goodbye.
fn check_order<M: Message + PartialEq + std::fmt::Debug>(
    sent: &[M],
    heard: &[M],
    is_bulk: impl Fn(&M) -> bool,
) {
    for bulk in [false, true] {
        let of_queue = |messages: &[M]| -> Vec<usize> {
            let positions = messages.iter().filter(|message| is_bulk(message) == bulk);
            positions
                .map(|message| sent.iter().position(|known| known == message).unwrap_or(usize::MAX))
                .collect()
        };
        let (all, arrived) = (of_queue(sent), of_queue(heard));
        assert!(all.starts_with(&arrived), "of {all:?} arrived {arrived:?}");
    }
}

async fn play(seed: u64) {
    let mut random = Random(seed);
    let closes = !random.one_in(4);
    let (ours, theirs) = connect(&mut random, closes);
    let (master_out, mut master_in, _) = spawn::<_, ToWorker, ToMaster>(ours);
    let (worker_out, mut worker_in, _) = spawn::<_, ToMaster, ToWorker>(theirs);
    let count = 1 + random.below(30);
    let down: Vec<_> = (0..count).map(|n| to_worker(&mut random, n)).collect();
    let up: Vec<_> = (0..count).map(|n| to_master(&mut random, n)).collect();
    let farewell = ToWorker::Goodbye { reason: "enough".into(), reconnect: Reconnect::Never };
    let answer = ToMaster::Goodbye { reason: "likewise".into() };

    // Who has said goodbye does not listen for long. Where nothing closes, all is to arrive, so goodbye comes afterwards.
    let (early_farewell, early_answer) = (closes.then(|| farewell.clone()), closes.then(|| answer.clone()));
    let most = if closes { usize::MAX } else { count as usize };
    let conversation = async {
        let spoken = tokio::join!(
            say(&master_out, &down, early_farewell),
            say(&worker_out, &up, early_answer),
            hear(&mut worker_in, most),
            hear(&mut master_in, most),
        );
        let (last_down, last_up) = (Some(farewell.clone()), Some(answer.clone()));
        tokio::join!(say(&master_out, &[], last_down), say(&worker_out, &[], last_up));
        tokio::join!(hear(&mut worker_in, usize::MAX), hear(&mut master_in, usize::MAX));
        spoken
    };
    let spoken = timeout(FOR_EVER, conversation).await;
    let ((), (), mut heard_down, mut heard_up) =
        spoken.unwrap_or_else(|_| panic!("the sessions did not end"));
    heard_down.pop_if(|message| *message == farewell);
    heard_up.pop_if(|message| *message == answer);
    check_order(&down, &heard_down, |message| matches!(message, ToWorker::AssetChunk { .. }));
    check_order(&up, &heard_up, |message| matches!(message, ToMaster::Pixels { .. }));
    assert!(closes || (heard_down.len(), heard_up.len()) == (down.len(), up.len()), "something was lost");
    // Both sides learn of the end, however it came.
    timeout(FOR_EVER, async { tokio::join!(master_out.closed(), worker_out.closed()) }).await.unwrap();
}

#[test]
fn sessions_survive_every_weather_or_end() {
    let seeds = match std::env::var("RAYFARM_SEED") {
        Ok(seed) => vec![seed.parse().unwrap()],
        Err(_) => (0..SEEDS).collect(),
    };
    for seed in seeds {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
        let played =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| runtime.unwrap().block_on(play(seed))));
        assert!(played.is_ok(), "play it again with RAYFARM_SEED={seed}");
    }
}
