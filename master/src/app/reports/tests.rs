use rayfarm_farm::ViewRequest;
use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::scene::RenderScale;

use super::*;

fn ms(values: &[u64]) -> Vec<Duration> {
    values.iter().copied().map(Duration::from_millis).collect()
}

#[test]
fn the_order_of_frames_does_not_matter() {
    let expected = MsPerFrame { min: 1.0, median: 3.0, p95: 8.2, max: 9.0 };
    assert_eq!(MsPerFrame::of(&ms(&[9, 1, 3, 5, 2])), expected);
    assert_eq!(MsPerFrame::of(&ms(&[1, 2, 3, 5, 9])), expected);
    assert_eq!(MsPerFrame::of(&[]), MsPerFrame::default());
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
        quality: Knobs::of(full.setting()),
        denoised: false,
        workers: 1,
        threads: 2,
        triangles: 12,
        rays_per_frame: RaysPerFrame { primary: 12_288, shadow: 7, secondary: 9 },
        ms_per_frame: MsPerFrame { min: 1.5, median: 2.0, p95: 2.45, max: 2.5 },
        latency_ms: MsPerFrame::default(),
        bytes_per_frame: BytesPerFrame { sent: 100, received: 9_216 },
        scene_bytes: 4_096,
        accounting: AccountReport::default(),
        verification: None,
        film: None,
        blake3: "00ff".to_owned(),
    };
    assert_eq!(
        serde_json::to_string(&report).unwrap(),
        concat!(
            r#"{"frames":2,"skipped":1,"fps":12.5,"width":64,"height":48,"samples":4,"quality":"#,
            r#"{"scale":1.0,"adaptive":false,"shadows":true,"shadow_samples":16,"terminator":true,"shading":"full","depth":5,"#,
            r#""min_contribution":0.004,"filter":null,"exponent":"exact","colors":"exact","dither":false},"#,
            r#""workers":1,"threads":2,"triangles":12,"#,
            r#""rays_per_frame":{"primary":12288,"shadow":7,"secondary":9},"#,
            r#""ms_per_frame":{"min":1.5,"median":2.0,"p95":2.45,"max":2.5},"#,
            r#""latency_ms":{"min":0.0,"median":0.0,"p95":0.0,"max":0.0},"#,
            r#""bytes_per_frame":{"sent":100,"received":9216},"scene_bytes":4096,"#,
            r#""accounting":{"percent":{"trace":0.0,"wait":0.0,"encode":0.0,"send":0.0,"decode":0.0,"#,
            r#""idle_tail":0.0,"scene":0.0},"workers":[]},"blake3":"00ff"}"#,
        )
    );
    let denoised = serde_json::to_string(&RenderReport { denoised: true, ..report }).unwrap();
    assert!(denoised.contains(r#""dither":false},"denoised":true,"workers":1"#), "{denoised}");
}
