//! Triangulation of polygons of any shape: concave ones, holes connected to the outline by a bridge of two equal
//! edges, collinear and coincident corners, non-planar polygons, self-intersecting outlines.
//!
//! The polygon is projected along its Newell normal, where its area is largest. Triangles of three adjacent corners
//! are cut off where they are inside ([`ears`]), so that the signed area of all triangles is always that of the
//! polygon.

mod ears;
mod grid;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

use ears::Ears;

/// Convex polygons of up to this number of corners are fans around their first corner. Larger fans have slivers with
/// a common corner, which no tree can separate: larger polygons are halved recursively.
const MOST_FANNED: usize = 8;

/// Error of a projected coordinate, as a share of the polygon's size.
const ROUNDING: f64 = 1e-15;

/// Least Newell normal, as a share of the sum of areas, of a polygon with a visible side.
const LEAST_AREA: f64 = 1e-12;

/// Triangulates a polygon of three corners or more. Triangles are indices of its corners; there is at least one.
pub(super) fn cut(points: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    let first = triangles.len();
    let ring = distinct(points);
    match projected(points) {
        Some(flat) if ring.len() > 3 => {
            if ring.len() == points.len() && ring.len() <= MOST_FANNED && is_convex(&flat) {
                fan(points.len(), triangles);
                return;
            }
            Ears::new(&flat, &ring).cut(triangles);
        }
        // Collinear, or two halves that cancel out.
        _ if points.len() <= MOST_FANNED => fan(points.len(), triangles),
        _ => halve(ring, triangles),
    }
    drop_without_area(points, first, triangles);
}

/// Corners that do not coincide with the previous corner.
fn distinct(points: &[DVec3]) -> Vec<u32> {
    let Some(mut last) = points.last() else { return Vec::new() };
    let mut ring = Vec::with_capacity(points.len());
    for (corner, point) in (0_u32..).zip(points) {
        if point != last {
            ring.push(corner);
        }
        last = point;
    }
    ring
}

/// The polygon projected along its Newell normal, counterclockwise, scaled to about one. `None` without a visible
/// area.
fn projected(points: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = *points.first()?;
    let size = points.iter().fold(DVec3::ZERO, |size, point| size.max((point - origin).abs())).max_element();
    let (_, exponent) = libm::frexp(size);
    // A power of two: it rounds nothing.
    let scale = libm::exp2(-f64::from(exponent));
    if !(size > 0.0 && scale.is_finite()) {
        return None;
    }
    let near: Vec<DVec3> = points.iter().map(|point| (point - origin) * scale).collect();
    let (mut normal, mut areas) = (DVec3::ZERO, 0.0);
    for (a, b) in near.iter().zip(near.iter().cycle().skip(1)) {
        normal += a.cross(*b);
        areas += a.cross(*b).length();
    }
    if !(normal.length() > LEAST_AREA * areas) {
        return None;
    }
    // Along the normal onto the plane of the two other axes, which leaves coordinates in such a plane unchanged.
    let axis = normal.abs().max_position();
    let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (x, y) = (y, x);
    }
    let (along_x, along_y) = (normal[x] / normal[axis], normal[y] / normal[axis]);
    let seen = |p: &DVec3| DVec2::new(p[x] - p[axis] * along_x, p[y] - p[axis] * along_y);
    Some(near.iter().map(seen).collect())
}

/// Twice the area of a triangle, positive for a left turn, and zero where rounding might decide.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (to_b, to_c) = (b - a, c - a);
    let turn = to_b.perp_dot(to_c);
    let error = ROUNDING * (to_b.abs().element_sum() + to_c.abs().element_sum());
    if turn.abs() <= error { 0.0 } else { turn }
}

/// Whether all corners are left turns.
fn is_convex(flat: &[DVec2]) -> bool {
    let n = flat.len();
    (0..n).all(|i| turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) > 0.0)
}

fn fan(corners: usize, triangles: &mut Vec<[u32; 3]>) {
    triangles.extend((2..corners as u32).map(|corner| [0, corner - 1, corner]));
}

/// Cuts off every second corner, repeatedly, until nothing is left.
fn halve(mut ring: Vec<u32>, triangles: &mut Vec<[u32; 3]>) {
    while ring.len() > 3 {
        let mut kept = Vec::with_capacity(ring.len() / 2 + 1);
        let mut pairs = ring.chunks_exact(2).peekable();
        let (first, rest) = (ring[0], ring.chunks_exact(2).remainder());
        while let Some(pair) = pairs.next() {
            let after = pairs.peek().map(|pair| pair[0]).or(rest.first().copied()).unwrap_or(first);
            triangles.push([pair[0], pair[1], after]);
            kept.push(pair[0]);
        }
        kept.extend(rest);
        ring = kept;
    }
    if let [a, b, c] = ring[..] {
        triangles.push([a, b, c]);
    }
}

/// Drops triangles without an area, which collinear corners cause; keeps one if there is no other.
fn drop_without_area(points: &[DVec3], first: usize, triangles: &mut Vec<[u32; 3]>) {
    let has_area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| points[corner as usize]);
        (b - a).cross(c - a) != DVec3::ZERO
    };
    let mut end = first;
    for i in first..triangles.len() {
        if has_area(&triangles[i]) {
            triangles[end] = triangles[i];
            end += 1;
        }
    }
    triangles.truncate(end);
    if end == first {
        triangles.push([0, 1, 2]);
    }
}
