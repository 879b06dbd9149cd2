//! Origins of shadow rays on smooth surfaces: points lifted to the surface that the interpolated normals describe.
//!
//! Interpolated normals light a triangle up to a place where its plane has turned away from the light. There the triangle is in the
//! shadow of its own mesh, and the edge of that shadow is a sawtooth of whole triangles. So shadow rays start on a smooth surface
//! above the triangle: at the mean, by barycentric weights, of the point's projections onto the planes through the corners across
//! their normals (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021). Of the shift only the part along the
//! geometric normal is used:
//!
//! ```text
//!   lift = sum_i w_i max(0, (v_i - p).n_i) (n_i . ng)      n_i on the side of the viewer
//!   full for ng.L <= 1/4, fading to 0 at ng.L = 1/2
//! ```
//!
//! A steeper light is not hidden by triangles that are turned by less than 30 degrees, and without the lift the shadows of things
//! that touch the surface stay where they are. The alternative is to fade the light out towards the plane of the triangle (Chiang,
//! Li and Burley, "Taming the Shadow Terminator", 2019). On coarse meshes that makes the triangles visible: on a sphere of 960
//! triangles the error of linear light is 0.009, against 0.005 without any remedy and 0.003, that of the normals themselves, with
//! this one.

use super::Surfaces;
use super::group::{Group, ThreeVectors};
use super::space::Space;
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, SurfaceSource};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, f32x16, mask32x16, select, splat};

/// Cosine ng.L from which on a shadow ray starts at the triangle itself.
const UNLIFTED: f32 = 0.5;

/// Full lift per cosine below [`UNLIFTED`].
const FADE: f32 = 4.0;

/// Lifts of the points of a tile, in eye units; 0 where normals are not interpolated.
pub(super) struct Lifts([Lanes; BLOCKS]);

/// Points on triangles with interpolated normals, in the space of their mesh.
pub(super) struct SmoothPoints<'a, S: Simd> {
    /// Relative to the first corner.
    pub at: Vec3x16<S>,
    pub ab: Vec3x16<S>,
    pub ac: Vec3x16<S>,
    /// Barycentric weights of the second and the third corner.
    pub weights: [f32x16<S>; 2],
    pub normals: &'a ThreeVectors<S>,
    /// Where the normals are on the back as the viewer sees it.
    pub against: mask32x16<S>,
    /// Geometric unit normals in eye space, on the side of the viewer.
    pub ng: Vec3x16<S>,
}

impl Lifts {
    /// Lifts for a frame; `None` if its shadows need none.
    pub(super) fn for_frame(frame: &PreparedFrame) -> Option<Box<Self>> {
        let features = &frame.features;
        let used = features.smooth && features.shadows && frame.view().quality.smooth_terminator;
        used.then(|| Box::new(Self([Lanes::ZERO; BLOCKS])))
    }

    /// Resets a block.
    pub(super) fn clear(&mut self, block: usize) {
        self.0[block] = Lanes::ZERO;
    }

    /// Sets the lifts of some lanes.
    #[inline(always)]
    pub(super) fn put<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        space: &Space<R>,
        points: &SmoothPoints<'_, S>,
    ) {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [u, v] = points.weights;
        let corners =
            [(one - u - v, points.at), (u, points.at.sub(points.ab)), (v, points.at.sub(points.ac))];
        let mut lift = zero;
        for (&normal, (weight, from_corner)) in points.normals.iter().zip(corners) {
            // n.d is the same in eye space and in mesh space, up to the scale of the normal.
            let height = normal.dot(from_corner) * splat(simd, space.normals_scale);
            let below = select(points.against, height, -height).max(zero);
            let normal = normal.transform(simd, &space.normals);
            let along = normal.dot(points.ng);
            let along = select(points.against, -along, along);
            lift += weight * below * along / normal.dot(normal);
        }
        // Not for NaN: a corner without a normal.
        let usable = lift.simd_gt(zero) & lift.simd_le(splat(simd, f32::MAX));
        group.put_one(simd, select(usable, lift, zero), &mut self.0[group.block]);
    }
}

impl Surfaces {
    /// Distances of the origins of shadow rays from the points of a block, along ng: to the side of the light, or onto the smooth
    /// surface. `along` is ng.L.
    #[inline(always)]
    pub(crate) fn to_shadow_origins<S: Simd>(&self, simd: S, block: usize, along: f32x16<S>) -> f32x16<S> {
        let zero = splat(simd, 0.0);
        let bias = self.blocks[block].bias.load(simd);
        let side = select(along.simd_lt(zero), -bias, bias);
        let Some(lifts) = &self.lifts else { return side };
        let lift = lifts.0[block].load(simd);
        let share = (splat(simd, UNLIFTED) - along) * splat(simd, FADE);
        let raised = bias + lift * share.min(splat(simd, 1.0)).max(zero);
        select(lift.simd_gt(zero), raised, side)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DMat3, DVec3, Vec3};

