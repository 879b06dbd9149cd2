//! Workers that are paused, drained and banned.

use super::*;

#[tokio::test]
async fn a_paused_worker_gets_no_leases_until_it_is_resumed() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    let first = farm.status().workers[0].id;
    farm.control().pause(first).unwrap();
    assert_eq!(farm.status().workers[0].state, WorkerState::Paused);
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 2).await;
    render(&mut farm, view()).await;
    assert_eq!(farm.status().workers[0].segments_done, 0);
    let second = farm.status().workers[1].id;
    farm.control().pause(second).unwrap();
    farm.request(turned(1));
    farm.control().resume(first).unwrap();
    assert!(is_picture(&turned(1), &finished(&mut farm).await.pixels));
    assert_ne!(farm.status().workers[0].segments_done, 0);
    assert_eq!(farm.control().pause(99), Err(UnknownWorker(99)));
}

#[tokio::test]
async fn a_drained_worker_leaves_and_may_reconnect() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let leaving = fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    render(&mut farm, view()).await;
    farm.control().drain(farm.status().workers[0].id).unwrap();
    let outcome = in_time(leaving).await.unwrap();
    assert!(outcome.drained, "the worker got no drain message");
    assert!(outcome.disconnect_reason.unwrap().contains("drains"));
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    render(&mut farm, turned(1)).await;
}

#[tokio::test]
async fn a_banned_worker_is_refused_until_it_is_allowed() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let banned = fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    farm.control().ban(farm.status().workers[0].id, "it is needed elsewhere").unwrap();
    assert_eq!(in_time(banned).await.unwrap().disconnect_reason.as_deref(), Some("it is needed elsewhere"));
    let names: Vec<_> = farm.status().banned.into_iter().map(|banned| banned.name).collect();
    assert_eq!(names, ["fake"]);

    let mut stream = TcpStream::connect(farm.address()).await.unwrap();
    let hello = Hello {
        name: "fake".into(),
        threads: 1,
        simd: "none".into(),
        software: "test".into(),
        tags: Vec::new(),
    };
    let refused =
        handshake::as_worker(&mut stream, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello)
            .await
            .unwrap_err()
            .to_string();
    assert!(refused.contains("is banned"), "{refused}");
    assert_eq!((farm.control().allow("fake"), farm.control().allow("fake")), (1, 0));
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    render(&mut farm, view()).await;
}
