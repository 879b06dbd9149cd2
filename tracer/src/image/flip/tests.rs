//! FLIP compared with values that follow from the paper, and with those of its authors' program.

use proptest::prelude::*;

use super::super::RgbImage;
use super::{PIXELS_PER_DEGREE, flip};

fn picture(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
    let pixels =
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| color(x, y)).collect();
    RgbImage { width, height, pixels }
}

fn uniform(color: [u8; 3]) -> RgbImage {
    picture(9, 7, |_, _| color)
}

fn noise(width: u32, height: u32, seed: u32) -> RgbImage {
    picture(width, height, |x, y| {
        let mut state = seed.wrapping_add(x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b));
        [0; 3].map(|_: u8| {
            state = (state ^ (state >> 15)).wrapping_mul(0x2c1b_3c6d).wrapping_add(0x297a_2d39);
            (state >> 24) as u8
        })
    })
}

fn mean(a: &RgbImage, b: &RgbImage) -> f64 {
    flip(a, b, PIXELS_PER_DEGREE).unwrap().mean()
}

/// The error of one colour compared with another, in `f64`, from the equations: no filter changes a uniform picture,
/// and it has no features. The matrix is the standard's, to seven digits.
fn by_hand(a: [u8; 3], b: [u8; 3]) -> f64 {
    let xyz = |rgb: [f64; 3]| {
        [
            [0.412_390_8, 0.357_584_3, 0.180_480_8],
            [0.212_639_0, 0.715_168_7, 0.072_192_3],
            [0.019_330_8, 0.119_194_8, 0.950_532_2],
        ]
        .map(|row: [f64; 3]| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
    };
    let decode = |code: u8| {
        let v = f64::from(code) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    let hunt_lab = |rgb: [f64; 3]| {
        let white = xyz([1.0; 3]);
        let f = |t: f64| if t > 0.008_856_451_7 { t.powf(1.0 / 3.0) } else { 7.787_037 * t + 0.137_931_03 };
        let [x, y, z] = xyz(rgb);
        let (x, y, z) = (f(x / white[0]), f(y / white[1]), f(z / white[2]));
        let l = 116.0 * y - 16.0;
        [l, 5.0 * l * (x - y), 2.0 * l * (y - z)]
    };
    let distance =
        |a: [f64; 3], b: [f64; 3]| ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(0.7);
    let greatest = distance(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]));
    let share = distance(hunt_lab(a.map(decode)), hunt_lab(b.map(decode))) / greatest;
    if share < 0.4 { share * 0.95 / 0.4 } else { 0.95 + (share - 0.4) / 0.6 * 0.05 }
}

#[test]
fn equal_pictures_have_no_error_whatever_their_size() {
    for (width, height) in [(0, 0), (0, 5), (5, 0), (1, 1), (3, 150), (33, 17)] {
        let image = noise(width, height, 1);
        let map = flip(&image, &image, PIXELS_PER_DEGREE).unwrap();
        assert_eq!((map.width, map.height, map.errors.len()), (width, height, (width * height) as usize));
        assert!(map.errors.iter().all(|error| *error == 0.0));
    }
}

#[test]
fn green_for_blue_is_the_largest_error() {
    let error = mean(&uniform([0, 255, 0]), &uniform([0, 0, 255]));
    assert!((error - 1.0).abs() < 1e-4, "{error}");
}

