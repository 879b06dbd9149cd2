//! Commands identify workers by number, although names are not unique. With TLS, workers are identified by their keys.

use std::sync::Arc;

use rayfarm_protocol::ProtocolError;
use rayfarm_protocol::transport::{
    Connection, JoinToken, MasterSecurity, MasterTrust, PrivateKey, WorkerSecurity,
};

use super::*;

async fn refusal(farm: &Farm, name: &str) -> String {
    let mut stream = TcpStream::connect(farm.address()).await.unwrap();
    let hello = Hello {
        name: name.into(),
        threads: 1,
        simd: "none".into(),
        software: "test".into(),
        tags: Vec::new(),
    };
    handshake::as_worker(&mut stream, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello)
        .await
        .unwrap_err()
        .to_string()
}

#[tokio::test]
async fn a_banned_worker_is_allowed_by_its_number() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    for name in ["one", "other"] {
        fake_worker::start_named(farm.address(), name, Script::Correct).await;
    }
    until_workers(&farm, 2).await;
    let ids: Vec<u64> = farm.status().workers.iter().map(|worker| worker.id).collect();
    ids.iter().for_each(|&id| farm.control().ban(id, "enough").unwrap());
    assert!(farm.control().allow_worker(ids[0]) && !farm.control().allow_worker(ids[0]));
    fake_worker::start_named(farm.address(), "one", Script::Correct).await;
    assert!(refusal(&farm, "other").await.contains("is banned"));
    assert_eq!(farm.status().banned[0].id, ids[1]);
}

/// A farm whose local worker is a script that appends its ticket to a file and exits with success: one line for each start.
#[cfg(unix)]
async fn farm_with_a_ticket(folder: &std::path::Path) -> (Farm, std::path::PathBuf) {
    use std::os::unix::fs::PermissionsExt;
    let (program, tickets) = (folder.join("worker"), folder.join("tickets"));
    let script = format!("#!/bin/sh\necho \"$RAYFARM_WORKER_NAME\" >> '{}'\n", tickets.display());
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let name_variable = "RAYFARM_WORKER_NAME".to_owned();
    let local_worker = LocalWorkerCommand { program, args: Vec::new(), name_variable };
    let options = FarmOptions { listen, local_workers: 1, local_worker, ..FarmOptions::default() };
    let drawn = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    (Farm::start(options, drawn).await.unwrap(), tickets)
}

#[cfg(unix)]
fn lines(path: &std::path::Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

#[cfg(unix)]
#[tokio::test]
async fn a_remote_worker_with_the_name_of_a_local_one_is_another_worker() {
    let folder = tempfile::tempdir().unwrap();
    let (farm, tickets) = farm_with_a_ticket(folder.path()).await;
    until(&farm, |status| status.local_exited == 1).await;
    let ticket = lines(&tickets).remove(0);

    fake_worker::start_named(farm.address(), "local-1", Script::Correct).await;
    fake_worker::start_named(farm.address(), &ticket, Script::Correct).await;
    until_workers(&farm, 2).await;
    let workers = farm.status().workers;
    assert!(workers.iter().all(|worker| worker.name == "local-1"), "tickets are not displayed: {workers:?}");
    assert_eq!(workers.iter().map(|worker| worker.local).collect::<Vec<_>>(), [false, true]);

    // The remote worker is banned, and the local one may connect.
    farm.control().ban(workers[0].id, "go").unwrap();
    assert!(refusal(&farm, "local-1").await.contains("is banned"));
    fake_worker::start_named(farm.address(), &ticket, Script::Correct).await;
    until_workers(&farm, 2).await;
    farm.control().allow("local-1");

    // The local worker is banned, and the remote one may connect.
    farm.control().ban(workers[1].id, "go").unwrap();
    assert!(refusal(&farm, &ticket).await.contains("is banned"));
    fake_worker::start_named(farm.address(), "local-1", Script::Correct).await;
    farm.shut_down().await;
}

#[cfg(unix)]
#[tokio::test]
async fn local_workers_are_restarted_when_they_are_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let (farm, tickets) = farm_with_a_ticket(folder.path()).await;
    until(&farm, |status| status.local_exited == 1).await;
    farm.control().allow_all();
    until(&farm, |status| status.local_exited == 1 && lines(&tickets).len() == 2).await;

    let ticket = lines(&tickets).remove(0);
    fake_worker::start_named(farm.address(), &ticket, Script::Correct).await;
    until_workers(&farm, 1).await;
    farm.control().ban(farm.status().workers[0].id, "go").unwrap();
    assert_eq!(farm.control().allow("local-1"), 1);
    until(&farm, |status| status.local_exited == 1 && lines(&tickets).len() == 3).await;
    fake_worker::start_named(farm.address(), &ticket, Script::Correct).await;
    farm.shut_down().await;
}

/// A farm with TLS.
async fn secure_farm() -> (Farm, Arc<MasterTrust>) {
    let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), JoinToken::random().unwrap()));
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let security = MasterSecurity::Tls(Arc::clone(&trust));
    let options = FarmOptions { listen, security, ..FarmOptions::default() };
    let drawn = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    (Farm::start(options, drawn).await.unwrap(), trust)
}

/// Security of a worker with a new key.
fn new_worker(trust: &MasterTrust) -> WorkerSecurity {
    WorkerSecurity::join(Arc::new(PrivateKey::generate().unwrap()), &trust.join_line("host:1"))
}

/// Joins through TLS. The session lasts as long as the result.
async fn join(
    farm: &Farm,
    name: &str,
    security: &WorkerSecurity,
) -> Result<Connection<TcpStream>, ProtocolError> {
    let stream = TcpStream::connect(farm.address()).await.unwrap();
    let (simd, software) = ("none".into(), "test".into());
    let hello = Hello { name: name.into(), threads: 1, simd, software, tags: Vec::new() };
    handshake::as_worker(stream, security, &hello).await.map(|(connection, _)| connection)
}

#[tokio::test]
async fn a_ban_of_a_key_holds_under_each_name_and_for_no_other_key() {
    let (farm, trust) = secure_farm().await;
    let (one, other) = (new_worker(&trust), new_worker(&trust));
    // Two workers of one name on one machine.
    let first = join(&farm, "twin", &one).await.unwrap();
    until_workers(&farm, 1).await;
    let _second = join(&farm, "twin", &other).await.unwrap();
    until_workers(&farm, 2).await;
    let ids: Vec<u64> = farm.status().workers.iter().map(|worker| worker.id).collect();
    farm.control().ban(ids[0], "enough").unwrap();
    until_workers(&farm, 1).await;
    assert_eq!(farm.status().workers[0].id, ids[1], "the other worker stays");
    drop(first);

    for name in ["twin", "renamed", "local-1"] {
        let error = join(&farm, name, &one).await.unwrap_err();
        assert!(error.to_string().contains("is banned") && error.is_final(true), "{error}");
    }
    let _third = join(&farm, "twin", &new_worker(&trust)).await.unwrap();
    until_workers(&farm, 2).await;

    assert!(farm.control().allow_worker(ids[0]));
    let _first = join(&farm, "renamed", &one).await.unwrap();
    until_workers(&farm, 3).await;
    farm.shut_down().await;
}
