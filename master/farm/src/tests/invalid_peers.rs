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
async fn a_thousand_silent_connections_keep_no_worker_out() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let mut silent = Vec::new();
    for _ in 0..1000 {
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

/// Sends messages of a worker that has shaken hands, until the master disconnects it. Returns the master's reason.
async fn reason_after(farm: &Farm, messages: Vec<ToMaster>) -> String {
    let stream = fake_worker::connect(farm.address(), 1).await;
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    tokio::spawn(async move {
        for message in messages {
            if sender.send(message).await.is_err() {
                return;
            }
        }
        sender.closed().await;
    });
    let disconnect = async {
        loop {
            match receiver.recv().await {
                Some(Ok(ToWorker::Disconnect { reason, .. })) => return reason,
                Some(Ok(_)) => {}
                other => panic!("no disconnect: {other:?}"),
            }
        }
    };
    in_time(disconnect).await
}

#[tokio::test]
async fn floods_of_messages_end_their_sessions_and_no_other() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    let (scene, unknown) = (farm.scene_id(), |number: u32| AssetId::of(&number.to_le_bytes()));
    let need = |id| ToMaster::NeedAsset { id, offset: 0, again: true };
    let pong = ToMaster::Pong { nonce: u64::MAX, progressed: true };
    let failed = ToMaster::Failed { frame: FrameId(1), reason: "x".repeat(2000) };
    let floods = [
        (vec![pong; 1000], "pongs that answer no ping"),
        (vec![failed; 1000], "more failures than"),
        (vec![need(scene); 1000], "requests an asset more than"),
        ((0..1000).map(|number| need(unknown(number))).collect(), "assets that no scene of the farm has"),
        (vec![ToMaster::HaveAsset { id: scene }; 1000], "has not requested"),
    ];
    for (flood, expected) in floods {
        let reason = reason_after(&farm, flood).await;
        assert!(reason.contains(expected), "{reason}");
    }
    until_workers(&farm, 1).await;
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_flood_of_hellos_leaves_workers_and_frames_alone() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    let address = farm.address();
    let flood = tokio::spawn(async move {
        for _ in 0..500 {
            drop(fake_worker::connect(address, 1).await);
        }
    });
    for spin in 0..20 {
        let requested = farm.request(turned(spin));
        let frame = finished(&mut farm).await;
        assert_eq!(frame.frame, requested);
        assert!(is_picture(&turned(spin), &frame.pixels));
    }
    in_time(flood).await.unwrap();
    until_workers(&farm, 1).await;
}

#[tokio::test]
async fn connections_that_give_way_are_counted() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    let mut silent = Vec::new();
    for _ in 0..100 {
        silent.push(TcpStream::connect(farm.address()).await.unwrap());
    }
    // 32 places of this machine, and 68 connections that lose them; one second later all have timed out.
    until(&farm, |status| status.refused >= 68).await;
    until(&farm, |status| status.pending == 0).await;
}
