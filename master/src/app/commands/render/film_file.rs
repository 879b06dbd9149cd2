//! Films in files: the sums of the samples of a picture, from which a later run goes on.
//!
//! ```text
//! magic      8 bytes   "RAYFILM\n"
//! version    u32       1
//! width      u32       pixels per row
//! height     u32       rows
//! samples    u32       samples of each pixel
//! picture    32 bytes  hash of everything that the samples depend on
//! sums       24 bytes a pixel, rows from top to bottom: see PixelSums::to_bytes
//! check      32 bytes  BLAKE3 hash of all bytes before
//! ```
//!
//! Numbers are little endian.

use std::io::Read;
use std::path::{Path, PathBuf};

use rayfarm_protocol::codec;
use rayfarm_tracer::files::{open_regular, write_whole};
use rayfarm_tracer::scene::{
    Camera, ColorDepth, FrameView, Lens, Quality, RenderSettings, Scene, ToneMapping,
};
use rayfarm_tracer::{PixelFormat, PixelSums};

use crate::error::CommandError;
use crate::viewer::film::{Film, passes, pixel_count};

const MAGIC: [u8; 8] = *b"RAYFILM\n";
const VERSION: u32 = 1;
/// Bytes before the sums.
const HEADER: usize = 56;
/// Bytes of the hash at the end.
const CHECK: usize = 32;
/// Bytes of a pixel.
const PIXEL: usize = PixelFormat::Sums.bytes_per_pixel();
/// Most samples of a film, for which sums have room.
const MAX_SAMPLES: u32 = 65_536;

/// Hash of everything that the samples of a picture depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PictureId([u8; 32]);

impl PictureId {
    /// The identity of a view of a scene, in this version of the program. It does not depend on the number of samples, nor on what a
    /// display makes of them: exposure, tone, dither and colours.
    ///
    /// # Errors
    /// A scene that cannot be encoded.
    pub(super) fn of(scene: &Scene, view: &FrameView) -> Result<Self, CommandError> {
        // The view has its own camera and settings.
        let body = Scene {
            render: RenderSettings::default(),
            camera: Camera::default(),
            lens: Lens::default(),
            ..scene.clone()
        };
        let quality = Quality { dither: false, colors: ColorDepth::Exact, ..view.quality };
        let view = FrameView { tone: ToneMapping::default(), quality, ..passes::pass(view, 0..1) };
        let mut hasher = blake3::Hasher::new();
        hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
        for part in [codec::encode(&body), codec::encode(&view)] {
            let part = part.map_err(CommandError::failed)?;
            hasher.update(&(part.len() as u64).to_le_bytes()).update(&part);
        }
        Ok(Self(*hasher.finalize().as_bytes()))
    }
}

/// Writes a film: whole or not at all.
///
/// # Errors
/// A file that cannot be written; an existing one is then unchanged.
pub(super) fn save(path: &Path, picture: PictureId, view: &FrameView, film: &Film) -> Result<(), String> {
    let mut bytes = Vec::new();
    let length = HEADER + film.sums().len() * PIXEL + CHECK;
    let wrong =
        |problem: &dyn std::fmt::Display| format!("{}: cannot save the film: {problem}", path.display());
    bytes.try_reserve_exact(length).map_err(|error| wrong(&error))?;
    bytes.extend_from_slice(&MAGIC);
    for number in [VERSION, view.width, view.height, film.samples()] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes.extend_from_slice(&picture.0);
    film.sums().iter().for_each(|sums| bytes.extend_from_slice(&sums.to_bytes()));
    let check = blake3::hash(&bytes);
    bytes.extend_from_slice(check.as_bytes());
    write_whole(path, &bytes).map_err(|error| wrong(&error))
}

/// Reads the film of a picture of a view. Reads no more bytes than the picture has.
///
/// # Errors
/// A file that cannot be read, is damaged, or is of another picture or version.
pub(super) fn load(path: &Path, picture: PictureId, view: &FrameView) -> Result<Film, CommandError> {
    read(path, picture, view)
        .map_err(|problem| CommandError::WrongInput(format!("{}: {problem}", path.display())))
}

fn read(path: &Path, picture: PictureId, view: &FrameView) -> Result<Film, String> {
    const CUT: &str = "is not a complete film";
    let readable = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::UnexpectedEof => CUT.to_owned(),
        _ => format!("cannot be read: {error}"),
    };
    let mut file = open_regular(path).map_err(readable)?;
    let mut header = [0; HEADER];
    file.read_exact(&mut header).map_err(readable)?;
    let number = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| header[8 + 4 * at + byte]));
    if header[..8] != MAGIC {
        return Err("is not a film of rayfarm".to_owned());
    }
    if number(0) != VERSION {
        return Err(format!("is a film of version {}, and this program reads version {VERSION}", number(0)));
    }
    let (width, height, samples) = (number(1), number(2), number(3));
    if (width, height) != (view.width, view.height) {
        let (wanted_width, wanted_height) = (view.width, view.height);
        return Err(format!(
            "is the film of a picture of {width}x{height} pixels, and this one has {wanted_width}x{wanted_height}"
        ));
    }
    if header[24..] != picture.0 {
        return Err(
            "is the film of another picture: scene, camera, settings and program must be the same, and only \
                    the number of samples, the largest noise, exposure, tone, dither and colours may differ"
                .to_owned(),
        );
    }
    if samples > MAX_SAMPLES {
        return Err(format!("has {samples} samples, and a film has at most {MAX_SAMPLES}"));
    }
    let length = pixel_count(view) * PIXEL + CHECK;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length).map_err(|error| error.to_string())?;
    // A byte more than the film has shows that the file is longer.
    file.take(length as u64 + 1).read_to_end(&mut bytes).map_err(readable)?;
    if bytes.len() != length {
        return Err(CUT.to_owned());
    }
    let (sums, check) = bytes.split_at(length - CHECK);
    let expected = blake3::Hasher::new().update(&header).update(sums).finalize();
    if expected.as_bytes().as_slice() != check {
        return Err("is damaged: its check does not fit its sums".to_owned());
    }
    let sums = sums.as_chunks::<PIXEL>().0.iter().map(PixelSums::from_bytes).collect();
    Ok(Film::of_sums(view, sums, samples))
}

