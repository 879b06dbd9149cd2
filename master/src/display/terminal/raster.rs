//! Pictures of any size as the pixels of the terminal's cells: each pixel is the average of the part of the picture that it covers.

use super::cells::Rgb;

/// A picture: `width` x `height` pixels of three bytes, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: &'a [u8],
}

/// Part of a row or column of the picture that one pixel covers: a range of pixels with their weights, which are 1 inside and less
/// at both ends.
#[derive(Clone, Debug)]
struct Cover {
    first: usize,
    weights: Vec<f32>,
}

/// The picture in another size, `width` x `height`. Empty where either has no pixels, or the picture is incomplete.
pub(super) fn resized(picture: Picture<'_>, width: usize, height: usize) -> Vec<Rgb> {
    let complete = picture.rgb.len() == picture.width * picture.height * 3;
    if !complete || picture.rgb.is_empty() || width == 0 || height == 0 {
        return Vec::new();
    }
    let rgb = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
    if (picture.width, picture.height) == (width, height) {
        return picture.rgb.chunks_exact(3).map(rgb).collect();
    }
    let columns = covers(picture.width, width);
    let rows = covers(picture.height, height);
    let mut out = Vec::with_capacity(width * height);
    for row in &rows {
        for column in &columns {
            out.push(average(picture, column, row));
        }
    }
    out
}

/// The parts of `from` pixels that each of `to` pixels covers. Where the picture is enlarged, a pixel covers part of one or two.
fn covers(from: usize, to: usize) -> Vec<Cover> {
    let ratio = from as f64 / to as f64;
    let cover = |index: usize| {
        let (begin, end) = (index as f64 * ratio, (index + 1) as f64 * ratio);
        let first = (begin as usize).min(from - 1);
        let last = (end.ceil() as usize).clamp(first + 1, from);
        let weight = |pixel: usize| {
            let covered = end.min((pixel + 1) as f64) - begin.max(pixel as f64);
            (covered.max(0.0) / ratio) as f32
        };
        Cover { first, weights: (first..last).map(weight).collect() }
    };
    (0..to).map(cover).collect()
}

fn average(picture: Picture<'_>, column: &Cover, row: &Cover) -> Rgb {
    let mut sum = [0.0_f32; 3];
    for (y, weight_y) in (row.first..).zip(&row.weights) {
        let start = (y * picture.width + column.first) * 3;
        let pixels = picture.rgb.get(start..).unwrap_or_default().chunks_exact(3);
        for (pixel, weight_x) in pixels.zip(&column.weights) {
            let weight = weight_x * weight_y;
            sum.iter_mut().zip(pixel).for_each(|(sum, part)| *sum += weight * f32::from(*part));
        }
    }
    sum.map(|part| (part + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_the_average_of_what_it_covers() {
        let rgb: Vec<u8> = [0, 100, 200, 40].into_iter().flat_map(|v| [v, v, v]).collect();
        let picture = Picture { width: 4, height: 1, rgb: &rgb };
        assert_eq!(resized(picture, 2, 1), [[50; 3], [120; 3]]);
        assert_eq!(resized(picture, 1, 1), [[85; 3]]);
        assert_eq!(resized(picture, 4, 1), [[0; 3], [100; 3], [200; 3], [40; 3]]);
        // 4 pixels to 3: each covers 1 1/3 of them.
        assert_eq!(resized(picture, 3, 1), [[25; 3], [150; 3], [80; 3]]);
        // Enlarged.
        assert_eq!(resized(picture, 8, 2)[..4], [[0; 3], [0; 3], [100; 3], [100; 3]]);
    }

    #[test]
    fn incomplete_pictures_and_empty_areas_have_no_pixels() {
        let picture = Picture { width: 2, height: 2, rgb: &[0; 11] };
        assert!(resized(picture, 2, 2).is_empty());
        assert!(resized(Picture { width: 0, height: 0, rgb: &[] }, 2, 2).is_empty());
        assert!(resized(Picture { width: 1, height: 1, rgb: &[0; 3] }, 0, 2).is_empty());
    }
}
