//! The denoiser: noise falls, edges of all kinds stay, and nothing but the inputs counts.

use super::*;
use crate::image::LinearImage;

const WIDTH: usize = 72;
const HEIGHT: usize = 60;
const SAMPLES: u32 = 8;

/// Numbers from 0 to 1, by a linear congruential generator (Knuth's MMIX).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}

/// Column and row of each pixel.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..WIDTH * HEIGHT).map(|index| (index % WIDTH, index / WIDTH))
}

fn picture(pixel: impl Fn(usize, usize) -> [f32; 3]) -> LinearImage {
    let pixels = places().flat_map(|(x, y)| pixel(x, y)).collect();
    LinearImage { width: WIDTH as u32, height: HEIGHT as u32, pixels }
}

/// A white wall across the view.
fn flat() -> Guides {
    guides(|_, _| [0.5; 3], |_, _| [0.0, 0.0, 1.0], |_, _| 4.0)
}

fn guides(
    albedo: impl Fn(usize, usize) -> [f32; 3],
    normal: impl Fn(usize, usize) -> [f32; 3],
    depth: impl Fn(usize, usize) -> f32,
) -> Guides {
    Guides::new(&picture(albedo), &picture(normal), &picture(|x, y| [depth(x, y); 3])).unwrap()
}

/// Sums of samples that are uniformly distributed from 0 to twice the light.
fn noisy(seed: u64, light: impl Fn(usize, usize) -> [f32; 3]) -> Vec<PixelSums> {
    let mut noise = Noise(seed);
    let pixel = |(x, y)| {
        let mut sums = PixelSums::default();
        for number in 0..SAMPLES {
            let factor = 2.0 * noise.next();
            sums.add_sample(number, PixelSums::steps(light(x, y).map(|value| factor * value)));
        }
        sums
    };
    places().map(pixel).collect()
}

/// Sums of samples that are the light.
fn exact(light: impl Fn(usize, usize) -> [f32; 3]) -> Vec<PixelSums> {
    let pixel = |(x, y)| {
        let mut sums = PixelSums::default();
        (0..SAMPLES).for_each(|number| sums.add_sample(number, PixelSums::steps(light(x, y))));
        sums
    };
    places().map(pixel).collect()
}

fn means(sums: &[PixelSums]) -> Vec<[f32; 3]> {
    sums.iter().map(|sums| sums.mean(SAMPLES)).collect()
}

/// Root of the mean square difference of pixels from the light, of those in columns that are `within`.
fn rmse(
    pixels: &[[f32; 3]],
    light: impl Fn(usize, usize) -> [f32; 3],
    within: impl Fn(usize) -> bool,
) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (pixel, (x, y)) in pixels.iter().zip(places()).filter(|(_, (x, _))| within(*x)) {
        for (found, expected) in pixel.iter().zip(light(x, y)) {
            squares += f64::from(found - expected).powi(2);
            count += 1.0;
        }
    }
    f64::sqrt(squares / count)
}

#[test]
fn light_without_noise_stays() {
    let constant = |_: usize, _: usize| [0.25_f32, 0.5, 4.0];
    // A shadow with a sharp edge, and a checkered texture.
    let shadow = |x: usize, y: usize| [if x < 30 { 0.2 } else { 0.21 }, 0.3, if y < 20 { 1.5 } else { 0.0 }];
    let checkered = guides(
        |x, y| if (x / 3 + y / 3) % 2 == 0 { [0.9, 0.1, 0.0] } else { [0.2, 0.6, 0.01] },
        |_, _| [0.0, 0.0, 1.0],
        |_, _| 4.0,
    );
    for guides in [flat(), checkered] {
        for light in [&constant as &dyn Fn(usize, usize) -> [f32; 3], &shadow] {
            let found = denoise(&exact(light), SAMPLES, &guides).unwrap();
            for (pixel, (x, y)) in found.iter().zip(places()) {
                for (found, expected) in pixel.iter().zip(light(x, y)) {
                    assert!((found - expected).abs() <= 4e-6 * expected.max(1.0), "{x} {y}: {pixel:?}");
                }
            }
        }
    }
}

#[test]
fn noise_on_a_wall_falls_to_a_third_at_most() {
    let even = |_: usize, _: usize| [0.5_f32, 0.4, 0.3];
    let slow = |x: usize, y: usize| [0.5 + 0.004 * x as f32, 0.4, 0.3 + 0.002 * y as f32];
    for light in [&even as &dyn Fn(usize, usize) -> [f32; 3], &slow] {
        for seed in [1, 2] {
            let sums = noisy(seed, light);
            let before = rmse(&means(&sums), light, |_| true);
            let after = rmse(&denoise(&sums, SAMPLES, &flat()).unwrap(), light, |_| true);
            assert!(after < before / 3.0, "{after}, before {before}");
        }
    }
}

/// A floor that recedes, whose depth grows quickly with the rows.
#[test]
fn noise_on_a_floor_at_a_small_angle_falls_too() {
    let even = |_: usize, _: usize| [0.5_f32; 3];
    let depth = |_: usize, y: usize| 400.0 / (y as f32 + 2.0);
    let guides = guides(|_, _| [0.5; 3], |_, _| [0.0, 1.0, 0.0], depth);
    let sums = noisy(3, even);
    let before = rmse(&means(&sums), even, |_| true);
    let after = rmse(&denoise(&sums, SAMPLES, &guides).unwrap(), even, |_| true);
    assert!(after < before / 3.0, "{after}, before {before}");
}

