//! A real browser for tests of the web display: Chromium without a window, driven over the WebDriver protocol (W3C).

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::{Running, free_port, require, wait_until};

/// Longest wait for one reply of the driver.
const REPLY_TIMEOUT: Duration = Duration::from_secs(120);

/// Key of an element's id in the protocol.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";

/// A browser with one empty page. It ends when it is dropped.
pub struct Browser {
    driver: Running,
    port: u16,
    session: String,
    _profile: TempDir,
}

impl Browser {
    /// Starts a browser with a page of `width` x `height` pixels and a new profile. Requires `chromium` and `chromedriver` (Debian's
    /// packages chromium and chromium-driver): see [`require`]. Returns `None` where one is missing: the test is to return then.
    pub fn start(width: u32, height: u32) -> Option<Self> {
        if !require(&["chromium", "chromedriver"]) {
            return None;
        }
        let port = free_port();
        let profile = tempfile::tempdir().unwrap();
        let mut command = Command::new("chromedriver");
        command.arg(format!("--port={port}")).stdin(Stdio::null()).env("HOME", profile.path());
        let driver = Running::start(&mut command);
        let mut browser = Self { driver, port, session: String::new(), _profile: profile };
        wait_until("the driver listens", || TcpStream::connect(("127.0.0.1", port)).is_ok());
        let data = browser._profile.path().join("data");
        let capabilities = json!({
            "browserName": "chrome",
            "acceptInsecureCerts": true,
            "goog:loggingPrefs": { "browser": "ALL" },
            "goog:chromeOptions": { "binary": chromium(), "args": arguments(&data, width, height) },
        });
        let body = json!({ "capabilities": { "alwaysMatch": capabilities } });
        let session = browser.call("POST", "/session", &body);
        browser.session = session["sessionId"].as_str().expect("a session").to_owned();
        Some(browser)
    }

    /// Opens an address.
    pub fn open(&self, url: &str) {
        self.command("url", &json!({ "url": url }));
    }

    /// Runs the body of a function and returns its value.
    pub fn run(&self, script: &str) -> Value {
        self.command("execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// Waits until an expression is true on the page.
    pub fn wait_for(&self, expression: &str) {
        wait_until(expression, || self.run(&format!("return Boolean({expression});")) == true);
    }

    /// Clicks the first element of a selector.
    pub fn click(&self, selector: &str) {
        let found = self.command("element", &json!({ "using": "css selector", "value": selector }));
        let id = found[ELEMENT].as_str().unwrap_or_else(|| panic!("no element {selector}: {found}"));
        self.command(&format!("element/{id}/click"), &json!({}));
    }

    /// Drags the mouse from the centre of an element by a number of pixels.
    pub fn drag(&self, selector: &str, (right, down): (i32, i32)) {
        let element = self.command("element", &json!({ "using": "css selector", "value": selector }));
        let step = |x: i32, y: i32, duration: u32| json!({ "type": "pointerMove", "duration": duration, "x": x, "y": y, "origin": element });
        let actions = [
            step(0, 0, 0),
            json!({ "type": "pointerDown", "button": 0 }),
            step(right / 2, down / 2, 50),
            step(right, down, 50),
            json!({ "type": "pointerUp", "button": 0 }),
        ];
        let mouse = json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": actions });
        self.command("actions", &json!({ "actions": [mouse] }));
    }

    /// Presses and releases a key.
    pub fn press(&self, key: &str) {
        let actions = [json!({ "type": "keyDown", "value": key }), json!({ "type": "keyUp", "value": key })];
        self.command("actions", &json!({ "actions": [{ "type": "key", "id": "keys", "actions": actions }] }));
    }

    /// Returns the errors of the console since the last call.
    pub fn console(&self) -> Vec<String> {
        let entries = self.command("se/log", &json!({ "type": "browser" }));
        let entries = entries.as_array().expect("a list of entries").iter();
        let errors = entries.filter(|entry| entry["level"] == "SEVERE");
        errors.map(|entry| entry["message"].as_str().unwrap_or_default().to_owned()).collect()
    }

    /// Sends a command of the session. Fails the test where the driver refuses it.
    fn command(&self, path: &str, body: &Value) -> Value {
        self.call("POST", &format!("/session/{}/{path}", self.session), body)
    }

    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let (status, reply) = self.request(method, path, &body.to_string());
        let value = reply["value"].clone();
        assert!(status == 200, "{method} {path}: {value}; the driver: {}", self.driver.stdout());
        value
    }

    /// Sends a request to the driver and returns status and body of the response.
    fn request(&self, method: &str, path: &str, body: &str) -> (u16, Value) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(REPLY_TIMEOUT)).unwrap();
        let (port, length) = (self.port, body.len());
        let head = format!(
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        stream.write_all((head + body).as_bytes()).unwrap();
        let mut stream = BufReader::new(stream);
        let (mut head, mut length) = (String::new(), 0);
        // The driver keeps the connection open, so the header says where the body ends.
        while !head.ends_with("\r\n\r\n") {
            let start = head.len();
            let count = stream.read_line(&mut head).expect("the driver does not reply");
            assert!(count > 0, "the driver ends the connection after {head:?}");
            let line = head[start..].to_ascii_lowercase();
            if let Some(value) = line.strip_prefix("content-length:") {
                length = value.trim().parse().expect("a length");
            }
        }
        let mut body = vec![0; length];
        stream.read_exact(&mut body).expect("the driver does not reply");
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
        (status, serde_json::from_slice(&body).unwrap_or(Value::Null))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The driver ends the browser with its session. It may have failed before there was one.
        if !self.session.is_empty() && !std::thread::panicking() {
            self.request("DELETE", &format!("/session/{}", self.session), "");
        } else {
            let processes = self.driver.children();
            processes.into_iter().for_each(|id| crate::process::signal(id, "KILL"));
        }
    }
}

/// Path of the browser.
fn chromium() -> String {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found =
        std::env::split_paths(&paths).map(|folder| folder.join("chromium")).find(|path| path.is_file());
    found.expect("required before").to_string_lossy().into_owned()
}

fn arguments(data: &Path, width: u32, height: u32) -> Vec<String> {
    let mut arguments: Vec<String> = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
    ]
    .map(str::to_owned)
    .to_vec();
    arguments.push(format!("--window-size={width},{height}"));
    arguments.push(format!("--user-data-dir={}", data.display()));
    arguments
}
