//! What is at the hits of a tile: points, normals, materials.

use glam::{DMat3, DVec3, Vec3};

use crate::compile::Item;
use crate::frame::Instance;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, each_bit, mask_of, select, splat, three};
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
    /// In eye space.
    pub point: [[Lanes; 3]; BLOCKS],
    /// Geometric unit normals on the viewer's side.
    pub ng: [[Lanes; 3]; BLOCKS],
    /// Shading unit normals, on the same side as `ng`.
    pub ns: [[Lanes; 3]; BLOCKS],
    /// Unit vectors to the eye.
    pub to_viewer: [[Lanes; 3]; BLOCKS],
    /// How far to lift shadow rays along `ng`.
    pub lift: [Lanes; BLOCKS],
    /// Index into the scene's materials; lanes without a hit repeat one of the block.
    pub material: [[u32; LANES]; BLOCKS],
}

impl Surfaces {
    #[inline(always)]
    pub(super) fn of<S: Simd>(simd: S, tile: &EyeTile<'_>, visible: &Visible) -> Self {
        let nowhere = [[Lanes::ZERO; 3]; BLOCKS];
        let mut surfaces = Self {
            hit: [0; BLOCKS],
            point: nowhere,
            ng: nowhere,
            ns: nowhere,
            to_viewer: nowhere,
            lift: [Lanes::ZERO; BLOCKS],
            material: [[0; LANES]; BLOCKS],
        };
        for block in 0..BLOCKS {
            let items = &visible.item[block];
            let mut rest = tile.live[block]
                & (0..LANES).fold(0, |b, lane| b | u32::from(items[lane] != NOTHING) << lane);
            surfaces.hit[block] = rest;
            if rest == 0 {
                continue;
            }
            let first = rest.trailing_zeros() as usize;
            while rest != 0 {
                let item = items[rest.trailing_zeros() as usize];
                let lanes = each_bit(rest).fold(0, |b, lane| b | u32::from(items[lane] == item) << lane);
                rest &= !lanes;
                surfaces.fill(simd, tile, visible, block, item, lanes);
            }
            let material = surfaces.material[block][first];
            for lane in each_bit(0xffff & !surfaces.hit[block]) {
                surfaces.material[block][lane] = material;
            }
            let view = tile.directions(simd, block).normalize(simd);
            view.scale(splat(simd, -1.0)).store(&mut surfaces.to_viewer[block]);
        }
        surfaces
    }

    /// The lanes of a block that see one item.
    #[inline(always)]
    fn fill<S: Simd>(
        &mut self,
        simd: S,
        tile: &EyeTile<'_>,
        visible: &Visible,
        block: usize,
        item: u32,
        lanes: u32,
    ) {
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
        match frame.items.get(item) {
            Item::Sphere(index) => {
                let sphere = frame.spheres[index];
                let material = frame.scene().spheres[index].material;
                self.fill_analytic(tile, block, item, lanes, material, |point| sphere.normal(point));
            }
            Item::Triangle(index) => {
                let corners = frame.triangles[index].corners.map(|corner| corner.as_vec3().to_array());
                let corners = corners.map(|corner| corner.map(|c| Lanes([c; LANES])));
                for lane in each_bit(lanes) {
                    self.material[block][lane] = frame.scene().triangles[index].material;
                }
                self.fill_triangles(simd, tile, block, lanes, &Space::of_eye(tile), &corners, None);
            }
            Item::Model(index) => {
                let instance = &frame.instances[index];
                let slots = &frame.scene().models[index].materials;
                let (corners, normals) = self.gather(instance, slots, &visible.triangle[block], block, lanes);
                let space = Space::of_instance(tile, instance);
                self.fill_triangles(simd, tile, block, lanes, &space, &corners, normals.as_ref());
            }
        }
    }

    /// Corners, and for smooth models normals, of the triangles that lanes see.
    #[inline(always)]
    fn gather(
        &mut self,
        instance: &Instance,
        slots: &[u32],
        triangles: &[u32; LANES],
        block: usize,
        lanes: u32,
    ) -> ([[Lanes; 3]; 3], Option<[[Lanes; 3]; 3]>) {
        let mut corners = [[Lanes::ZERO; 3]; 3];
        let mut normals = instance.smooth.then_some([[Lanes::ZERO; 3]; 3]);
        for lane in each_bit(lanes) {
            let triangle = triangles[lane];
            // `CompiledScene::new` made sure that there is one per slot.
            self.material[block][lane] = slots[instance.mesh.slot(triangle) as usize];
            put(&mut corners, lane, instance.mesh.corners(triangle));
            if let Some(normals) = &mut normals {
                put(normals, lane, instance.mesh.corner_normals(triangle).unwrap_or_default());
            }
        }
        (corners, normals)
    }

