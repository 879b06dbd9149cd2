//! The same bytes from tiles and from sums, in every format.

use std::sync::Arc;

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::compile::CompiledScene;
use crate::film::{develop, develop_light};
use crate::integrator::render_rows;
use crate::scene::{Background, Quality, RenderSettings, Scene, ToneCurve};
use crate::simd;

const WIDTH: u32 = 37;
const HEIGHT: u32 = 21;

/// Tone mappings, the plain one first.
const TONES: [ToneMapping; 5] = [
    ToneMapping { exposure: 0.0, curve: ToneCurve::Srgb },
    ToneMapping { exposure: -1.5, curve: ToneCurve::Srgb },
    ToneMapping { exposure: 2.0, curve: ToneCurve::Agx },
    ToneMapping { exposure: 0.0, curve: ToneCurve::Aces },
    ToneMapping { exposure: 0.5, curve: ToneCurve::Neutral },
];

/// Rounded, dithered, and both with fewer colours.
fn qualities() -> [Quality; 4] {
    let exact = Quality { dither: false, colors: ColorDepth::Exact, ..Quality::default() };
    let reduced = Quality { colors: ColorDepth::Reduced, ..exact };
    [exact, Quality { dither: true, ..exact }, reduced, Quality { dither: true, ..reduced }]
}

fn scene(background: Background) -> Scene {
    let render = RenderSettings { width: WIDTH, height: HEIGHT, ..RenderSettings::default() };
    Scene { background, render, ..Scene::default() }
}

/// The bytes of a picture on each level, which are equal.
fn rendered(scene: &Scene, view: &FrameView) -> Vec<u8> {
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let mut frame = PreparedFrame::new(compiled, view).unwrap();
    let mut pictures = simd::all().into_iter().map(|level| {
        frame.level = level;
        let mut bytes = vec![0xee; frame.row_bytes() * HEIGHT as usize];
        render_rows(&frame, 0..HEIGHT, &mut bytes, &|| false).unwrap();
        bytes
    });
    let first = pictures.next().unwrap();
    pictures.for_each(|other| assert!(other == first, "levels differ"));
    first
}

fn floats(bytes: &[u8]) -> Vec<[f32; 3]> {
    let numbers: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    numbers.as_chunks::<3>().0.to_vec()
}

/// Sums of equal samples.
fn sums_of(light: [f32; 3], samples: u32) -> PixelSums {
    let mut sums = PixelSums::default();
    (0..samples).for_each(|number| sums.add_sample(number, PixelSums::steps(light)));
    sums
}

/// All samples of a picture of one colour are that colour, on workers and on the master.
#[test]
fn sums_develop_to_the_bytes_that_are_rendered() {
    let light = [0.25, 1.75, 0.015625];
    let scene = scene(Background::Color(Vec3::from(light)));
    for (tone, quality) in TONES.into_iter().flat_map(|tone| qualities().map(|quality| (tone, quality))) {
        for format in [PixelFormat::Rgb8, PixelFormat::Linear] {
            for (samples, adaptive) in [(1, false), (4, false), (9, true)] {
                let quality = Quality { adaptive, ..quality };
                let view = FrameView { tone, quality, format, samples, ..FrameView::of(&scene) };
                let sums = vec![sums_of(light, samples); (WIDTH * HEIGHT) as usize];
                let mut developed = vec![0xdd; format.bytes_of(WIDTH, HEIGHT)];
                develop(&view, 0, samples, &sums, &mut developed);
                assert!(rendered(&scene, &view) == developed, "{view:?}");
            }
        }
    }
}

