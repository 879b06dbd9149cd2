//! Bodies of glass that touch.

use glam::{DVec3, Vec3};

use super::scenes::{Furnished, ball, glass, quad, room};
use crate::scene::{Material, Triangle};

/// The sides of a box, their fronts outside.
fn sides([low, high]: [DVec3; 2], material: u32) -> impl Iterator<Item = Triangle> {
    (0..6).flat_map(move |side| {
        let (axis, far) = (side / 2, side % 2 == 1);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |over_u: bool, over_v: bool| {
            let mut corner = low;
            for (axis, over) in [(axis, far), (u, over_u), (v, over_v)] {
                corner[axis] = if over { high[axis] } else { low[axis] };
            }
            corner
        };
        let [a, b, c, d] =
            [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
        quad(if far { [a, b, c, d] } else { [d, c, b, a] }, material)
    })
}

/// The room with three blocks of different glass, each of which shares parts of its sides with the others, and a ball on top. One of
/// the blocks touches the floor.
pub(super) fn touching_glass() -> Furnished {
    let mut scene = room();
    let first = scene.materials.len() as u32;
    scene.materials.extend([
        Material { ior: 1.5, ..glass(Vec3::new(0.9, 0.7, 0.6)) },
        Material { ior: 1.33, ..glass(Vec3::new(0.6, 0.8, 0.9)) },
        Material { ior: 1.8, ..glass(Vec3::ONE) },
    ]);
    let corner = DVec3::new;
    let blocks = [
        [corner(-0.9, -1.0, -0.4), corner(0.1, 0.0, 0.5)],
        [corner(0.1, -0.9, -0.4), corner(0.9, 0.0, 0.5)],
        [corner(-0.6, 0.0, -0.3), corner(0.7, 0.3, 0.4)],
    ];
    for (block, material) in blocks.into_iter().zip(first..) {
        scene.triangles.extend(sides(block, material));
    }
    scene.spheres.push(ball(corner(0.1, 0.6, 0.0), 0.3, first));
    Furnished { scene, meshes: Vec::new(), textures: Vec::new() }
}
