//! A scripted worker over a real connection, with pixels from a simple function.

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

/// Render time of [`Script::Busy`] for one pixel.
const PIXEL_TIME: Duration = Duration::from_nanos(2_440);

/// The behaviour of a fake worker, besides rendering its leases correctly.
pub enum Script {
    /// Renders every lease correctly.
    Correct,
    /// Closes the connection without a disconnect message at its n-th lease, from 0.
    DisconnectAt(usize),
    /// Delays the reply to its first lease until the channel fires.
    Late(oneshot::Receiver<()>),
    /// Takes 2.44 microseconds a pixel: five milliseconds for a frame of 32 x 64 pixels.
    Busy,
    /// Replies to no lease of a frame of at least this width, in pixels.
    OnlyNarrowerThan(u32),
    /// Sends one byte too few for its first lease.
    Short,
    /// Replies twice to its first lease.
    Twice,
    /// Flips a bit of the last pixel of every lease.
    WrongPixels,
    /// Reports that it cannot render its first lease.
    FailOnce,
    /// Sends bytes that are no envelope after its handshake.
    Garbage,
}

/// The end of a fake worker's session.
#[derive(Debug, PartialEq)]
pub struct Outcome {
    /// The reason in the master's disconnect message; `None` if there was none.
    pub disconnect_reason: Option<String>,
    /// Number of leases granted.
    pub leases: usize,
    /// Whether the master drained it.
    pub drained: bool,
}

/// Test pixels of a range of rows in the view's format, a function of view, x and y only.
pub fn pixels(view: &FrameView, rows: Range<u32>) -> Vec<u8> {
    let seed = view.spin as u32 + (view.camera.position.x * 1e4).abs() as u32;
    let bytes = view.format.bytes_per_pixel();
    let pixel = |x: u32, y: u32| [x as u8, y as u8, (seed + x * y) as u8].into_iter().cycle().take(bytes);
    rows.flat_map(|y| (0..view.width).flat_map(move |x| pixel(x, y))).collect()
}

/// Whether `picture` is the complete picture of [`pixels`].
pub fn is_picture(view: &FrameView, picture: &FramePixels) -> bool {
    **picture == *pixels(view, 0..view.height)
}

/// Connects and shakes hands as a worker named "fake".
pub async fn connect(address: SocketAddr, threads: u32) -> TcpStream {
    connect_named(address, "fake", threads).await
}

async fn connect_named(address: SocketAddr, name: &str, threads: u32) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let hello =
        Hello { name: name.into(), threads, simd: "none".into(), software: "test".into(), tags: Vec::new() };
    handshake::as_worker(&mut stream, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello)
        .await
        .unwrap();
    stream
}

/// Starts a worker with this name and one thread. It is connected when this returns.
pub async fn start_named(address: SocketAddr, name: &str, script: Script) -> JoinHandle<Outcome> {
    let stream = connect_named(address, name, 1).await;
    tokio::spawn(run(stream, script))
}

/// Starts a worker with one thread. It is connected when this returns.
pub async fn start(address: SocketAddr, script: Script) -> JoinHandle<Outcome> {
    start_named(address, "fake", script).await
}

async fn run(stream: TcpStream, mut script: Script) -> Outcome {
    if matches!(script, Script::Garbage) {
        return send_garbage(stream).await;
    }
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    let mut outcome = Outcome { disconnect_reason: None, leases: 0, drained: false };
    let mut views: Vec<(FrameId, FrameView)> = Vec::new();
    while let Some(Ok(message)) = receiver.recv().await {
        match message {
            ToWorker::Frame(FrameAnnounce { frame, view, .. }) => {
                views.push((frame, codec::decode(&view, 4096).unwrap()));
            }
            ToWorker::Segment(lease) => {
                let view = views.iter().find(|(frame, _)| *frame == lease.frame).expect("announced").1;
                outcome.leases += 1;
                if matches!(script, Script::DisconnectAt(n) if n + 1 == outcome.leases) {
                    sender.abort();
                    return outcome;
                }
                answer(&sender, &mut script, lease, &view).await;
            }
            ToWorker::Ping { nonce } => {
                sender.send(ToMaster::Pong { nonce, progressed: false }).await.unwrap();
            }
            ToWorker::Disconnect { reason, .. } => outcome.disconnect_reason = Some(reason),
            ToWorker::Drain => outcome.drained = true,
            ToWorker::Cancel { .. } => {}
            ToWorker::AssetBegin { .. }
            | ToWorker::AssetChunk { .. }
            | ToWorker::AssetUnknown { .. }
            | ToWorker::AssetFrom { .. }
            | ToWorker::ShareKey { .. } => {
                unreachable!("a fake worker requests no assets")
            }
        }
    }
    outcome
}

async fn answer(sender: &Sender<ToMaster>, script: &mut Script, lease: Lease, view: &FrameView) {
    let mut bytes = pixels(view, lease.first_row..lease.first_row + lease.row_count);
    // Every other deviation happens once.
    let deviation = match script {
        Script::DisconnectAt(_) => Script::Correct,
        Script::Busy => Script::Busy,
        Script::WrongPixels => Script::WrongPixels,
        Script::OnlyNarrowerThan(width) if view.width >= *width => return,
        Script::OnlyNarrowerThan(_) => Script::Correct,
        _ => std::mem::replace(script, Script::Correct),
    };
    let answers = match deviation {
        Script::Busy => {
            tokio::time::sleep(PIXEL_TIME * view.width * lease.row_count).await;
            1
        }
        Script::Correct | Script::DisconnectAt(_) | Script::OnlyNarrowerThan(_) | Script::Garbage => 1,
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
        Script::WrongPixels => {
            bytes.last_mut().into_iter().for_each(|byte| *byte ^= 1);
            1
        }
        Script::FailOnce => {
            let failed = ToMaster::Failed { frame: lease.frame, reason: "out of memory".into() };
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
    // Sending fails where the master has ended the session because of the script.
    let _ = sender.send(ToMaster::Pixels { header, bytes: Bytes::from(bytes) }).await;
}

/// Sends bytes that are no envelope, until the master closes the connection.
async fn send_garbage(stream: TcpStream) -> Outcome {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let (mut read, mut write) = stream.into_split();
    write.write_all(&[0xff; 64]).await.unwrap();
    let mut heard = Vec::new();
    // The connection ends with EOF or a reset, depending on the operating system.
    let _ = read.read_to_end(&mut heard).await;
    Outcome { disconnect_reason: None, leases: 0, drained: false }
}
