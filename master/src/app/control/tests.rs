use std::net::SocketAddr;
use std::time::Duration;

use proptest::prelude::*;
use rayfarm_farm::testing::fake_worker::{self, Script};
use rayfarm_farm::testing::test_scene::{scene, view};
use rayfarm_farm::{Farm, FarmOptions, FarmScene, SegmentPolicy};
use rayfarm_tracer::scene::{RenderScale, Setting};
use serde_json::Value;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio_util::sync::CancellationToken;

use super::command::{Command, WorkerSelector};
use super::console::Then;
use super::lines::{Line, LineSplitter, MAX_LINE_BYTES};
use super::*;
use crate::viewer::orbit::Animation;
use crate::viewer::{CameraControl, RequestPolicy, Viewer, ViewerConfig};

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);

async fn farm() -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy: SegmentPolicy::Adaptive, ..FarmOptions::default() };
    Farm::start(options, FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() })
        .await
        .unwrap()
}

async fn until_workers(farm: &Farm, count: usize) {
    let wait = async {
        while farm.status().workers.len() != count {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(PATIENCE, wait).await.expect("the number of workers is never reached");
}

fn console(farm: &Farm) -> (Console, CancellationToken) {
    let quit = CancellationToken::new();
    (Console::new(farm.control(), None, quit.clone()), quit)
}

fn ask(console: &Console, line: &str) -> Value {
    let answer = console.answer(&Line::Text(line.to_owned()));
    assert!(answer.line.ends_with('\n') && answer.line.matches('\n').count() == 1);
    serde_json::from_str(&answer.line).unwrap()
}

#[test]
fn lines_are_parsed_as_documented() {
    let one = |name: &str| WorkerSelector::One(name.to_owned());
    for (line, command) in [
        ("workers", Command::Workers),
        ("  status \t", Command::Status),
        ("drain 3", Command::Drain(one("3"))),
        ("kick the old mill", Command::Kick(one("the old mill"))),
        ("pause", Command::Pause(WorkerSelector::All)),
        ("resume\tmill", Command::Resume(one("mill"))),
        ("allow mill", Command::Allow("mill".to_owned())),
        ("set denoise on", Command::Denoise(true)),
        (" set denoise  off ", Command::Denoise(false)),
        ("help", Command::Help),
        ("quit", Command::Quit),
    ] {
        assert_eq!(Command::parse(line), Ok(command));
    }
    for (line, fact) in [
        ("", "help"),
        ("kik 3", "kik"),
        ("kick", "kick"),
        ("drain ", "drain"),
        ("allow", "allow"),
        ("quit now", "now"),
        ("set denoise", "on or off"),
        ("set denoise 1", "on or off"),
    ] {
        let error = Command::parse(line).unwrap_err();
        assert!(error.contains(fact), "{line}: {error}");
    }
}

#[test]
fn a_knob_is_set_by_its_option_or_its_name() {
    let parsed = |line: &str| match Command::parse(line) {
        Ok(Command::Set(change)) => {
            let mut setting = Setting::FULL;
            change.value.apply(&mut setting);
            (change.knob.name, setting)
        }
        other => panic!("{line}: {other:?}"),
    };
    assert_eq!(parsed("set samples 4"), ("samples", Setting { samples: 4, ..Setting::FULL }));
    assert_eq!(parsed(" set  scale  1/2 "), ("scale", Setting { scale: RenderScale::Half, ..Setting::FULL }));
    assert_eq!(parsed("set shadow-samples 4"), parsed("set shadow_samples 4"));
    assert_eq!(parsed("set adaptive on").0, "adaptive");
    for (line, facts) in [
        ("set", &["samples", "adaptive"][..]),
        ("set fly 3", &["fly", "samples"]),
        ("set samples", &["samples", "65536"]),
        ("set samples 0", &["samples", "65536"]),
        ("set adaptive perhaps", &["adaptive", "on", "off"]),
        ("set max-depth 99999999", &["max-depth"]),
    ] {
        let error = Command::parse(line).unwrap_err();
        assert!(facts.iter().all(|fact| error.contains(fact)), "{line}: {error}");
    }
}

#[tokio::test]
async fn a_run_without_a_view_refuses_to_set_knobs() {
    let farm = farm().await;
    let (console, _quit) = console(&farm);
    assert_eq!(ask(&console, "set samples 4")["ok"], false);
    assert_eq!(ask(&console, "set denoise on")["ok"], false);
    farm.shut_down().await;
}

#[tokio::test]
async fn a_set_knob_is_in_the_next_frame_of_the_view() {
    let farm = farm().await;
    fake_worker::start(farm.address(), Script::Correct).await;
    let control = farm.control();
    let animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };
    let config = ViewerConfig {
        request: view().into(),
        camera: CameraControl::new(view().camera, None),
        policy: RequestPolicy { animation, limit: None, continuous: false },
        log: None,
        controller: None,
        denoised: false,
    };
    let (viewer, mut handle) = Viewer::interactive(farm, config);
    let stop = CancellationToken::new();
    let console = Console::new(control, Some(handle.knob_sender()), stop.clone());
    let running = {
        let stop = stop.clone();
        tokio::spawn(async move { viewer.run(&stop).await })
    };
    assert_eq!(ask(&console, "set samples 9")["knob"], "samples");
    let wait = async {
        while handle.new_frame().is_none_or(|frame| frame.frame.view.samples != 9) {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(PATIENCE, wait).await.expect("no frame has nine samples");
    stop.cancel();
    running.await.unwrap().0.shut_down().await;
    drop(handle);
    assert_eq!(ask(&console, "set samples 4")["ok"], false, "the view has ended");
}

#[test]
fn only_loopback_addresses_accept_commands() {
    assert_eq!(Place::parse("-"), Ok(Place::StandardInput));
    assert_eq!(Place::parse("127.0.0.1:7118"), Ok(Place::Tcp(([127, 0, 0, 1], 7118).into())));
    assert!(matches!(Place::parse("[::1]:0"), Ok(Place::Tcp(_))));
    assert_eq!(Place::parse("./control"), Ok(Place::Unix("./control".into())));
    for outside in ["0.0.0.0:7118", "192.168.1.2:7118", "[::]:7118"] {
        let error = Place::parse(outside).unwrap_err();
        assert!(error.contains("127.0.0.1:7118"), "{error}");
    }
    assert!(Place::parse("control").unwrap_err().contains("./control"));
}

proptest! {
    #[test]
    fn lines_do_not_depend_on_how_they_arrive(lines in prop::collection::vec("[^\\x00-\\x08\\x0a-\\x1f\\x7f]{0,40}", 0..10), open in "[a-z]{0,9}") {
        let text: String = lines.iter().map(|line| format!("{line}\r\n")).chain([open.clone()]).collect();
        let mut splitter = LineSplitter::default();
        let mut read: Vec<Line> = text.bytes().filter_map(|byte| splitter.push(byte)).collect();
        read.extend(splitter.end());
        let expected = lines.into_iter().chain((!open.is_empty()).then_some(open));
        prop_assert_eq!(read, expected.map(Line::Text).collect::<Vec<_>>());
    }

    #[test]
    fn no_bytes_make_a_line_longer_than_its_bound(bytes in prop::collection::vec(any::<u8>(), 0..5000)) {
        let mut splitter = LineSplitter::default();
        for byte in bytes {
            if let Some(Line::Text(text)) = splitter.push(byte) {
                // A byte that is not UTF-8 becomes a character of three bytes.
                prop_assert!(text.len() <= 3 * MAX_LINE_BYTES);
            }
        }
    }
}

#[test]
fn an_endless_line_is_refused_and_the_next_one_is_not() {
    let mut splitter = LineSplitter::default();
    let text = "x".repeat(MAX_LINE_BYTES + 1) + "\nhelp\n";
    let read: Vec<Line> = text.bytes().filter_map(|byte| splitter.push(byte)).collect();
    assert_eq!(read, [Line::TooLong, Line::Text("help".to_owned())]);
}

#[tokio::test]
async fn workers_are_listed_paused_resumed_kicked_and_allowed() {
    let mut farm = farm().await;
    let worker = fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    let (console, quit) = console(&farm);
    let listed = ask(&console, "workers");
    assert_eq!((&listed["ok"], &listed["workers"][0]["name"]), (&true.into(), &"fake".into()));
    let id = listed["workers"][0]["id"].as_u64().unwrap();

    assert_eq!(ask(&console, "pause fake")["workers"], serde_json::json!([id]));
    assert_eq!(ask(&console, "workers")["workers"][0]["state"], "paused");
    assert_eq!(ask(&console, "resume")["workers"], serde_json::json!([id]));
    farm.request(view());
    tokio::time::timeout(PATIENCE, farm.finished()).await.unwrap().unwrap();

    assert_eq!(ask(&console, &format!("kick {id}"))["ok"], true);
    let reason = worker.await.unwrap().disconnect_reason.unwrap();
    assert!(reason.contains("kicked"), "{reason}");
    assert_eq!(ask(&console, "status")["kicked"], serde_json::json!(["fake"]));
    assert_eq!(ask(&console, "allow fake")["allowed"], 1);
    assert!(ask(&console, "allow fake")["error"].as_str().unwrap().contains("fake"));
    assert!(ask(&console, "kick fake")["error"].as_str().unwrap().contains("fake"));
    assert_eq!(ask(&console, "help")["ok"], true);
    assert_eq!(console.answer(&Line::Text("quit".to_owned())).then, Then::Quit);
    assert!(!quit.is_cancelled(), "the answer is written first");
    farm.shut_down().await;
}

#[tokio::test]
async fn a_name_of_two_workers_is_refused() {
    let farm = farm().await;
    let _workers = [
        fake_worker::start(farm.address(), Script::Correct).await,
        fake_worker::start(farm.address(), Script::Correct).await,
    ];
    until_workers(&farm, 2).await;
    let (console, _quit) = console(&farm);
    let error = ask(&console, "drain fake")["error"].as_str().unwrap().to_owned();
    assert!(error.contains('2') && error.contains('1'), "{error}");
    assert_eq!(ask(&console, "drain 2")["workers"], serde_json::json!([2]));
    until_workers(&farm, 1).await;
    farm.shut_down().await;
}

/// A port for commands, and its token.
struct Port {
    address: SocketAddr,
    folder: tempfile::TempDir,
    stop: CancellationToken,
}

impl Port {
    fn open(console: Console) -> Self {
        let address = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let (folder, stop) = (tempfile::tempdir().unwrap(), CancellationToken::new());
        let folders = [folder.path().join("rayfarm")];
        socket::listen_tcp(address, &folders, console, stop.clone()).unwrap();
        Self { address, folder, stop }
    }

    fn file(&self) -> std::path::PathBuf {
        self.folder.path().join(format!("rayfarm/control-127.0.0.1-{}", self.address.port()))
    }

    /// A connection that has sent the token.
    async fn connect(&self) -> BufReader<TcpStream> {
        let mut stream = BufReader::new(TcpStream::connect(self.address).await.unwrap());
        stream.write_all(&std::fs::read(self.file()).unwrap()).await.unwrap();
        assert_eq!(read_line(&mut stream).await, "{\"ok\":true}\n");
        stream
    }

    /// Answers, until the end of the connection, to something other than the token.
    async fn answer_to(&self, bytes: &[u8]) -> String {
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        // Closing over unread bytes may reset the connection.
        let _ = stream.write_all(bytes).await;
        let mut answer = Vec::new();
        let _ = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut answer))
            .await
            .expect("the connection stays open");
        String::from_utf8(answer).unwrap()
    }
}

async fn read_line(stream: &mut (impl tokio::io::AsyncBufRead + Unpin)) -> String {
    let mut line = String::new();
    let read = tokio::time::timeout(PATIENCE, stream.read_line(&mut line)).await;
    // The server may have closed with unread bytes.
    let _ = read.expect("no answer arrives");
    line
}

#[tokio::test]
async fn a_port_requires_the_token_in_its_owners_file() {
    let farm = farm().await;
    let (console, quit) = console(&farm);
    let port = Port::open(console);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &std::path::Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!((mode(&port.file()), mode(port.file().parent().unwrap())), (0o600, 0o700));
    }
    for bytes in ["quit\n", "status\n", "token 00\nquit\n", "token\nquit\n", "\nquit\n"] {
        let answer = port.answer_to(bytes.as_bytes()).await;
        assert!(answer.matches('\n').count() <= 1 && !answer.contains("true"), "{bytes:?}: {answer}");
    }
    let mut stream = port.connect().await;
    stream.write_all(b"status\nnonsense\n").await.unwrap();
    for ok in ["\"ok\":true", "\"ok\":false"] {
        let line = read_line(&mut stream).await;
        assert!(line.contains(ok), "{line}");
    }
    assert!(!quit.is_cancelled());
    stream.write_all(b"quit\n").await.unwrap();
    tokio::time::timeout(PATIENCE, quit.cancelled()).await.unwrap();
    port.stop.cancel();
    let gone = async {
        while port.file().exists() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(PATIENCE, gone).await.expect("the token remains after its run");
    farm.shut_down().await;
}

/// First bytes of browsers and other clients of the wrong protocol.
fn foreign_requests() -> Vec<Vec<u8>> {
    let long = "x".repeat(3 * MAX_LINE_BYTES);
    let mut all: Vec<Vec<u8>> = [
        "POST / HTTP/1.1\r\nHost: 127.0.0.1:7118\r\n\r\nquit\r\n",
        "GET /\r\nquit\r\n",
        "PROPFIND / http/1.1\r\nquit\r\n",
        "M-SEARCH *\r\nquit\r\n",
        "quit / HTTP/1.1\r\nquit\r\n",
        "Host: 127.0.0.1\r\nquit\r\n",
        "host:127.0.0.1\nquit\n",
        "\x16\x03\x01\x02\0\x01\0\x01\nquit\n",
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\nquit\r\n",
        "{\"command\":\"quit\"}\nquit\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec();
    all.push(format!("POST /{long} HTTP/1.1\r\nquit\r\n").into_bytes());
    all.push(format!("{long}\nquit\n").into_bytes());
    all.push(b"\xff\xfe\nquit\n".to_vec());
    all
}

#[tokio::test]
async fn a_web_page_cannot_end_a_run() {
    let farm = farm().await;
    let (console, quit) = console(&farm);
    let port = Port::open(console.clone());
    for bytes in foreign_requests() {
        port.answer_to(&bytes).await;
        // The same after a token: even then, none of it is a command.
        let mut stream = port.connect().await;
        let _ = stream.write_all(&bytes).await;
        let refusal = read_line(&mut stream).await;
        assert!(!refusal.contains("\"ok\":true"), "{refusal}");
        assert_eq!(read_line(&mut stream).await, "", "{:?}", String::from_utf8_lossy(&bytes));
    }
    assert!(!quit.is_cancelled());
    farm.shut_down().await;
}

#[cfg(unix)]
#[tokio::test]
async fn a_unix_socket_refuses_http_too() {
    let farm = farm().await;
    let (console, quit) = console(&farm);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("control");
    start(&Place::Unix(path.clone()), console, CancellationToken::new()).unwrap();
    for bytes in foreign_requests() {
        let mut stream = BufReader::new(tokio::net::UnixStream::connect(&path).await.unwrap());
        let _ = stream.write_all(&bytes).await;
        let refusal = read_line(&mut stream).await;
        assert!(!refusal.contains("\"ok\":true"), "{refusal}");
        assert_eq!(read_line(&mut stream).await, "", "{:?}", String::from_utf8_lossy(&bytes));
    }
    assert!(!quit.is_cancelled());
    farm.shut_down().await;
}

#[tokio::test]
async fn new_connections_replace_idle_ones() {
    let farm = farm().await;
    let port = Port::open(console(&farm).0);
    let mut streams = Vec::new();
    for _ in 0..8 {
        streams.push(port.connect().await);
    }
    // The first one is no longer idle for longest.
    streams[0].write_all(b"help\n").await.unwrap();
    assert!(read_line(&mut streams[0]).await.contains("true"));
    let mut ninth = port.connect().await;
    let reason = read_line(&mut streams[1]).await;
    assert!(reason.contains("8 connections"), "{reason}");
    assert_eq!(read_line(&mut streams[1]).await, "");
    // Connections without a token are replaced first, however many arrive.
    for _ in 0..20 {
        drop(TcpStream::connect(port.address).await.unwrap());
    }
    let mut silent = Vec::new();
    for _ in 0..20 {
        silent.push(TcpStream::connect(port.address).await.unwrap());
    }
    for stream in [&mut streams[0], &mut ninth] {
        stream.write_all(b"help\n").await.unwrap();
        assert!(
            read_line(stream).await.contains("true"),
            "a connection without a token replaced one with a token"
        );
    }
    farm.shut_down().await;
}

#[tokio::test]
async fn a_silent_connection_ends() {
    let farm = farm().await;
    let port = Port::open(console(&farm).0);
    let mut trusted = port.connect().await;
    let mut silent = BufReader::new(TcpStream::connect(port.address).await.unwrap());
    // Single bytes are no command.
    silent.write_all(b"t").await.unwrap();
    tokio::time::pause();
    assert!(read_line(&mut silent).await.contains("token"));
    tokio::time::timeout(Duration::from_secs(3600), trusted.read_line(&mut String::new()))
        .await
        .unwrap()
        .unwrap();
    assert_eq!(read_line(&mut trusted).await, "");
}

#[cfg(unix)]
#[tokio::test]
async fn a_unix_socket_is_private_and_removed_after_the_run() {
    use std::os::unix::fs::PermissionsExt;
    let farm = farm().await;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("control");
    let place = Place::Unix(path.clone());
    // The socket of a killed run is replaced.
    drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
    let stop = CancellationToken::new();
    start(&place, console(&farm).0, stop.clone()).unwrap();
    assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    let mut stream = BufReader::new(tokio::net::UnixStream::connect(&path).await.unwrap());
    stream.write_all(b"workers\n").await.unwrap();
    let mut line = String::new();
    stream.read_line(&mut line).await.unwrap();
    assert_eq!(line, "{\"ok\":true,\"workers\":[]}\n");
    let taken = start(&place, console(&farm).0, stop.clone()).unwrap_err().to_string();
    assert!(taken.contains("another run") && taken.contains("choose another"), "{taken}");
    stop.cancel();
    let gone = async {
        while path.exists() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(PATIENCE, gone).await.unwrap();
    std::fs::write(&path, b"a file").unwrap();
    assert!(start(&place, console(&farm).0, stop).is_err(), "another file is not replaced");
    assert_eq!(std::fs::read(&path).unwrap(), b"a file");
    farm.shut_down().await;
}
