//! The arbiter: settles mismatches by rendering the rows on the master.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use rayfarm_protocol::FrameId;
use rayfarm_scheduler::{ArbiterResult, Event};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::SegmentDigest;
use crate::options::FarmScene;

/// Renders rows of a view: pixels in its format without gaps, or the reason why it cannot.
pub(crate) type RowRenderer = dyn Fn(&FrameView, Range<u32>) -> Result<Vec<u8>, String> + Send + Sync;

/// A segment for the arbiter to render: two renderings differ, or no second worker can render it.
#[derive(Clone, Debug)]
pub(crate) struct Dispute {
    pub(crate) frame: FrameId,
    /// The number of the segment within the frame.
    pub(crate) segment: u32,
    pub(crate) view: FrameView,
    pub(crate) rows: Range<u32>,
    /// The digest of the rows in the picture.
    pub(crate) first: SegmentDigest,
    /// The digest of a second rendering that differs.
    pub(crate) second: Option<SegmentDigest>,
}

/// Settles one dispute after the other until `stop`. Each is rendered on a blocking thread; `report` receives the result
/// as an event for the scheduler.
pub(crate) async fn run(
    mut disputes: mpsc::UnboundedReceiver<Dispute>,
    renderer: Arc<RowRenderer>,
    report: impl Fn(Event) + Send,
    stop: CancellationToken,
) {
    while let Some(Some(dispute)) = stop.run_until_cancelled(disputes.recv()).await {
        let Dispute { frame, segment, .. } = dispute;
        let renderer = renderer.clone();
        let settled = tokio::task::spawn_blocking(move || settle(dispute, &*renderer)).await;
        let result = match settled.map_err(|error| error.to_string()).flatten() {
            Ok(result) => result,
            Err(error) => {
                tracing::error!("the master cannot verify rows of frame {frame} itself: {error}");
                ArbiterResult::default()
            }
        };
        report(Event::SegmentArbitrated { frame, segment, result });
    }
}

fn settle(dispute: Dispute, renderer: &RowRenderer) -> Result<ArbiterResult, String> {
    let Dispute { view, rows, first, second, .. } = dispute;
    let own = SegmentDigest::of(renderer(&view, rows)?);
    Ok(ArbiterResult {
        rendered: true,
        first_differs: first != own,
        second_differs: second.is_some_and(|second| second != own),
    })
}

/// A renderer of a scene on this machine, with the code that workers use. The scene is compiled at the first call; `stop`
/// cancels a call.
pub(crate) fn row_renderer(scene: FarmScene, stop: CancellationToken) -> Arc<RowRenderer> {
    let compiled: OnceLock<Result<Arc<CompiledScene>, String>> = OnceLock::new();
    Arc::new(move |view, rows| {
        let scene = compiled.get_or_init(|| {
            let FarmScene { scene, meshes, textures } = scene.clone();
            let compiled = CompiledScene::new_unless(scene, meshes, textures, &|| stop.is_cancelled());
            compiled.map(Arc::new).map_err(|error| error.to_string())
        });
        let frame = PreparedFrame::new(scene.clone()?, view).map_err(|error| error.to_string())?;
        let mut pixels = vec![0; rows.len() * frame.row_bytes()];
        let rendered = render_rows(&frame, rows, &mut pixels, &|| stop.is_cancelled());
        rendered.map_err(|_| "the master ends".to_owned())?;
        Ok(pixels)
    })
}
