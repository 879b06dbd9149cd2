//! The project's own scenes compared with the oracle, from outside, from within, and with difficult lights: near a
//! surface, behind the camera, grazing, many. One pixel in N is compared, because the oracle tests all triangles for
//! each.

use std::ops::AddAssign;
use std::path::Path;
use std::sync::Arc;

use crate::common::{light, point};
use glam::DVec3;
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{Attenuation, Camera, FrameView, Light, LightKind, LoadedScene, Quality, load};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const WIDTH: u32 = 122;
const HEIGHT: u32 = 91;

fn loaded(name: &str) -> LoadedScene {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name)).unwrap()
}

/// Distance in pixels within which a pixel is at an edge: the oracle's colours there bracket the compared colour. Curved glass
/// and mirrors magnify the rounding of points and normals to `f32`.
const NEXT_TO: f64 = 1.0 / 128.0;

/// Numbers of compared pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Comparison {
    tested: usize,
    /// Those that differ from the oracle's by more than one step of a channel, and are at an edge.
    at_edges: usize,
    /// Those that differ elsewhere.
    wrong: usize,
}

impl AddAssign for Comparison {
    fn add_assign(&mut self, other: Self) {
        self.tested += other.tested;
        self.at_edges += other.at_edges;
        self.wrong += other.wrong;
    }
}

/// Compares every `step`th pixel with the oracle's.
fn compare(loaded: &LoadedScene, camera: &Camera, step: usize) -> Comparison {
    let scene = &loaded.scene;
    let (width, height, quality) = (WIDTH, HEIGHT, Quality::default());
    let view =
        FrameView { width, height, samples: 1, camera: *camera, spin: 0.0, quality, ..FrameView::default() };
    let (meshes, textures) = (loaded.meshes.iter().cloned(), loaded.textures.iter().cloned());
    let compiled = Arc::new(CompiledScene::new(scene.clone(), meshes, textures).unwrap());
    let frame = PreparedFrame::new(compiled, &view).unwrap();
    let mut pixels = vec![0; (WIDTH * HEIGHT * 3) as usize];
    render_rows(&frame, 0..HEIGHT, &mut pixels, &|| false).unwrap();
    let oracle = Oracle::new(scene, &loaded.meshes, &loaded.textures, &view).with_points_of_integrator();
    let mut counts = Comparison::default();
    for i in (0..WIDTH * HEIGHT).step_by(step) {
        let found = [0, 1, 2].map(|channel| pixels[i as usize * 3 + channel]);
        let (x, y) = (f64::from(i % WIDTH) + 0.5, f64::from(i / WIDTH) + 0.5);
        let expected = oracle.encoded_at(x, y);
        counts.tested += 1;
        if is_bracketed(found, &[expected]) {
            continue;
        }
        let around = (0..9).map(|k| (f64::from(k % 3 - 1) * NEXT_TO, f64::from(k / 3 - 1) * NEXT_TO));
        let around: Vec<[u8; 3]> = around.map(|(dx, dy)| oracle.encoded_at(x + dx, y + dy)).collect();
        if is_bracketed(found, &around) { counts.at_edges += 1 } else { counts.wrong += 1 }
    }
    counts
}

/// Whether each channel is between those of the colours, or within one step of them.
fn is_bracketed(found: [u8; 3], colors: &[[u8; 3]]) -> bool {
    (0..3).all(|channel| {
        let of = || colors.iter().map(|color| color[channel]);
        let (least, greatest) = (of().min().unwrap(), of().max().unwrap());
        (least.saturating_sub(1)..=greatest.saturating_add(1)).contains(&found[channel])
    })
}

/// The camera of the scene, one amid its objects, and one from the other side.
fn cameras(loaded: &LoadedScene) -> [Camera; 3] {
    let own = loaded.scene.camera;
    let towards = own.look_at - own.position;
    let up = own.up.normalize() * towards.length();
    let amid = Camera { position: own.look_at + up * 0.05, look_at: own.position, fov: 75.0, ..own };
    let opposite = Camera { position: own.look_at + towards * 0.8 + up * 0.3, ..own };
    [own, amid, opposite]
}

