use rayfarm_tracer::scene::RenderScale;

use super::*;
use crate::test_scene;
use crate::viewer::view_request::ViewRequest;

fn ms(values: &[u64]) -> Vec<Duration> {
    values.iter().copied().map(Duration::from_millis).collect()
}

#[test]
fn percentiles_interpolate() {
    let sorted = ms(&[10, 20, 30, 40]);
    assert_eq!(percentile(&sorted, 0.0), Duration::from_millis(10));
    assert_eq!(percentile(&sorted, 0.5), Duration::from_millis(25));
    assert_eq!(percentile(&sorted, 1.0), Duration::from_millis(40));
    assert_eq!(percentile(&sorted, 7.0), Duration::from_millis(40));
    assert_eq!(percentile(&[], 0.5), Duration::ZERO);
    assert_eq!(percentile(&ms(&[3]), 0.95), Duration::from_millis(3));
}

#[test]
fn the_order_of_frames_does_not_matter() {
    let expected = MsPerFrame { min: 1.0, median: 3.0, p95: 8.2, max: 9.0 };
    assert_eq!(MsPerFrame::of(&ms(&[9, 1, 3, 5, 2])), expected);
    assert_eq!(MsPerFrame::of(&ms(&[1, 2, 3, 5, 9])), expected);
    assert_eq!(MsPerFrame::of(&[]), MsPerFrame::default());
}

#[test]
fn means_round_to_the_nearest() {
    assert_eq!([mean(10, 4), mean(9, 4), mean(0, 4), mean(7, 0)], [3, 2, 0, 7]);
}

#[test]
fn claims_of_any_size_sum_up_and_have_a_mean() {
    let claim = RaysPerFrame { primary: u64::MAX, shadow: u64::MAX - 1, secondary: 3 };
    let mut sum = claim;
    sum.add(claim);
    assert_eq!(sum, RaysPerFrame { primary: u64::MAX, shadow: u64::MAX, secondary: 6 });
    assert_eq!(sum.mean(2).primary, u64::MAX / 2 + 1);
    assert_eq!((sum.mean(1).shadow, sum.mean(u32::MAX).secondary, sum.total()), (u64::MAX, 0, u64::MAX));
    let mut bytes = BytesPerFrame { sent: u64::MAX, received: 1 };
    bytes.add(bytes);
    assert_eq!(bytes, BytesPerFrame { sent: u64::MAX, received: 2 });
}

#[test]
fn the_json_line_has_the_documented_shape() {
    let full = ViewRequest { view: test_scene::view(), scale: RenderScale::Full };
    let report = RenderReport {
        frames: 2,
        skipped: 1,
        fps: 12.5,
        width: 64,
        height: 48,
        samples: 4,
        quality: full.knobs(),
        workers: 1,
        threads: 2,
        triangles: 12,
        rays_per_frame: RaysPerFrame { primary: 12_288, shadow: 7, secondary: 0 },
        ms_per_frame: MsPerFrame { min: 1.5, median: 2.0, p95: 2.45, max: 2.5 },
        latency_ms: MsPerFrame::default(),
        bytes_per_frame: BytesPerFrame { sent: 100, received: 9_216 },
        scene_bytes: 4_096,
        accounting: AccountReport::default(),
        verification: None,
        blake3: "00ff".to_owned(),
    };
    assert_eq!(
        serde_json::to_string(&report).unwrap(),
        concat!(
            r#"{"frames":2,"skipped":1,"fps":12.5,"width":64,"height":48,"samples":4,"quality":"#,
            r#"{"shadows":true,"shading":"full","filter":null,"exponent":"exact","colors":"exact","scale":1.0,"adaptive":false,"dither":false},"#,
            r#""workers":1,"threads":2,"triangles":12,"#,
            r#""rays_per_frame":{"primary":12288,"shadow":7,"secondary":0},"#,
            r#""ms_per_frame":{"min":1.5,"median":2.0,"p95":2.45,"max":2.5},"#,
            r#""latency_ms":{"min":0.0,"median":0.0,"p95":0.0,"max":0.0},"#,
            r#""bytes_per_frame":{"sent":100,"received":9216},"scene_bytes":4096,"#,
            r#""accounting":{"percent":{"trace":0.0,"wait":0.0,"encode":0.0,"send":0.0,"decode":0.0,"#,
            r#""idle_tail":0.0,"scene":0.0},"workers":[]},"blake3":"00ff"}"#,
        )
    );
}

#[test]
fn the_log_has_as_many_columns_as_its_first_line() {
    let mut log = FpsLog::new(Vec::new(), "log".to_owned()).unwrap();
    let line =
        FrameLine { frame: 3, elapsed: Duration::from_micros(12_345), fps: 80.0, ..FrameLine::default() };
    log.add(&line).unwrap();
    let text = String::from_utf8(log.out).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(
        lines[1],
        "3,0.000000,12.345,80.000,0,0,0,0,0,0,0,0.000,0.000,0.000,0.000,0.000,0.000,0.000,0.000"
    );
    let last = "received_bytes,trace_percent,wait_percent,encode_percent,send_percent,decode_percent,\
                idle_tail_percent,scene_percent,latency_ms";
    assert!(lines[0].ends_with(last));
    assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
}