/// The film of a run in a file.
#[derive(Clone, Debug)]
pub(super) struct FilmFile {
    /// File to which the film is saved.
    pub(super) path: PathBuf,
    /// Identity of the picture.
    pub(super) picture: PictureId,
}

#[cfg(test)]
mod tests {
    use rayfarm_farm::testing::test_scene;
    use rayfarm_tracer::scene::{Integrator, PathSettings};

    use super::*;

    fn view() -> FrameView {
        let integrator = Integrator::Path(PathSettings::default());
        FrameView { width: 5, height: 3, samples: 64, integrator, ..test_scene::view() }
    }

    fn id(view: &FrameView) -> PictureId {
        PictureId::of(&test_scene::scene(), view).unwrap()
    }

    fn film(samples: u32) -> Film {
        let mut sums = vec![PixelSums::default(); 15];
        for (pixel, at) in sums.iter_mut().zip(0_u16..) {
            (0..samples)
                .for_each(|number| pixel.add_sample(number, PixelSums::steps([f32::from(at) / 7.0; 3])));
        }
        Film::of_sums(&view(), sums, samples)
    }

    #[test]
    fn a_saved_film_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.film");
        for samples in [1, 5] {
            save(&path, id(&view()), &view(), &film(samples)).unwrap();
            let read = load(&path, id(&view()), &view()).unwrap();
            assert_eq!((read.samples(), read.sums()), (samples, film(samples).sums()));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_samples_do_not_depend_on_is_not_of_the_identity() {
        let more = PathSettings { max_noise: 0.25, ..PathSettings::default() };
        let quality = Quality { dither: true, colors: ColorDepth::Reduced, ..view().quality };
        let tone = ToneMapping { exposure: 1.5, ..ToneMapping::default() };
        let same = FrameView { samples: 7, integrator: Integrator::Path(more), quality, tone, ..view() };
        assert_eq!(id(&same), id(&view()));
        let seeded = PathSettings { seed: 1, ..PathSettings::default() };
        let deep = Quality { max_depth: view().quality.max_depth + 1, ..view().quality };
        for other in [
            FrameView { spin: 1.0, ..view() },
            FrameView { integrator: Integrator::Path(seeded), ..view() },
            FrameView { quality: deep, ..view() },
        ] {
            assert_ne!(id(&other), id(&view()));
        }
        let darker = Scene { ambient: glam::Vec3::ONE, ..test_scene::scene() };
        assert_ne!(PictureId::of(&darker, &view()).unwrap(), id(&view()));
        let resized = RenderSettings { width: 9, samples: 4, ..test_scene::scene().render };
        let resized = Scene { render: resized, ..test_scene::scene() };
        assert_eq!(PictureId::of(&resized, &view()).unwrap(), id(&view()));
    }

    #[test]
    fn other_and_damaged_films_are_refused_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.film");
        let problem = |bytes: &[u8], view: &FrameView| {
            std::fs::write(&path, bytes).unwrap();
            load(&path, id(view), view).unwrap_err().to_string()
        };
        save(&path, id(&view()), &view(), &film(2)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let changed = |at: usize| {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            bytes
        };
        let longer = [whole.as_slice(), b"x"].concat();
        let many = {
            let mut bytes = whole.clone();
            bytes[20..24].copy_from_slice(&65_537_u32.to_le_bytes());
            bytes
        };
        for (bytes, view, hint) in [
            (&whole, FrameView { spin: 1.0, ..view() }, "another picture"),
            (&whole, FrameView { width: 6, ..view() }, "5x3 pixels"),
            (&changed(0), view(), "not a film"),
            (&changed(8), view(), "version 0"),
            (&changed(20), view(), "damaged"),
            (&changed(100), view(), "damaged"),
            (&changed(whole.len() - 1), view(), "damaged"),
            (&many, view(), "65537 samples"),
            (&whole[..whole.len() - 1].to_vec(), view(), "complete"),
            (&whole[..20].to_vec(), view(), "complete"),
            (&Vec::new(), view(), "complete"),
            (&longer, view(), "complete"),
        ] {
            let problem = problem(bytes, &view);
            assert!(problem.contains(hint) && problem.contains("a.film"), "{hint}: {problem}");
        }
        let missing = load(&folder.path().join("b.film"), id(&view()), &view()).unwrap_err();
        assert!(missing.to_string().contains("cannot be read"), "{missing}");
    }
}
