//! Directions to a cube map, by the light that comes from there: a face by its light, and a place on it.
//!
//! The faces +X, -X, +Y, -Y, +Z, -Z are those of OpenGL's table (OpenGL 4.6, table 8.19).

use std::sync::Arc;

use super::select::Choice;
use crate::texture::{Distribution, Texture};

/// Faces of a cube.
const FACES: usize = 6;

/// Selects directions to a cube map.
#[derive(Clone, Debug)]
pub(super) struct CubeTable {
    faces: [Arc<Texture>; FACES],
    choice: Choice,
    /// Integral of red, green and blue added over all directions.
    total: f64,
}

/// A direction of any length in the cube, and the probability density there over solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CubeDirection {
    pub direction: [f32; 3],
    pub density: f32,
}

impl CubeTable {
    /// The table of six faces; `None` if all are black.
    pub(super) fn new(faces: [&Arc<Texture>; FACES]) -> Option<Self> {
        let of_faces = faces.map(|face| face.face_light().map_or(0.0, Distribution::total));
        let choice = Choice::by_power(&of_faces);
        let total = of_faces.iter().sum();
        (!choice.is_empty()).then(|| Self { faces: faces.map(Arc::clone), choice, total })
    }

    /// Integral of red, green and blue added over all directions.
    pub(super) fn total(&self) -> f64 {
        self.total
    }

    /// The direction of two numbers in [0, 1): the first one selects the face as well.
    pub(super) fn sample(&self, [x, y]: [f32; 2]) -> Option<CubeDirection> {
        let (face, probability, rest) = self.choice.select_and_rescale(x);
        let place = self.faces[face as usize].face_light()?.place([rest, y]);
        let on_face = place.at.map(|along| along + along - 1.0);
        let density = probability * place.density * per_solid_angle(on_face);
        Some(CubeDirection { direction: direction_of(face as usize, on_face), density })
    }

    /// Density over solid angle of [`CubeTable::sample`] in a direction of any length.
    pub(super) fn density(&self, direction: [f32; 3]) -> f32 {
        let (face, on_face) = place_of(direction);
        let Some(light) = self.faces[face].face_light() else { return 0.0 };
        let place = on_face.map(|along| along * 0.5 + 0.5);
        self.choice.probability(face as u32) * light.density(place) * per_solid_angle(on_face)
    }
}

/// Density over solid angle where that over the unit square of a picture is 1: (1 + x^2 + y^2)^(3/2) / 4 at a place in [-1, 1] x
/// [-1, 1].
fn per_solid_angle([x, y]: [f32; 2]) -> f32 {
    let square = 1.0 + x * x + y * y;
    0.25 * square * square.sqrt()
}

/// The direction of a place on a face: x to the right and y upwards in its picture, both in [-1, 1].
fn direction_of(face: usize, [x, y]: [f32; 2]) -> [f32; 3] {
    match face {
        0 => [1.0, y, -x],
        1 => [-1.0, y, x],
        2 => [x, 1.0, -y],
        3 => [x, -1.0, y],
        4 => [x, y, 1.0],
        _ => [-x, y, -1.0],
    }
}

