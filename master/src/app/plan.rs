//! Plan of a run: the frames to render, all or those without a file.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayfarm_tracer::image;

use crate::app::output::OutputPattern;
use crate::error::CommandError;

/// Largest number of files that are read at a time.
const MAX_READERS: usize = 8;
/// Largest number of damaged files that are named one by one.
const MAX_NAMED: usize = 5;
/// Last bytes of every PNG file: an empty chunk IEND, and its checksum.
const PNG_END: [u8; 12] = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xae, 0x42, 0x60, 0x82];

/// Treatment of existing files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Existing {
    /// Frames are rendered again.
    Replace,
    /// Files are kept without being read.
    Skip,
    /// Complete pictures of the size `width` x `height` are kept.
    Resume {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Names of the layers of files that have layers.
        layers: Vec<&'static str>,
    },
}

/// Frames of a run to render.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    /// Numbers of the frames in the camera path, from 0; ascending.
    pub(crate) frames: Vec<u64>,
    /// Number of frames whose files are kept.
    pub(crate) skipped: u64,
}

impl Plan {
    /// Plan for the frames `first..end` of a camera path.
    ///
    /// # Errors
    /// A first frame beyond the end; an existing file with a picture of another size, or that is not a regular file.
    pub(crate) fn new(
        first: u64,
        end: u64,
        existing: Existing,
        pattern: &OutputPattern,
    ) -> Result<Self, CommandError> {
        if first >= end {
            return Err(CommandError::WrongInput(format!(
                "--first-frame {first}: the frames of this run are numbered 0 to {}; --frames says how many the whole \
                 camera path has",
                end - 1
            )));
        }
        if existing != Existing::Replace && pattern.path(first).is_none() {
            return Err(CommandError::WrongInput(
                "--resume and --skip-existing depend on files, and -o none writes none; leave them out"
                    .to_owned(),
            ));
        }
        let all = first..end;
        let Existing::Resume { width, height, ref layers } = existing else {
            let is_kept = |frame: &u64| {
                existing == Existing::Skip
                    && pattern.path(*frame).is_some_and(|path| path.symlink_metadata().is_ok())
            };
            let frames: Vec<u64> = all.filter(|frame| !is_kept(frame)).collect();
            return Ok(Self { skipped: end - first - frames.len() as u64, frames });
        };
        let existing: Vec<(u64, PathBuf)> = all
            .clone()
            .filter_map(|frame| Some((frame, pattern.path(frame)?)))
            .filter(|(_, path)| path.symlink_metadata().is_ok())
            .collect();
        let kept = complete_files(&existing, width, height, layers)?;
        let mut kept = kept.into_iter().peekable();
        let frames: Vec<u64> = all.filter(|frame| kept.next_if_eq(frame).is_none()).collect();
        Ok(Self { skipped: end - first - frames.len() as u64, frames })
    }

    /// Text about the files that existed before the run.
    pub(crate) fn already(&self) -> String {
        match self.skipped {
            0 => String::new(),
            1 => ", 1 was there already".to_owned(),
            more => format!(", {more} were there already"),
        }
    }
}

/// Numbers of the frames whose files are complete pictures, ascending. Reads files on several threads.
fn complete_files(
    files: &[(u64, PathBuf)],
    width: u32,
    height: u32,
    layers: &[&str],
) -> Result<Vec<u64>, CommandError> {
    if files.len() > 1 {
        tracing::info!("checking {} existing pictures", files.len());
    }
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::with_capacity(files.len()));
    let check = || {
        while let Some((frame, path)) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            let state = state_of(path, width, height, layers);
            found.lock().unwrap_or_else(PoisonError::into_inner).push((*frame, path, state));
        }
    };
    let readers = std::thread::available_parallelism().map_or(1, usize::from).min(MAX_READERS);
    std::thread::scope(|scope| {
        for _ in 1..readers {
            scope.spawn(check);
        }
        check();
    });
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_unstable_by_key(|(frame, ..)| *frame);
    let (mut kept, mut damaged) = (Vec::new(), 0);
    for (frame, path, state) in found {
        match state? {
            State::Complete => kept.push(frame),
            State::Damaged(problem) => {
                damaged += 1;
                if damaged <= MAX_NAMED {
                    tracing::warn!("{}: {problem}; it is rendered again", path.display());
                }
            }
        }
    }
    if damaged > MAX_NAMED {
        tracing::warn!("{} more damaged pictures are rendered again", damaged - MAX_NAMED);
    }
    Ok(kept)
}

