//! Corners of faces: `v`, `v/vt`, `v//vn` or `v/vt/vn`. Negative numbers count back from the current line.

/// Index of an absent part of a corner.
pub(super) const NONE: u32 = u32::MAX;

/// Index of a part that no file can have.
const ABSENT: u32 = u32::MAX - 1;

/// A corner with its parts as indices, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Index of the `v`.
    pub(super) vertex: u32,
    /// Index of the `vt`, or [`NONE`]. It may be out of range.
    pub(super) uv: u32,
    /// Index of the `vn`, or [`NONE`].
    pub(super) normal: u32,
}

/// Parses a corner, given the `counts` of vertices, texture coordinates and normals before it.
///
/// # Errors
/// Numbers that are not whole; a vertex that cannot exist. Texture coordinates and normals are not checked.
pub(super) fn read(corner: &str, [vertices, uvs, normals]: [usize; 3]) -> Result<Corner, String> {
    let mut parts = corner.split('/');
    let vertex = parts.next().unwrap_or_default();
    let uv = parts.next().unwrap_or_default();
    let normal = parts.next().unwrap_or_default();
    let number = |text: &str| text.parse::<i64>().map_err(|_| expected_corner(corner));
    if parts.next().is_some() {
        return Err(expected_corner(corner));
    }
    let optional = |text: &str, count: usize| match text {
        "" => Ok(NONE),
        text => number(text).map(|number| index(number, count).map_or(ABSENT, clamped)),
    };
    let vertex = vertex_index(number(vertex)?, vertices, corner)?;
    Ok(Corner { vertex: clamped(vertex), uv: optional(uv, uvs)?, normal: optional(normal, normals)? })
}

/// A number as an index counted from 0, given `count` earlier items.
fn index(number: i64, count: usize) -> Option<usize> {
    let back = || usize::try_from(number.unsigned_abs()).ok();
    match number {
        0 => None,
        1.. => usize::try_from(number - 1).ok(),
        _ => count.checked_sub(back()?),
    }
}

fn vertex_index(number: i64, count: usize, corner: &str) -> Result<usize, String> {
    index(number, count).ok_or_else(|| match number {
        0 => format!("`{corner}`: there is no vertex 0; they are counted from 1"),
        1.. => expected_corner(corner),
        _ => {
            let back = number.unsigned_abs();
            format!("`{corner}` counts {back} back, but only {count} vertex lines come before this one")
        }
    })
}

/// Clamps indices that are too large for any file.
fn clamped(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(ABSENT).min(ABSENT)
}

/// The vertex number as written, if it is not counted back.
pub(super) fn vertex_number(corner: &str) -> Option<usize> {
    corner.split('/').next()?.parse().ok()
}

fn expected_corner(corner: &str) -> String {
    let corner: String = corner.chars().take(40).collect();
    format!(
        "`{corner}` is no corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn` was expected, all whole numbers"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_read_in_every_notation() {
        let counts = [10, 20, 30];
        let corner = |vertex, uv, normal| Ok(Corner { vertex, uv, normal });
        for (text, expected) in [
            ("3", corner(2, NONE, NONE)),
            ("3/4", corner(2, 3, NONE)),
            ("3//5", corner(2, NONE, 4)),
            ("3/4/5", corner(2, 3, 4)),
            ("-1/-1/-1", corner(9, 19, 29)),
            ("-10//", corner(0, NONE, NONE)),
            ("1/0/0", corner(0, ABSENT, ABSENT)),
            ("1/-21/-31", corner(0, ABSENT, ABSENT)),
            ("1/99999999999/99999999999", corner(0, ABSENT, ABSENT)),
        ] {
            assert_eq!(read(text, counts), expected, "{text}");
        }
        for text in ["", "/1", "x", "1.5", "1/x", "1//x", "1/1/1/1", "0", "-11", "99999999999999999999"] {
            assert!(read(text, counts).is_err(), "{text}");
        }
        assert_eq!((vertex_number("7/1"), vertex_number("-7")), (Some(7), None));
    }
}
