//! Frames rendered by the threads of this process, without a farm.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayfarm_tracer::{Cancelled, PreparedFrame, RayCounts, render_rows};

/// Number of threads that run at the same time on this machine.
pub(crate) fn all_cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Traces a frame into `pixels` (rows in its format) with `threads` threads. Each takes the next band of rows, calls `cancelled` before
/// it and `done` with its row count after it.
///
/// # Errors
/// [`Cancelled`], when `cancelled` returns true.
pub(crate) fn trace(
    frame: &PreparedFrame,
    pixels: &mut [u8],
    threads: usize,
    cancelled: &(dyn Fn() -> bool + Sync),
    done: &(dyn Fn(u32) + Sync),
) -> Result<RayCounts, Cancelled> {
    let band_rows = frame.tile_rows();
    let band_bytes = frame.row_bytes() * band_rows as usize;
    let bands = Mutex::new(pixels.chunks_mut(band_bytes).zip(bands(frame.height(), band_rows)));
    let work = || {
        let mut rays = RayCounts::default();
        loop {
            let next = bands.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((out, rows)) = next else { return Ok(rays) };
            let count = rows.end - rows.start;
            rays += render_rows(frame, rows, out, cancelled)?;
            done(count);
        }
    };
    if threads == 1 {
        return work();
    }
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let mut rays = RayCounts::default();
        for thread in threads {
            rays += thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        }
        Ok(rays)
    })
}

/// The rows of each band, top to bottom.
fn bands(height: u32, rows: u32) -> impl Iterator<Item = Range<u32>> {
    (0..height).step_by(rows as usize).map(move |first| first..(first + rows).min(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_every_row_once() {
        for height in [1, 7, 8, 9, 768] {
            for band in [1, 4, 16] {
                let rows: Vec<u32> = bands(height, band).flatten().collect();
                assert_eq!(rows, (0..height).collect::<Vec<_>>());
            }
        }
    }
}