/// State of an existing file.
#[derive(Debug, PartialEq, Eq)]
enum State {
    Complete,
    /// Reason for which it is not a complete picture.
    Damaged(String),
}

fn state_of(path: &Path, width: u32, height: u32, layers: &[&str]) -> Result<State, CommandError> {
    let refuse = |problem: String| Err(CommandError::WrongInput(format!("{}: {problem}", path.display())));
    match path.metadata() {
        Ok(metadata) if metadata.is_file() => {}
        Ok(_) => return refuse("is not a regular file; remove it, or write the frames elsewhere".to_owned()),
        Err(error) => return Ok(State::Damaged(format!("cannot be read: {error}"))),
    }
    match image::size(path) {
        Ok(size) if size == (width, height) => {}
        Ok((w, h)) => {
            return refuse(format!(
                "is a picture of {w}x{h} pixels, and this run renders {width}x{height}; resume with the same --size, \
                 remove the file, or write the frames elsewhere"
            ));
        }
        Err(image::ImageError::Read { source, .. }) => return refuse(format!("cannot be read: {source}")),
        Err(error) => return Ok(State::Damaged(format!("is not a complete picture ({error})"))),
    }
    if image::has_layers(path) {
        return Ok(match image::layer_names(path, width, height) {
            Err(error) => State::Damaged(format!("is not a complete picture ({error})")),
            Ok(names) if names != layers => {
                let (found, expected) = (names.join(", "), layers.join(", "));
                State::Damaged(format!("has the layers {found}, and this run writes {expected}"))
            }
            Ok(_) => State::Complete,
        });
    }
    let decoded = match image::is_linear(path) {
        true => image::load_sky(path).map(drop),
        false => image::load(path).map(drop),
    };
    match decoded {
        Err(error) => Ok(State::Damaged(format!("is not a complete picture ({error})"))),
        Ok(_) if !has_end(path) => {
            Ok(State::Damaged("is not a complete picture: its end is missing".to_owned()))
        }
        Ok(_) => Ok(State::Complete),
    }
}

