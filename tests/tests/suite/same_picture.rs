//! Tests of the same picture: number of workers, threads and policies change no byte.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use rayfarm_tests::{Running, Scenes, free_port, master, shared, worker};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{ColorDepth, FrameView, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

fn render(scene: &Path, output: &Path, more: &[&str]) -> serde_json::Value {
    let mut command: Command = master();
    command
        .arg("render")
        .arg(scene)
        .arg("-o")
        .arg(output)
        .args(["--json", "--listen", "127.0.0.1:0"])
        .args(more);
    let outcome = Running::start(&mut command).finish().expect_success();
    let mut lines = outcome.stdout.lines();
    let report = serde_json::from_str(lines.next().unwrap()).unwrap();
    assert_eq!(lines.next(), None, "standard output has one line");
    report
}

/// Renders a scene in this process, without the farm.
fn traced(scene: &Path) -> RgbImage {
    traced_at(scene, |_| {})
}

/// Renders a scene in this process with a changed view.
fn traced_at(scene: &Path, change: impl FnOnce(&mut FrameView)) -> RgbImage {
    let loaded = load(scene).unwrap();
    let mut view = FrameView::of(&loaded.scene);
    change(&mut view);
    let compiled = Arc::new(CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures).unwrap());
    let mut image = RgbImage::new(view.width, view.height);
    render_rows(&PreparedFrame::new(compiled, &view).unwrap(), 0..view.height, &mut image.pixels, &|| false)
        .unwrap();
    image
}

#[test]
fn one_two_and_three_workers_render_the_bytes_of_the_tracer() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    let expected = traced(&scene);
    for workers in ["1", "2", "3"] {
        let name = format!("by-{workers}.png");
        let report = render(
            &scene,
            &scenes.path(&name),
            &["--local-workers", workers, "--wait-for-workers", workers, "--threads", "1"],
        );
        let image = rayfarm_tracer::image::load(&scenes.path(&name)).unwrap();
        assert!(image == expected, "{workers} workers");
        assert_eq!(report["workers"], workers.parse::<u32>().unwrap());
        assert_eq!(report["blake3"], blake3::hash(&expected.pixels).to_string());
        assert_eq!(report["rays_per_frame"]["primary"], 160 * 120);
    }
    assert_eq!(scenes.read("by-1.png"), scenes.read("by-2.png"));
    assert_eq!(scenes.read("by-1.png"), scenes.read("by-3.png"));
}

#[test]
fn every_policy_and_segment_size_renders_the_same_bytes() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    let expected = traced(&scene);
    for segment in ["static:1", "static:7", "static:1000", "smart:16", "smart:3", "adaptive"] {
        let output = scenes.path("picture.ppm");
        render(&scene, &output, &["--segment", segment, "--local-workers", "2", "--threads", "2"]);
        assert!(rayfarm_tracer::image::load(&output).unwrap() == expected, "{segment}");
    }
}

/// A mirror floor with glass, and lamps with soft shadows: by one worker, and by two with another policy.
#[test]
fn bounces_and_soft_shadows_are_the_same_bytes_by_one_and_two_workers() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
    let scenes = Scenes::new();
    for name in ["showroom.toml", "room-soft.toml"] {
        let scene = models.join(name);
        let expected = traced_at(&scene, |view| (view.width, view.height, view.samples) = (64, 48, 1));
        let digest = blake3::hash(&expected.pixels).to_string();
        let picture = |file: &str, workers: &str, more: &[&str]| {
            let size = ["--size", "64x48", "--samples", "1", "--threads", "1"];
            let workers = ["--local-workers", workers, "--wait-for-workers", workers];
            let output = scenes.path(file);
            let report = render(&scene, &output, &[&size[..], &workers, more].concat());
            (report, rayfarm_tracer::image::load(&output).unwrap())
        };
        let (one, by_one) = picture("one.png", "1", &["--segment", "static:48"]);
        let (two, by_two) = picture("two.png", "2", &["--segment", "static:5"]);
        assert!(by_one == expected && by_two == expected, "{name}");
        for report in [&one, &two] {
            assert_eq!(report["blake3"], digest, "{name}");
            assert_eq!(report["rays_per_frame"]["secondary"], one["rays_per_frame"]["secondary"], "{name}");
        }
        let bounces = one["rays_per_frame"]["secondary"].as_u64().unwrap() > 0;
        assert_eq!(bounces, name == "showroom.toml", "{name}");
        assert_eq!((&one["workers"], &two["workers"]), (&1.into(), &2.into()), "{name}");
    }
}