/// Results of the authors' program (version 1.7 of the Python package flip-evaluator) for pictures that formulas
/// define.
#[test]
fn errors_match_the_authors_program() {
    let (width, height) = (96, 64);
    let original = |x: u32, y: u32| {
        [(5 * x + y) as u8, (3 * y + x * x / 16) as u8, ((x / 8 + y / 8) % 2 * 160 + 40) as u8]
    };
    let inverted = |x: u32, y: u32| original(x, y).map(|code| 255 - code);
    let in_disc = |x: u32, y: u32| x.abs_diff(48).pow(2) + y.abs_diff(32).pow(2) < 200;
    let reference = picture(width, height, original);
    let shifted = picture(width, height, |x, y| original(x.saturating_sub(1), y));
    let brighter = picture(width, height, |x, y| original(x, y).map(|code| code.saturating_add(24)));
    let disc = picture(width, height, |x, y| if in_disc(x, y) { [250, 128, 10] } else { original(x, y) });
    let all_inverted = picture(width, height, inverted);
    let dots =
        picture(width, height, |x, y| if x % 7 == 0 && y % 5 == 0 { inverted(x, y) } else { original(x, y) });
    // The mean at two distances; the pixel in the middle at the first of them.
    for (name, test, at_desk, at_30, middle) in [
        ("shifted", shifted, 0.259_837, 0.295_765, 0.277_287),
        ("brighter", brighter, 0.380_839, 0.377_408, 0.397_155),
        ("disc", disc, 0.120_907, 0.107_363, 0.985_049),
        ("inverted", all_inverted, 0.900_645, 0.931_245, 0.983_491),
        ("dots", dots, 0.129_878, 0.123_960, 0.121_634),
    ] {
        let map = flip(&reference, &test, PIXELS_PER_DEGREE).unwrap();
        let found = [
            map.mean(),
            flip(&reference, &test, 30.0).unwrap().mean(),
            f64::from(map.errors[(32 * width + 48) as usize]),
        ];
        for (found, expected) in found.into_iter().zip([at_desk, at_30, middle]) {
            assert!((found - expected).abs() < 1e-4, "{name}: {found}, but expected {expected}");
        }
    }
}

/// A difference is visible only near it, and its error is independent of the strips.
#[test]
fn a_dot_is_visible_around_itself_in_every_row() {
    let (width, height) = (41, 300);
    let dotted = |row| picture(width, height, |x, y| if (x, y) == (20, row) { [255; 3] } else { [90; 3] });
    let plain = picture(width, height, |_, _| [90; 3]);
    let around = |row: u32| {
        let map = flip(&plain, &dotted(row), PIXELS_PER_DEGREE).unwrap();
        let touched = |y: u32| map.errors[(y * width) as usize..][..width as usize].iter().any(|e| *e > 0.0);
        assert!((0..height).all(|y| y.abs_diff(row) <= 10 || !touched(y)), "row {row}");
        map.errors[((row - 10) * width) as usize..((row + 11) * width) as usize].to_vec()
    };
    let first = around(20);
    assert!(first[(10 * width + 20) as usize] > 0.1);
    for row in [54, 63, 64, 65, 127, 128, 200, 289] {
        assert_eq!(around(row), first, "row {row}");
    }
}

#[test]
fn incomparable_pictures_are_refused() {
    let image = uniform([1, 2, 3]);
    let message = flip(&image, &noise(7, 9, 1), 67.0).unwrap_err().to_string();
    assert!(message.contains("9 x 7") && message.contains("7 x 9"), "{message}");
    for odd in [0.0, -67.0, f64::NAN, f64::INFINITY, 1001.0] {
        let message = flip(&image, &image, odd).unwrap_err().to_string();
        assert!(message.contains("1 to 1000"), "{message}");
    }
}

proptest! {
    #[test]
    fn uniform_pictures_follow_the_equations(a in any::<[u8; 3]>(), b in any::<[u8; 3]>()) {
        let (found, expected) = (mean(&uniform(a), &uniform(b)), by_hand(a, b));
        prop_assert!((found - expected).abs() < 1e-3, "{} {}", found, expected);
    }

    #[test]
    fn the_measure_is_symmetric(seed in any::<u32>()) {
        let (a, b) = (noise(23, 19, seed), noise(23, 19, seed ^ 0xffff));
        prop_assert_eq!(flip(&a, &b, PIXELS_PER_DEGREE).unwrap(), flip(&b, &a, PIXELS_PER_DEGREE).unwrap());
        let errors = flip(&a, &b, PIXELS_PER_DEGREE).unwrap().errors;
        prop_assert!(errors.iter().all(|error| (0.0..=1.0).contains(error)));
    }
}
