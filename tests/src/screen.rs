//! A virtual screen for the window.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::wait_until;

/// A virtual X11 screen of 1280x1024 pixels, gone when dropped.
pub struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts one of 24 bits. Where `Xvfb`, `xdotool` or ImageMagick's `import` is missing it says so and returns `None`, unless
    /// `RAYFARM_REQUIRE_WINDOW` is set: then the test fails.
    pub fn start() -> Option<Self> {
        Self::of_depth(24)
    }

    /// Starts one whose pixels have `depth` bits; otherwise as [`Screen::start`].
    pub fn of_depth(depth: u32) -> Option<Self> {
        let missing: Vec<&str> =
            ["Xvfb", "xdotool", "import"].into_iter().filter(|program| !is_installed(program)).collect();
        if !missing.is_empty() {
            assert!(
                std::env::var_os("RAYFARM_REQUIRE_WINDOW").is_none(),
                "{missing:?} not installed, and RAYFARM_REQUIRE_WINDOW is set"
            );
            eprintln!("skipped: {missing:?} not installed (apt-get install xvfb xdotool imagemagick)");
            return None;
        }
        // Process ids are unique, and so are the numbers within a process; what another program has taken is passed
        // over.
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let first = 100 + std::process::id() % 2_000 * 20;
        (0..20)
            .map(|_| first + NEXT.fetch_add(1, Ordering::Relaxed))
            .find_map(|number| Self::on(number, depth))
    }

    fn on(number: u32, depth: u32) -> Option<Self> {
        let socket = format!("/tmp/.X11-unix/X{number}");
        if Path::new(&socket).exists() {
            return None;
        }
        let display = format!(":{number}");
        // Without -noreset a server that its last client leaves starts anew and refuses clients meanwhile.
        let server = Command::new("Xvfb")
            .args([&display, "-noreset", "-nolisten", "tcp", "-screen", "0", &format!("1280x1024x{depth}")])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_until("Xvfb listens", || Path::new(&socket).exists());
        Some(Self { server, display })
    }

    /// Lets a command open its windows here.
    pub fn show<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY")
    }

    /// Runs `xdotool` and returns what it prints, or `None` if it fails (a window that is not there yet).
    pub fn xdotool(&self, args: &[&str]) -> Option<String> {
        let output = self.show(Command::new("xdotool").args(args)).output().unwrap();
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// Writes what the screen shows as a picture.
    pub fn shoot(&self, file: &Path) {
        let status = self.show(Command::new("import").args(["-window", "root"]).arg(file)).status();
        assert!(status.unwrap().success(), "import failed");
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn is_installed(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| folder.join(program).is_file())
}