/// The point that the camera sees in the middle of its picture.
fn seen(loaded: &LoadedScene, camera: &Camera) -> DVec3 {
    let (meshes, textures) = (loaded.meshes.iter().cloned(), loaded.textures.iter().cloned());
    let compiled = Arc::new(CompiledScene::new(loaded.scene.clone(), meshes, textures).unwrap());
    let frame = PreparedFrame::new(compiled, &FrameView::of(&loaded.scene)).unwrap();
    let direction = camera.look_at - camera.position;
    let t = frame.closest_hit(camera.position, direction, f64::INFINITY).map_or(1.0, |hit| hit.t);
    camera.position + direction * t
}

/// Lights that are difficult for the shadows that `camera` sees.
fn hard_lights(loaded: &LoadedScene, camera: &Camera) -> Vec<(&'static str, Vec<Light>)> {
    let (eye, seen) = (camera.position, seen(loaded, camera));
    let to_eye = eye - seen;
    let side = to_eye.cross(camera.up).normalize() * to_eye.length();
    let at = |p: DVec3| light(point(p.x, p.y, p.z), 0.7, Attenuation::None);
    let sun = LightKind::Directional { direction: -(side + camera.up.normalize() * 0.03 * side.length()) };
    let spot = LightKind::Spot {
        position: eye + side * 0.5,
        direction: -to_eye - side * 0.5,
        beam_angle: 25.0,
        penumbra: 3.0,
    };
    let ring = |i: u32| {
        let (s, c) = libm::sincos(f64::from(i) * 0.7);
        at(seen + to_eye * 0.4 + side * (0.6 * c) + camera.up * (0.6 * s))
    };
    let dimmed = |light: Light| Light { color: light.color * 0.05, ..light };
    vec![
        ("amid", vec![at(seen + to_eye * 0.3)]),
        ("near a surface", vec![at(seen + to_eye * 1e-3), at(seen + to_eye * 0.02 + side * 0.05)]),
        ("at a surface, all but", vec![at(seen + to_eye * 1e-6)]),
        ("behind the camera", vec![at(eye + to_eye * 300.0 + side * 90.0)]),
        (
            "grazing, and a spot",
            vec![light(sun, 0.8, Attenuation::None), light(spot, 0.5, Attenuation::None)],
        ),
        ("twenty", (0..20).map(ring).map(dimmed).collect()),
    ]
}

/// Compares pictures of a scene. At most `wrong` pixels of all pictures may differ without an edge, and one in 200 at edges.
fn check(name: &str, step: usize, wrong: usize) {
    let mut loaded = loaded(name);
    let mut sum = Comparison::default();
    let mut found = Vec::new();
    let mut add = |what: String, counts: Comparison| {
        sum += counts;
        if counts.at_edges + counts.wrong > 0 {
            found.push(format!("{what}: {counts:?}"));
        }
    };
    for (index, camera) in cameras(&loaded).iter().enumerate() {
        add(format!("camera {index}"), compare(&loaded, camera, step));
    }
    let camera = loaded.scene.camera;
    for (what, lights) in hard_lights(&loaded, &camera) {
        loaded.scene.lights = lights;
        add(format!("lights {what}"), compare(&loaded, &camera, step));
    }
    assert!(sum.wrong <= wrong && sum.at_edges * 200 <= sum.tested, "{name}: {sum:?}, {found:?}");
}

#[test]
fn the_room_matches_the_oracle() {
    check("room.toml", 23, 0);
}

#[test]
fn the_lights_match_the_oracle() {
    check("lights.toml", 23, 0);
}

#[test]
fn the_textures_match_the_oracle() {
    check("textured.toml", 23, 0);
}

#[test]
fn the_instances_match_the_oracle() {
    check("instances.toml", 23, 0);
}

#[test]
fn the_product_matches_the_oracle() {
    check("product.toml", 23, 0);
}

#[test]
fn the_table_matches_the_oracle() {
    check("table.toml", 23, 0);
}

#[test]
fn the_showroom_matches_the_oracle() {
    // Two pixels of the light that is a millionth off a surface differ. Why is not known.
    check("showroom.toml", 23, 2);
}

#[test]
fn the_room_with_soft_shadows_matches_the_oracle() {
    check("room-soft.toml", 23, 0);
}
