//! The arbiter: settles mismatches by rendering the rows on the master.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use rayfarm_protocol::{AssetId, FrameId};
use rayfarm_scheduler::{ArbiterResult, Event};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::SegmentDigest;
use crate::assets::scene_table::SceneTable;
use crate::farm_scene::FarmScene;

/// Renders rows of a view of a scene: pixels in its format without gaps, or the reason why it cannot.
pub(crate) type RowRenderer =
    dyn Fn(AssetId, &FrameView, Range<u32>) -> Result<Vec<u8>, String> + Send + Sync;

/// A segment for the arbiter to render: two renderings differ, or no second worker can render it.
#[derive(Clone, Debug)]
pub(crate) struct Dispute {
    pub(crate) frame: FrameId,
    /// The number of the segment within the frame.
    pub(crate) segment: u32,
    /// The hash of the scene body.
    pub(crate) scene: AssetId,
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
    let Dispute { scene, view, rows, first, second, .. } = dispute;
    let own = SegmentDigest::of(renderer(scene, &view, rows)?);
    Ok(ArbiterResult {
        rendered: true,
        first_differs: first != own,
        second_differs: second.is_some_and(|second| second != own),
    })
}

/// A renderer of the scenes of a table on this machine, with the code that workers use. It keeps the scene that it compiled
/// last; `stop` cancels a call.
pub(crate) fn row_renderer(scenes: Arc<SceneTable>, stop: CancellationToken) -> Arc<RowRenderer> {
    let last = Mutex::new(None::<(AssetId, Arc<CompiledScene>)>);
    Arc::new(move |id, view, rows| {
        let is_stopped = || stop.is_cancelled();
        let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
        let compiled = match last.as_ref().filter(|(compiled, _)| *compiled == id) {
            Some((_, compiled)) => compiled.clone(),
            None => {
                let scene = scenes.scene(id).ok_or("the scene of the frame is not kept any more")?;
                let FarmScene { scene, meshes, textures } = FarmScene::clone(&scene);
                // Before another scene is compiled, the memory of the last one is released.
                *last = None;
                let compiled = CompiledScene::new_unless(scene, meshes, textures, &is_stopped);
                let compiled = Arc::new(compiled.map_err(|error| error.to_string())?);
                last.insert((id, compiled)).1.clone()
            }
        };
        drop(last);
        let frame = PreparedFrame::new(compiled, view).map_err(|error| error.to_string())?;
        let mut pixels = vec![0; rows.len() * frame.row_bytes()];
        let rendered = render_rows(&frame, rows, &mut pixels, &is_stopped);
        rendered.map_err(|_| "the master ends".to_owned())?;
        Ok(pixels)
    })
}
