//! What is at the hits of a tile: points, normals, materials.

use glam::DVec3;

use super::facet::Facets;
use super::group::{Group, ThreeVectors, barycentric, put};
use super::space::{Space, space_of};
use super::texel::{CornerUvs, Texels};
use super::tint::CornerColors;
use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};
use crate::mesh::CompiledMesh;
use crate::simd::math::to_unit;
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, mask_of, select, splat, three,
};
use crate::tile::BLOCKS;
use crate::tile::visible::{EyeTile, NOTHING, Visible};
use crate::trace::PrimitiveId;

/// How far a shadow ray is lifted off the surface that it leaves, relative to the largest coordinates that went into its
/// origin: four times the error of a point that went through a dozen `f32` operations.
const LIFT: f32 = 1.0 / (1 << 20) as f32;

/// Points of surfaces, lane by lane. Lanes without a hit hold anything.
pub(super) struct Surfaces {
    /// Bits of the lanes that hit something.
    pub hit: [u32; BLOCKS],
    /// Those of them that lights shine on.
    pub lit: [u32; BLOCKS],
    /// Bits of the lanes that see the front side. Only kept if a material of the scene emits light.
    pub front: [u32; BLOCKS],
    /// In eye space.
    pub point: [[Lanes; 3]; BLOCKS],
    /// Geometric unit normals on the viewer's side.
    pub ng: [[Lanes; 3]; BLOCKS],
    /// Shading unit normals, on the same side as `ng`. Only kept if a model of the scene is smooth: else they are `ng`.
    pub ns: [[Lanes; 3]; BLOCKS],
    /// Unit vectors to the eye. Only kept if a material of the scene is specular.
    pub to_viewer: [[Lanes; 3]; BLOCKS],
    /// How far to lift shadow rays along `ng`.
    pub lift: [Lanes; BLOCKS],
    /// Index into the scene's materials; in blocks with a hit, lanes without one repeat one of the others.
    pub material: [Indices; BLOCKS],
    /// What textures and vertices make of colours; only in scenes that have either.
    pub texels: Option<Box<Texels>>,
}

impl Surfaces {
    /// For [`Surfaces::find`] to fill.
    pub(super) fn empty(frame: &PreparedFrame) -> Self {
        let nowhere = [[Lanes::ZERO; 3]; BLOCKS];
        Self {
            hit: [0; BLOCKS],
            lit: [0; BLOCKS],
            front: [0; BLOCKS],
            point: nowhere,
            ng: nowhere,
            ns: nowhere,
            to_viewer: nowhere,
            lift: [Lanes::ZERO; BLOCKS],
            material: [Indices::ZERO; BLOCKS],
            texels: Texels::for_scene(frame),
        }
    }

    /// Finds what is at the hits of a tile.
    #[inline(always)]
    pub(super) fn find<S: Simd>(
        &mut self,
        simd: S,
        tile: &EyeTile<'_>,
        visible: &Visible,
        facets: &mut Facets,
    ) {
        facets.clear();
        let mut space = None;
        for block in 0..BLOCKS {
            let items = &visible.item[block];
            let mut rest = tile.live[block] & !items.equal(simd, NOTHING);
            self.hit[block] = rest;
            self.lit[block] = rest;
            facets.begin_block(block);
            if let Some(texels) = &mut self.texels {
                texels.clear(block);
            }
            while rest != 0 {
                let item = items.0[rest.trailing_zeros() as usize];
                let lanes = rest & items.equal(simd, item);
                rest &= !lanes;
                if !add_facets(simd, facets, tile, visible, block, item, lanes) {
                    let direction = tile.directions(simd, block);
                    let group = Group { tile, block, lanes, alone: lanes == self.hit[block], direction };
                    self.fill(simd, &group, visible, item, &mut space);
                }
            }
        }
        facets.find_planes(simd, tile);
        for block in 0..BLOCKS {
            if self.hit[block] == 0 {
                continue;
            }
            let direction = tile.directions(simd, block);
            facets.fill(simd, tile, block, direction, self);
            if self.hit[block] != 0xffff {
                let material = self.material[block].0[self.hit[block].trailing_zeros() as usize];
                self.material[block].put(simd, mask_of(simd, 0xffff & !self.hit[block]), material);
            }
            if tile.frame.features.specular {
                let backwards = splat(simd, -1.0) / direction.dot(direction).sqrt();
                direction.scale(backwards).store(&mut self.to_viewer[block]);
            }
        }
        if visible.tied != [0; BLOCKS] {
            self.lift_off_others(tile.frame, visible);
        }
    }

