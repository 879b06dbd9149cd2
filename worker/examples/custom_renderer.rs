//! A worker with a renderer of its own, and a small master that gives it one frame to render.
//!
//! A scene is any bytes that the renderer understands; here they are the colour at the left edge of the picture, which fades
//! to black at the right one.
//!
//! ```sh
//! cargo run -p rayfarm-worker --example custom_renderer
//! ```

use std::error::Error;
use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::{
    AssetId, FrameAnnounce, FrameId, Lease, PixelFormat, Reconnect, ToMaster, ToWorker, Welcome, handshake,
    session,
};
use rayfarm_worker::{Cancelled, RayCounts, Renderer, Share, ShutdownHandle, WorkerOptions, run_with};
use tokio::net::TcpListener;

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;

struct Gradient;

/// One frame: its width in pixels, and the colour at its left edge.
struct Frame {
    width: u32,
    color: [u8; 3],
}

impl Renderer for Gradient {
    type Draft = [u8; 3];
    type Part = ();
    type Scene = [u8; 3];
    type Frame = Frame;

    fn simd(&self) -> String {
        "none".to_owned()
    }

    fn band_rows(&self, _frame: &Frame) -> u32 {
        1
    }

    fn decode_scene(&self, body: &[u8]) -> Result<([u8; 3], Vec<AssetId>), String> {
        let color = body.try_into().map_err(|_| format!("a scene has 3 bytes, not {}", body.len()))?;
        Ok((color, Vec::new()))
    }

    fn decode_part(&self, _bytes: &[u8]) -> Result<(), String> {
        Err("a scene of this renderer has no parts".to_owned())
    }

    fn compile(
        &self,
        draft: [u8; 3],
        _parts: Vec<Arc<()>>,
        _cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<[u8; 3], String> {
        Ok(draft)
    }

    fn prepare(
        &self,
        scene: Arc<[u8; 3]>,
        announce: &FrameAnnounce,
        _cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Frame, String> {
        Ok(Frame { width: announce.width, color: *scene })
    }

    fn is_rgb565(&self, _frame: &Frame) -> bool {
        false
    }

    fn render(
        &self,
        frame: &Frame,
        _rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<RayCounts, Cancelled> {
        let mut counts = RayCounts::default();
        for row in out.chunks_exact_mut(frame.width as usize * 3) {
            if cancelled() {
                return Err(Cancelled);
            }
            for (x, pixel) in (0..frame.width).zip(row.chunks_exact_mut(3)) {
                let light = f64::from(frame.width - x) / f64::from(frame.width);
                pixel.copy_from_slice(&frame.color.map(|channel| (f64::from(channel) * light) as u8));
            }
            counts.primary += u64::from(frame.width);
        }
        Ok(counts)
    }
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let options = WorkerOptions {
        master: listener.local_addr()?.to_string(),
        threads: Some(2),
        name: "gradient".to_owned(),
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        once: true,
        asset_cache_bytes: 1 << 20,
        disk_cache: None,
        compress: None,
        share: Share::Off,
        security: Default::default(),
    };
    let worker = tokio::spawn(run_with(Gradient, options, ShutdownHandle::new()));
    let pixels = render_frame(listener, Bytes::from_static(&[255, 160, 0])).await?;
    println!("{} bytes, the first pixel is {:?}", pixels.len(), &pixels.get(..3));
    worker.await??;
    Ok(())
}

/// The master: takes one worker, sends it the scene that it requests, and returns the pixels of one frame.
async fn render_frame(listener: TcpListener, scene: Bytes) -> Result<Bytes, Box<dyn Error>> {
    let (mut stream, _) = listener.accept().await?;
    handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| {
        Ok(Welcome { worker: 1 })
    })
    .await?;
    let (sender, mut receiver, _) = session::spawn::<_, ToWorker, ToMaster>(stream);

    let frame = FrameId(1);
    let id = AssetId::of(&scene);
    let (format, view) = (PixelFormat::Rgb8, Bytes::new());
    let announce = FrameAnnounce { frame, scene: id, width: WIDTH, height: HEIGHT, format, view };
    sender.send(ToWorker::Frame(announce)).await?;
    let lease = Lease { frame, segment: 0, attempt: 0, first_row: 0, row_count: HEIGHT };
    sender.send(ToWorker::Segment(lease)).await?;

    while let Some(message) = receiver.recv().await.transpose()? {
        match message {
            ToMaster::NeedAsset { .. } => {
                sender.send(ToWorker::AssetBegin { id, size: scene.len() as u64 }).await?;
                sender.send(ToWorker::AssetChunk { id, offset: 0, bytes: scene.clone() }).await?;
            }
            ToMaster::Pixels { bytes, .. } => {
                let reason = "the frame is complete".to_owned();
                sender.send(ToWorker::Disconnect { reason, reconnect: Reconnect::Never }).await?;
                return Ok(bytes);
            }
            other => return Err(format!("the worker sent {other:?}").into()),
        }
    }
    Err("the worker left".into())
}
