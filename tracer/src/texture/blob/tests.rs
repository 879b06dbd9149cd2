//! Layouts, limits and refusals of textures.

use proptest::prelude::*;

use super::*;

fn picture(width: u32, height: u32) -> RgbImage {
    let pixels = (0..width * height * 3).map(|i| (i * 7 % 256) as u8).collect();
    RgbImage { width, height, pixels }
}

#[test]
fn rows_are_stored_from_the_bottom() {
    let picture = picture(5, 3);
    let texture = Texture::new(&picture).unwrap();
    for (x, y) in (0..3).flat_map(|y| (0..5).map(move |x| (x, y))) {
        assert_eq!(Some(texture.texel(x, 2 - y)), picture.pixel(x, y));
    }
    assert_eq!(texture.texel(0, 3), [0; 3]);
    let again = Texture::from_bytes(texture.bytes()).unwrap();
    assert_eq!((again.id(), again.width(), again.height()), (texture.id(), 5, 3));
}

#[test]
fn alpha_is_kept_where_it_cuts_and_colours_bleed() {
    let picture = picture(4, 3);
    let mut alpha = vec![255; 12];
    alpha[5] = LEAST_ALPHA;
    let opaque = Texture::with_alpha(&picture, &alpha).unwrap();
    assert!(!opaque.has_alpha() && opaque.id() == Texture::new(&picture).unwrap().id());
    assert_eq!(opaque.alpha(1, 1), 255);
    alpha[5] = LEAST_ALPHA - 1;
    alpha[0] = 0;
    let cut = Texture::from_bytes(Texture::with_alpha(&picture, &alpha).unwrap().bytes()).unwrap();
    assert!(cut.has_alpha() && cut.bytes().len() == 16 + 4 * 12);
    for (x, y) in (0..3).flat_map(|y| (0..4).map(move |x| (x, y))) {
        assert_eq!(cut.alpha(x, 2 - y), alpha[(4 * y + x) as usize]);
        let own = picture.pixel(x, y).unwrap();
        assert_eq!(cut.texel(x, 2 - y) == own, (x, y) != (0, 0), "{x} {y}");
    }
    // The mean of the eight around it, across the picture's border.
    let around = [(3, 2), (0, 2), (1, 2), (3, 0), (1, 0), (3, 1), (0, 1), (1, 1)];
    let red: u32 = around.iter().map(|&(x, y)| u32::from(picture.pixel(x, y).unwrap()[0])).sum();
    assert_eq!(u32::from(cut.texel(0, 2)[0]), (red + 4) / 8);
    assert_eq!(cut.alpha(0, 3), 255);
    assert!(Texture::from_bytes(&cut.bytes()[..60]).is_err());
}

#[test]
fn linear_texels_are_stored_from_the_bottom() {
    let pixels = (0..36).map(|i| if i == 5 { 3e4 } else { 0.25 * i as f32 }).collect();
    let picture = LinearImage { width: 4, height: 3, pixels };
    let (made, replaced) = Texture::linear(&picture).unwrap();
    assert_eq!(replaced, Replaced::default());
    let texture = Texture::from_bytes(made.bytes()).unwrap();
    assert!(texture.is_linear() && !texture.has_alpha() && texture.id() == made.id());
    assert_eq!((texture.width(), texture.height(), texture.bytes().len()), (4, 3, 16 + 4 * 12));
    for (x, y) in (0..3).flat_map(|y| (0..4).map(move |x| (x, y))) {
        let first = 3 * (4 * y + x) as usize;
        let expected = &picture.pixels[first..first + 3];
        let allowed = expected.iter().fold(0.0_f32, |a, b| a.max(*b)) / 512.0;
        for (found, expected) in texture.linear_texel(x, 2 - y).into_iter().zip(expected) {
            assert!((found - expected).abs() <= allowed, "{x} {y}: {found} {expected}");
        }
    }
    assert_eq!(texture.linear_texel(0, 3), [0.0; 3]);
    assert_eq!(texture.alpha(0, 0), 255);
}

