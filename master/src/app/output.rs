//! Files of frames: names, and checks before rendering.

use std::path::{Path, PathBuf};

use rayfarm_tracer::image;

use super::video::VideoFormat;
use crate::error::CommandError;

/// Extensions of pictures.
const EXTENSIONS: [&str; 4] = ["png", "ppm", "exr", "hdr"];
/// Largest number of digits of a frame number; more would only be zeros.
const MAX_DIGITS: usize = 18;

/// Word in place of a file name for which no picture is written.
const NONE: &str = "none";

/// Files of the frames of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum OutputPattern {
    /// No files: frames are rendered for measurements.
    None,
    /// One file.
    Single(PathBuf),
    /// One file with all frames.
    Video {
        /// Its path.
        path: PathBuf,
        /// Its format.
        format: VideoFormat,
    },
    /// A file per frame. Its name is `prefix`, the frame number with at least `digits` digits, and `suffix`.
    Sequence {
        /// Folder of the files.
        folder: PathBuf,
        /// Name before the number.
        prefix: String,
        /// Least number of digits, padded with zeros.
        digits: usize,
        /// Name after the number, with the extension.
        suffix: String,
    },
}

impl OutputPattern {
    /// Parses `picture.png`, `frame-%04d.png`, `turn.mp4` or `none`, for a run of `frames` frames.
    ///
    /// # Errors
    /// A name without a known extension, an invalid `%`, one name for many frames, or a number in the name of a video.
    pub(crate) fn parse(output: &Path, frames: u32) -> Result<Self, CommandError> {
        if output == Path::new(NONE) {
            return Ok(Self::None);
        }
        let refuse =
            |problem: String| Err(CommandError::WrongInput(format!("{}: {problem}", output.display())));
        let video = VideoFormat::of(output);
        let known = output
            .extension()
            .and_then(|extension| extension.to_str())
            .is_some_and(|extension| EXTENSIONS.iter().any(|known| known.eq_ignore_ascii_case(extension)));
        if !known && video.is_none() {
            return refuse(
                "pictures are written as .png or .ppm, linear ones as .exr or .hdr, videos as .gif, .apng, .mp4 or .webm; end \
                 the name with one of them"
                    .to_owned(),
            );
        }
        let Some(name) = output.file_name().and_then(|name| name.to_str()) else {
            return refuse("the file's name is not Unicode text".to_owned());
        };
        let folder = output.parent().unwrap_or(Path::new("")).to_owned();
        let name = split_number(name);
        if let (Some(format), Ok(name)) = (video, &name) {
            return match name {
                Name::Plain(name) => Ok(Self::Video { path: folder.join(name), format }),
                Name::Numbered { .. } => {
                    refuse("a video has all frames: leave the number out of its name".to_owned())
                }
            };
        }
        match name {
            Err(problem) => refuse(problem),
            Ok(Name::Plain(name)) if frames == 1 => Ok(Self::Single(folder.join(name))),
            Ok(Name::Plain(name)) => refuse(format!(
                "{frames} frames would overwrite each other; number them, as in {}, or write a video, as in {}",
                folder.join(numbered_example(&name)).display(),
                folder.join(&name).with_extension("apng").display()
            )),
            Ok(Name::Numbered { prefix, digits, suffix }) => {
                Ok(Self::Sequence { folder, prefix, digits, suffix })
            }
        }
    }

    /// Path and format of the video, if the output is one.
    pub(crate) fn video(&self) -> Option<(&Path, VideoFormat)> {
        match self {
            Self::Video { path, format } => Some((path, *format)),
            _ => None,
        }
    }

    /// Whether the files have linear light.
    pub(crate) fn is_linear(&self) -> bool {
        self.path(0).is_some_and(|path| image::is_linear(&path))
    }

    /// Whether the files may have several layers.
    pub(crate) fn has_layers(&self) -> bool {
        self.path(0).is_some_and(|path| image::has_layers(&path))
    }

    /// Path of the file of frame `index`, from 0; `None` without files.
    pub(crate) fn path(&self, index: u64) -> Option<PathBuf> {
        match self {
            Self::None => None,
            Self::Single(path) | Self::Video { path, .. } => Some(path.clone()),
            Self::Sequence { folder, prefix, digits, suffix } => {
                Some(folder.join(format!("{prefix}{index:0digits$}{suffix}")))
            }
        }
    }
}

enum Name {
    Plain(String),
    Numbered { prefix: String, digits: usize, suffix: String },
}

/// Splits a name at its only `%d` or `%04d`; `%%` is a per cent sign.
fn split_number(name: &str) -> Result<Name, String> {
    let (mut plain, mut number, mut rest) = (String::new(), None, name);
    while let Some((before, after)) = rest.split_once('%') {
        plain.push_str(before);
        if let Some(after) = after.strip_prefix('%') {
            plain.push('%');
            rest = after;
            continue;
        }
        let digits_end = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let (digits, after) = after.split_at(digits_end);
        let width = if digits.is_empty() { Some(0) } else { digits.parse().ok() };
        match (width.filter(|width| *width <= MAX_DIGITS), after.strip_prefix('d')) {
            (Some(width), Some(after)) if number.is_none() => {
                number = Some((std::mem::take(&mut plain), width));
                rest = after;
            }
            (Some(_), Some(_)) => return Err("the name holds two frame numbers; keep one".to_owned()),
            _ => {
                return Err(
                    "after % expected d or a number of digits and d, as in %04d (%% is a per cent sign)"
                        .to_owned(),
                );
            }
        }
    }
    plain.push_str(rest);
    Ok(match number {
        None => Name::Plain(plain),
        Some((prefix, digits)) => Name::Numbered { prefix, digits, suffix: plain },
    })
}