    /// Points on the planes of triangles, by the planes' own equations; the rays are known to hit them.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "one call, split off so that both kinds of triangle share it"
    )]
    fn fill_triangles<S: Simd>(
        &mut self,
        simd: S,
        tile: &EyeTile<'_>,
        block: usize,
        lanes: u32,
        space: &Space,
        corners: &[[Lanes; 3]; 3],
        normals: Option<&[[Lanes; 3]; 3]>,
    ) {
        let [a, b, c] = three!(k => Vec3x16::load(simd, &corners[k]));
        let origin = Vec3x16::splat(simd, space.origin);
        let (x, y) = (tile.rays.x[block].load(simd), tile.rays.y[block].load(simd));
        let [center, right, down] = three!(i => Vec3x16::splat(simd, space.directions[i]));
        let direction = center.add(right.scale(x)).add(down.scale(y));
        let (ab, ac) = (b.sub(a), c.sub(a));
        let normal = ab.cross(ac);
        let normal = normal.scale(splat(simd, 1.0) / normal.size());
        let to_a = a.sub(origin);
        let t = normal.dot(to_a) / normal.dot(direction);
        let eye_direction = tile.directions(simd, block);
        let point = eye_direction.scale(t);
        let ng = normal.transform(simd, &space.normals).normalize(simd);
        let backwards = ng.dot(eye_direction).simd_gt(splat(simd, 0.0));
        let ng = Vec3x16(three!(i => select(backwards, -ng.0[i], ng.0[i])));
        let ns = match normals {
            None => ng,
            Some(normals) => {
                let at = direction.scale(t).sub(to_a);
                // Barycentric weights by areas, clamped: rounding must not leave the triangle.
                let full = ab.cross(ac);
                let whole = splat(simd, 1.0) / full.dot(full);
                let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
                let u = (at.cross(ac).dot(full) * whole).max_precise(zero).min_precise(one);
                let v = (ab.cross(at).dot(full) * whole).max_precise(zero).min_precise(one - u);
                let [na, nb, nc] = three!(k => Vec3x16::load(simd, &normals[k]));
                let blended = na.scale(one - u - v).add(nb.scale(u)).add(nc.scale(v));
                let smooth = blended.transform(simd, &space.normals).normalize(simd);
                let usable = smooth.dot(smooth).simd_gt(splat(simd, 0.5));
                let against = smooth.dot(ng).simd_lt(zero);
                Vec3x16(three!(i => {
                    let turned = select(against, -smooth.0[i], smooth.0[i]);
                    select(usable, turned, ng.0[i])
                }))
            }
        };
        let lift = (point.size() + splat(simd, space.reach)) * splat(simd, LIFT);
        let sound = bits(point.size().simd_le(splat(simd, f32::MAX)) & ng.dot(ng).simd_gt(splat(simd, 0.5)));
        let mask = mask_of(simd, lanes);
        for (new, old) in
            [(point, &mut self.point[block]), (ng, &mut self.ng[block]), (ns, &mut self.ns[block])]
        {
            let before = Vec3x16::load(simd, old);
            Vec3x16(three!(i => select(mask, new.0[i], before.0[i]))).store(old);
        }
        let lifted = select(mask, lift, self.lift[block].load(simd));
        self.lift[block].store(lifted);
        for lane in each_bit(lanes & !sound) {
            self.repair(tile, block, lane, space, a, ab, ac);
        }
    }

    /// A triangle too thin for single precision: once more in `f64`.
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "what the caller has at hand")]
    fn repair<S: Simd>(
        &mut self,
        tile: &EyeTile<'_>,
        block: usize,
        lane: usize,
        space: &Space,
        a: Vec3x16<S>,
        ab: Vec3x16<S>,
        ac: Vec3x16<S>,
    ) {
        let vector = |v: Vec3x16<S>| Vec3::from_array(v.0.map(|component| component[lane])).as_dvec3();
        let columns = space.normals.map(|column| Vec3::from_array(column).as_dvec3());
        let normal = DMat3::from_cols(columns[0], columns[1], columns[2]) * vector(ab).cross(vector(ac));
        let ray = tile.ray(block, lane);
        let ng = normal.normalize_or(-ray.direction.normalize());
        let ng = if ng.dot(ray.direction) > 0.0 { -ng } else { ng };
        // Without a plane to rely on, the first corner tells the distance.
        let depth = (vector(a) - Vec3::from_array(space.origin).as_dvec3()).length()
            / Vec3::from_array(space.directions[0]).as_dvec3().length();
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
            let t = tile.frame.hit_of(&ray, primitive, None).map_or(0.0, |hit| hit.t);
            let point = ray.direction * t;
            let ng = normal(point);
            let ng = if ng.dot(ray.direction) > 0.0 { -ng } else { ng };
            self.set(block, lane, point, ng);
            self.material[block][lane] = material;
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

fn put(lanes: &mut [[Lanes; 3]; 3], lane: usize, vectors: [Vec3; 3]) {
    for (lanes, vector) in lanes.iter_mut().zip(vectors) {
        for axis in 0..3 {
            lanes[axis].0[lane] = vector[axis];
        }
    }
}

/// The rays of a tile in the space of a mesh.
struct Space {
    /// Where they start.
    origin: [f32; 3],
    /// Through the tile's centre, and what a step right and a step down add.
    directions: [[f32; 3]; 3],
    /// Columns of the matrix that takes normals to eye space.
    normals: [[f32; 3]; 3],
    /// Largest coordinate that placed the mesh.
    reach: f32,
}

impl Space {
    fn of_eye(tile: &EyeTile<'_>) -> Self {
        let directions = tile.steps.map(|step| step.as_vec3().to_array());
        let normals = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis.to_array());
        Self { origin: [0.0; 3], directions, normals, reach: 0.0 }
    }

    fn of_instance(tile: &EyeTile<'_>, instance: &Instance) -> Self {
        let single = |v: DVec3| v.as_vec3().to_array();
        // Normals are normalised afterwards: their scale is free, and kept near one.
        let size = instance.normals.to_cols_array().into_iter().fold(0.0, |size: f64, n| size.max(n.abs()));
        Self {
            origin: single(instance.inverse * -instance.translation),
            directions: tile.steps.map(|step| single(instance.inverse * step)),
            normals: [0, 1, 2].map(|i| single(instance.normals.col(i) / size)),
            reach: instance.translation.abs().max_element() as f32,
        }
    }
}
