//! Requests without a page: rules, bounds, and the interface for programs.

use rayfarm_farm::testing::fake_worker::pixels;
use rayfarm_farm::testing::test_scene::view;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::client::{fetch, request};
use super::*;

fn bearer() -> (&'static str, String) {
    ("Authorization", format!("Bearer {TOKEN}"))
}

#[tokio::test]
async fn the_page_has_its_files_and_safe_headers() {
    let served = Served::start("127.0.0.1:8080").await;
    let files = [("/", "text/html"), ("/style.css", "text/css"), ("/app.js", "text/javascript")];
    for (path, kind) in files {
        let response = fetch(served.address, path, &[]).await;
        assert_eq!(response.status, 200, "{path}");
        assert!(response.headers["content-type"].starts_with(kind), "{path}: {:?}", response.headers);
        assert!(response.headers["content-security-policy"].starts_with("default-src 'self';"));
        assert_eq!(response.headers["x-content-type-options"], "nosniff");
        // No other server is needed.
        let outside =
            response.text().match_indices("//").filter(|(at, _)| response.text()[..*at].ends_with(':'));
        assert_eq!(outside.count(), 0, "{path} names another server");
    }
    assert_eq!(fetch(served.address, "/other", &[]).await.status, 404);
    served.end().await;
}

#[tokio::test]
async fn requests_for_other_servers_and_of_other_pages_are_refused() {
    let served = Served::start("127.0.0.1:8080").await;
    let host = served.address.to_string();
    for path in ["/", "/ws", "/api/status", "/api/frame.png", "/metrics", "/other"] {
        let refused = request(served.address, "GET", path, &[("Host", "evil.example")], b"").await;
        assert_eq!(refused.status, 421, "{path}");
        assert!(refused.headers.contains_key("content-security-policy"), "{path}");
        let headers = [("Host", host.as_str()), ("Origin", "http://evil.example")];
        assert_eq!(request(served.address, "GET", path, &headers, b"").await.status, 403, "{path}");
    }
    let headers = [("Host", host.as_str()), ("Origin", "http://evil.example")];
    let refused = request(served.address, "POST", "/api/command", &headers, b"status").await;
    assert_eq!(refused.status, 403);
    served.end().await;
}

#[tokio::test]
async fn beyond_loopback_nothing_is_answered_without_the_token() {
    let served = Served::start("0.0.0.0:8080").await;
    for path in ["/", "/app.js", "/api/status", "/api/frame.png", "/metrics", "/?token=00", "/ws"] {
        let refused = fetch(served.address, path, &[("Authorization", "Bearer 00")]).await;
        assert_eq!(refused.status, 401, "{path}");
    }
    let (name, value) = bearer();
    assert_eq!(fetch(served.address, "/api/status", &[(name, &value)]).await.status, 200);
    let entered = fetch(served.address, &format!("/?token={TOKEN}"), &[]).await;
    assert_eq!((entered.status, entered.headers["location"].as_str()), (303, "/"));
    let cookie = entered.headers["set-cookie"].split(';').next().unwrap().to_owned();
    let page = fetch(served.address, "/", &[("Cookie", &cookie)]).await;
    assert_eq!(page.status, 200);
    served.end().await;
}

#[tokio::test]
async fn the_picture_has_the_exact_bytes_of_the_frame() {
    let served = Served::start("127.0.0.1:8080").await;
    // No page is open: the request itself makes the viewer render.
    let response = fetch(served.address, "/api/frame.png?download", &[]).await;
    assert_eq!((response.status, response.headers["content-type"].as_str()), (200, "image/png"));
    assert!(response.headers["content-disposition"].starts_with("attachment"));
    let mut reader = png::Decoder::new(std::io::Cursor::new(&response.body)).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut rgb).unwrap();
    assert_eq!(rgb, pixels(&view(), 0..view().height));
    served.end().await;
}

