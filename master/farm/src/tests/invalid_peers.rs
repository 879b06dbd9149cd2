//! Connections that are not from a worker of this version.

use super::*;

#[tokio::test]
async fn invalid_peers_do_not_disturb_the_farm() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    farm.request(view());
    let garbage = fake_worker::start(farm.address(), Script::Garbage).await;
    let mut silent = TcpStream::connect(farm.address()).await.unwrap();
    let mut browser = TcpStream::connect(farm.address()).await.unwrap();
    browser.write_all(b"GET / HTTP/1.1\r\nHost: farm\r\n\r\n").await.unwrap();
    let mut early_close = TcpStream::connect(farm.address()).await.unwrap();
    early_close.write_all(b"RAYF").await.unwrap();
    drop(early_close);
    in_time(garbage).await.unwrap();
    let _ = browser.read_to_end(&mut Vec::new()).await;
    assert!(is_picture(&view(), &finished(&mut farm).await.pixels));
    until_workers(&farm, 1).await;
    render(&mut farm, turned(1)).await;
    silent.shutdown().await.unwrap();
}

#[tokio::test]
async fn a_worker_of_another_version_gets_a_message() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let mut skewed = TcpStream::connect(farm.address()).await.unwrap();
    skewed.write_all(b"RAYFARM\n\x63\0\x02\0").await.unwrap();
    let mut answer = Vec::new();
    skewed.read_to_end(&mut answer).await.unwrap();
    let text = String::from_utf8_lossy(&answer);
    assert!(text.contains("99"), "{text}");
    fake_worker::start(farm.address(), Script::Correct).await;
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn hundreds_of_silent_connections_keep_no_worker_out() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let mut silent = Vec::new();
    for _ in 0..300 {
        silent.push(TcpStream::connect(farm.address()).await.unwrap());
    }
    let begun = std::time::Instant::now();
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    // Without places that new connections take over, it waits for several deadlines of one second.
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_worker_without_leases_may_announce_no_pixels() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    let mut stream = fake_worker::connect(farm.address(), 1).await;
    until_workers(&farm, 1).await;
    // The header of 8 MiB of pixels: length, type, flags, stream.
    let mut header = (8_u32 << 20).to_le_bytes().to_vec();
    header.extend([0x21, 0, 0, 0]);
    stream.write_all(&header).await.unwrap();
    until_workers(&farm, 0).await;
    let mut rest = Vec::new();
    let _ = stream.read_to_end(&mut rest).await;
}
