//! A virtual screen for tests of the window.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::{require, wait_until};

/// A virtual X11 screen of 1280x1024 pixels. Its server ends when it is dropped.
pub struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts a screen of 24 bits per pixel. Requires `Xvfb`, `xdotool` and ImageMagick's `import`: see [`require`]. Returns
    /// `None` where one is missing: the test is to return then.
    pub fn start() -> Option<Self> {
        Self::of_depth(24)
    }

    /// Starts a screen of `depth` bits per pixel: see [`Screen::start`].
    pub fn of_depth(depth: u32) -> Option<Self> {
        // Debian's packages: xvfb, xdotool, imagemagick.
        if !require(&["Xvfb", "xdotool", "import"]) {
            return None;
        }
        // The numbers of two processes and of two tests of a process differ. A display that exists already is skipped.
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
        // Without -noreset the server restarts after its last client, and refuses clients while it restarts.
        let server = Command::new("Xvfb")
            .args([&display, "-noreset", "-nolisten", "tcp", "-screen", "0", &format!("1280x1024x{depth}")])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_until("Xvfb listens", || Path::new(&socket).exists());
        Some(Self { server, display })
    }

    /// Makes a command open its windows on this screen.
    pub fn attach<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY")
    }

    /// Runs `xdotool` and returns its output, or `None` where it fails, as for a window that does not exist yet.
    pub fn xdotool(&self, args: &[&str]) -> Option<String> {
        let output = self.attach(Command::new("xdotool").args(args)).output().unwrap();
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// Writes a screenshot.
    pub fn capture(&self, file: &Path) {
        let status = self.attach(Command::new("import").args(["-window", "root"]).arg(file)).status();
        assert!(status.unwrap().success(), "import failed");
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
