//! Surface points on triangles, lane by lane: with interpolated normals, texture coordinates and vertex colours.

use super::group::{Group, ThreeVectors, barycentric, put};
use super::space::{Space, space_of};
use super::terminator::SmoothPoints;
use super::uv::CornerUvs;
use super::vertex_color::CornerColors;
use super::{Surfaces, material_of};
use crate::bvh::WIDTH;
use crate::frame::Instance;
use crate::rays::{HitBlock, LocalRays, SurfaceSource};
use crate::simd::math::to_unit;
use crate::simd::vector::Vec3x16;
use crate::simd::{Indices, Simd, SimdBase, SimdFloat, bits, each_bit, mask_of, select, splat, three};

/// The corners of the triangles that lanes hit.
struct Corners<S: Simd> {
    places: ThreeVectors<S>,
    normals: Option<ThreeVectors<S>>,
    uvs: Option<CornerUvs>,
    colors: Option<CornerColors>,
}

impl Surfaces {
    /// Sets the points of lanes that hit a triangle of the scene file.
    #[inline(always)]
    pub(super) fn put_single_triangle<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
        item: u32,
        index: usize,
        space: &mut Option<(u32, Space<R>)>,
    ) {
        let frame = group.rays.frame();
        let corners = frame.triangles[index].corners;
        let places = three!(k => Vec3x16::splat(simd, corners[k].as_vec3().to_array()));
        let material = frame.scene().triangles[index].material;
        self.blocks[group.block].material.put(simd, mask_of(simd, group.lanes), material);
        let uvs = frame.scene().triangles[index].uvs.map(CornerUvs::splat);
        let space = space_of(space, item, || Space::of_eye(group.rays));
        let corners = Corners { places, normals: None, uvs, colors: None };
        self.put_triangles(simd, group, hits, item, space, &corners);
    }

    /// Sets the points of lanes that hit a model.
    #[inline(always)]
    pub(super) fn put_model<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
        item: u32,
        index: usize,
        space: &mut Option<(u32, Space<R>)>,
    ) {
        let frame = group.rays.frame();
        let instance = &frame.instances[index];
        let slots = &frame.scene().models[index].materials;
        let (places, normals) = self.gather(simd, group, instance, slots, &hits.triangle);
        let (mesh, triangles) = (&instance.mesh, &hits.triangle.0);
        let uvs = instance.textured.then(|| CornerUvs::gather(mesh, triangles, group.lanes));
        let colors = instance.colored.then(|| CornerColors::gather(mesh, triangles, group.lanes));
        let space = space_of(space, item, || Space::of_instance(group.rays, instance));
        self.put_triangles(simd, group, hits, item, space, &Corners { places, normals, uvs, colors });
    }

    /// Gathers corners, and for smooth models normals, of the triangles that lanes hit: triangle by triangle, because
    /// neighbours often hit the same one.
    #[inline(always)]
    fn gather<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        instance: &Instance,
        slots: &[u32],
        triangles: &Indices,
    ) -> (ThreeVectors<S>, Option<ThreeVectors<S>>) {
        let nothing = Vec3x16::splat(simd, [0.0; 3]);
        let (mut corners, mut normals) = ([nothing; 3], [nothing; 3]);
        let leaves = instance.mesh.blocks();
        let material = &mut self.blocks[group.block].material;
        let mut rest = group.lanes;
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
                material.put(simd, mask, material_of(&instance.mesh, slots, triangle));
            }
        }
        if let &[slot] = slots {
            material.put(simd, mask_of(simd, group.lanes), slot);
        }
        (corners, instance.smooth.then_some(normals))
    }

    /// Sets points on the planes of triangles, by the planes' own equations: the rays are known to hit them.
    #[inline(always)]
    fn put_triangles<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
        item: u32,
        space: &Space<R>,
        corners: &Corners<S>,
    ) {
        let &Group { rays, block, lanes, direction, .. } = group;
        let frame = rays.frame();
        let footprint = if corners.uvs.is_some() { self.footprint(group, hits) } else { None };
        let surface = &mut self.blocks[block];
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [a, b, c] = corners.places;
        let to_a = a.sub(space.rays.origins(simd, rays, block));
        let (ab, ac) = (b.sub(a), c.sub(a));
        let normal = ab.cross(ac);
        let normal = normal.scale(to_unit(simd, normal.size()));
        // n.d is the same in eye space and in mesh space, up to the scale of the normal.
        let eye_normal = normal.transform(simd, &space.normals);
        let along = eye_normal.dot(direction);
        let t = normal.dot(to_a) * splat(simd, space.normals_scale) / along;
        let point = rays.points(simd, block, direction, t);
        let length = eye_normal.dot(eye_normal).sqrt();
        let turned = one.copysign(-along) / length;
        let ng = eye_normal.scale(turned);
        let bias = surface.put_plane(simd, group, point, ng, splat(simd, space.reach));
        if let Some([na, nb, nc]) = corners.normals {
            let at = space.rays.directions(simd, rays, block).scale(t).sub(to_a);
            let [u, v] = barycentric(simd, at, ab, ac);
            let blended = na.scale(one - u - v).add(nb.scale(u)).add(nc.scale(v));
            let smooth = blended.transform(simd, &space.normals).normalize(simd);
            let usable = smooth.dot(smooth).simd_gt(splat(simd, 0.5));
            let against = smooth.dot(ng).simd_lt(zero);
            let ns = Vec3x16(three!(i => {
                let turned = select(against, -smooth.0[i], smooth.0[i]);
                select(usable, turned, ng.0[i])
            }));
            group.put(simd, ns, &mut surface.ns);
            if let Some(lifts) = &mut self.lifts {
                let normals = &[na, nb, nc];
                let points = SmoothPoints { at, ab, ac, weights: [u, v], normals, against, ng };
                lifts.put(simd, group, space, &points);
            }
        } else if frame.features.shaded_normals() {
            group.put(simd, ng, &mut surface.ns);
        }
        if frame.features.emissive {
            surface.set_front(lanes, bits(along.simd_lt(zero)));
        }
        if let (true, Some(texels)) = (corners.uvs.is_some() || corners.colors.is_some(), &mut self.texels) {
            let at = space.rays.directions(simd, rays, block).scale(t).sub(to_a);
            let weights = barycentric(simd, at, ab, ac);
            let materials = &surface.material;
            if let Some(uvs) = &corners.uvs {
                let uv = uvs.at(simd, weights, footprint);
                texels.fill(frame, block, lanes, materials, &uv);
            }
            if let Some(colors) = &corners.colors {
                texels.tint(simd, frame, block, lanes, materials, colors.at(simd, weights));
            }
        }
        let sound = bits(bias.simd_le(splat(simd, f32::MAX)) & turned.abs().simd_le(splat(simd, f32::MAX)));
        for lane in each_bit(lanes & !sound) {
            surface.repair(rays, block, lane, item, hits.triangle.0[lane]);
        }
    }
}
