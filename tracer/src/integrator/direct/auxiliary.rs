//! Pictures that show no light but a property of the surfaces, for other programs and for finding faults in scenes: see
//! [`Shading`].
//!
//! ```text
//!             colours                                            numbers
//!   normals   (n + 1) / 2                                        n
//!   depth     1 / (1 + d / s)                                    d in world units; infinite without a hit
//!   item      a bright colour for each item, by a hash           1 + the index of the item
//!   albedo    the diffuse colour                                 the same
//! ```
//!
//! n is the shading normal on the viewer's side, along the axes of the world; d the distance along the ray, s the distance from the
//! camera to its look_at. Colours are linear, and encoded as light is. Frames in [`PixelFormat::Linear`] have the numbers. Rays
//! without a hit are black, 0.

use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, HitBlock, SurfaceSource, TileColors};
use crate::scene::{PixelFormat, Shading};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, SimdFloat, dispatch, each_bit, f32x16, select, splat, three};
use crate::surface::{Materials, SurfaceBlock, Surfaces};

/// Colours the rays of a tile by what they hit. Dispatched again, and not inlined: few pictures use it.
#[inline(never)]
pub(super) fn shade<R: SurfaceSource>(
    rays: &R,
    hits: &[HitBlock; BLOCKS],
    surfaces: &Surfaces,
    colors: &mut TileColors,
) {
    dispatch!(rays.frame().level, simd => shade_with(simd, rays, hits, surfaces, colors));
}

/// The same on one level.
#[inline(always)]
fn shade_with<S: Simd, R: SurfaceSource>(
    simd: S,
    rays: &R,
    hits: &[HitBlock; BLOCKS],
    surfaces: &Surfaces,
    colors: &mut TileColors,
) {
    let frame = rays.frame();
    let shading = frame.view().quality.shading;
    let numbers = frame.pixel_format() == PixelFormat::Linear;
    let without_hit = if numbers && shading == Shading::Depth { f32::INFINITY } else { 0.0 };
    for block in 0..BLOCKS {
        let surface = &surfaces.blocks[block];
        let mut shown = [Lanes::ZERO; 3];
        if surface.hit != 0 {
            match shading {
                Shading::Full | Shading::Diffuse => {}
                Shading::Normals => {
                    let normals = normals(simd, frame, surface);
                    if numbers { normals } else { as_colors(simd, normals) }.store(&mut shown);
                }
                Shading::Depth => {
                    let relative = relative_distance(simd, rays, surface, block);
                    let depth =
                        if numbers { distance(simd, frame, relative) } else { nearness(simd, relative) };
                    Vec3x16([depth; 3]).store(&mut shown);
                }
                Shading::Item if numbers => shown = item_numbers(&hits[block], surface.hit),
                Shading::Item => shown = items(&hits[block], surface.hit),
                Shading::Albedo => {
                    Materials::gather(simd, frame.scene(), surfaces, block).diffuse.store(&mut shown);
                }
            }
        }
        for channel in &mut shown {
            for lane in each_bit(0xffff & !surface.hit) {
                channel.0[lane] = without_hit;
            }
        }
        colors[block] = shown;
    }
}

/// The normals of a block. Eye space has the axes of the world.
#[inline(always)]
fn normals<S: Simd>(simd: S, frame: &PreparedFrame, surface: &SurfaceBlock) -> Vec3x16<S> {
    let features = &frame.features;
    let is_tilted = features.smooth || features.normal_mapped;
    Vec3x16::load(simd, if is_tilted { &surface.ns } else { &surface.ng })
}

/// (n + 1) / 2 of normals.
#[inline(always)]
fn as_colors<S: Simd>(simd: S, normals: Vec3x16<S>) -> Vec3x16<S> {
    let (one, half) = (splat(simd, 1.0), splat(simd, 0.5));
    Vec3x16(three!(axis => (normals.0[axis] + one) * half))
}

/// d / s of the distances d of the points of a block from the origins of their rays. It may be infinite or NaN for points that are
/// infinitely far away in single precision.
#[inline(always)]
fn relative_distance<S: Simd, R: SurfaceSource>(
    simd: S,
    rays: &R,
    surface: &SurfaceBlock,
    block: usize,
) -> f32x16<S> {
    let points = Vec3x16::load(simd, &surface.point);
    let along = if R::COMMON_ORIGIN { points } else { points.sub(rays.origins(simd, block)) };
    let relative = along.scale(splat(simd, 1.0) / splat(simd, scale(rays.frame())));
    relative.dot(relative).sqrt()
}

