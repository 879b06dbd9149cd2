//! Surface points of objects that move: found at rest, and taken to the pose at the time of the ray.

use glam::DVec3;

use super::{SHADOW_BIAS, SurfaceBlock, Surfaces};
use crate::frame::Pose;
use crate::simd::{Lanes, three};

impl Surfaces {
    /// Takes the point of a lane from the rest of its object to a pose. The rounding of the new point adds to the bias.
    pub(crate) fn take_to(&mut self, block: usize, lane: usize, pose: &Pose) {
        let surface = &mut self.blocks[block];
        let SurfaceBlock { point, ng, ns, to_viewer, bias, .. } = surface;
        let moved = pose.point_from_rest(vector(point, lane));
        put(point, lane, moved);
        for normals in [ng, ns, to_viewer] {
            let normal = pose.normal_from_rest(vector(normals, lane));
            put(normals, lane, normal);
        }
        bias.0[lane] += moved.abs().max_element() as f32 * SHADOW_BIAS;
    }
}

fn vector(lanes: &[Lanes; 3], lane: usize) -> DVec3 {
    DVec3::from_array(three!(axis => f64::from(lanes[axis].0[lane])))
}

fn put(lanes: &mut [Lanes; 3], lane: usize, vector: DVec3) {
    for axis in 0..3 {
        lanes[axis].0[lane] = vector[axis] as f32;
    }
}
