//! Names are not unique: commands concern the worker, not its name.

use super::*;

async fn refusal(farm: &Farm, name: &str) -> String {
    let mut stream = TcpStream::connect(farm.address()).await.unwrap();
    let hello = Hello { name: name.into(), threads: 1, simd: "none".into(), software: "test".into() };
    handshake::as_worker(&mut stream, &hello).await.unwrap_err().to_string()
}

#[tokio::test]
async fn a_kicked_worker_is_allowed_by_its_number() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    for name in ["one", "other"] {
        fake_worker::start_named(farm.address(), name, Script::Honest).await;
    }
    until_workers(&farm, 2).await;
    let ids: Vec<u64> = farm.status().workers.iter().map(|worker| worker.id).collect();
    ids.iter().for_each(|&id| farm.control().kick(id, "enough").unwrap());
    assert!(farm.control().allow_worker(ids[0]) && !farm.control().allow_worker(ids[0]));
    fake_worker::start_named(farm.address(), "one", Script::Honest).await;
    assert!(refusal(&farm, "other").await.contains("was kicked"));
    assert_eq!(farm.status().kicked[0].id, ids[1]);
}

/// A farm whose local worker is a program that writes down the word that it was given, and ends in order. Its file grows
/// by a line with each start.
#[cfg(unix)]
async fn farm_with_a_ticket(folder: &std::path::Path) -> (Farm, std::path::PathBuf) {
    use std::os::unix::fs::PermissionsExt;
    let (program, words) = (folder.join("worker"), folder.join("words"));
    let script = format!("#!/bin/sh\necho \"$RAYFARM_WORKER_NAME\" >> '{}'\n", words.display());
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let name_variable = "RAYFARM_WORKER_NAME".to_owned();
    let local_worker = LocalWorkerCommand { program, args: Vec::new(), name_variable };
    let options = FarmOptions { listen, local_workers: 1, local_worker, ..FarmOptions::default() };
    let drawn = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    (Farm::start(options, drawn).await.unwrap(), words)
}

#[cfg(unix)]
fn lines(path: &std::path::Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

#[cfg(unix)]
#[tokio::test]
async fn a_stranger_with_a_local_workers_name_is_another_worker() {
    let folder = tempfile::tempdir().unwrap();
    let (farm, words) = farm_with_a_ticket(folder.path()).await;
    until(&farm, |status| status.local_gone == 1).await;
    let ticket = lines(&words).remove(0);

    fake_worker::start_named(farm.address(), "local-1", Script::Honest).await;
    fake_worker::start_named(farm.address(), &ticket, Script::Honest).await;
    until_workers(&farm, 2).await;
    let workers = farm.status().workers;
    assert!(workers.iter().all(|worker| worker.name == "local-1"), "a ticket is not shown: {workers:?}");
    assert_eq!(workers.iter().map(|worker| worker.local).collect::<Vec<_>>(), [false, true]);

    // The stranger is kicked, and the local worker may come.
    farm.control().kick(workers[0].id, "go").unwrap();
    assert!(refusal(&farm, "local-1").await.contains("was kicked"));
    fake_worker::start_named(farm.address(), &ticket, Script::Honest).await;
    until_workers(&farm, 2).await;
    farm.control().allow("local-1");

    // The local worker is kicked, and the stranger may come.
    farm.control().kick(workers[1].id, "go").unwrap();
    assert!(refusal(&farm, &ticket).await.contains("was kicked"));
    fake_worker::start_named(farm.address(), "local-1", Script::Honest).await;
    farm.shut_down().await;
}

#[cfg(unix)]
#[tokio::test]
async fn local_workers_that_have_left_are_started_again_when_they_are_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let (farm, words) = farm_with_a_ticket(folder.path()).await;
    until(&farm, |status| status.local_gone == 1).await;
    farm.control().bring_back();
    until(&farm, |status| status.local_gone == 1 && lines(&words).len() == 2).await;

    let ticket = lines(&words).remove(0);
    fake_worker::start_named(farm.address(), &ticket, Script::Honest).await;
    until_workers(&farm, 1).await;
    farm.control().kick(farm.status().workers[0].id, "go").unwrap();
    assert_eq!(farm.control().allow("local-1"), 1);
    until(&farm, |status| status.local_gone == 1 && lines(&words).len() == 3).await;
    fake_worker::start_named(farm.address(), &ticket, Script::Honest).await;
    farm.shut_down().await;
}