#[test]
fn compressed_pixels_are_the_same_pixels_in_fewer_bytes() {
    let scenes = Scenes::new();
    let expected = traced(&scenes.path("small.toml"));
    assert_segments_shrink(&scenes, &[], &expected, 3);
}

#[test]
fn reduced_colors_take_two_bytes_per_pixel_without_loss() {
    let scenes = Scenes::new();
    let expected = traced_at(&scenes.path("small.toml"), |view| view.quality.colors = ColorDepth::Reduced);
    assert_segments_shrink(&scenes, &["--colors", "reduced"], &expected, 2);
}

/// Renders `small.toml` with raw and with compressed pixels: both are the expected picture, a raw pixel has `pixel_bytes`
/// bytes, and compressed ones have fewer. Compares segments, because the bytes of a whole frame include rows that a late lease
/// renders twice.
fn assert_segments_shrink(scenes: &Scenes, options: &[&str], expected: &RgbImage, pixel_bytes: u64) {
    let expected = blake3::hash(&expected.pixels).to_string();
    for pixels in ["raw", "lz4"] {
        let address = format!("127.0.0.1:{}", free_port());
        let mut command = worker();
        command.args(["--master", &address, "--threads", "2", "--pixels", pixels]);
        let _worker = Running::start(&mut command);
        let mut command = master();
        command.arg("render").arg(scenes.path("small.toml")).args([
            "-o",
            "none",
            "--json",
            "--no-local-workers",
        ]);
        command
            .args(["--listen", &address])
            .arg("--timeline")
            .arg(scenes.path("timeline.json"))
            .args(options);
        let outcome = Running::start(&mut command).finish().expect_success();
        let report: serde_json::Value = serde_json::from_str(outcome.stdout.trim()).unwrap();
        assert_eq!(report["blake3"], expected, "{pixels}");
        assert_eq!(report["quality"]["colors"] == "reduced", options.contains(&"reduced"), "{pixels}");
        let segments = segments(&scenes.read("timeline.json"));
        let raw_bytes = |rows: u64| rows * 160 * pixel_bytes;
        for &(rows, bytes) in &segments {
            let fits = if pixels == "raw" { bytes == raw_bytes(rows) } else { bytes <= raw_bytes(rows) };
            assert!(fits, "{pixels}: {bytes} bytes for {rows} rows");
        }
        let (rows, bytes) = segments.iter().fold((0, 0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
        assert_eq!(bytes < raw_bytes(rows), pixels == "lz4", "{pixels}: {bytes} bytes for {rows} rows");
    }
}

/// Rows and bytes of each segment in a timeline.
fn segments(timeline: &[u8]) -> Vec<(u64, u64)> {
    let timeline: serde_json::Value = serde_json::from_slice(timeline).unwrap();
    let events = timeline.as_array().or_else(|| timeline["traceEvents"].as_array()).unwrap();
    let segment = |event: &serde_json::Value| {
        let (first, last) = event["name"].as_str()?.strip_prefix("rows ")?.split_once(" to ")?;
        let rows = last.parse::<u64>().ok()? + 1 - first.parse::<u64>().ok()?;
        Some((rows, event["args"]["bytes"].as_u64()?))
    };
    let segments: Vec<_> = events.iter().filter_map(segment).collect();
    assert!(!segments.is_empty(), "no segment in {} events", events.len());
    segments
}

#[test]
fn knobs_of_the_scene_and_of_the_command_line_have_the_same_effect() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    let keys = "[render]\nshadows = false\nshading = \"diffuse\"\nexponent = \"fast\"\n";
    let text = String::from_utf8(scenes.read("small.toml")).unwrap().replace("[render]\n", keys);
    let reduced = scenes.write("reduced.toml", text);
    let expected = traced(&reduced);
    assert!(expected != traced(&scene));
    let options = ["--shadows", "off", "--shading", "diffuse", "--exponent", "fast"];
    for (scene, options) in [(&reduced, &[][..]), (&scene, &options)] {
        let report = render(scene, &scenes.path("a.png"), options);
        assert!(rayfarm_tracer::image::load(&scenes.path("a.png")).unwrap() == expected);
        assert_eq!(report["rays_per_frame"]["shadow"], 0);
        let quality = serde_json::json!({
            "adaptive": false, "shadows": false, "shading": "diffuse", "filter": null, "exponent": "fast", "colors": "exact", "scale": 1.0,
            "dither": false, "depth": 5, "min_contribution": 0.004, "shadow_samples": 16, "terminator": true
        });
        assert_eq!(report["quality"], quality);
    }
    render(&reduced, &scenes.path("b.png"), &["--shadows", "on", "--shading", "full", "--exponent", "exact"]);
    assert!(rayfarm_tracer::image::load(&scenes.path("b.png")).unwrap() == traced(&scene));
}

#[test]
fn a_smaller_scale_is_rendered_small_and_enlarged() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    for (scale, width, height) in [("1/2", 80, 60), ("3/4", 120, 90)] {
        let small = traced_at(&scene, |view| (view.width, view.height) = (width, height));
        let expected = rayfarm_tracer::image::resize(small, 160, 120).unwrap();
        let output = scenes.path("picture-%d.png");
        let report = render(&scene, &output, &["--scale", scale, "--frames", "3"]);
        for index in 0..3 {
            let picture = rayfarm_tracer::image::load(&scenes.path(&format!("picture-{index}.png"))).unwrap();
            assert!(picture == expected, "frame {index} at {scale}");
        }
        assert_eq!((&report["width"], &report["height"]), (&160.into(), &120.into()));
        assert_eq!(report["rays_per_frame"]["primary"], width * height);
        assert_eq!(report["blake3"], blake3::hash(&expected.pixels).to_string());
    }
}