/// Tiles with one and with several samples, and adaptive ones, write the light whose tone-mapped bytes they write otherwise.
#[test]
fn linear_pixels_are_the_light_of_the_encoded_ones() {
    let scene =
        scene(Background::Gradient { bottom: Vec3::new(0.0, 0.1, 3.0), top: Vec3::new(1.2, 0.02, 0.0) });
    for (tone, quality) in TONES.into_iter().flat_map(|tone| qualities().map(|quality| (tone, quality))) {
        for (samples, adaptive) in [(1, false), (4, false), (9, true)] {
            let quality = Quality { adaptive, ..quality };
            let view = FrameView { tone, quality, samples, ..FrameView::of(&scene) };
            let linear = rendered(&scene, &FrameView { format: PixelFormat::Linear, ..view });
            let mut expected = vec![0; PixelFormat::Rgb8.bytes_of(WIDTH, HEIGHT)];
            let development = Development::new(simd::best(), &view, 0);
            for (pixel, light) in floats(&linear).into_iter().enumerate() {
                let lanes = light.map(|value| Lanes([value; LANES]));
                development.write(&lanes, &[pixel], &mut expected);
            }
            super::super::finish_rows(&view, 0, &mut expected);
            assert!(rendered(&scene, &view) == expected, "{view:?}");
        }
    }
}

#[test]
fn linear_light_is_neither_clipped_nor_mapped() {
    let light = [0.0, 123.5, 1.0e-5];
    let scene = scene(Background::Color(Vec3::from(light)));
    for tone in TONES {
        let view = FrameView { tone, format: PixelFormat::Linear, ..FrameView::of(&scene) };
        assert!(floats(&rendered(&scene, &view)).into_iter().all(|pixel| pixel == light), "{tone:?}");
    }
}

#[test]
fn what_is_no_number_is_black_in_linear_pixels() {
    let view = FrameView { format: PixelFormat::Linear, width: 1, ..FrameView::default() };
    let light = [f32::NAN, -2.0, f32::INFINITY].map(|value| Lanes([value; LANES]));
    let mut bytes = [0xee; LINEAR];
    Development::new(simd::best(), &view, 0).write(&light, &[0], &mut bytes);
    assert_eq!(floats(&bytes), [[0.0, -2.0, f32::INFINITY]]);
}

#[test]
fn buffers_of_another_length_are_filled_as_far_as_both_go() {
    let view = FrameView { width: 4, height: 1, ..FrameView::default() };
    let sums = [sums_of([1.0; 3], 1); 4];
    let mut short = [7; 8];
    develop(&view, 0, 1, &sums, &mut short);
    assert_eq!(short, [255, 255, 255, 255, 255, 255, 7, 7]);
    let mut long = [7; 15];
    develop(&view, 0, 1, &sums, &mut long);
    assert_eq!((&long[..12], &long[12..]), (&[255; 12][..], &[7; 3][..]));
}

proptest! {
    #[test]
    fn any_cut_of_the_rows_develops_to_the_same_bytes(
        light in prop::collection::vec(prop::array::uniform3(0.0_f32..3.0), 7 * 23),
        samples in 1_u32..5,
        tone in prop::sample::select(TONES.to_vec()),
        quality in prop::sample::select(qualities().to_vec()),
        format in prop::sample::select(vec![PixelFormat::Rgb8, PixelFormat::Linear, PixelFormat::Sums]),
        cut in 1_u32..23,
    ) {
        let view = FrameView { width: 7, height: 23, tone, quality, format, ..FrameView::default() };
        let sums: Vec<PixelSums> = light.into_iter().map(|light| sums_of(light, samples)).collect();
        let mut whole = vec![0; format.bytes_of(7, 23)];
        develop(&view, 0, samples, &sums, &mut whole);
        let light: Vec<[f32; 3]> = sums.iter().map(|sums| sums.mean(samples)).collect();
        let mut of_light = vec![0; whole.len()];
        develop_light(&view, 0, &light, &mut of_light);
        prop_assert!(format == PixelFormat::Sums || of_light == whole);
        let mut parts = vec![0; whole.len()];
        let (upper, lower) = parts.split_at_mut(format.bytes_of(7, cut));
        develop(&view, cut, samples, &sums[7 * cut as usize..], lower);
        develop(&view, 0, samples, &sums[..7 * cut as usize], upper);
        prop_assert_eq!(&parts, &whole);
        if format == PixelFormat::Sums {
            let read: Vec<PixelSums> = whole.as_chunks::<SUMS>().0.iter().map(PixelSums::from_bytes).collect();
            prop_assert_eq!(read, sums);
        }
    }
}
