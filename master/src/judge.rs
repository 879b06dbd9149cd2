//! The last word on pixels: the master traces rows itself, as any worker would, and sees who has sent others.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use blake3::Hash;
use rayfarm_protocol::FrameId;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use crate::driver::Driver;
use crate::farm::FarmScene;
use crate::scheduler::{ArbiterResult, Event};

/// RGB8 sRGB rows of a frame, or why there are none.
pub(crate) type Trace = dyn Fn(&FrameView, Range<u32>) -> Result<Vec<u8>, String> + Send + Sync;

/// Rows to be traced here.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) frame: FrameId,
    /// The number of the audit.
    pub(crate) segment: u32,
    pub(crate) view: FrameView,
    pub(crate) rows: Range<u32>,
    /// What is in the picture.
    pub(crate) painter: Hash,
    /// What was sent to verify it, if it was something else.
    pub(crate) checker: Option<Hash>,
}

/// Traces one case after the other, each on a blocking thread, until `stop`.
pub(crate) async fn hold_court(
    mut cases: mpsc::UnboundedReceiver<Case>,
    trace: Arc<Trace>,
    driver: Arc<Driver>,
    stop: CancellationToken,
) {
    while let Some(Some(case)) = stop.run_until_cancelled(cases.recv()).await {
        let Case { frame, segment, view, rows, painter, checker } = case;
        let trace = trace.clone();
        let traced = tokio::task::spawn_blocking(move || trace(&view, rows)).await;
        let result = match traced.map_err(|error| error.to_string()).flatten() {
            Ok(bytes) => {
                let own = blake3::hash(&bytes);
                ArbiterResult {
                    rendered: true,
                    first_differs: painter != own,
                    second_differs: checker.is_some_and(|hash| hash != own),
                }
            }
            Err(error) => {
                tracing::error!("the master cannot verify rows of frame {frame} itself: {error}");
                ArbiterResult::default()
            }
        };
        driver.handle(Event::SegmentArbitrated { frame, segment, result });
    }
}

/// The scene as the master traces it; it is compiled when it is asked for first. Gives up when `stop` says so.
pub(crate) fn tracer(scene: FarmScene, stop: CancellationToken) -> Arc<Trace> {
    let compiled: OnceLock<Result<Arc<CompiledScene>, String>> = OnceLock::new();
    Arc::new(move |view, rows| {
        let scene = compiled.get_or_init(|| {
            let FarmScene { scene, meshes, textures } = scene.clone();
            let compiled = CompiledScene::new_unless(scene, meshes, textures, &|| stop.is_cancelled());
            compiled.map(Arc::new).map_err(|error| error.to_string())
        });
        let frame = PreparedFrame::new(scene.clone()?, view).map_err(|error| error.to_string())?;
        let mut pixels = vec![0; rows.len() * view.width as usize * 3];
        let traced = render_rows(&frame, rows, &mut pixels, &|| stop.is_cancelled());
        traced.map_err(|_| "the master ends".to_owned())?;
        Ok(pixels)
    })
}