/// The face that a direction meets, and the place on it.
fn place_of([x, y, z]: [f32; 3]) -> (usize, [f32; 2]) {
    let [size_x, size_y, size_z] = [x.abs(), y.abs(), z.abs()];
    let (face, right, up, size) = if size_x >= size_y && size_x >= size_z {
        if x < 0.0 { (1, z, y, size_x) } else { (0, -z, y, size_x) }
    } else if size_y >= size_z {
        if y < 0.0 { (3, x, z, size_y) } else { (2, x, -z, size_y) }
    } else if z < 0.0 {
        (5, -x, y, size_z)
    } else {
        (4, x, y, size_z)
    };
    let size = if size > 0.0 { size } else { 1.0 };
    (face, [right / size, up / size])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::image::LinearImage;

    /// Faces with texels by face, column and row from the top.
    fn cube(side: u32, texel: impl Fn(usize, u32, u32) -> f32) -> [Arc<Texture>; FACES] {
        std::array::from_fn(|face| {
            let places = (0..side * side).map(|i| (i % side, i / side));
            let pixels = places.flat_map(|(x, y)| [texel(face, x, y); 3]).collect();
            Arc::new(Texture::linear(&LinearImage { width: side, height: side, pixels }).unwrap().0)
        })
    }

    fn table(faces: &[Arc<Texture>; FACES]) -> Option<CubeTable> {
        CubeTable::new(std::array::from_fn(|face| &faces[face]))
    }

    /// All different, with a sun on the face +Y, and a black face.
    fn varied() -> CubeTable {
        let texel = |face, x, y| match (face, x, y) {
            (3, ..) => 0.0,
            (2, 5, 2) => 300.0,
            _ => 0.2 + 0.1 * face as f32 + 0.05 * ((x * 7 + y * 3) % 11) as f32,
        };
        table(&cube(8, texel)).unwrap()
    }

    #[test]
    fn places_and_directions_are_inverse() {
        for face in 0..FACES {
            for place in [[0.0, 0.0], [0.5, -0.25], [-0.75, 0.875]] {
                let direction = direction_of(face, place);
                assert_eq!(place_of(direction), (face, place));
                assert_eq!(place_of(direction.map(|axis| axis * 4.0)), (face, place));
            }
        }
        assert_eq!(place_of([0.0; 3]), (0, [0.0, 0.0]));
    }

    #[test]
    fn samples_have_the_density_of_their_directions() {
        let table = varied();
        for i in 0..4096 {
            let at = [(i % 64) as f32 / 64.0 + 0.003, (i / 64) as f32 / 64.0 + 0.005];
            let CubeDirection { direction, density } = table.sample(at).unwrap();
            let found = table.density(direction);
            assert!(
                density > 0.0 && (found / density - 1.0).abs() < 1e-3,
                "{direction:?}: {found}, {density}"
            );
        }
    }

    #[test]
    fn densities_add_up_to_one_and_samples_follow_them() {
        let table = varied();
        const CELLS: usize = 8;
        let fine = 32;
        let mut expected = vec![0.0; FACES * CELLS * CELLS];
        let cell = |(face, place): (usize, [f32; 2])| {
            let [x, y] = place.map(|along| ((along + 1.0) / 2.0 * CELLS as f32) as usize);
            (face * CELLS + y.min(CELLS - 1)) * CELLS + x.min(CELLS - 1)
        };
        let along = |i: usize| (i as f32 + 0.5) / (CELLS * fine) as f32 * 2.0 - 1.0;
        for face in 0..FACES {
            for i in 0..(CELLS * fine).pow(2) {
                let place = [along(i % (CELLS * fine)), along(i / (CELLS * fine))];
                let area = (2.0 / (CELLS * fine) as f64).powi(2);
                let solid_angle = area / (4.0 * f64::from(per_solid_angle(place)));
                let density = f64::from(table.density(direction_of(face, place)));
                expected[cell((face, place))] += density * solid_angle;
            }
        }
        let sum: f64 = expected.iter().sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        let samples = 1 << 17;
        let mut counts = vec![0_u32; expected.len()];
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            (((word >> 22) ^ word) >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..samples {
            let at = [number(), number()];
            counts[cell(place_of(table.sample(at).unwrap().direction))] += 1;
        }
        let (mut chi_square, mut freedom) = (0.0, -1.0);
        for (count, expected) in counts.into_iter().zip(&expected) {
            if *expected > 1e-9 {
                let expected = expected * f64::from(samples);
                chi_square += (f64::from(count) - expected).powi(2) / expected;
                freedom += 1.0;
            } else {
                assert_eq!(count, 0);
            }
        }
        // Six standard deviations.
        assert!(chi_square < freedom + 6.0 * f64::sqrt(2.0 * freedom), "{chi_square}, {freedom}");
    }

    #[test]
    fn a_white_cube_is_sampled_evenly() {
        let table = table(&cube(1, |_, _, _| 1.0)).unwrap();
        assert!((table.total() / (12.0 * PI) - 1.0).abs() < 1e-5);
        for direction in [[1.0, 0.0, 0.0], [0.3, -0.9, 0.2], [-1.0, 0.99, 0.98], [0.1, 0.2, -0.5]] {
            let density = f64::from(table.density(direction)) * 4.0 * PI;
            // Constant in cells of which there are 32 along each side.
            assert!((density - 1.0).abs() < 0.07, "{density}");
        }
    }

    #[test]
    fn black_cubes_have_no_table_and_black_faces_no_samples() {
        assert!(table(&cube(4, |_, _, _| 0.0)).is_none());
        let table = table(&cube(4, |face, _, _| if face == 5 { 1.0 } else { 0.0 })).unwrap();
        for i in 0..100 {
            let found = table.sample([i as f32 / 100.0, 0.5]).unwrap();
            assert!(found.direction[2] == -1.0 && found.density > 0.0);
        }
        assert_eq!(table.density([0.0, 1.0, 0.0]), 0.0);
    }
}