/// 1 / (1 + d / s); 0 for points that are infinitely far away.
#[inline(always)]
fn nearness<S: Simd>(simd: S, relative: f32x16<S>) -> f32x16<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let nearness = one / (one + relative);
    // Comparisons with NaN are false.
    select(nearness.simd_ge(zero), nearness, zero)
}

/// d in world units; infinite for points that are infinitely far away.
#[inline(always)]
fn distance<S: Simd>(simd: S, frame: &PreparedFrame, relative: f32x16<S>) -> f32x16<S> {
    let world = f64::from(scale(frame)) / frame.per_unit;
    let distance = relative * splat(simd, (world as f32).clamp(f32::MIN_POSITIVE, f32::MAX));
    // Comparisons with NaN are false.
    select(distance.simd_ge(splat(simd, 0.0)), distance, splat(simd, f32::INFINITY))
}

/// Distance from the camera to the point that it looks at, in eye units.
fn scale(frame: &PreparedFrame) -> f32 {
    let camera = &frame.view().camera;
    let distance = (camera.look_at - camera.position).length() * frame.per_unit;
    (distance as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// 1 + the indices of the items of some lanes, exact up to 2^24.
fn item_numbers(hits: &HitBlock, lanes: u32) -> [Lanes; 3] {
    let mut numbers = Lanes::ZERO;
    for lane in each_bit(lanes) {
        numbers.0[lane] = hits.item.0[lane] as f32 + 1.0;
    }
    [numbers; 3]
}

/// Colours of the items of some lanes.
fn items(hits: &HitBlock, lanes: u32) -> [Lanes; 3] {
    let mut colors = [Lanes::ZERO; 3];
    for lane in each_bit(lanes) {
        let color = item_color(hits.item.0[lane]);
        for channel in 0..3 {
            colors[channel].0[lane] = color[channel];
        }
    }
    colors
}

/// The colour of an item: a hue by the golden ratio, so that neighbours in the list differ, with a brightness and a paleness by a
/// hash, the finaliser of MurmurHash3 (Appleby, 2011). The largest channel is at least 1/2.
fn item_color(item: u32) -> [f32; 3] {
    let hash = finalised(item.wrapping_add(1));
    // Multiples of the golden ratio, without their whole part, are spread evenly, however many there are.
    let hue = item.wrapping_mul(0x9e37_79b9) >> 8;
    let (brightness, paleness) = (0.5 + byte(hash) * 0.5, byte(hash >> 8) * 0.5);
    // A triangle wave for each channel, a third of the circle apart: one of them is 1, another one 0.
    let circle = hue as f32 / (1 << 24) as f32 * 6.0;
    let third = |shift: f32| {
        let at = if circle + shift >= 6.0 { circle + shift - 6.0 } else { circle + shift };
        ((at - 3.0).abs() - 1.0).clamp(0.0, 1.0)
    };
    [0.0, 4.0, 2.0].map(|shift| brightness * (paleness + (1.0 - paleness) * third(shift)))
}

fn byte(hash: u32) -> f32 {
    (hash & 0xff) as f32 / 255.0
}

fn finalised(index: u32) -> u32 {
    let hash = (index ^ index >> 16).wrapping_mul(0x85eb_ca6b);
    let hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::Arc;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::compile::CompiledScene;
    use crate::frame::Basis;
    use crate::integrator::render_rows;
    use crate::scene::{
        Attenuation, Background, Camera, CameraKind, FrameView, Light, LightKind, Material, Plane, Quality,
        RenderSettings, Scene, Sphere,
    };
    use crate::{simd, srgb};

    const SIDE: u32 = 40;
    const COLORS: [Vec3; 2] = [Vec3::new(0.8, 0.4, 0.2), Vec3::new(0.1, 0.6, 0.3)];

    /// A ball with a radius of 1 on a mirror at y = -1, in front of a bright background, with every length times `scale`.
    fn scene(scale: f64) -> Scene {
        let material =
            |diffuse, reflect| Material { diffuse, reflect: Vec3::splat(reflect), ..Material::NEUTRAL };
        Scene {
            ambient: Vec3::ONE,
            render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
            camera: Camera {
                position: DVec3::new(0.5, 1.0, 4.0) * scale,
                look_at: DVec3::ZERO,
                up: DVec3::Y,
                fov: 50.0,
                zoom: 1.0,
                kind: CameraKind::PINHOLE,
            },
            background: Background::Color(Vec3::ONE),
            background_visible: true,
            lights: vec![Light {
                kind: LightKind::Point { position: DVec3::splat(5.0) * scale },
                color: Vec3::ONE,
                attenuation: Attenuation::None,
                shadows: true,
                radius: 0.0,
                shadow_samples: None,
            }],
            materials: vec![material(COLORS[0], 0.0), material(COLORS[1], 0.5)],
            textures: vec![],
            models: vec![],
            spheres: vec![Sphere {
                center: DVec3::ZERO,
                radius: scale,
                material: 0,
                inside_out: false,
                uv_rotate: DVec3::ZERO,
            }],
            planes: vec![Plane { point: DVec3::NEG_Y * scale, normal: DVec3::NEG_Y, material: 1, size: 1.0 }],
            triangles: vec![],
            disks: vec![],
            ..Scene::default()
        }
    }

    /// The picture of a kind, the same on all levels. No ray leaves a surface for it.
    fn rendered(scene: &Scene, shading: Shading) -> Vec<[u8; 3]> {
        let quality = Quality { shading, ..Quality::default() };
        let view = FrameView { quality, ..FrameView::of(scene) };
        let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
        let mut frame = PreparedFrame::new(compiled, &view).unwrap();
        let mut pictures = simd::all().into_iter().map(|level| {
            frame.level = level;
            let mut bytes = vec![0; (SIDE * SIDE * 3) as usize];
            let counts = render_rows(&frame, 0..SIDE, &mut bytes, &|| false).unwrap();
            assert_eq!((counts.shadow, counts.secondary), (0, 0));
            bytes
        });
        let first = pictures.next().unwrap();
        pictures.for_each(|other| assert_eq!(other, first));
        first.as_chunks().0.to_vec()
    }

    /// The index of the surface in front of a pixel (0: ball, 1: mirror), its distance, and its normal on the viewer's side, by the
    /// formulas of a sphere and a plane.
    fn seen(scene: &Scene, pixel: usize) -> Option<(usize, f64, DVec3)> {
        let Camera { position, fov, .. } = scene.camera;
        let Basis { forward, right, up } = Basis::of(&scene.camera);
        let half = libm::tan(fov.to_radians() / 2.0);
        let place = |index: usize| ((index as f64 + 0.5) / f64::from(SIDE) * 2.0 - 1.0) * half;
        let (x, y) = (place(pixel % SIDE as usize), place(pixel / SIDE as usize));
        let ray = (forward + right * x - up * y).normalize();
        let along = position.dot(ray);
        let inside = along * along - position.length_squared() + 1.0;
        if inside > 0.0 {
            let t = -along - inside.sqrt();
            return Some((0, t, position + ray * t));
        }
        let t = -(position.y + 1.0) / ray.y;
        (t > 0.0).then_some((1, t, DVec3::Y))
    }

    /// Asserts that each pixel of a picture is within a step of a colour by what is seen there, and black where nothing is.
    fn expect(shading: Shading, color: impl Fn(usize, f64, DVec3) -> Vec3) {
        let scene = scene(1.0);
        let mut seen_kinds = BTreeSet::new();
        for (pixel, found) in rendered(&scene, shading).into_iter().enumerate() {
            let what = seen(&scene, pixel);
            seen_kinds.insert(what.map(|(index, ..)| index));
            let expected = srgb::encode(what.map_or(Vec3::ZERO, |(index, t, n)| color(index, t, n)));
            let off = found.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
            assert!(off <= Some(1), "{shading:?}, pixel {pixel}: {found:?}, expected {expected:?}");
        }
        assert_eq!(seen_kinds.len(), 3, "ball, mirror and background are visible");
    }

    /// Asserts the numbers of a kind at each pixel of a linear picture.
    fn expect_numbers(shading: Shading, number: impl Fn(usize, f64, DVec3) -> DVec3, without_hit: f32) {
        let scene = scene(1.0);
        let quality = Quality { shading, ..Quality::default() };
        let view = FrameView { quality, format: PixelFormat::Linear, ..FrameView::of(&scene) };
        let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
        let frame = PreparedFrame::new(compiled, &view).unwrap();
        let mut bytes = vec![0; frame.row_bytes() * SIDE as usize];
        render_rows(&frame, 0..SIDE, &mut bytes, &|| false).unwrap();
        let numbers = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        for (index, found) in numbers.enumerate() {
            let (pixel, channel) = (index / 3, index % 3);
            match seen(&scene, pixel) {
                None => assert_eq!(found, without_hit, "{shading:?}, pixel {pixel}"),
                Some((index, t, n)) => {
                    let expected = number(index, t, n)[channel];
                    let off = (f64::from(found) - expected).abs();
                    assert!(off < 1e-4 * t, "{shading:?}, pixel {pixel}: {found}, expected {expected}");
                }
            }
        }
    }

    #[test]
    fn linear_pictures_have_numbers() {
        expect_numbers(Shading::Normals, |_, _, normal| normal, 0.0);
        expect_numbers(Shading::Depth, |_, distance, _| DVec3::splat(distance), f32::INFINITY);
        expect_numbers(Shading::Albedo, |index, _, _| COLORS[index].as_dvec3(), 0.0);
        expect_numbers(Shading::Item, |index, _, _| DVec3::splat(index as f64 + 1.0), 0.0);
    }

    #[test]
    fn normals_are_those_on_the_viewers_side_along_the_worlds_axes() {
        expect(Shading::Normals, |_, _, normal| ((normal + 1.0) / 2.0).as_vec3());
    }

    #[test]
    fn depth_falls_with_the_distance_along_the_ray() {
        let scale = DVec3::new(0.5, 1.0, 4.0).length();
        expect(Shading::Depth, |_, distance, _| Vec3::splat((1.0 / (1.0 + distance / scale)) as f32));
    }

    #[test]
    fn albedo_is_the_diffuse_colour() {
        expect(Shading::Albedo, |index, _, _| COLORS[index]);
    }

    #[test]
    fn each_item_has_a_colour() {
        let scene = scene(1.0);
        let mut colors: [BTreeSet<[u8; 3]>; 3] = Default::default();
        for (pixel, found) in rendered(&scene, Shading::Item).into_iter().enumerate() {
            colors[seen(&scene, pixel).map_or(2, |(index, ..)| index)].insert(found);
        }
        assert!(colors.iter().all(|colors| colors.len() == 1), "{colors:?}");
        assert!(colors[0] != colors[1] && colors[2] == BTreeSet::from([[0; 3]]), "{colors:?}");
    }

    #[test]
    fn pictures_do_not_depend_on_the_unit_of_length() {
        for shading in [Shading::Normals, Shading::Depth, Shading::Item, Shading::Albedo] {
            let expected = rendered(&scene(1.0), shading);
            for power in [-40, -3, 40] {
                assert!(
                    rendered(&scene(libm::exp2(power.into())), shading) == expected,
                    "{shading:?}, 2^{power}"
                );
            }
        }
    }

    #[test]
    fn points_out_of_range_are_infinitely_far_away() {
        let mut far = scene(1.0);
        far.spheres.clear();
        far.planes[0].point = DVec3::NEG_Y * 1e30;
        assert!(rendered(&far, Shading::Depth).iter().all(|pixel| *pixel == [0; 3]));
    }

    #[test]
    fn colours_of_items_are_bright_and_differ() {
        let encoded = |item| srgb::encode(Vec3::from(item_color(item)));
        let first: BTreeSet<[u8; 3]> = (0..256).map(encoded).collect();
        assert_eq!(first.len(), 256);
        for item in (0..10_000).chain([u32::MAX - 1, u32::MAX]) {
            let color = item_color(item);
            assert!(color.iter().all(|channel| (0.0..=1.0).contains(channel)), "{item}: {color:?}");
            assert!(color.iter().copied().fold(0.0, f32::max) >= 0.49, "{item}: {color:?}");
            // Neighbours in the list are far apart in at least one channel.
            let next = item_color(item.wrapping_add(1));
            let distance = color.iter().zip(next).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(distance > 0.25, "{item}: {color:?} and {next:?}");
        }
    }
}