#[test]
fn a_compiled_model_renders_like_its_source() {
    let scenes = Scenes::new();
    let (source, compiled) = (scenes.path("bumps.obj"), scenes.path("bumps.rfm"));
    let mut compile = master();
    compile.arg("compile").arg(&source).arg("-o").arg(&compiled);
    Running::start(&mut compile).finish().expect_success();
    let size = ["--size", "120x90"];
    let [a, b] = [(&source, "a.png"), (&compiled, "b.png")]
        .map(|(model, name)| render(model, &scenes.path(name), &size)["blake3"].clone());
    assert_eq!(a, b);
}

/// Writes a scene with a textured model, and single triangles with a repeated texture.
fn write_textured(scenes: &Scenes) -> PathBuf {
    for (name, side) in [("wood.png", 16), ("tile.png", 5)] {
        let pixels = (0..side * side * 3).map(|i: u32| (i.wrapping_mul(0x9e37_79b1) >> 24) as u8).collect();
        rayfarm_tracer::image::save(&scenes.path(name), &RgbImage { width: side, height: side, pixels })
            .unwrap();
    }
    scenes.write("wood.mtl", "newmtl wood\nKd 0.9 1 0.8\nmap_Kd wood.png\n");
    let head = "mtllib wood.mtl\nusemtl wood\nv -1 0 0\nv 1 0 0\nv 1 1.5 -0.3\nv -1 1.5 -0.3\n";
    scenes.write("sheet.obj", format!("{head}vt -0.5 0\nvt 2 0\nvt 2 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"));
    let triangle = |vertices: &str, uvs: &str| {
        format!("[[triangle]]\nvertices = [{vertices}]\nuvs = [{uvs}]\nmaterial = \"tile\"\n")
    };
    let floor = triangle("[-3, 0, 2], [3, 0, 2], [3, 0, -3]", "[0, 0], [6, 0], [6, 5]")
        + &triangle("[-3, 0, 2], [3, 0, -3], [-3, 0, -3]", "[0, 0], [6, 5], [0, 5]");
    let text = format!(
        "render = {{ width = 160, height = 120 }}\n[camera]\nposition = [0.5, 1.5, 4]\nlook_at = [0, 0.6, 0]\n\
         [[light]]\nkind = \"point\"\nposition = [2, 4, 3]\n\
         [material.tile]\ndiffuse = {{ texture = \"tile.png\", filter = \"nearest\" }}\n\
         [[model]]\nfile = \"sheet.obj\"\n{floor}"
    );
    scenes.write("textured.toml", text)
}

