//! The state of view and farm as JSON, for pages and for `/api/status`. Lengths of time are in seconds.

use std::time::Duration;

use rayfarm_farm::accounting::{Fading, PART_NAMES};
use rayfarm_farm::{FarmStatus, WorkerStatus};
use rayfarm_tracer::scene::Setting;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobForm};
use serde_json::{Map, Value, json};

use crate::display::SceneInfo;
use crate::viewer::{PresentedFrame, Statistics, banned_facts, worker_facts};

/// The state now. A state at rest does not change.
pub(super) fn status(statistics: &Statistics, farm: &FarmStatus, newest: Option<&PresentedFrame>) -> Value {
    json!({
        "ok": true,
        "view": view(statistics, newest),
        "farm": {
            "frame": farm.frame.map(|frame| frame.0),
            "rows_done": farm.rows_done,
            "rows": farm.rows,
            "frames_done": farm.totals.frames_done,
            "sent_bytes": farm.totals.sent_bytes,
            "received_bytes": farm.totals.received_bytes,
            "scene_bytes": farm.totals.scene_bytes,
            "wrong_frames": farm.wrong_frames,
            "pending_connections": farm.pending,
            "refused_connections": farm.refused,
            "local_exited": farm.local_exited,
            "threads": farm.workers.iter().map(|worker| u64::from(worker.threads)).sum::<u64>(),
        },
        "workers": farm.workers.iter().map(|it| worker(it, &statistics.accounts)).collect::<Vec<_>>(),
        "kicked": farm.banned.iter().map(banned_facts).collect::<Vec<_>>(),
        "options": statistics.setting.map(|setting| options(&setting)),
    })
}

fn view(statistics: &Statistics, newest: Option<&PresentedFrame>) -> Value {
    let film = statistics.film.map(|film| {
        json!({
            "samples": film.samples,
            "of": film.of,
            "error": film.error,
            "seconds_left": film.left.map(rounded),
            "denoised": film.is_denoised,
        })
    });
    json!({
        "fps": (statistics.fps * 100.0).round() / 100.0,
        "frame_seconds": rounded(statistics.frame_time),
        "latency_seconds": statistics.latency.map(rounded),
        "frames": statistics.completed,
        "at_rest": statistics.resting,
        "problem": statistics.problem,
        "quality": statistics.quality,
        "film": film,
        "width": newest.map(|newest| newest.frame.view.width),
        "height": newest.map(|newest| newest.frame.view.height),
    })
}

fn worker(worker: &WorkerStatus, accounts: &Fading) -> Value {
    let parts = accounts.of(worker.id).map(|account| {
        let percent = account.percent.map(|part| (part * 10.0).round() / 10.0);
        PART_NAMES.iter().map(|name| (*name).to_owned()).zip(percent.map(Value::from)).collect::<Map<_, _>>()
    });
    let mut facts = worker_facts(worker);
    facts["thread_time_percent"] = parts.into();
    facts
}

/// Value of each knob of a setting, as commands write it.
fn options(setting: &Setting) -> Map<String, Value> {
    let value = |knob: &'static Knob| match knob.form {
        KnobForm::Number(range) | KnobForm::Count(range) => json!(f64::from(range.of(setting))),
        KnobForm::Switch | KnobForm::Word | KnobForm::Fraction => json!(knob.value_of(setting).word),
    };
    let has = |knob: &&Knob| knob.has_effect_with(&setting.integrator);
    KNOBS.iter().filter(has).map(|knob| (knob.option.to_owned(), value(knob))).collect()
}

/// Facts that do not change: the scene, and the knobs with their values, best first.
pub(super) fn facts(info: &SceneInfo) -> Value {
    let option = |knob: &Knob| {
        let range = match knob.form {
            KnobForm::Number(range) | KnobForm::Count(range) => {
                json!({ "least": f64::from(range.least), "most": f64::from(range.most), "whole": range.whole })
            }
            KnobForm::Switch | KnobForm::Word | KnobForm::Fraction => Value::Null,
        };
        let words: Vec<&str> = match knob.form {
            KnobForm::Switch => vec!["on", "off"],
            _ => knob.words().collect(),
        };
        json!({ "option": knob.option, "summary": knob.summary, "words": words, "range": range })
    };
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": info.name,
        "triangles": info.triangles,
        "parts": PART_NAMES,
        "options": KNOBS.iter().map(option).collect::<Vec<_>>(),
    })
}

/// Seconds with the precision of a tenth of a millisecond.
fn rounded(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::scene::RenderSettings;

    use super::*;

    #[test]
    fn each_option_has_a_value_that_a_command_accepts() {
        let setting = RenderSettings::default().setting();
        let options = options(&setting);
        assert!(!options.contains_key("roulette"), "an option of paths only");
        for knob in KNOBS.iter().filter(|knob| options.contains_key(knob.option)) {
            let value = &options[knob.option];
            let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            // The value without a word is that of an absent option.
            let is_known = knob.value(&text).is_some() || value.is_null() || value.is_number();
            assert!(is_known, "{}: {text}", knob.option);
        }
        assert_eq!((&options["shadows"], &options["samples"]), (&json!("on"), &json!(1.0)));
    }

    #[test]
    fn the_state_at_rest_is_the_same_each_time() {
        let statistics = Statistics { resting: true, ..Statistics::default() };
        let later = Statistics { since_last_frame: Duration::from_secs(5), ..statistics.clone() };
        let farm = FarmStatus::default();
        assert_eq!(status(&statistics, &farm, None), status(&later, &farm, None));
    }
}
