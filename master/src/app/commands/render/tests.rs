//! Runs with workers that send wrong pixels: files and exit status.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rayfarm_farm::testing::fake_worker::{self, Script};
use rayfarm_tracer::image::{self, LinearImage, SkyPixels};
use rayfarm_tracer::srgb;
use tokio::task::JoinHandle;

use super::*;
use crate::app::cli::Invocation;
use crate::test_worker;

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(120);
const SCENE: &str = r#"
[render]
width = 32
height = 64

[camera]
position = [0.0, 0.0, 3.0]
look_at = [0.0, 0.0, 0.0]
fov = 45.0

[[light]]
kind = "point"
position = [2.0, 3.0, 4.0]

[material.clay]
diffuse = [0.7, 0.4, 0.3]

[[sphere]]
center = [0.0, 0.0, 0.0]
radius = 1.0
material = "clay"
"#;

/// Runs of `render` in a folder, and the address of their workers.
struct Renders {
    folder: tempfile::TempDir,
    address: SocketAddr,
}

impl Renders {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        let address = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        Self { folder, address }
    }

    fn file(&self, name: &str, index: u32) -> PathBuf {
        self.folder.path().join(format!("{name}-{index}.ppm"))
    }

    /// Renders frames to `NAME-0.ppm` and so on, one segment each, all verified.
    fn start(&self, name: &str, frames: u32) -> JoinHandle<Result<(), CommandError>> {
        self.start_as(
            &format!("{name}-%d.ppm"),
            &format!("--frames {frames} --segment static:64 --verify 100"),
        )
    }

    /// Renders to files of this name with these options.
    fn start_as(&self, output: &str, options: &str) -> JoinHandle<Result<(), CommandError>> {
        let path = |file: &str| self.folder.path().join(file).display().to_string();
        let words = format!(
            "rayfarm-master render {} -o {} {options} --wait-for-workers 1 --no-local-workers --listen {}",
            path("scene.toml"),
            path(output),
            self.address
        );
        let parsed = Invocation::parse(words.split_whitespace().map(Into::into)).unwrap();
        let Invocation::Command(command, _) = parsed else { panic!("no command") };
        tokio::task::spawn_blocking(|| crate::app::commands::run(*command))
    }

    /// Waits until the run listens.
    async fn ready(&self) {
        while tokio::net::TcpStream::connect(self.address).await.is_err() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Starts a worker that renders the scene.
    fn real_worker(&self) -> JoinHandle<()> {
        test_worker::start(self.address)
    }
}

