//! Pages over WebSockets: pictures, input, commands, steering.

use rayfarm_farm::testing::fake_worker::is_picture;
use serde_json::json;

use super::client::{Message, Socket};
use super::*;

fn number(picture: &[u8]) -> u32 {
    u32::from_le_bytes(picture[4..8].try_into().unwrap())
}

async fn acknowledge(socket: &mut Socket, picture: &[u8]) {
    socket.send(&json!({ "type": "shown", "picture": number(picture) }).to_string()).await;
}

/// Reads pictures until the exact one of a picture at rest.
async fn exact(socket: &mut Socket) -> Vec<u8> {
    loop {
        let picture = socket.next_picture().await;
        acknowledge(socket, &picture).await;
        if picture[0] == 2 {
            return picture;
        }
    }
}

fn decoded(picture: &[u8]) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(&picture[16..])).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut rgb).unwrap();
    rgb
}

#[tokio::test]
async fn pages_of_other_servers_open_no_socket() {
    let local = Served::start("127.0.0.1:8080").await;
    assert_eq!(Socket::open(local.address, &[("Origin", "http://evil.example")]).await.err(), Some(403));
    let origin = format!("http://{}", local.address);
    assert!(Socket::open(local.address, &[("Origin", &origin)]).await.is_ok());
    local.end().await;
    let open = Served::start("0.0.0.0:8080").await;
    let origin = format!("http://{}", open.address);
    assert_eq!(Socket::open(open.address, &[("Origin", &origin)]).await.err(), Some(401));
    open.end().await;
}