    /// Where surfaces coincide, shadow rays are lifted off all of them: these are apart by at most twice what one may be off, and the
    /// lifted point is off by as much again.
    #[cold]
    #[inline(never)]
    fn lift_off_others(&mut self, frame: &PreparedFrame, visible: &Visible) {
        let least = (4.0 * frame.coarsest) as f32;
        for block in 0..BLOCKS {
            for lane in each_bit(visible.tied[block]) {
                let lift = &mut self.lift[block].0[lane];
                *lift = lift.max(least);
            }
        }
    }

    /// The lanes of a block that see one item without facets. `space` is kept for the next block that sees it.
    #[inline(always)]
    fn fill<S: Simd>(
        &mut self,
        simd: S,
        group: &Group<'_, S>,
        visible: &Visible,
        item: u32,
        space: &mut Option<(u32, Space)>,
    ) {
        let &Group { tile, block, lanes, .. } = group;
        let frame = tile.frame;
        if item >= frame.items.first_plane() {
            let index = (item - frame.items.first_plane()) as usize;
            let normal = frame.planes[index].normal;
            return self.fill_analytic(
                tile,
                block,
                item,
                lanes,
                frame.scene().planes[index].material,
                |_| normal,
            );
        }
        let triangles = &visible.triangle[block];
        let (corners, normals, paint, space) = match frame.items.get(item) {
            Item::Sphere(index) => {
                let sphere = frame.spheres[index];
                let material = frame.scene().spheres[index].material;
                return self.fill_analytic(tile, block, item, lanes, material, |point| sphere.normal(point));
            }
            Item::Triangle(index) => {
                let corners = frame.triangles[index].corners;
                let corners = three!(k => Vec3x16::splat(simd, corners[k].as_vec3().to_array()));
                self.material[block].put(simd, mask_of(simd, lanes), frame.scene().triangles[index].material);
                let uvs = frame.scene().triangles[index].uvs.map(CornerUvs::splat);
                (corners, None, Paint { uvs, colors: None }, space_of(space, item, || Space::of_eye(tile)))
            }
            Item::Model(index) => {
                let instance = &frame.instances[index];
                let slots = &frame.scene().models[index].materials;
                let (corners, normals) = self.gather(simd, instance, slots, triangles, block, lanes);
                let (mesh, triangles) = (&instance.mesh, &triangles.0);
                let uvs = instance.textured.then(|| CornerUvs::gather(mesh, triangles, lanes));
                let colors = instance.colored.then(|| CornerColors::gather(mesh, triangles, lanes));
                (
                    corners,
                    normals,
                    Paint { uvs, colors },
                    space_of(space, item, || Space::of_instance(tile, instance)),
                )
            }
        };
        let sound = self.fill_triangles(simd, group, space, corners, normals, &paint);
        for lane in each_bit(lanes & !sound) {
            self.repair(tile, block, lane, item, triangles.0[lane]);
        }
    }

    /// Corners, and for smooth models normals, of the triangles that lanes see: triangle by triangle, because neighbours
    /// often see the same one.
    #[inline(always)]
    fn gather<S: Simd>(
        &mut self,
        simd: S,
        instance: &Instance,
        slots: &[u32],
        triangles: &Indices,
        block: usize,
        lanes: u32,
    ) -> (ThreeVectors<S>, Option<ThreeVectors<S>>) {
        let nothing = Vec3x16::splat(simd, [0.0; 3]);
        let (mut corners, mut normals) = ([nothing; 3], [nothing; 3]);
        let leaves = instance.mesh.blocks();
        let mut rest = lanes;
        while rest != 0 {
            let triangle = triangles.0[rest.trailing_zeros() as usize];
            let same = rest & triangles.equal(simd, triangle);
            rest &= !same;
            let mask = mask_of(simd, same);
            let leaf = &leaves[triangle as usize / WIDTH];
            put(simd, mask, leaf.corners(triangle as usize % WIDTH), &mut corners);
            if instance.smooth {
                put(simd, mask, instance.mesh.corner_normals(triangle).unwrap_or_default(), &mut normals);
            }
            if slots.len() > 1 {
                self.material[block].put(simd, mask, slot_of(&instance.mesh, slots, triangle));
            }
        }
        if let &[slot] = slots {
            self.material[block].put(simd, mask_of(simd, lanes), slot);
        }
        (corners, instance.smooth.then_some(normals))
    }

