//! Tints over the picture: by the worker that rendered each row, or by its cost. Only the window shows them.

use rayfarm_farm::accounting::{FrameAccount, SegmentNote, WorkerAccount};

use super::canvas::RowTint;
use super::overlay::legend::Entry;

/// Meaning of the tints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Coloring {
    /// No tints.
    #[default]
    Off,
    /// Worker of each segment.
    ByWorker,
    /// Time of each segment, per row.
    ByCost,
}

/// Colours of workers 1, 2, 3, ...; they repeat.
const WORKER_COLORS: [u32; 10] = [
    0x00ff_5a36,
    0x0033_8dff,
    0x0040_d060,
    0x00ff_d21f,
    0x00b0_5cff,
    0x001f_e0d8,
    0x00ff_6ec7,
    0x00a8_e61d,
    0x00ff_9d1f,
    0x008a_9bff,
];
/// Colours from cheap to expensive.
const HEAT: [[f64; 3]; 5] = [
    [70.0, 90.0, 235.0],
    [0.0, 180.0, 220.0],
    [60.0, 200.0, 60.0],
    [250.0, 220.0, 30.0],
    [240.0, 40.0, 20.0],
];
/// Steps of `HEAT` in the legend.
const HEAT_STEPS: u32 = 5;

impl Coloring {
    /// The next meaning, by the key of the window.
    pub(super) fn next(self) -> Self {
        match self {
            Self::Off => Self::ByWorker,
            Self::ByWorker => Self::ByCost,
            Self::ByCost => Self::Off,
        }
    }

    /// Tint of each of `rows` rows; empty without tints.
    pub(super) fn tints(self, account: &FrameAccount, rows: u32) -> Vec<RowTint> {
        let highest = highest_cost(account);
        let color = |note: &SegmentNote| match self {
            Self::Off => None,
            Self::ByWorker => Some((worker_color(note.worker), false)),
            Self::ByCost => Some((heat(ns_per_row(note) / highest), true)),
        };
        let mut tints = vec![RowTint::None; rows as usize];
        if self == Self::Off {
            return Vec::new();
        }
        for note in &account.segments {
            let Some((color, grey)) = color(note) else { continue };
            let first = note.first_row as usize;
            let end = first.saturating_add(note.row_count as usize).min(tints.len());
            for (row, tint) in tints.iter_mut().enumerate().take(end).skip(first) {
                // The first rendering of a row counts, so its tint does as well.
                if *tint == RowTint::None {
                    *tint = match (grey, row == first) {
                        (_, true) => RowTint::Edge(color),
                        (true, false) => RowTint::Grey(color),
                        (false, false) => RowTint::Blend(color),
                    };
                }
            }
        }
        tints
    }

    /// Legend of the colours: a title and the entries.
    pub(super) fn legend(self, account: &FrameAccount) -> Option<(&'static str, Vec<Entry>)> {
        match self {
            Self::Off => None,
            Self::ByWorker => {
                Some(("rendered by", account.workers.iter().filter(|w| w.rows > 0).map(worker).collect()))
            }
            Self::ByCost => Some(("us of tracing a row", heat_steps(highest_cost(account)))),
        }
    }
}

fn worker(worker: &WorkerAccount) -> Entry {
    Entry { color: worker_color(worker.id), label: format!("{} {}", worker.id, worker.name) }
}

fn worker_color(id: u64) -> u32 {
    let place = usize::try_from(id.saturating_sub(1) % WORKER_COLORS.len() as u64).unwrap_or(0);
    WORKER_COLORS[place]
}

fn heat_steps(highest: f64) -> Vec<Entry> {
    let step = |index: u32| {
        let share = f64::from(index) / f64::from(HEAT_STEPS - 1);
        Entry { color: heat(share), label: format!("{:.0}", share * highest / 1e3) }
    };
    (0..HEAT_STEPS).rev().map(step).collect()
}

fn ns_per_row(note: &SegmentNote) -> f64 {
    note.trace_ns as f64 / f64::from(note.row_count.max(1))
}

/// Nanoseconds per row of the most expensive segment; above zero.
fn highest_cost(account: &FrameAccount) -> f64 {
    account.segments.iter().map(ns_per_row).fold(1.0, f64::max)
}

/// Colour of a part (0..=1) of the highest cost.
fn heat(share: f64) -> u32 {
    let place = share.clamp(0.0, 1.0) * (HEAT.len() - 1) as f64;
    let below = (place as usize).min(HEAT.len() - 2);
    let part = place - below as f64;
    let channel = |c: usize| (HEAT[below][c] + (HEAT[below + 1][c] - HEAT[below][c]) * part).round() as u8;
    u32::from_be_bytes([0, channel(0), channel(1), channel(2)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(first_row: u32, row_count: u32, worker: u64, trace_ns: u64) -> SegmentNote {
        SegmentNote { first_row, row_count, worker, trace_ns }
    }

    fn account() -> FrameAccount {
        let named =
            |id, name: &str, rows| WorkerAccount { id, name: name.into(), rows, ..WorkerAccount::default() };
        FrameAccount {
            workers: vec![named(1, "mill", 2), named(2, "barn", 3), named(3, "idle", 0)],
            segments: vec![note(0, 2, 1, 2000), note(2, 3, 2, 30_000), note(1, 9, 1, 9)],
        }
    }

    #[test]
    fn rows_have_the_colour_of_the_worker_of_their_first_rendering() {
        let tints = Coloring::ByWorker.tints(&account(), 6);
        let (one, two) = (worker_color(1), worker_color(2));
        let expected = [RowTint::Edge(one), RowTint::Blend(one), RowTint::Edge(two), RowTint::Blend(two)];
        assert_eq!(tints[..4], expected);
        assert_eq!(tints[5], RowTint::Blend(one));
        assert_ne!(one, two);
    }

    #[test]
    fn the_most_expensive_rows_are_hottest() {
        let tints = Coloring::ByCost.tints(&account(), 5);
        assert_eq!(tints[3], RowTint::Grey(heat(1.0)));
        assert_eq!(tints[1], RowTint::Grey(heat(0.1)));
        assert_eq!(heat(f64::NAN.max(2.0)), 0x00f0_2814);
    }

    #[test]
    fn the_key_cycles_through_all_meanings() {
        let mut coloring = Coloring::default();
        for shown in [Coloring::ByWorker, Coloring::ByCost, Coloring::Off] {
            coloring = coloring.next();
            assert_eq!(coloring, shown);
        }
        assert!(Coloring::Off.tints(&account(), 5).is_empty());
        assert_eq!(Coloring::Off.legend(&account()), None);
    }

    #[test]
    fn the_legend_names_the_workers_that_rendered() {
        let (_, entries) = Coloring::ByWorker.legend(&account()).unwrap();
        assert_eq!(
            entries.iter().map(|entry| entry.label.as_str()).collect::<Vec<_>>(),
            ["1 mill", "2 barn"]
        );
        let (_, entries) = Coloring::ByCost.legend(&account()).unwrap();
        assert_eq!((entries.len(), entries[0].label.as_str(), entries[4].label.as_str()), (5, "10", "0"));
    }
}