#[tokio::test]
async fn a_picture_at_rest_arrives_exactly_and_input_moves_it() {
    let served = Served::start("127.0.0.1:8080").await;
    let mut socket = Socket::open(served.address, &[]).await.unwrap();
    let hello = socket.next_of("hello").await;
    assert_eq!((&hello["scene"], &hello["owner"]), (&json!("a scene"), &json!(false)));
    assert!(hello["join"].is_null(), "the join line is for owners: {hello}");
    let first = exact(&mut socket).await;
    let mut viewer = served.viewer.clone();
    let shown = viewer.newest_frame().unwrap();
    assert_eq!(decoded(&first), shown.frame.pixels.to_vec());
    let camera = shown.frame.view.camera;
    socket.send(r#"{"type":"input","moves":[{"orbit":[0.3,0.1]},{"zoom":1}]}"#).await;
    let second = exact(&mut socket).await;
    let shown = viewer.newest_frame().unwrap();
    assert_ne!(shown.frame.view.camera, camera);
    assert!(is_picture(&shown.frame.view, &shown.frame.pixels));
    assert_eq!(decoded(&second), shown.frame.pixels.to_vec());
    served.end().await;
}

#[tokio::test]
async fn the_next_picture_waits_until_the_last_one_is_shown() {
    let served = Served::start("127.0.0.1:8080").await;
    let mut socket = Socket::open(served.address, &[]).await.unwrap();
    let first = socket.next_picture().await;
    let before = served.viewer.clone().newest_frame().unwrap().frame.frame;
    for _ in 0..3 {
        socket.send(r#"{"type":"input","moves":[{"orbit":[0.1,0]}]}"#).await;
        // A reply shows that the movement was applied.
        socket.send(r#"{"type":"command","id":1,"line":"status"}"#).await;
        loop {
            match socket.next().await {
                Message::Json(message) if message["type"] == "reply" => break,
                Message::Json(_) => {}
                other => panic!("a second picture is on its way: {other:?}"),
            }
        }
    }
    let mut viewer = served.viewer.clone();
    let newest = async {
        while viewer.newest_frame().unwrap().frame.frame == before {
            viewer.frame_changed().await;
        }
    };
    tokio::time::timeout(PATIENCE, newest).await.expect("no further frame is rendered");
    acknowledge(&mut socket, &first).await;
    let second = socket.next_picture().await;
    assert_ne!(number(&second), number(&first));
    served.end().await;
}

#[tokio::test]
async fn pages_share_pictures_and_one_of_them_steers() {
    let served = Served::start("127.0.0.1:8080").await;
    let mut first = Socket::open(served.address, &[]).await.unwrap();
    let own = first.next_of("hello").await["client"].clone();
    let mut second = Socket::open(served.address, &[]).await.unwrap();
    let other = second.next_of("hello").await["client"].clone();
    exact(&mut first).await;
    exact(&mut second).await;
    assert!(served.shared.pictures.work()[1].pictures <= 2, "encoded once for both");
    let camera = |served: &Served| served.viewer.clone().newest_frame().unwrap().frame.view.camera;
    let before = camera(&served);
    second.send(r#"{"type":"input","moves":[{"orbit":[0.3,0]}]}"#).await;
    second.send(r#"{"type":"command","id":1,"line":"set samples 4"}"#).await;
    assert_eq!(
        second.next_of("reply").await["reply"]["ok"],
        false,
        "only the page that steers changes the view"
    );
    assert_eq!(camera(&served), before);
    second.send(r#"{"type":"steer"}"#).await;
    let requested = loop {
        let steering = first.next_of("steering").await["steering"].clone();
        if !steering["requests"].is_null() {
            break steering;
        }
    };
    assert_eq!(requested, json!({ "steers": own, "requests": other, "clients": 2 }));
    first.send(r#"{"type":"handover","grant":true}"#).await;
    while second.next_of("steering").await["steering"]["steers"] != other {}
    second.send(r#"{"type":"input","moves":[{"orbit":[0.3,0]}]}"#).await;
    exact(&mut second).await;
    assert_ne!(camera(&served), before);
    drop(second);
    while first.next_of("steering").await["steering"]["steers"] != own {}
    served.end().await;
}

#[tokio::test]
async fn commands_have_replies_with_their_number() {
    let served = Served::start("127.0.0.1:8080").await;
    let token = format!("Bearer {TOKEN}");
    let mut owner = Socket::open(served.address, &[("Authorization", &token)]).await.unwrap();
    let hello = owner.next_of("hello").await;
    assert!(hello["join"][0].as_str().unwrap().starts_with("rayfarm-worker --"), "{hello}");
    owner.send(r#"{"type":"command","id":7,"line":"kick 1"}"#).await;
    let reply = owner.next_of("reply").await;
    assert_eq!(reply, json!({ "type": "reply", "id": 7, "reply": { "ok": true, "line": "kick 1" } }));
    let mut guest = Socket::open(served.address, &[]).await.unwrap();
    guest.send(r#"{"type":"command","id":8,"line":"kick 1"}"#).await;
    let reply = guest.next_of("reply").await;
    assert_eq!((&reply["id"], &reply["reply"]["ok"]), (&json!(8), &json!(false)));
    served.end().await;
}

#[tokio::test]
async fn invalid_and_large_messages_end_the_connection() {
    let served = Served::start("127.0.0.1:8080").await;
    let large = format!(r#"{{"type":"command","id":1,"line":"{}"}}"#, "x".repeat(5000));
    for text in ["quit", r#"{"type":"fly"}"#, &large] {
        let mut socket = Socket::open(served.address, &[]).await.unwrap();
        socket.next_of("hello").await;
        socket.send(text).await;
        while !matches!(socket.next().await, Message::Closed) {}
    }
    served.end().await;
}

#[tokio::test]
async fn pages_are_bounded_and_leave_their_place() {
    let served = Served::start("127.0.0.1:8080").await;
    let mut pages = Vec::new();
    let refused = loop {
        match Socket::open(served.address, &[]).await {
            Ok(page) => pages.push(page),
            Err(status) => break status,
        }
    };
    assert_eq!((pages.len(), refused), (16, 503));
    drop(pages);
    let is_free = async {
        while served.shared.steering.clients() > 0 {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(PATIENCE, is_free).await.expect("pages remain after their connections");
    assert!(Socket::open(served.address, &[]).await.is_ok());
    served.end().await;
}
