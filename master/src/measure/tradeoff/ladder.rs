//! The ladder of a measured scene: from a table of `tradeoff`.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::RenderScale;

use super::setting::MeasuredSetting;
use super::table::{Row, Table};
use crate::viewer::quality_controller::{Ladder, Origin, Rung, bytes, continued};

/// Front of a table, for pictures that are at rest as in `wanted`. Costs are parts of the time of the row for that picture,
/// losses are differences to its mean FLIP error.
///
/// # Errors
/// In words: a table without a row for the picture at rest, or a picture at rest with a reduced knob. The table's errors are
/// differences to the picture with every knob at full quality, not to a reduced one. A low number, such as the depth, is the scene's
/// own full quality, and not refused.
pub(crate) fn ladder(table: &Table, wanted: &ViewRequest) -> Result<Ladder, String> {
    let full = MeasuredSetting::plain().applied_to(&wanted.view).setting().reductions();
    let mut turned = wanted.setting().reductions();
    turned.retain(|reduction| !full.contains(reduction));
    if !turned.is_empty() {
        return Err(format!(
            "was measured against pictures with every knob at full quality, and this one is at rest with {}: leave that out, or \
             the table",
            turned.join(", ")
        ));
    }
    // Pictures of the viewer are not denoised by its quality controller.
    let known = |name: &str| {
        let setting = MeasuredSetting::named(name).filter(|setting| !setting.is_denoised());
        setting.map(|setting| setting.applied_to(&wanted.view))
    };
    let is_at_rest = |request: &ViewRequest| request == wanted;
    let full = table.rows.iter().find(|row| known(&row.setting).as_ref().is_some_and(is_at_rest));
    let Some(full) = full else {
        let names: Vec<&str> = table.rows.iter().map(|row| row.setting.as_str()).collect();
        return Err(format!(
            "has no row for the picture at rest, with {} samples a pixel; it has {}",
            wanted.view.samples,
            names.join(", ")
        ));
    };
    let small = small_rows(table);
    let rungs = table.rows.iter().chain(&small).filter_map(|row| {
        let request = known(&row.setting).filter(|request| is_below(request, wanted))?;
        let cost = row.median_ms / full.median_ms;
        let (setting, wire) = (request.setting(), bytes(&request) / bytes(wanted));
        Some(Rung { setting, cost, wire, loss: (row.flip - full.flip).max(0.0) })
    });
    Ok(Ladder::of(rungs, Origin::Measured))
}

/// Rows for the scales of a third and a quarter, for a table that has none: versions before these scales wrote such tables.
fn small_rows(table: &Table) -> Vec<Row> {
    let row = |name: &str| table.rows.iter().find(|row| row.setting == name);
    let larger = ["samples-1", "scale-3-4", "scale-1-2"].map(row);
    let [Some(full), Some(three_quarters), Some(half)] = larger else { return Vec::new() };
    let known = [full, three_quarters, half].map(|row| (row.median_ms, row.flip));
    let small = [("scale-1-3", RenderScale::Third), ("scale-1-4", RenderScale::Quarter)];
    let missing = small.into_iter().filter(|(name, _)| row(name).is_none());
    missing
        .map(|(name, scale)| {
            let (median_ms, flip) = continued(known, scale);
            Row { setting: name.to_owned(), median_ms, flip, ..half.clone() }
        })
        .collect()
}