/// Whether a decodable picture has its last bytes. A PNG without its end may decode; a truncated PPM does not.
fn has_end(path: &Path) -> bool {
    use std::io::{Read, Seek, SeekFrom};
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
        return true;
    }
    let mut end = [0; PNG_END.len()];
    let read = std::fs::File::open(path).and_then(|mut file| {
        file.seek(SeekFrom::End(-(PNG_END.len() as i64)))?;
        file.read_exact(&mut end)
    });
    read.is_ok() && end == PNG_END
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::image::{LinearImage, RgbImage, save};

    use super::*;
    use crate::app::cli::Aov;
    use crate::app::picture::{BEAUTY, Picture};

    const SIZE: Existing = Existing::Resume { width: 6, height: 4, layers: Vec::new() };

    fn sequence(folder: &Path, extension: &str) -> OutputPattern {
        OutputPattern::parse(&folder.join(format!("f%02d.{extension}")), 10).unwrap()
    }

    fn picture(width: u32) -> RgbImage {
        let pixels = (0..width * 4 * 3).map(|i| (i * 37 % 251) as u8).collect();
        RgbImage { width, height: 4, pixels }
    }

    #[test]
    fn all_frames_from_the_first_one_are_rendered() {
        let pattern = sequence(Path::new("nowhere"), "png");
        let plan = |first, end| Plan::new(first, end, Existing::Replace, &pattern);
        assert_eq!(plan(0, 3).unwrap(), Plan { frames: vec![0, 1, 2], skipped: 0 });
        assert_eq!(plan(40, 42).unwrap(), Plan { frames: vec![40, 41], skipped: 0 });
        let problem = plan(3, 3).unwrap_err().to_string();
        assert!(problem.contains("--first-frame 3") && problem.contains("0 to 2"), "{problem}");
    }

    #[test]
    fn only_complete_pictures_are_kept() {
        for extension in ["png", "ppm"] {
            let folder = tempfile::tempdir().unwrap();
            let pattern = sequence(folder.path(), extension);
            let path = |frame| pattern.path(frame).unwrap();
            for frame in [0, 2, 3, 4, 5] {
                save(&path(frame), &picture(6)).unwrap();
            }
            let whole = std::fs::read(path(0)).unwrap();
            // Cut by a byte, cut in the middle, empty, no picture at all.
            std::fs::write(path(3), &whole[..whole.len() - 1]).unwrap();
            std::fs::write(path(4), &whole[..whole.len() / 2]).unwrap();
            std::fs::write(path(5), b"").unwrap();
            std::fs::write(path(6), b"what is this").unwrap();
            let plan = Plan::new(0, 8, SIZE, &pattern).unwrap();
            assert_eq!(plan, Plan { frames: vec![1, 3, 4, 5, 6, 7], skipped: 2 }, "{extension}");
            let plan = Plan::new(0, 8, Existing::Skip, &pattern).unwrap();
            assert_eq!(plan, Plan { frames: vec![1, 7], skipped: 6 }, "{extension}");
            let plan = Plan::new(2, 8, SIZE, &pattern).unwrap();
            assert_eq!(plan, Plan { frames: vec![3, 4, 5, 6, 7], skipped: 1 }, "{extension}");
        }
    }

    fn linear(aov: &[Aov]) -> Picture {
        let pixels = (0..6 * 4 * 3).map(|i| (i * 37 % 251) as f32 / 16.0).collect();
        let picture = LinearImage { width: 6, height: 4, pixels };
        Picture::of_layers(BEAUTY, picture.clone(), aov.iter().map(|aov| (*aov, picture.clone())))
    }

    #[test]
    fn only_complete_linear_pictures_with_the_same_layers_are_kept() {
        for (extension, aov) in [("hdr", &[][..]), ("exr", &[]), ("exr", &[Aov::Depth, Aov::Item])] {
            let folder = tempfile::tempdir().unwrap();
            let pattern = sequence(folder.path(), extension);
            let path = |frame| pattern.path(frame).unwrap();
            (0..4).for_each(|frame| linear(aov).save(&path(frame)).unwrap());
            let whole = std::fs::read(path(0)).unwrap();
            std::fs::write(path(1), &whole[..whole.len() - 1]).unwrap();
            std::fs::write(path(2), &whole[..whole.len() / 2]).unwrap();
            let layers = std::iter::once(BEAUTY).chain(aov.iter().map(|aov| aov.name())).collect();
            let same = Existing::Resume { width: 6, height: 4, layers };
            assert_eq!(Plan::new(0, 5, same, &pattern).unwrap().frames, [1, 2, 4], "{extension}");
            let more = Existing::Resume { width: 6, height: 4, layers: vec![BEAUTY, "albedo"] };
            let frames = Plan::new(0, 5, more, &pattern).unwrap().frames;
            assert_eq!(frames, if extension == "exr" { vec![0, 1, 2, 3, 4] } else { vec![1, 2, 4] });
            let other = Existing::Resume { width: 7, height: 4, layers: vec![BEAUTY] };
            assert!(Plan::new(0, 1, other, &pattern).unwrap_err().to_string().contains("6x4"));
        }
    }

    #[test]
    fn a_flipped_bit_in_a_png_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = sequence(folder.path(), "png");
        save(&pattern.path(0).unwrap(), &picture(6)).unwrap();
        let mut bytes = std::fs::read(pattern.path(0).unwrap()).unwrap();
        let middle = bytes.len() - 30;
        bytes[middle] ^= 4;
        std::fs::write(pattern.path(0).unwrap(), bytes).unwrap();
        assert_eq!(Plan::new(0, 1, SIZE, &pattern).unwrap().frames, [0]);
    }

    #[test]
    fn pictures_of_another_size_and_folders_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let pattern = sequence(folder.path(), "png");
        save(&pattern.path(1).unwrap(), &picture(5)).unwrap();
        let problem = Plan::new(0, 3, SIZE, &pattern).unwrap_err().to_string();
        for word in ["f01.png", "5x4", "6x4", "--size"] {
            assert!(problem.contains(word), "{problem}");
        }
        std::fs::remove_file(pattern.path(1).unwrap()).unwrap();
        std::fs::create_dir(pattern.path(2).unwrap()).unwrap();
        let problem = Plan::new(0, 3, SIZE, &pattern).unwrap_err().to_string();
        assert!(problem.contains("f02.png"), "{problem}");
    }

    #[test]
    fn without_files_no_frame_can_be_kept() {
        for existing in [Existing::Skip, SIZE] {
            let problem = Plan::new(0, 3, existing, &OutputPattern::None).unwrap_err().to_string();
            assert!(problem.contains("-o none"), "{problem}");
        }
    }
}