fn numbered_example(name: &str) -> String {
    let (stem, extension) = name.rsplit_once('.').unwrap_or((name, "png"));
    format!("{stem}-%04d.{extension}")
}

/// Checks, before any work is done for it, that `path` can be written.
///
/// # Errors
/// A missing or unwritable folder, or a folder in place of the file; the message names it.
pub(crate) fn check_writable(path: &Path) -> Result<(), CommandError> {
    let refuse = |problem: String| Err(CommandError::WrongInput(format!("{}: {problem}", path.display())));
    if path.is_dir() {
        return refuse("is a folder; name a file in it".to_owned());
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return refuse(format!("there is no folder {}; create it first", folder.display()));
    }
    // Permission bits do not suffice (read-only mounts, access lists): only writing is a proof.
    let probe = folder.join(format!(".rayfarm-{}.tmp", std::process::id()));
    match std::fs::OpenOptions::new().write(true).create_new(true).open(&probe) {
        Ok(_) => std::fs::remove_file(&probe).or_else(|error| refuse(error.to_string())),
        Err(error) => refuse(format!("cannot write into {}: {error}", folder.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(name: &str, frames: u32) -> Result<OutputPattern, String> {
        OutputPattern::parse(Path::new(name), frames).map_err(|error| error.to_string())
    }

    #[test]
    fn one_frame_goes_to_the_file_itself() {
        for name in ["picture.png", "out/picture.PPM", "/a/b.c/d.e.png"] {
            assert_eq!(parse(name, 1), Ok(OutputPattern::Single(name.into())));
        }
    }

    #[test]
    fn linear_files_are_known_by_their_extension() {
        let kinds = |name: &str| parse(name, 1).map(|pattern| (pattern.is_linear(), pattern.has_layers()));
        assert_eq!(
            ["a.png", "a.ppm", "none"].map(kinds),
            [Ok((false, false)), Ok((false, false)), Ok((false, false))]
        );
        assert_eq!(["a%02d.HDR", "a.exr"].map(kinds), [Ok((true, false)), Ok((true, true))]);
    }

    #[test]
    fn a_video_has_any_number_of_frames() {
        for (name, format) in [
            ("a.gif", VideoFormat::Gif),
            ("a.APNG", VideoFormat::Apng),
            ("a/b.mp4", VideoFormat::Mp4),
            ("a.webm", VideoFormat::WebM),
        ] {
            for frames in [1, 7] {
                let pattern = parse(name, frames).unwrap();
                assert_eq!(pattern.video(), Some((Path::new(name), format)));
                assert!(!pattern.is_linear() && !pattern.has_layers());
            }
        }
        assert_eq!(parse("a.png", 1).unwrap().video(), None);
    }

    #[test]
    fn none_has_no_file() {
        for frames in [1, 7] {
            assert_eq!(parse("none", frames).unwrap().path(0), None);
        }
        assert_eq!(parse("none.png", 1), Ok(OutputPattern::Single("none.png".into())));
    }

    #[test]
    fn a_sequence_is_numbered_from_zero() {
        let names = |name: &str| {
            let pattern = parse(name, 2000).unwrap();
            [0, 7, 12_345].map(|index| pattern.path(index).unwrap().to_str().unwrap().to_owned())
        };
        assert_eq!(names("o/f-%04d.png"), ["o/f-0000.png", "o/f-0007.png", "o/f-12345.png"]);
        assert_eq!(names("%d.ppm"), ["0.ppm", "7.ppm", "12345.ppm"]);
        assert_eq!(names("100%%-%02d.png"), ["100%-00.png", "100%-07.png", "100%-12345.png"]);
    }

    #[test]
    fn a_numbered_name_of_one_frame_has_a_number_too() {
        assert_eq!(parse("f%03d.png", 1).unwrap().path(0).as_deref(), Some(Path::new("f000.png")));
    }

    #[test]
    fn many_frames_need_a_number_and_the_message_shows_how() {
        let message = parse("out/walk.png", 12).unwrap_err();
        assert!(message.contains("out/walk.png") && message.contains("out/walk-%04d.png"), "{message}");
    }

    #[test]
    fn invalid_names_are_refused() {
        for (name, hint) in [
            ("turn-%d.gif", "leave the number out"),
            ("picture", ".png or .ppm"),
            ("picture.jpg", ".png or .ppm"),
            (".png", ".png or .ppm"),
            ("a%s.png", "%04d"),
            ("a%4x.png", "%04d"),
            ("a%.png", "%04d"),
            ("a%99999999999999999999d.png", "%04d"),
            ("a%19d.png", "%04d"),
            ("a%d-%d.png", "two frame numbers"),
        ] {
            let message = parse(name, 2).unwrap_err();
            assert!(message.contains(name) && message.contains(hint), "{name}: {message}");
        }
    }

    #[test]
    fn unwritable_paths_are_found_before_rendering() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"x").unwrap();
        let message = |path: &Path| check_writable(path).unwrap_err().to_string();
        assert!(message(&folder.path().join("missing/a.png")).contains("there is no folder"));
        assert!(message(&file.join("a.png")).contains("there is no folder"));
        assert!(message(folder.path()).contains("is a folder"));
        check_writable(&folder.path().join("a.png")).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the check leaves nothing behind");
    }
}
