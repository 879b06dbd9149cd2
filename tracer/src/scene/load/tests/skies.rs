//! Pictures of skies as textures, and warnings about them.

use ::image::{Rgb, Rgb32FImage, Rgba, RgbaImage};

use super::*;
use crate::scene::load::textures::Textures;

const LIMIT: u64 = 1 << 20;

/// A folder with a picture of linear light, 4 x 2 pixels.
fn with_light(name: &str, color: impl Fn(u32) -> f32) -> Folder {
    let folder = Folder::with(&[]);
    let picture = Rgb32FImage::from_fn(4, 2, |x, y| Rgb([color(x), 0.5, y as f32]));
    picture.save(folder.path(name)).unwrap();
    folder
}

#[test]
fn pictures_of_both_kinds_become_skies_once() {
    let folder = with_light("a.hdr", |_| 1024.0);
    RgbaImage::from_pixel(3, 3, Rgba([255, 0, 7, 255])).save(folder.path("a.png")).unwrap();
    let mut textures = Textures::new(LIMIT);
    let indices = ["a.hdr", "a.png", "a.hdr"].map(|name| textures.add_sky(&folder.path(name)).unwrap());
    assert_eq!(indices, [0, 1, 0]);
    assert_eq!([0, 1, 2].map(|index| textures.size(index)), [Some((4, 2)), Some((3, 3)), None]);
    let (maps, textures, notes) = textures.take_parts();
    assert!(notes.is_empty() && textures.len() == 2);
    for map in &maps {
        assert_eq!((map.filter, map.tiling), (Filter::Bilinear, Tiling::default()));
    }
    let of = |index: usize| textures.iter().find(|texture| texture.id() == maps[index].texture).unwrap();
    assert!(of(0).is_linear() && !of(1).is_linear());
    // The upper row of the picture is the last one of the texture.
    assert_eq!(of(0).linear_texel(2, 0)[0], 1024.0);
    assert_eq!(of(1).linear_texel(1, 1)[0], 1.0);
}

#[test]
fn what_a_sky_cannot_hold_is_counted() {
    for (name, color, words) in [
        ("nan.exr", f32::NAN, "a.exr: channels that are negative, infinite or no number, in 2 pixels"),
        ("negative.exr", -1e-5, "no number, in 2 pixels"),
        ("sun.exr", 1e6, "channels above 65408, in 2 pixels"),
    ] {
        let folder = with_light(name, |x| if x == 1 { color } else { 65_000.0 });
        let mut textures = Textures::new(LIMIT);
        textures.add_sky(&folder.path(name)).unwrap();
        textures.add_sky(&folder.path(name)).unwrap();
        let (_, textures, notes) = textures.take_parts();
        let words = words.replace("a.exr", name);
        assert!(notes.len() == 1 && notes.first().unwrap().contains(&words), "{notes:?}");
        let expected = if color > 0.0 { 65_408.0 } else { 0.0 };
        assert_eq!(textures[0].linear_texel(1, 0)[0], expected, "{name}");
    }
    let folder = Folder::with(&[]);
    RgbaImage::from_pixel(3, 3, Rgba([255, 0, 7, 100])).save(folder.path("a.png")).unwrap();
    let mut textures = Textures::new(LIMIT);
    textures.add_sky(&folder.path("a.png")).unwrap();
    let (_, textures, notes) = textures.take_parts();
    assert!(!textures[0].has_alpha());
    assert!(notes.first().unwrap().contains("alpha"), "{notes:?}");
}

#[test]
fn pictures_that_are_no_skies_are_refused_by_name() {
    let folder = with_light("a.exr", |_| 1.0);
    let whole = std::fs::read(folder.path("a.exr")).unwrap();
    std::fs::write(folder.path("a.exr"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(folder.path("a.psd"), b"8BPS\0\x01").unwrap();
    let mut textures = Textures::new(LIMIT);
    for (name, words) in [
        ("a.exr", "as Radiance HDR or OpenEXR of at most"),
        ("a.psd", "a Photoshop picture (.psd)"),
        ("b.exr", "cannot read"),
    ] {
        let message = textures.add_sky(&folder.path(name)).unwrap_err();
        assert!(message.contains(name) && message.contains(words), "{message}");
    }
    let small = with_light("a.hdr", |_| 1.0);
    let message = Textures::new(31).add_sky(&small.path("a.hdr")).unwrap_err();
    assert!(message.contains("the limit"), "{message}");
}

#[test]
fn pictures_of_high_range_are_no_textures_of_materials() {
    let folder = with_light("a.hdr", |_| 1.0);
    let message = Textures::new(LIMIT)
        .add(&folder.path("a.hdr"), Filter::Bilinear, Tiling::default())
        .map(|listed| listed.index)
        .unwrap_err();
    assert!(message.contains("a.hdr"), "{message}");
}
