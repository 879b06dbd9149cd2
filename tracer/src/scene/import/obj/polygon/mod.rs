//! Polygons as triangles inside of them, whatever their shape: concave ones, holes that a bridge of two equal edges joins
//! to the outline, corners in one line or in one place, polygons that are not flat, outlines that cross themselves.
//!
//! The polygon is seen along its Newell normal, where its area is largest. A triangle of three neighbours is cut off where
//! it is inside ([`ears`]), so that the signed area of all triangles is that of the polygon in every case.

mod ears;
mod grid;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

use ears::Ears;

/// Convex polygons of up to this number of corners are fans around their first corner. Fans of more make slivers that
/// share a corner, which no tree can tell apart: larger ones are halved again and again.
const MOST_FANNED: usize = 8;

/// Error of a projected coordinate, as a share of the polygon's size.
const ROUNDING: f64 = 1e-15;

/// Share of the sum of areas that the Newell normal has at least, where the polygon has a side that can be looked at.
const LEAST_AREA: f64 = 1e-12;

/// Cuts a polygon of three corners or more into triangles, which name its corners. There is at least one.
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
        // All in one line, or two halves that cancel out.
        _ if points.len() <= MOST_FANNED => fan(points.len(), triangles),
        _ => halve(ring, triangles),
    }
    drop_without_area(points, first, triangles);
}

/// Corners that are not in the place of the corner before.
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

/// The polygon seen along its Newell normal, counterclockwise, scaled to about one. `None` where it has no area to be seen.
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
    // Along the normal onto the plane of the two other axes: what lies in such a plane stays as it is.
    let axis = normal.abs().max_position();
    let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (x, y) = (y, x);
    }
    let (along_x, along_y) = (normal[x] / normal[axis], normal[y] / normal[axis]);
    let seen = |p: &DVec3| DVec2::new(p[x] - p[axis] * along_x, p[y] - p[axis] * along_y);
    Some(near.iter().map(seen).collect())
}

/// Twice the area of a triangle, positive where it turns to the left, and zero where rounding might decide.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (to_b, to_c) = (b - a, c - a);
    let turn = to_b.perp_dot(to_c);
    let error = ROUNDING * (to_b.abs().element_sum() + to_c.abs().element_sum());
    if turn.abs() <= error { 0.0 } else { turn }
}

/// Whether all corners turn to the left.
fn is_convex(flat: &[DVec2]) -> bool {
    let n = flat.len();
    (0..n).all(|i| turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) > 0.0)
}

fn fan(corners: usize, triangles: &mut Vec<[u32; 3]>) {
    triangles.extend((2..corners as u32).map(|corner| [0, corner - 1, corner]));
}

/// Cuts off every second corner, until nothing is left.
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

/// Leaves out triangles without an area, which come of corners in one line; one of them stays where there is nothing else.
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
