//! Work of a session on blocking threads: disk reads, decoding, compilation, preparation of frames.

use std::sync::Arc;

use rayfarm_protocol::PixelFormat;

use super::state::{Work, WorkResult};
use crate::catch_panic::catch_panic;
use crate::progress::ProgressFlag;
use crate::render_pool::{Gain, ReadyFrame};
use crate::renderer::Renderer;
use crate::scenes::{BuildPool, DiskCache, SceneResult, SceneWork};

/// Runs a compilation with the build pool's permit. Where the session ends first, the compilation does not begin, or holds
/// the permit until it notices its cancellation.
pub(super) async fn compile_with_permit<R: Renderer>(
    renderer: Arc<R>,
    builders: BuildPool,
    progress: ProgressFlag,
    work: Work<R>,
) -> Option<WorkResult<R>> {
    let permit = builders.compile_permit().await;
    let compile = move || {
        let _permit = permit;
        do_work(&*renderer, &builders, None, &progress, work)
    };
    // Panics are caught in `do_work`, so an error means that the runtime shuts down.
    tokio::task::spawn_blocking(compile).await.ok().flatten()
}

/// Runs work on the current thread and notes its progress. Returns `None` where it was cancelled.
pub(super) fn do_work<R: Renderer>(
    renderer: &R,
    builders: &BuildPool,
    disk: Option<&DiskCache>,
    progress: &ProgressFlag,
    work: Work<R>,
) -> Option<WorkResult<R>> {
    let result = match work {
        Work::Scene(SceneWork::Find { id }) => {
            WorkResult::Scene(SceneResult::Found { id, size: disk.and_then(|disk| disk.find(id)) })
        }
        Work::Scene(SceneWork::Read { id, size }) => {
            WorkResult::Scene(SceneResult::Read { id, bytes: disk.and_then(|disk| disk.read(id, size)) })
        }
        Work::Scene(SceneWork::DecodeScene { id, body }) => {
            let result = catch_panic(|| builders.run(|| renderer.decode_scene(&body))).flatten();
            WorkResult::Scene(SceneResult::SceneDecoded { id, result })
        }
        Work::Scene(SceneWork::DecodePart { id, bytes }) => {
            let result = catch_panic(|| builders.run(|| renderer.decode_part(&bytes))).flatten();
            WorkResult::Scene(SceneResult::PartDecoded { id, result })
        }
        Work::Scene(SceneWork::Compile { id, draft, parts, cancel }) => {
            let cancelled = || {
                progress.note();
                cancel.is_cancelled()
            };
            if cancelled() {
                return None;
            }
            let compile = || renderer.compile(draft, parts, &cancelled);
            let result = catch_panic(|| builders.run(compile)).flatten();
            if cancelled() {
                return None;
            }
            WorkResult::Scene(SceneResult::Compiled { id, result })
        }
        Work::Prepare { announce, scene, cancel } => {
            let cancelled = || {
                progress.note();
                cancel.is_cancelled()
            };
            if cancelled() {
                return None;
            }
            let result = catch_panic(|| renderer.prepare(scene, &announce, &cancelled)).flatten();
            if cancelled() {
                return None;
            }
            let ready = |frame| {
                let rgb565 = announce.format == PixelFormat::Rgb8 && renderer.is_rgb565(&frame);
                ReadyFrame {
                    frame,
                    width: announce.width,
                    format: announce.format,
                    rgb565,
                    gain: Gain::default(),
                }
            };
            WorkResult::Prepared { frame: announce.frame, result: result.map(ready) }
        }
    };
    progress.note();
    Some(result)
}