#[test]
fn workers_receive_the_textures_of_a_scene() {
    let scenes = Scenes::new();
    let scene = write_textured(&scenes);
    let loaded = load(&scene).unwrap();
    assert_eq!((loaded.textures.len(), loaded.warnings), (2, vec![]));
    let expected = traced(&scene);
    for workers in ["1", "2"] {
        let output = scenes.path("textured.png");
        let report = render(
            &scene,
            &output,
            &["--local-workers", workers, "--wait-for-workers", workers, "--threads", "1"],
        );
        assert!(rayfarm_tracer::image::load(&output).unwrap() == expected, "{workers} workers");
        assert_eq!(report["workers"], workers.parse::<u32>().unwrap());
    }
    // The texture of the model is visible: without it the picture differs.
    scenes.write("wood.mtl", "newmtl wood\nKd 0.9 1 0.8\n");
    assert!(traced(&scene) != expected);
}

#[test]
fn a_compiled_model_in_another_folder_finds_its_textures() {
    let scenes = Scenes::new();
    write_textured(&scenes);
    std::fs::create_dir(scenes.path("compiled")).unwrap();
    let (source, compiled) = (scenes.path("sheet.obj"), scenes.path("compiled/sheet.rfm"));
    let mut compile = master();
    compile.arg("compile").arg(&source).arg("-o").arg(&compiled);
    Running::start(&mut compile).finish().expect_success();
    let pictures = [scenes.path("source.png"), scenes.path("compiled.png")];
    render(&source, &pictures[0], &[]);
    render(&compiled, &pictures[1], &["--allow-parent-textures"]);
    let [of_source, of_compiled] = pictures.map(|picture| rayfarm_tracer::image::load(&picture).unwrap());
    assert!(of_source == of_compiled && of_source == traced(&source));
}

#[test]
fn a_camera_move_costs_each_worker_less_than_a_kilobyte() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    let scene_bytes = |frames: &str| {
        let output = scenes.path("frame-%03d.ppm");
        let more = [
            "--frames",
            frames,
            "--orbit",
            "90",
            "--size",
            "40x30",
            "--local-workers",
            "2",
            "--wait-for-workers",
            "2",
        ];
        render(&scene, &output, &more)["scene_bytes"].as_u64().unwrap()
    };
    // The shorter run has enough frames for both workers to fetch the scene.
    let (few, many) = (scene_bytes("20"), scene_bytes("100"));
    // 80 more frames and two workers.
    let per_frame_and_worker = many.saturating_sub(few) / 160;
    assert!(per_frame_and_worker > 0 && per_frame_and_worker < 1024, "{per_frame_and_worker} bytes");
}

/// A bust of 99,938 triangles, where its mesh exists, compared with a reference picture.
#[test]
fn a_bust_of_99938_triangles_by_one_two_and_three_workers() {
    let Some(scene) = shared("workloads/w1.toml") else { return };
    let Some(reference) = shared("workloads/reference/w1.png") else { return };
    let scenes = Scenes::new();
    for workers in ["1", "2", "3"] {
        let name = format!("bust-by-{workers}.png");
        render(&scene, &scenes.path(&name), &["--local-workers", workers, "--wait-for-workers", workers]);
        assert!(scenes.read(&name) == scenes.read("bust-by-1.png"), "{workers} workers");
    }
    let picture = rayfarm_tracer::image::load(&scenes.path("bust-by-1.png")).unwrap();
    let reference = rayfarm_tracer::image::load(&reference).unwrap();
    let off = (picture.pixels.chunks_exact(3).zip(reference.pixels.chunks_exact(3)))
        .filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 2))
        .count();
    // The reference is of an independent tracer in single precision. Pixels at silhouettes and shadow edges differ.
    assert!(off < 400, "{off} of 786432 pixels differ from the reference picture");
}