#[test]
fn an_edge_of_the_albedo_stays_where_the_noise_falls() {
    let left = |x: usize| x < WIDTH / 2;
    let albedo = move |x: usize, _: usize| if left(x) { [0.8, 0.1, 0.1] } else { [0.1, 0.1, 0.7] };
    let guides = guides(albedo, |_, _| [0.0, 0.0, 1.0], |_, _| 4.0);
    let light = move |x: usize, y: usize| albedo(x, y).map(|albedo| 0.6 * albedo);
    let sums = noisy(4, light);
    let near = |x: usize| x.abs_diff(WIDTH / 2) < 2;
    let before = rmse(&means(&sums), light, near);
    let after = rmse(&denoise(&sums, SAMPLES, &guides).unwrap(), light, near);
    assert!(after < before / 3.0, "{after}, before {before}");
}

#[test]
fn edges_of_normals_and_depth_separate_light() {
    let left = |x: usize| x < WIDTH / 2;
    let light = move |x: usize, _: usize| [if left(x) { 0.5 } else { 0.4 }; 3];
    let normal = move |x: usize, _: usize| if left(x) { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let depth = move |x: usize, _: usize| if left(x) { 4.0 } else { 5.0 };
    let sums = noisy(5, light);
    let by_normal = guides(|_, _| [0.5; 3], normal, |_, _| 4.0);
    let by_depth = guides(|_, _| [0.5; 3], |_, _| [0.0, 0.0, 1.0], depth);
    let side = |pixels: &[[f32; 3]], column: usize| {
        let values = pixels.iter().zip(places()).filter(|(_, (x, _))| *x == column);
        values.map(|(pixel, _)| f64::from(pixel[0])).sum::<f64>() / HEIGHT as f64
    };
    for guides in [by_normal, by_depth] {
        let found = denoise(&sums, SAMPLES, &guides).unwrap();
        let step = side(&found, WIDTH / 2 - 1) - side(&found, WIDTH / 2);
        assert!((step - 0.1).abs() < 0.03, "{step}");
    }
    // Without an edge of the guides the same step is blurred.
    let found = denoise(&sums, SAMPLES, &flat()).unwrap();
    assert!(side(&found, WIDTH / 2 - 1) - side(&found, WIDTH / 2) < 0.06);
}

#[test]
fn background_and_surfaces_are_separate() {
    let left = |x: usize| x < WIDTH / 2;
    let light = move |x: usize, _: usize| [if left(x) { 0.5 } else { 0.0 }; 3];
    let depth = move |x: usize, _: usize| if left(x) { 4.0 } else { f32::INFINITY };
    let guides = guides(|_, _| [0.5; 3], |_, _| [0.0, 0.0, 1.0], depth);
    let found = denoise(&noisy(6, light), SAMPLES, &guides).unwrap();
    for (pixel, _) in found.iter().zip(places()).filter(|(_, (x, _))| !left(*x)) {
        assert_eq!(*pixel, [0.0; 3]);
    }
}

#[test]
fn black_and_broken_inputs_give_finite_numbers() {
    let black = vec![PixelSums::default(); WIDTH * HEIGHT];
    let bright = exact(|x, _| [if x == 7 { 1024.0 } else { 0.0 }, 0.0, 1024.0]);
    let broken = [f32::NAN, f32::INFINITY, -1.0, 0.0, f32::MAX, 1e-40];
    for value in broken {
        let guides = guides(|_, _| [value; 3], |_, _| [value; 3], |_, y| if y < 9 { value } else { 2.0 });
        assert!(denoise(&black, SAMPLES, &guides).unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "{value}");
        let found = denoise(&bright, SAMPLES, &guides).unwrap();
        assert!(found.as_flattened().iter().all(|value| value.is_finite()), "{value}");
    }
}

#[test]
fn one_sample_has_no_estimate_and_stays() {
    let mut sums = vec![PixelSums::default(); WIDTH * HEIGHT];
    let mut noise = Noise(7);
    sums.iter_mut().for_each(|sums| sums.add_sample(0, PixelSums::steps([noise.next(); 3])));
    let found = denoise(&sums, 1, &flat()).unwrap();
    for (found, sums) in found.iter().zip(&sums) {
        assert!((found[0] - sums.mean(1)[0]).abs() < 1e-5);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let sums = noisy(8, |x, y| [0.5, 0.01 * x as f32, 0.3 + 0.01 * y as f32]);
    let guides = flat();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| denoise(&sums, SAMPLES, &guides).unwrap())
    };
    let expected = on(1);
    for threads in [2, 3, 7] {
        assert!(on(threads) == expected, "{threads} threads");
    }
}

#[test]
fn pictures_of_different_sizes_are_refused() {
    let of = |width, height| LinearImage { width, height, pixels: vec![0.5; (3 * width * height) as usize] };
    let cut = LinearImage { pixels: vec![0.5; 8], ..of(3, 1) };
    let sizes = Guides::new(&of(3, 2), &of(2, 3), &of(3, 2));
    assert!(matches!(sizes, Err(ImageError::SizesDiffer { a: (3, 2), b: (2, 3) })));
    let cut = Guides::new(&cut, &cut, &cut);
    assert!(matches!(cut, Err(ImageError::WrongBuffer { expected: 9, actual: 8, .. })));
    let guides = Guides::new(&of(3, 2), &of(3, 2), &of(3, 2)).unwrap();
    let few = denoise(&[PixelSums::default(); 5], 1, &guides);
    assert!(matches!(few, Err(ImageError::WrongBuffer { width: 3, height: 2, expected: 6, actual: 5 })));
    let empty = of(0, 0);
    let guides = Guides::new(&empty, &empty, &empty).unwrap();
    assert!(denoise(&[], 1, &guides).unwrap().is_empty());
}
