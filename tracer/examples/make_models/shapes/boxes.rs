//! Boxes: sharp, and with a bevel that catches the light.

use glam::DVec3;

use crate::generator::shape::Shape;

/// A box from `low` to `high`.
pub(crate) fn plain_box(low: DVec3, high: DVec3) -> Shape {
    let corner = |x: usize, y: usize, z: usize| {
        let ends = [low, high];
        DVec3::new(ends[x].x, ends[y].y, ends[z].z)
    };
    let mut solid = Shape::default();
    for side in [0, 1] {
        let turned = |quad: [DVec3; 4]| if side == 1 { quad } else { [quad[3], quad[2], quad[1], quad[0]] };
        solid.quad(turned([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(y, z)| corner(side, y, z))));
        solid.quad(turned([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(z, x)| corner(x, side, z))));
        solid.quad(turned([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| corner(x, y, side))));
    }
    solid.welded()
}

/// A box of `size` round the origin whose twelve edges are cut at 45 degrees, `bevel` wide on each side.
pub(crate) fn beveled_box(size: DVec3, bevel: f64) -> Shape {
    let half = size / 2.0;
    let mut solid = Shape::default();
    for corner in 0..8u32 {
        let outer = half * DVec3::from_array([0, 1, 2].map(|axis| sign(corner, axis)));
        for axis in 0..3 {
            let mut p = outer;
            for other in (0..3).filter(|&other| other != axis) {
                p[other] -= bevel * sign(corner, other);
            }
            solid.vertex(p);
        }
    }
    for axis in 0..3 {
        add_sides(&mut solid, axis);
        add_edges(&mut solid, axis);
    }
    (0..8).for_each(|corner| add_corner(&mut solid, corner));
    solid
}

fn sign(corner: u32, axis: usize) -> f64 {
    if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }
}

/// The vertex of `corner` that lies on the side across `axis`.
fn on_side(corner: u32, axis: usize) -> u32 {
    corner * 3 + axis as u32
}

fn add_sides(solid: &mut Shape, axis: usize) {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let low = [0, u, u | v, v].map(|corner| on_side(corner, axis));
    let high = [0, u, u | v, v].map(|corner| on_side(corner | 1 << axis, axis));
    solid.faces.push([low[3], low[2], low[1], low[0]]);
    solid.faces.push(high);
}

/// The four bevels that run along `axis`.
fn add_edges(solid: &mut Shape, axis: usize) {
    let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    for corner in [0, 1 << u_axis, 1 << v_axis, 1 << u_axis | 1 << v_axis] {
        let end = corner | 1 << axis;
        let quad =
            [on_side(corner, u_axis), on_side(corner, v_axis), on_side(end, v_axis), on_side(end, u_axis)];
        let outwards = sign(corner, u_axis) * sign(corner, v_axis) > 0.0;
        solid.faces.push(if outwards { quad } else { [quad[3], quad[2], quad[1], quad[0]] });
    }
}

fn add_corner(solid: &mut Shape, corner: u32) {
    let [x, y, z] = [0, 1, 2].map(|axis| on_side(corner, axis));
    let outwards = (0..3).map(|axis| sign(corner, axis)).product::<f64>() > 0.0;
    solid.faces.push(if outwards { [x, y, z, z] } else { [z, y, x, x] });
}