    /// Points on the planes of triangles, by the planes' own equations; the rays are known to hit them. Returns the bits of
    /// those that came out sound.
    #[inline(always)]
    fn fill_triangles<S: Simd>(
        &mut self,
        simd: S,
        group: &Group<'_, S>,
        space: &Space,
        [a, b, c]: ThreeVectors<S>,
        normals: Option<ThreeVectors<S>>,
        paint: &Paint,
    ) -> u32 {
        let &Group { tile, block, lanes, direction, .. } = group;
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let to_a = a.sub(Vec3x16::splat(simd, space.origin));
        let (ab, ac) = (b.sub(a), c.sub(a));
        let normal = ab.cross(ac);
        let normal = normal.scale(to_unit(simd, normal.size()));
        // The plane's normal in eye space meets the ray there as the normal in mesh space meets it here.
        let eye_normal = normal.transform(simd, &space.normals);
        let along = eye_normal.dot(direction);
        let t = normal.dot(to_a) * splat(simd, space.normals_scale) / along;
        let point = direction.scale(t);
        let length = eye_normal.dot(eye_normal).sqrt();
        let turned = one.copysign(-along) / length;
        let ng = eye_normal.scale(turned);
        let lift = self.put_plane(simd, group, point, ng, splat(simd, space.reach));
        if let Some(normals) = normals {
            let at = space.direction(simd, tile, block).scale(t).sub(to_a);
            let [u, v] = barycentric(simd, at, ab, ac);
            let [na, nb, nc] = normals;
            let blended = na.scale(one - u - v).add(nb.scale(u)).add(nc.scale(v));
            let smooth = blended.transform(simd, &space.normals).normalize(simd);
            let usable = smooth.dot(smooth).simd_gt(splat(simd, 0.5));
            let against = smooth.dot(ng).simd_lt(zero);
            let ns = Vec3x16(three!(i => {
                let turned = select(against, -smooth.0[i], smooth.0[i]);
                select(usable, turned, ng.0[i])
            }));
            group.keep(simd, ns, &mut self.ns[block]);
        } else if tile.frame.features.smooth {
            group.keep(simd, ng, &mut self.ns[block]);
        }
        if tile.frame.features.emissive {
            self.face(block, lanes, bits(along.simd_lt(zero)));
        }
        if let (Paint { uvs: Some(_), .. } | Paint { colors: Some(_), .. }, Some(texels)) =
            (paint, &mut self.texels)
        {
            let at = space.direction(simd, tile, block).scale(t).sub(to_a);
            let weights = barycentric(simd, at, ab, ac);
            let materials = &self.material[block];
            if let Some(uvs) = &paint.uvs {
                texels.fill(tile.frame, block, lanes, materials, &uvs.at(simd, weights));
            }
            if let Some(colors) = &paint.colors {
                texels.tint(simd, tile.frame, block, lanes, materials, colors.at(simd, weights));
            }
        }
        bits(lift.simd_le(splat(simd, f32::MAX)) & turned.abs().simd_le(splat(simd, f32::MAX)))
    }

    /// Keeps which of some lanes see the front side.
    #[inline(always)]
    pub(super) fn face(&mut self, block: usize, lanes: u32, front: u32) {
        self.front[block] = (self.front[block] & !lanes) | (front & lanes);
    }

    /// Keeps points on planes with their normals. Returns how far shadow rays are lifted off them.
    #[inline(always)]
    pub(super) fn put_plane<S: Simd>(
        &mut self,
        simd: S,
        group: &Group<'_, S>,
        point: Vec3x16<S>,
        ng: Vec3x16<S>,
        reach: f32x16<S>,
    ) -> f32x16<S> {
        let lift = (point.size() + reach) * splat(simd, LIFT);
        group.keep(simd, point, &mut self.point[group.block]);
        group.keep(simd, ng, &mut self.ng[group.block]);
        group.keep_one(simd, lift, &mut self.lift[group.block]);
        lift
    }

