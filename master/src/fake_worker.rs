//! A worker that does as its script says, with pixels from a simple function, over a real connection.

use std::net::SocketAddr;
use std::ops::Range;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::session::{self, Sender};
use rayfarm_protocol::{
    Cost, Encoding, FrameAnnounce, FrameId, Hello, Lease, PixelsHeader, ToMaster, ToWorker, codec, handshake,
};
use rayfarm_tracer::scene::FrameView;
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::framebuffer::FramePixels;

/// What one that is busy takes for a pixel.
const PIXEL_TIME: Duration = Duration::from_nanos(2_440);

/// What a worker does besides rendering what it is asked to.
pub(crate) enum Script {
    /// Nothing.
    Honest,
    /// Is gone at its n-th lease (from 0), without a word.
    VanishAt(usize),
    /// Answers its first lease only when it is told to.
    Late(oneshot::Receiver<()>),
    /// Takes five milliseconds a frame of 32 x 64 pixels, and as much as that for each pixel of others.
    Busy,
    /// Answers no lease of a frame that is as wide as that, or wider.
    OnlyNarrowerThan(u32),
    /// Sends a byte too few.
    Short,
    /// Answers every lease twice.
    Twice,
    /// Flips a bit of the last pixel of every lease.
    Lie,
    /// Cannot render its first lease.
    FailOnce,
    /// Sends bytes that are no envelope in answer to its first lease.
    Babble,
}

/// What became of a worker.
#[derive(Debug, PartialEq)]
pub(crate) struct Outcome {
    /// The master's last word, if it said one.
    pub(crate) goodbye: Option<String>,
    /// Leases granted.
    pub(crate) leases: usize,
    /// Whether it was told that no more would come.
    pub(crate) drained: bool,
}

/// The pixels of rows: a function of the view, x and y, like any picture.
pub(crate) fn pixels(view: &FrameView, rows: Range<u32>) -> Vec<u8> {
    let seed = view.spin as u32 + (view.camera.position.x * 1e4).abs() as u32;
    let pixel = |x: u32, y: u32| [x as u8, y as u8, (seed + x * y) as u8];
    rows.flat_map(|y| (0..view.width).flat_map(move |x| pixel(x, y))).collect()
}

/// Whether this is the whole picture of a view.
pub(crate) fn is_picture(view: &FrameView, picture: &FramePixels) -> bool {
    **picture == *pixels(view, 0..view.height)
}

pub(crate) async fn connect(address: SocketAddr, threads: u32) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let hello = Hello { name: "fake".into(), threads, simd: "none".into(), software: "test".into() };
    handshake::as_worker(&mut stream, &hello).await.unwrap();
    stream
}

/// A worker of that name; it is connected when this returns.
pub(crate) async fn start_named(address: SocketAddr, name: &str, script: Script) -> JoinHandle<Outcome> {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let hello = Hello { name: name.into(), threads: 1, simd: "none".into(), software: "test".into() };
    handshake::as_worker(&mut stream, &hello).await.unwrap();
    tokio::spawn(live(stream, script))
}

/// Starts a worker with one thread. It is connected when this returns.
pub(crate) async fn start(address: SocketAddr, script: Script) -> JoinHandle<Outcome> {
    let stream = connect(address, 1).await;
    tokio::spawn(live(stream, script))
}

async fn live(stream: TcpStream, mut script: Script) -> Outcome {
    if matches!(script, Script::Babble) {
        return babble(stream).await;
    }
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    let mut outcome = Outcome { goodbye: None, leases: 0, drained: false };
    let mut views: Vec<(FrameId, FrameView)> = Vec::new();
    while let Some(Ok(message)) = receiver.recv().await {
        match message {
            ToWorker::Frame(FrameAnnounce { frame, view, .. }) => {
                views.push((frame, codec::decode(&view, 4096).unwrap()));
            }
            ToWorker::Segment(lease) => {
                let view = views.iter().find(|(frame, _)| *frame == lease.frame).expect("announced").1;
                outcome.leases += 1;
                if matches!(script, Script::VanishAt(n) if n + 1 == outcome.leases) {
                    sender.abort();
                    return outcome;
                }
                answer(&sender, &mut script, lease, &view).await;
            }
            ToWorker::Ping { nonce } => sender.send(ToMaster::Pong { nonce }).await.unwrap(),
            ToWorker::Goodbye { reason, .. } => outcome.goodbye = Some(reason),
            ToWorker::Drain => outcome.drained = true,
            ToWorker::Cancel { .. } => {}
            ToWorker::AssetBegin { .. }
            | ToWorker::AssetChunk { .. }
            | ToWorker::AssetUnknown { .. }
            | ToWorker::AssetFrom { .. }
            | ToWorker::ShareKey { .. } => {
                unreachable!("a fake worker asks for no assets")
            }
        }
    }
    outcome
}

async fn answer(sender: &Sender<ToMaster>, script: &mut Script, lease: Lease, view: &FrameView) {
    let mut bytes = pixels(view, lease.first_row..lease.first_row + lease.row_count);
    // Every other misdeed is done once.
    let misdeed = match script {
        Script::VanishAt(_) => Script::Honest,
        Script::Busy => Script::Busy,
        Script::Lie => Script::Lie,
        Script::OnlyNarrowerThan(width) if view.width >= *width => return,
        Script::OnlyNarrowerThan(_) => Script::Honest,
        _ => std::mem::replace(script, Script::Honest),
    };
    let answers = match misdeed {
        Script::Busy => {
            tokio::time::sleep(PIXEL_TIME * (bytes.len() / 3) as u32).await;
            1
        }
        Script::Honest | Script::VanishAt(_) | Script::OnlyNarrowerThan(_) | Script::Babble => 1,
        Script::Late(go) => {
            let sender = sender.clone();
            tokio::spawn(async move {
                go.await.unwrap();
                send_pixels(&sender, lease, bytes).await;
            });
            return;
        }
        Script::Short => {
            bytes.pop();
            1
        }
        Script::Twice => 2,
        Script::Lie => {
            bytes.last_mut().into_iter().for_each(|byte| *byte ^= 1);
            1
        }
        Script::FailOnce => {
            let failed = ToMaster::Failed { frame: lease.frame, reason: "out of paint".into() };
            return sender.send(failed).await.unwrap();
        }
    };
    for _ in 0..answers {
        send_pixels(sender, lease, bytes.clone()).await;
    }
}

async fn send_pixels(sender: &Sender<ToMaster>, lease: Lease, bytes: Vec<u8>) {
    let cost = Cost { trace_ns: 1000, primary: u64::from(lease.row_count), ..Cost::default() };
    let header = PixelsHeader { lease, encoding: Encoding::Raw, cost };
    // The master may have ended the session meanwhile: some scripts are written for that.
    let _ = sender.send(ToMaster::Pixels { header, bytes: Bytes::from(bytes) }).await;
}

/// Shakes hands like a worker and then speaks gibberish until it is thrown out.
async fn babble(stream: TcpStream) -> Outcome {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let (mut read, mut write) = stream.into_split();
    write.write_all(&[0xff; 64]).await.unwrap();
    let mut heard = Vec::new();
    // Whether the end comes as EOF or as a reset is the operating system's business.
    let _ = read.read_to_end(&mut heard).await;
    Outcome { goodbye: None, leases: 0, drained: false }
}