/// The pixels of a picture of linear light.
fn linear(path: &Path) -> LinearImage {
    match image::load_sky(path).unwrap().pixels {
        SkyPixels::Linear(picture) => picture,
        SkyPixels::Srgb(_) => panic!("{} is not linear", path.display()),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn linear_files_show_the_same_light_and_have_the_requested_layers() {
    let renders = Renders::new();
    let outputs = [
        ("shown-%d.ppm", ""),
        ("one-%d.hdr", ""),
        ("layers-%d.exr", "--aov albedo,normal,depth,item"),
        // A file has its layers already, the other one is missing.
        ("layers-%d.exr", "--aov albedo,normal,depth,item --resume"),
    ];
    for (output, options) in outputs {
        if options.contains("--resume") {
            std::fs::remove_file(renders.folder.path().join("layers-1.exr")).unwrap();
        }
        let run = renders.start_as(output, &format!("--frames 2 --orbit 90 {options}"));
        renders.ready().await;
        renders.real_worker();
        in_time(run).await.unwrap().unwrap();
    }
    for index in 0..2 {
        let path = |name: &str| renders.folder.path().join(name.replace("%d", &index.to_string()));
        let names = image::layer_names(&path("layers-%d.exr"), 32, 64).unwrap();
        assert_eq!(names, ["beauty", "albedo", "normal", "depth", "item"]);
        let shown = image::load(&path("shown-%d.ppm")).unwrap();
        for (name, tolerance) in [("layers-%d.exr", 1), ("one-%d.hdr", 3)] {
            let light = linear(&path(name));
            assert!(light.pixels.iter().any(|value| *value > 0.1), "{name} is not black");
            let encoded = light.pixels.as_chunks::<3>().0.iter().map(|light| srgb::encode((*light).into()));
            let off = encoded.flatten().zip(&shown.pixels).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(tolerance), "{name}: off by {off:?}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn denoised_files_show_the_same_light_in_any_cut_and_say_so() {
    let renders = Renders::new();
    let outputs = [
        ("noisy-%d.ppm", ""),
        ("denoised-%d.ppm", "--denoise"),
        ("cut-%d.ppm", "--denoise --segment static:64"),
        ("small-%d.ppm", "--denoise --scale 1/2"),
        ("layers-%d.exr", "--denoise --aov normal"),
    ];
    for (output, options) in outputs {
        let paths = "--integrator path --samples 8 --frames 2 --orbit 90";
        let run = renders.start_as(output, &format!("{paths} {options}"));
        renders.ready().await;
        renders.real_worker();
        in_time(run).await.unwrap().unwrap();
    }
    for index in 0..2 {
        let path = |name: &str| renders.folder.path().join(name.replace("%d", &index.to_string()));
        let [noisy, denoised, cut, small] = ["noisy-%d.ppm", "denoised-%d.ppm", "cut-%d.ppm", "small-%d.ppm"]
            .map(|name| image::load(&path(name)).unwrap());
        assert!(denoised == cut && denoised != noisy && small != denoised);
        assert_eq!((small.width, small.height), (32, 64));
        let difference = image::compare(&noisy, &denoised).unwrap();
        assert!(difference.rmse < 8.0, "{}", difference.rmse);
        assert_eq!(image::layer_names(&path("layers-%d.exr"), 32, 64).unwrap(), ["denoised", "normal"]);
        let light = linear(&path("layers-%d.exr"));
        let encoded = light.pixels.as_chunks::<3>().0.iter().map(|light| srgb::encode((*light).into()));
        let off = encoded.flatten().zip(&denoised.pixels).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(1), "off by {off:?}");
    }
}

#[test]
fn files_that_cannot_have_what_is_requested_are_refused_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).unwrap();
    for (output, options, hint) in [
        ("a.png", "--aov depth", ".exr"),
        ("a.hdr", "--aov depth", ".exr"),
        ("a.exr", "--aov depth,item,depth", "depth twice"),
        ("a.exr", "--scale 1/2", "--scale 1"),
        ("a.png", "--denoise", "--integrator path"),
        ("a.png", "--denoise --integrator path --max-noise 0.1", "--max-noise"),
    ] {
        let output = folder.path().join(output);
        let words = format!("rayfarm-master render {} -o {} {options}", scene.display(), output.display());
        let Invocation::Command(command, _) = Invocation::parse(words.split(' ').map(Into::into)).unwrap()
        else {
            panic!("no command")
        };
        let error = crate::app::commands::run(*command).unwrap_err().to_string();
        assert!(error.contains(hint), "{options}: {error}");
        assert!(!output.exists());
    }
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

async fn in_time<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, what).await.expect("it never comes to pass")
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_with_wrong_rows_are_rendered_again_and_their_files_are_replaced() {
    let renders = Renders::new();
    let run = renders.start("right", 3);
    renders.ready().await;
    renders.real_worker();
    in_time(run).await.unwrap().unwrap();

    // The pixels of a fake worker are not those of this scene.
    let run = renders.start("repaired", 3);
    renders.ready().await;
    let worker = fake_worker::start(renders.address, Script::Correct).await;
    in_time(worker).await.unwrap();
    renders.real_worker();
    in_time(run).await.unwrap().unwrap();
    for index in 0..3 {
        assert!(
            bytes(&renders.file("repaired", index)) == bytes(&renders.file("right", index)),
            "frame {index}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_that_cannot_render_its_frames_again_names_them_and_fails() {
    let renders = Renders::new();
    let run = renders.start("wrong", 1);
    renders.ready().await;
    // The only segment is the frame: it is complete before it is verified.
    let worker = fake_worker::start(renders.address, Script::Correct).await;
    in_time(worker).await.unwrap();
    let error = in_time(run).await.unwrap().unwrap_err();
    assert_eq!(error.exit_code(), std::process::ExitCode::from(1));
    assert!(error.to_string().contains("frames 0 "), "{error}");
    assert!(renders.file("wrong", 0).exists());
}

/// Renders a picture to `NAME-0.ppm` with paths and these options, by a number of workers.
async fn render_paths(
    renders: &Renders,
    name: &str,
    options: &str,
    workers: u32,
) -> Result<(), CommandError> {
    let run = renders.start_as(&format!("{name}-%d.ppm"), &format!("--integrator path {options}"));
    // A run with wrong options does not listen.
    tokio::select! {
        () = renders.ready() => {}
        () = async { while !run.is_finished() { tokio::time::sleep(Duration::from_millis(5)).await } } => {}
    }
    (0..workers).for_each(|_| drop(renders.real_worker()));
    in_time(run).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_continued_picture_is_that_of_a_run_without_interruption() {
    let renders = Renders::new();
    let path = |name: &str| renders.folder.path().join(name);
    let picture = |name: &str| bytes(&renders.file(name, 0));
    render_paths(&renders, "whole", "--samples 24", 1).await.unwrap();
    let film = path("a.film").display().to_string();
    render_paths(&renders, "part", &format!("--samples 5 --checkpoint {film}"), 2).await.unwrap();
    assert!(picture("part") != picture("whole"));
    render_paths(&renders, "rest", &format!("--samples 24 --continue {film}"), 2).await.unwrap();
    assert!(picture("rest") == picture("whole"));
    // Nothing is left to render, and another exposure shows the same film.
    render_paths(&renders, "again", &format!("--samples 24 --continue {film}"), 1).await.unwrap();
    assert!(picture("again") == picture("whole"));
    render_paths(&renders, "brighter", "--samples 24 --exposure 1", 1).await.unwrap();
    render_paths(&renders, "film", &format!("--samples 24 --exposure 1 --continue {film}"), 1).await.unwrap();
    assert!(picture("film") == picture("brighter") && picture("film") != picture("whole"));
    // A run that its time ends has at least one sample.
    let early = path("b.film").display().to_string();
    render_paths(&renders, "early", &format!("--samples 24 --time 0.001 --checkpoint {early}"), 1)
        .await
        .unwrap();
    render_paths(&renders, "late", &format!("--samples 24 --continue {early}"), 1).await.unwrap();
    assert!(picture("late") == picture("whole"));

    for (options, hint) in [
        (format!("--samples 24 --seed 4 --continue {film}"), "another picture"),
        (format!("--samples 24 --size 32x63 --continue {film}"), "32x64 pixels"),
        (format!("--samples 5 --continue {film}"), "24 samples already"),
        (format!("--samples 5 --continue {film}.none"), "cannot be read"),
        (format!("--integrator direct --samples 4 --continue {film}"), "--integrator path"),
        (format!("--samples 5 --frames 2 --checkpoint {film}"), "one picture"),
    ] {
        let error = render_paths(&renders, "refused", &options, 0).await.unwrap_err().to_string();
        assert!(error.contains(hint), "{options}: {error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_ends_at_its_largest_noise() {
    let renders = Renders::new();
    let film = renders.folder.path().join("a.film");
    let options = format!("--samples 4096 --max-noise 0.5 --checkpoint {}", film.display());
    render_paths(&renders, "noisy", &options, 2).await.unwrap();
    let samples = u32::from_le_bytes(bytes(&film)[20..24].try_into().unwrap());
    assert!((2..4096).contains(&samples) && (samples.is_power_of_two() || samples.is_multiple_of(16)));
    render_paths(&renders, "same", &format!("--samples {samples}"), 1).await.unwrap();
    assert!(bytes(&renders.file("noisy", 0)) == bytes(&renders.file("same", 0)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_film_with_wrong_pixels_starts_again() {
    let renders = Renders::new();
    render_paths(&renders, "right", "--samples 6", 1).await.unwrap();
    let options = "--integrator path --samples 6 --verify 100 --checkpoint";
    let film = renders.folder.path().join("a.film");
    let run = renders.start_as("again-%d.ppm", &format!("{options} {}", film.display()));
    renders.ready().await;
    let worker = fake_worker::start(renders.address, Script::Correct).await;
    in_time(worker).await.unwrap();
    renders.real_worker();
    in_time(run).await.unwrap().unwrap();
    assert!(bytes(&renders.file("again", 0)) == bytes(&renders.file("right", 0)));
}
