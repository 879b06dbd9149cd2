//! A renderer whose scenes are short byte strings.
//!
//! A scene body is `scene`, one byte of salt, and the ids of its meshes. A mesh is `mesh` and any bytes. The view of a
//! frame selects its behaviour: `wait`, `steps`, `panic`, `endless`, `unpreparable`, `rgb565`, or plain rendering.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::{AssetId, FrameAnnounce, PixelFormat};

use crate::renderer::{Cancelled, RayCounts, Renderer};

/// Number of pixels per row of all frames.
pub(super) const WIDTH: u32 = 5;

/// Number of rows of all frames.
pub(super) const HEIGHT: u32 = 40;

/// Number of bytes of a row.
const ROW_BYTES: usize = PixelFormat::Rgb8.row_bytes(WIDTH);

/// Salt of scenes whose compilation lasts until it is cancelled, and then until the gate is open.
pub(super) const SLOW_SCENE: u8 = 100;

/// Gate for render threads of frames whose view is `wait`. Closed at first.
#[derive(Default)]
pub(super) struct Gate {
    is_open: Mutex<bool>,
    changed: Condvar,
}

impl Gate {
    pub(super) fn open(&self) {
        *self.is_open.lock().unwrap() = true;
        self.changed.notify_all();
    }

    fn is_open(&self) -> bool {
        *self.is_open.lock().unwrap()
    }

    fn wait(&self) {
        let is_open = self.is_open.lock().unwrap();
        drop(self.changed.wait_while(is_open, |is_open| !*is_open).unwrap());
    }
}

/// Counts of calls to a [`FakeRenderer`].
#[derive(Debug, Default)]
pub(super) struct Calls {
    /// Compilations that have begun.
    pub(super) compiled: AtomicUsize,
    compiling: AtomicUsize,
    /// Most concurrent compilations.
    pub(super) most_compiling: AtomicUsize,
    /// Compilations and preparations that noticed a cancellation.
    pub(super) cancelled: AtomicUsize,
    /// Preparations that have begun.
    pub(super) prepared: AtomicUsize,
    /// Bands of frames whose view is `steps` that have begun.
    pub(super) stepping: AtomicUsize,
    /// Steps that bands of such frames may still do. A band polls its cancellation after each, and ends with the gate.
    pub(super) steps: AtomicUsize,
    /// Sizes of the thread pools that decoded and compiled scenes.
    pub(super) pool_sizes: Mutex<BTreeSet<usize>>,
}

impl Calls {
    fn wait_until_cancelled(&self, cancelled: &(dyn Fn() -> bool + Sync)) {
        while !cancelled() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.cancelled.fetch_add(1, Relaxed);
    }

    fn record_pool(&self) {
        self.pool_sizes.lock().unwrap().insert(rayon::current_num_threads());
    }
}

/// Waits until one of the counts of [`Calls`] reaches a number.
pub(super) async fn until(count: &AtomicUsize, number: usize) {
    while count.load(Relaxed) < number {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[derive(Default)]
pub(super) struct FakeRenderer {
    pub(super) gate: Arc<Gate>,
    pub(super) calls: Arc<Calls>,
}

pub(super) struct FakeFrame {
    view: Bytes,
    salt: u8,
}

/// Value of all bytes of row `y`.
fn shade(salt: u8, view: &[u8], y: u32) -> u8 {
    view.iter().fold(salt, |sum, byte| sum.wrapping_mul(3).wrapping_add(*byte)).wrapping_add(y as u8)
}

/// Pixels of rows of a frame with this scene body and this view.
pub(super) fn expected(scene: &[u8], view: &[u8], rows: Range<u32>) -> Vec<u8> {
    rows.flat_map(|y| vec![shade(scene[5], view, y); ROW_BYTES]).collect()
}

/// Body of a scene with these meshes.
pub(super) fn scene(salt: u8, meshes: &[&[u8]]) -> Vec<u8> {
    let ids = meshes.iter().flat_map(|mesh| AssetId::of(mesh).0);
    b"scene".iter().copied().chain([salt]).chain(ids).collect()
}

impl FakeRenderer {
    fn render_steps(&self, cancelled: &dyn Fn() -> bool) {
        let calls = &self.calls;
        calls.stepping.fetch_add(1, Relaxed);
        while !self.gate.is_open() {
            if calls.steps.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_ok() {
                cancelled();
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Renderer for FakeRenderer {
    type Draft = u8;
    type Part = ();
    type Scene = u8;
    type Frame = FakeFrame;

    fn simd(&self) -> String {
        "fake".to_owned()
    }

    fn band_rows(&self, _frame: &FakeFrame) -> u32 {
        8
    }

    fn decode_scene(&self, body: &[u8]) -> Result<(u8, Vec<AssetId>), String> {
        self.calls.record_pool();
        let rest = body.strip_prefix(b"scene").ok_or("this is no scene")?;
        let (salt, meshes) = rest.split_first().ok_or("this scene has no salt")?;
        Ok((*salt, meshes.chunks_exact(32).map(|id| AssetId(id.try_into().unwrap())).collect()))
    }

    fn decode_part(&self, bytes: &[u8]) -> Result<(), String> {
        self.calls.record_pool();
        assert!(bytes != b"mesh that panics", "this mesh panics");
        if bytes.starts_with(b"mesh") { Ok(()) } else { Err("this is no mesh".to_owned()) }
    }

    fn compile(
        &self,
        draft: u8,
        _parts: Vec<Arc<()>>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<u8, String> {
        self.calls.record_pool();
        let compiling = self.calls.compiling.fetch_add(1, Relaxed) + 1;
        self.calls.most_compiling.fetch_max(compiling, Relaxed);
        self.calls.compiled.fetch_add(1, Relaxed);
        if draft == SLOW_SCENE {
            self.calls.wait_until_cancelled(cancelled);
            self.gate.wait();
        }
        self.calls.compiling.fetch_sub(1, Relaxed);
        Ok(draft)
    }

    fn prepare(
        &self,
        scene: Arc<u8>,
        announce: &FrameAnnounce,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<FakeFrame, String> {
        self.calls.prepared.fetch_add(1, Relaxed);
        match announce.view.as_ref() {
            b"endless" => {
                self.calls.wait_until_cancelled(cancelled);
                Err("it was cancelled".to_owned())
            }
            b"unpreparable" => Err("this view cannot be prepared".to_owned()),
            _ => Ok(FakeFrame { view: announce.view.clone(), salt: *scene }),
        }
    }

    /// Claims RGB 5-6-5 for the view `rgb565`, whose pixels have other colours.
    fn is_rgb565(&self, frame: &FakeFrame) -> bool {
        frame.view.as_ref() == b"rgb565"
    }

    fn render(
        &self,
        frame: &FakeFrame,
        rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<RayCounts, Cancelled> {
        match frame.view.as_ref() {
            b"wait" => self.gate.wait(),
            b"steps" => self.render_steps(cancelled),
            b"panic" => panic!("row {} panics", rows.start),
            _ => {}
        }
        if cancelled() {
            return Err(Cancelled);
        }
        for (y, row) in rows.clone().zip(out.chunks_exact_mut(ROW_BYTES)) {
            row.fill(shade(frame.salt, &frame.view, y));
        }
        Ok(RayCounts { primary: u64::from(WIDTH) * rows.len() as u64, shadow: 1, secondary: 0 })
    }
}
