//! Tests of the web display with a real browser.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;

use rayfarm_tests::{Browser, Running, Scenes, free_port, master, wait_until};
use serde_json::Value;

/// Size of the picture of the scene `small.toml`.
const SIZE: (usize, usize) = (160, 120);

/// Script that returns the pixels of the picture as hexadecimal digits.
const PIXELS: &str = "
    const canvas = document.getElementById('picture');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let text = '';
    for (let at = 0; at < data.length; at += 4) {
        for (let channel = 0; channel < 3; channel += 1) text += data[at + channel].toString(16).padStart(2, '0');
    }
    return text;";

/// Condition that the picture is complete and exact.
const EXACT: &str = "document.getElementById('picture').dataset.exact === 'true'";

fn view(scenes: &Scenes, web: &str, more: &[&str]) -> Command {
    let mut command = master();
    command.arg("view").arg(scenes.path("small.toml")).args(["--listen", "127.0.0.1:0", "--web", web]);
    command.args(["--local-workers", "2", "--threads", "1"]).args(more);
    command.env("XDG_STATE_HOME", scenes.path("state"));
    command
}

/// Starts a view, and returns it with the address that its log names.
fn start(command: &mut Command) -> (Running, String) {
    let mut run = Running::start(command);
    run.wait_for("?token=");
    let log = run.stderr();
    let at = log.find("http").unwrap();
    (run, log[at..].split_whitespace().next().unwrap().to_owned())
}

/// The picture as `render` writes it, as hexadecimal digits.
fn rendered(scenes: &Scenes) -> String {
    let output = scenes.path("rendered.ppm");
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(&output);
    Running::start(command.args(["--listen", "127.0.0.1:0"])).finish().expect_success();
    let file = scenes.read("rendered.ppm");
    let pixels = &file[file.len() - SIZE.0 * SIZE.1 * 3..];
    pixels.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Sends a request for JSON without a browser, with the token of an address.
fn api(url: &str, method: &str, path: &str, body: &str) -> Value {
    let (_, rest) = url.split_once("://").unwrap();
    let (host, token) = rest.split_once("/?token=").unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let length = body.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all((head + body).as_bytes()).unwrap();
    let mut response = String::new();
    stream.read_to_string(&mut response).unwrap();
    serde_json::from_str(response.split_once("\r\n\r\n").unwrap().1).unwrap()
}

fn wait_for_picture(browser: &Browser, expected: &str) {
    let mut pixels = String::new();
    wait_until("the page shows the exact picture", || {
        browser.wait_for(EXACT);
        browser.run(PIXELS).as_str().unwrap().clone_into(&mut pixels);
        pixels == expected
    });
}

#[test]
fn a_page_shows_moves_and_commands_and_finds_a_master_again() {
    let Some(browser) = Browser::start(1280, 800) else { return };
    let scenes = Scenes::new();
    let expected = rendered(&scenes);
    let place = format!("127.0.0.1:{}", free_port());
    let (run, url) = start(&mut view(&scenes, &place, &[]));
    browser.open(&url);
    wait_for_picture(&browser, &expected);
    assert_eq!(browser.run("return location.search;"), "", "the token is in no address any more");
    assert_eq!(browser.run("return document.cookie;"), "", "scripts cannot read the token");

    browser.drag("#picture", (120, 30));
    let moved = || {
        browser.wait_for(EXACT);
        browser.run(PIXELS) != expected.as_str()
    };
    wait_until("the drag has moved the camera", moved);
    browser.press("r");
    wait_for_picture(&browser, &expected);

    let workers = || api(&url, "GET", "/api/status", "")["workers"].as_array().unwrap().len();
    wait_until("both workers are connected", || workers() == 2);
    browser.wait_for("document.querySelectorAll('#workers li').length === 2");
    browser.click("#workers .kick");
    wait_until("the farm has one worker", || workers() == 1);
    browser.wait_for("document.querySelectorAll('#workers li').length === 1");
    browser.wait_for("document.querySelectorAll('#kicked li').length === 1");

    browser.run("document.getElementById('option-samples').value = 4; document.getElementById('option-samples').onchange();");
    let samples = || api(&url, "GET", "/api/status", "")["options"]["samples"].as_f64();
    wait_until("the option is set", || samples() == Some(4.0));
    assert_eq!(browser.console(), [""; 0], "the console has errors");

    drop(run);
    browser.wait_for("document.body.dataset.connected === 'false'");
    let (run, again) = start(&mut view(&scenes, &place, &[]));
    assert_eq!(again, url, "the token is kept");
    browser.wait_for("document.body.dataset.connected === 'true'");
    wait_for_picture(&browser, &expected);
    // While there is no master, the browser itself reports that it cannot connect.
    let other = browser.console().into_iter().filter(|line| !line.contains("WebSocket connection to"));
    assert_eq!(other.collect::<Vec<_>>(), [""; 0]);

    assert_eq!(api(&url, "POST", "/api/command", "quit")["ok"], true);
    run.finish().expect_success();
}

#[test]
fn beyond_loopback_the_page_is_encrypted_and_needs_the_token() {
    let Some(browser) = Browser::start(390, 844) else { return };
    let scenes = Scenes::new();
    let expected = rendered(&scenes);
    let port = free_port();
    let (run, url) = start(&mut view(&scenes, &format!("0.0.0.0:{port}"), &[]));
    let (_, token) = url.split_once("/?token=").unwrap();
    assert!(url.starts_with("https://"), "{url}");
    let place = format!("https://127.0.0.1:{port}/");
    browser.open(&place);
    let text = browser.run("return document.body.textContent;");
    assert!(text.as_str().unwrap().contains("token"), "{text}");
    // The refusal of the page and of its icon.
    let refused = browser.console();
    assert!(refused.iter().all(|line| line.contains("401")), "{refused:?}");
    browser.open(&format!("{place}?token={token}"));
    wait_for_picture(&browser, &expected);
    browser.wait_for("document.documentElement.scrollWidth <= innerWidth");
    assert_eq!(browser.console(), [""; 0]);
    drop(run);
}

#[test]
fn a_picture_is_rendered_for_a_program_without_a_page() {
    let scenes = Scenes::new();
    let expected = rendered(&scenes);
    let (run, url) = start(&mut view(&scenes, "127.0.0.1:0", &[]));
    let (host, _) = url.split_once("://").unwrap().1.split_once('/').unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let head = format!("GET /api/frame.png HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(head.as_bytes()).unwrap();
    let mut response = Vec::new();
    stream.read_to_end(&mut response).unwrap();
    let at = response.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap() + 4;
    let picture = rayfarm_tracer::image::load(&scenes.write("picture.png", &response[at..])).unwrap();
    let digits: String = picture.pixels.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(digits, expected);
    run.signal("INT");
    run.finish().expect_success();
}

#[test]
fn an_address_in_use_ends_the_view_with_a_remedy() {
    let scenes = Scenes::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let place = taken.local_addr().unwrap().to_string();
    Running::start(&mut view(&scenes, &place, &[])).finish().expect_failure(2, &[&place, "--web"]);
}