    /// A triangle too thin for single precision: once more in `f64`.
    #[inline(never)]
    pub(super) fn repair(&mut self, tile: &EyeTile<'_>, block: usize, lane: usize, item: u32, triangle: u32) {
        let ([a, b, c], mirrored) = match tile.frame.items.get(item) {
            Item::Model(index) => {
                let instance = &tile.frame.instances[index];
                let corners = instance.mesh.corners(triangle);
                let placed = corners.map(|corner| instance.linear * corner.as_dvec3() + instance.translation);
                (placed, instance.linear.determinant() < 0.0)
            }
            Item::Triangle(index) => (tile.frame.triangles[index].corners, false),
            // Never too thin.
            Item::Sphere(_) => return,
        };
        let ray = tile.ray(block, lane);
        let ng = (b - a).cross(c - a).normalize_or(-ray.direction.normalize());
        let behind = ng.dot(ray.direction) > 0.0;
        let ng = if behind { -ng } else { ng };
        self.face(block, 1 << lane, u32::from(behind == mirrored) << lane);
        // Without a plane to rely on, the first corner tells the distance.
        let depth = a.length() / ray.direction.length();
        self.set(block, lane, ray.direction * depth, ng);
    }

    /// Spheres and planes: exactly, ray by ray.
    fn fill_analytic(
        &mut self,
        tile: &EyeTile<'_>,
        block: usize,
        item: u32,
        lanes: u32,
        material: u32,
        normal: impl Fn(DVec3) -> DVec3,
    ) {
        for lane in each_bit(lanes) {
            let ray = tile.ray(block, lane);
            let primitive = PrimitiveId { item, triangle: 0 };
            let t = tile.frame.t_of(&ray, primitive, None).unwrap_or(0.0);
            let point = ray.direction * t;
            let ng = normal(point);
            let behind = ng.dot(ray.direction) > 0.0;
            let ng = if behind { -ng } else { ng };
            self.face(block, 1 << lane, u32::from(!behind) << lane);
            self.set(block, lane, point, ng);
            self.material[block].0[lane] = material;
        }
    }

    fn set(&mut self, block: usize, lane: usize, point: DVec3, ng: DVec3) {
        for axis in 0..3 {
            self.point[block][axis].0[lane] = point[axis] as f32;
            self.ng[block][axis].0[lane] = ng[axis] as f32;
            self.ns[block][axis].0[lane] = ng[axis] as f32;
        }
        self.lift[block].0[lane] = point.abs().max_element() as f32 * LIFT;
    }
}

/// What corners of triangles carry beside normals.
struct Paint {
    uvs: Option<CornerUvs>,
    colors: Option<CornerColors>,
}

/// Notes the triangles that some lanes of a block see, if their item is flat and bare: else they want more than a plane.
#[inline(always)]
fn add_facets<S: Simd>(
    simd: S,
    facets: &mut Facets,
    tile: &EyeTile<'_>,
    visible: &Visible,
    block: usize,
    item: u32,
    lanes: u32,
) -> bool {
    let frame = tile.frame;
    if item >= frame.items.first_plane() {
        return false;
    }
    let triangles = &visible.triangle[block];
    match frame.items.get(item) {
        Item::Model(index) if frame.instances[index].is_bare() => {
            let slots = &frame.scene().models[index].materials;
            let mesh = &frame.instances[index].mesh;
            facets.add(simd, block, item, lanes, triangles, |triangle| match slots.as_slice() {
                &[slot] => slot,
                _ => slot_of(mesh, slots, triangle),
            });
            true
        }
        Item::Triangle(index) if frame.scene().triangles[index].uvs.is_none() => {
            let material = frame.scene().triangles[index].material;
            facets.add(simd, block, item, lanes, triangles, |_| material);
            true
        }
        Item::Model(_) | Item::Triangle(_) | Item::Sphere(_) => false,
    }
}

/// `CompiledScene::new` made sure that there is one per slot.
fn slot_of(mesh: &CompiledMesh, slots: &[u32], triangle: u32) -> u32 {
    slots[mesh.slot(triangle) as usize]
}