/// Whether a request is the other one with some knobs reduced and none raised.
fn is_below(request: &ViewRequest, wanted: &ViewRequest) -> bool {
    wanted.at_most(&request.setting()) == *request && request != wanted
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings};

    use super::*;

    fn row(setting: &str, ms: f64, flip: f64) -> Row {
        let (max_error, rmse, psnr_db, ssim) = (9, 1.0, 40.0, 0.9);
        Row { setting: setting.to_owned(), median_ms: ms, min_ms: ms, max_error, rmse, psnr_db, ssim, flip }
    }

    fn table() -> Table {
        let rows = vec![
            row("samples-1", 20.0, 0.05),
            row("samples-4", 60.0, 0.02),
            row("samples-4+adaptive", 30.0, 0.022),
            row("scale-1-2", 6.0, 0.11),
            row("no-shadows", 12.0, 0.3),
            row("samples-16", 200.0, 0.01),
        ];
        let (scene, simd_level) = ("a".to_owned(), "none".to_owned());
        Table { scene, width: 64, height: 48, threads: 1, simd_level, rows }
    }

    fn resting(samples: u32) -> ViewRequest {
        let view = FrameView { samples, ..rayfarm_farm::testing::test_scene::view() };
        ViewRequest { view, scale: RenderScale::Full }
    }

    #[test]
    fn the_front_of_a_table_starts_at_the_picture_at_rest() {
        let wanted = resting(4);
        let ladder = ladder(&table(), &wanted).unwrap();
        let figures: Vec<(f64, f64)> = ladder.rungs().iter().map(|rung| (rung.cost, rung.loss)).collect();
        assert_eq!(figures.len(), 4, "{figures:?}");
        assert_eq!(figures[0], (1.0, 0.0));
        assert!((figures[1].0 - 0.5).abs() < 1e-9 && (figures[1].1 - 0.002).abs() < 1e-9, "{figures:?}");
        let adaptive = wanted.at_most(&ladder.rungs()[1].setting).view;
        assert!(adaptive.quality.adaptive && adaptive.samples == 4);
        let last = wanted.at_most(&ladder.cheapest());
        assert_eq!((last.scale, last.view.samples), (RenderScale::Half, 1));
    }

    #[test]
    fn denoised_pictures_are_no_rungs() {
        let (mut table, mut wanted) = (table(), resting(32));
        wanted.view =
            wanted.view.with_setting(&wanted.setting().changed_to(Integrator::Path(PathSettings::DEFAULT)));
        wanted.view.samples = 32;
        table.rows.extend([row("samples-32+denoised", 1.0, 0.001), row("samples-32", 300.0, 0.02)]);
        table.rows.push(row("samples-8+denoised", 1.0, 0.001));
        let ladder = ladder(&table, &wanted).unwrap();
        let figures: Vec<(f64, f64)> = ladder.rungs().iter().map(|rung| (rung.cost, rung.loss)).collect();
        assert_eq!(figures[0], (1.0, 0.0));
        assert!(figures.iter().all(|(cost, _)| *cost > 1.5 / 300.0), "{figures:?}");
    }

    #[test]
    fn a_table_without_the_small_scales_gets_them_from_its_larger_ones() {
        let mut table = table();
        let smallest = |table: &Table| {
            let ladder = ladder(table, &resting(1)).unwrap();
            let rung = *ladder.rungs().iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap();
            (rung.setting.scale, rung.cost)
        };
        assert_eq!(smallest(&table).0, RenderScale::Half, "from two rows nothing is continued");
        table.rows.push(row("scale-3-4", 12.0, 0.08));
        let (scale, cost) = smallest(&table);
        assert!(scale == RenderScale::Quarter && (cost - 0.09).abs() < 1e-9, "{scale:?} {cost}");
        table.rows.push(row("scale-1-4", 1.0, 0.2));
        assert_eq!(smallest(&table), (RenderScale::Quarter, 0.05), "a measured row has priority");
    }

    #[test]
    fn a_table_without_the_picture_at_rest_is_refused_with_what_it_has() {
        let message = ladder(&table(), &resting(9)).unwrap_err();
        assert!(message.contains("9 samples") && message.contains("samples-16"), "{message}");
    }

    #[test]
    fn numbers_of_the_picture_at_rest_are_its_full_quality() {
        let mut table = table();
        table.rows.push(row("depth-3", 15.0, 0.055));
        table.rows.push(row("depth-1", 10.0, 0.06));
        let mut wanted = resting(1);
        wanted.view.quality.max_depth = 3;
        let ladder = ladder(&table, &wanted).unwrap();
        let figures = |rung: &Rung| (wanted.at_most(&rung.setting).view.quality.max_depth, rung.cost);
        let figures: Vec<(u8, f64)> = ladder.rungs().iter().map(figures).collect();
        // The depth of 3 is that of the picture at rest, and its row no rung.
        assert_eq!(figures, [(3, 1.0), (1, 0.5), (3, 0.3)]);
    }

    #[test]
    fn a_picture_at_rest_with_a_reduced_knob_has_no_ladder() {
        let mut wanted = resting(4);
        wanted.view.quality.shadows = false;
        let message = ladder(&table(), &wanted).unwrap_err();
        assert!(message.contains("no shadows"), "{message}");
    }
}