    use crate::compile::CompiledScene;
    use crate::frame::PreparedFrame;
    use crate::integrator::render_rows;
    use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
    use crate::scene::{
        Attenuation, Background, Camera, CameraKind, FrameView, Light, LightKind, Material, Model,
        NormalMode, Quality, RenderSettings, Scene,
    };
    use crate::simd;

    const SIDE: u32 = 64;

    /// A unit sphere of triangles, with 32 around and 16 from pole to pole.
    fn ball() -> Mesh {
        let (around, rows) = (32, 16);
        let place = |i: u32, j: u32| {
            let (across, down) = (f64::from(i) / f64::from(around), f64::from(j) / f64::from(rows));
            let (s, c) = libm::sincos(across * std::f64::consts::TAU);
            let (ring, height) = libm::sincos(down * std::f64::consts::PI);
            DVec3::new(ring * c, height, ring * s)
        };
        let positions: Vec<DVec3> = (0..=rows).flat_map(|j| (0..around).map(move |i| place(i, j))).collect();
        let at = |i: u32, j: u32| j * around + i % around;
        let quad = |(i, j): (u32, u32)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        };
        let triangles: Vec<[u32; 3]> =
            (0..rows).flat_map(|j| (0..around).map(move |i| (i, j))).flat_map(quad).collect();
        Mesh {
            normals: positions.iter().map(|position| position.as_vec3()).collect(),
            positions,
            triangle_materials: vec![0; triangles.len()],
            triangles,
            materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
            ..Mesh::default()
        }
    }

    fn scene(mesh: &CompiledMesh, normals: NormalMode, scale: DVec3) -> Scene {
        let model = Model {
            mesh: mesh.id(),
            materials: vec![0],
            normals,
            translate: DVec3::new(0.3, -0.2, 0.1),
            rotate: DVec3::new(10.0, 20.0, 30.0),
            scale,
            group: DMat3::IDENTITY,
        };
        Scene {
            ambient: Vec3::splat(0.05),
            render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
            camera: Camera {
                position: DVec3::new(0.0, 0.0, 6.0),
                look_at: DVec3::ZERO,
                up: DVec3::Y,
                fov: 35.0,
                zoom: 1.0,
                kind: CameraKind::PINHOLE,
            },
            background: Background::Color(Vec3::ZERO),
            background_visible: true,
            lights: vec![Light {
                kind: LightKind::Directional { direction: DVec3::new(-1.0, -0.3, 0.1).normalize() },
                color: Vec3::ONE,
                attenuation: Attenuation::None,
                shadows: true,
                radius: 0.0,
                shadow_samples: None,
            }],
            materials: vec![Material::NEUTRAL],
            textures: vec![],
            models: vec![model],
            spheres: vec![],
            disks: vec![],
            planes: vec![],
            triangles: vec![],
        }
    }

    fn rendered(scene: &Scene, mesh: &Arc<CompiledMesh>, quality: Quality) -> Vec<u8> {
        let compiled = Arc::new(CompiledScene::new(scene.clone(), [Arc::clone(mesh)], []).unwrap());
        let view = FrameView { quality, ..FrameView::of(scene) };
        let mut frame = PreparedFrame::new(compiled, &view).unwrap();
        let mut bytes_at = |level| {
            frame.level = level;
            let mut bytes = vec![0; (SIDE * SIDE * 3) as usize];
            render_rows(&frame, 0..SIDE, &mut bytes, &|| false).unwrap();
            bytes
        };
        let first = bytes_at(simd::best());
        for level in simd::all() {
            assert!(bytes_at(level) == first, "with {}", simd::name(level));
        }
        first
    }

    fn different(a: &[u8], b: &[u8]) -> usize {
        a.chunks_exact(3).zip(b.chunks_exact(3)).filter(|(a, b)| a != b).count()
    }

    /// Nothing shades a convex body but itself, and N.L does that: a picture without shadows is the right one.
    #[test]
    fn a_convex_mesh_alone_has_no_shadow_on_its_lit_side() {
        let mesh = Arc::new(CompiledMesh::compile(&ball()).unwrap().0);
        for scale in [DVec3::ONE, DVec3::new(1.0, 1.4, 0.7), DVec3::new(-1.0, 1.0, 1.2)] {
            let scene = scene(&mesh, NormalMode::Smooth, scale);
            let quality = Quality::default();
            let right = rendered(&scene, &mesh, Quality { shadows: false, ..quality });
            let smooth = rendered(&scene, &mesh, quality);
            assert_eq!(different(&smooth, &right), 0, "scale {scale}");
            let sawtooth = rendered(&scene, &mesh, Quality { smooth_terminator: false, ..quality });
            assert!(different(&sawtooth, &right) > 20, "the remedy is needed, scale {scale}");
        }
    }

    #[test]
    fn flat_normals_are_not_lifted() {
        let mesh = Arc::new(CompiledMesh::compile(&ball()).unwrap().0);
        let scene = scene(&mesh, NormalMode::Flat, DVec3::ONE);
        let quality = Quality::default();
        let off = rendered(&scene, &mesh, Quality { smooth_terminator: false, ..quality });
        assert_eq!(different(&rendered(&scene, &mesh, quality), &off), 0);
    }
}