#[tokio::test]
async fn the_state_and_the_metrics_name_the_worker() {
    let served = Served::start("127.0.0.1:8080").await;
    assert_eq!(fetch(served.address, "/api/frame.png", &[]).await.status, 200);
    let status = fetch(served.address, "/api/status", &[]).await.json();
    assert_eq!((&status["ok"], &status["scene"]), (&true.into(), &"a scene".into()), "{status}");
    assert_eq!(status["workers"][0]["name"], "fake", "{status}");
    assert_eq!(status["view"]["width"], view().width, "{status}");
    let metrics = fetch(served.address, "/metrics", &[]).await;
    assert!(metrics.headers["content-type"].starts_with("text/plain; version=0.0.4"));
    let line =
        |name: &str| metrics.text().lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    assert!(line("rayfarm_frames_total").unwrap().parse::<u64>().unwrap() > 0, "{}", metrics.text());
    assert_eq!(line("rayfarm_web_pictures_total{format=\"png\"}"), Some("1"));
    assert_eq!(
        line("rayfarm_web_pictures_total{format=\"jpeg\"}"),
        Some("0"),
        "nothing is encoded without a page"
    );
    served.end().await;
}

#[tokio::test]
async fn commands_are_executed_for_owners_and_bounded() {
    let served = Served::start("127.0.0.1:8080").await;
    let host = served.address.to_string();
    let (name, value) = bearer();
    let guest = [("Host", host.as_str())];
    let owner = [("Host", host.as_str()), (name, value.as_str())];
    let send = |headers: Vec<(&'static str, String)>, body: Vec<u8>| async move {
        let headers: Vec<(&str, &str)> =
            headers.iter().map(|(name, value)| (*name, value.as_str())).collect();
        request(served.address, "POST", "/api/command", &headers, &body).await
    };
    let owned = |headers: &[(&'static str, &str)]| -> Vec<(&'static str, String)> {
        headers.iter().map(|(name, value)| (*name, (*value).to_owned())).collect()
    };
    let done = send(owned(&owner), b"kick 3\n".to_vec()).await;
    assert_eq!((done.status, done.json()["line"].clone()), (200, "kick 3".into()));
    assert_eq!(send(owned(&guest), b"status".to_vec()).await.status, 200);
    let forbidden = send(owned(&guest), b"kick 3".to_vec()).await;
    assert_eq!((forbidden.status, forbidden.json()["ok"].clone()), (401, false.into()));
    assert_eq!(send(owned(&owner), b"wrong".to_vec()).await.status, 400);
    assert_eq!(send(owned(&owner), b"status\nquit".to_vec()).await.status, 400);
    assert_eq!(send(owned(&owner), vec![0xff, 0xfe]).await.status, 400);
    assert_eq!(send(owned(&owner), vec![b'x'; 1025]).await.status, 413);
    let mut busy = None;
    for _ in 0..1000 {
        let response = send(owned(&owner), b"help".to_vec()).await;
        if response.status != 200 {
            busy = Some(response);
            break;
        }
    }
    // A machine that takes longer than the budget's interval for each request never runs out of it.
    if let Some(busy) = busy {
        assert_eq!((busy.status, busy.json()["ok"].clone()), (429, false.into()));
    }
    served.end().await;
}

#[tokio::test]
async fn large_and_endless_headers_end_the_connection() {
    let served = Served::start("127.0.0.1:8080").await;
    let long = "x".repeat(20 << 10);
    let host = served.address.to_string();
    let refused = request(served.address, "GET", "/", &[("Host", &host), ("X-Long", &long)], b"").await;
    assert_eq!(refused.status, 431);
    let mut stream = TcpStream::connect(served.address).await.unwrap();
    stream.write_all(b"GET / HTTP/1.1\r\nHost: local").await.unwrap();
    let mut rest = Vec::new();
    tokio::time::timeout(PATIENCE, stream.read_to_end(&mut rest)).await.expect("it stays open").unwrap();
    assert!(!rest.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&rest));
    served.end().await;
}