#[test]
fn srgb_texels_are_decoded_by_the_table() {
    let picture = picture(5, 3);
    let texture = Texture::new(&picture).unwrap();
    let expected = picture.pixel(3, 0).unwrap().map(|code| srgb::decode(code) as f32);
    assert_eq!(texture.linear_texel(3, 2), expected);
    assert!(!texture.is_linear());
}

#[test]
fn unusable_texels_are_counted() {
    let pixels = vec![1.0, f32::NAN, 2.0, -1e-9, 0.5, 0.5, f32::INFINITY, 7e4, 0.0, 0.0, 7e4, 1.0];
    let (texture, replaced) = Texture::linear(&LinearImage { width: 2, height: 2, pixels }).unwrap();
    assert_eq!(replaced, Replaced { unusable: 3, too_bright: 1 });
    assert_eq!(texture.linear_texel(0, 1), [1.0, 0.0, 2.0]);
    assert_eq!(texture.linear_texel(1, 1), [0.0, 0.5, 0.5]);
    assert_eq!(texture.linear_texel(0, 0), [MAX_CHANNEL, MAX_CHANNEL, 0.0]);
    let short = LinearImage { width: 2, height: 2, pixels: vec![0.0; 9] };
    assert!(Texture::linear(&short).unwrap_err().to_string().contains("9 channels for 2 x 2"));
}

#[test]
fn sizes_are_checked_before_memory_is_allocated() {
    let announced = |width: u32, height: u32| {
        let header = Header { magic: MAGIC, version: FORMAT_VERSION, width, height };
        Texture::from_bytes(bytemuck::bytes_of(&header)).unwrap_err()
    };
    for (width, height) in [(u32::MAX, u32::MAX), (16384, 8192), (16385, 1)] {
        assert_eq!(announced(width, height), TextureError::TooLarge { width, height });
    }
    assert_eq!(announced(0, 7), TextureError::Empty { width: 0, height: 7 });
    assert!(announced(8192, 8192).to_string().contains("201326608"));
    assert!(Texture::new(&picture(0, 0)).unwrap_err().to_string().contains("needs at least one"));
}

#[test]
fn other_bytes_are_refused() {
    for (bytes, words) in [
        (&b"RFMESH"[..], "does not start with RFTEXM"),
        (b"RFTEXM", "6 bytes are too few"),
        (
            b"RFTEXM\x04\x00\x01\x00\x00\x00\x01\x00\x00\x00abcd",
            "format version 4, this program reads 1 to 3",
        ),
        (b"RFTEXM\x03\x00\x01\x00\x00\x00\x01\x00\x00\x00abc", "announces 20 bytes, there are 19"),
        (b"RFTEXM\x09\x00\x01\x00\x00\x00\x01\x00\x00\x00abc", "format version 9"),
    ] {
        let message = Texture::from_bytes(bytes).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

proptest! {
    #[test]
    fn changed_bytes_are_refused_or_a_valid_texture(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
        cut in 0_usize..4,
        linear: bool,
    ) {
        let light = LinearImage { width: 4, height: 3, pixels: vec![0.3; 36] };
        let texture = if linear { Texture::linear(&light).unwrap().0 } else { Texture::new(&picture(4, 3)).unwrap() };
        let mut bytes = texture.bytes().to_vec();
        bytes.truncate(bytes.len() - cut);
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(texture) = Texture::from_bytes(&bytes) {
            let texels = u64::from(texture.width()) * u64::from(texture.height());
            let bytes_a_texel = if texture.is_linear() || texture.has_alpha() { 4 } else { 3 };
            prop_assert_eq!(texels * bytes_a_texel + 16, bytes.len() as u64);
            let [x, y] = [texture.width() - 1, texture.height() - 1];
            texture.texel(x, y);
            let color = texture.linear_texel(x, y);
            prop_assert!(color.iter().all(|channel| (0.0..=MAX_CHANNEL).contains(channel)));
        }
    }
}
