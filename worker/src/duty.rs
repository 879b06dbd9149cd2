//! One session: carries out what the [`Desk`] decides. Nothing in here takes long: whatever does, runs on the render
//! threads or on blocking ones, so a ping is answered at once.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::session::{self, Receiver, SendError, Sender, Traffic};
use rayfarm_protocol::{Reconnect, ToMaster, ToWorker};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};

use crate::build_pool::BuildPool;
use crate::desk::{Desk, Done, Effect, Work};
use crate::disk_cache::DiskCache;
use crate::disk_writer::DiskWriter;
use crate::ending::Ending;
use crate::fetch::{FromPeer, fetch};
use crate::guard::guarded;
use crate::render_pool::{Answers, PoolJob, ReadyFrame, RenderPool};
use crate::renderer::Renderer;
use crate::scene_loader::{SceneDone, SceneLoader, SceneWork};
use crate::shelf::Shelf;
use crate::silence::{LOOK_EVERY, Silence};

/// Finished segments between the render threads and the session's own queue.
const UNSENT_SEGMENTS: usize = 8;

/// Parts of assets from other workers that were not looked at yet.
const UNREAD_CHUNKS: usize = 8;

/// Pieces of blocking work at a time; while there are more, the master is not listened to.
const MAX_WORK: usize = 64;

/// Leases that are queued or being rendered at a time.
const MAX_LEASES: usize = 4096;

/// How long the master may take to hear our goodbye.
const FAREWELL: Duration = Duration::from_millis(800);

/// What a worker keeps from session to session.
pub(crate) struct Keep<R: Renderer> {
    pub(crate) renderer: Arc<R>,
    pub(crate) pool: RenderPool<R>,
    pub(crate) builders: BuildPool,
    pub(crate) loader: SceneLoader<R>,
    pub(crate) disk: Option<DiskWriter>,
}

/// What depends on where the master is.
#[derive(Clone, Debug)]
pub(crate) struct Terms {
    /// Whether pixels are compressed where that makes them fewer bytes.
    pub(crate) compress: bool,
    /// Whether assets are kept on the disk.
    pub(crate) uses_disk: bool,
    /// Where assets are passed on, if they are.
    pub(crate) sharing: Option<Sharing>,
}

/// What is passed on, and where others ask for it.
#[derive(Clone, Debug)]
pub(crate) struct Sharing {
    pub(crate) port: u16,
    pub(crate) shelf: Arc<Shelf>,
}

/// How a session ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// The master said goodbye for good, and why.
    Goodbye(String),
    /// The master itself ends, and why; another may listen at its address later.
    MasterEnded(String),
    /// All leases are done and no more will come.
    Drained,
    /// We were told to stop.
    Stopped,
    /// Without a goodbye, or with one that asks us to come back.
    Lost(String),
}

/// Serves a master until one of the two has enough. Says goodbye if it is we.
pub(crate) async fn serve<R, S>(io: S, terms: Terms, keep: &mut Keep<R>, ending: &Ending) -> End
where
    R: Renderer,
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let (sender, receiver, traffic) = session::spawn(io);
    let Keep { renderer, pool, builders, loader, disk } = keep;
    let disk = disk.as_ref().filter(|_| terms.uses_disk);
    let desk = Desk::new(&mut *loader, disk.is_some(), terms.sharing.is_some());
    let duty = Duty {
        renderer,
        pool,
        builders,
        disk,
        desk,
        sender: sender.clone(),
        work: JoinSet::new(),
        fetches: JoinSet::new(),
        sharing: terms.sharing,
        compress: terms.compress,
        ending,
        traffic,
    };
    let end = tokio::select! {
        biased;
        () = ending.stopped() => End::Stopped,
        end = duty.run(receiver) => end,
    };
    pool.cancel(|_| true);
    // What is still being compiled is not wanted any more.
    loader.reset(false, false);
    let farewell = match &end {
        End::Stopped => Some("this worker was told to stop"),
        End::Drained => Some("all its segments are done"),
        End::Goodbye(_) | End::MasterEnded(_) | End::Lost(_) => None,
    };
    if let Some(reason) = farewell {
        let goodbye = async {
            if sender.send(ToMaster::Disconnect { reason: reason.to_owned() }).await.is_ok() {
                sender.closed().await;
            }
        };
        // A master that does not listen will notice that we are gone.
        let _ = tokio::time::timeout(FAREWELL, goodbye).await;
    }
    sender.abort();
    end
}

struct Duty<'a, R: Renderer> {
    renderer: &'a Arc<R>,
    pool: &'a RenderPool<R>,
    builders: &'a BuildPool,
    disk: Option<&'a DiskWriter>,
    desk: Desk<'a, R>,
    sender: Sender<ToMaster>,
    /// `None`: it was not wanted any more.
    work: JoinSet<Option<Done<R>>>,
    /// Assets that other workers pass on.
    fetches: JoinSet<()>,
    sharing: Option<Sharing>,
    compress: bool,
    ending: &'a Ending,
    traffic: Arc<Traffic>,
}

impl<R: Renderer> Duty<'_, R> {
    async fn run(mut self, mut receiver: Receiver<ToWorker>) -> End {
        let (pixels, finished) = mpsc::channel(UNSENT_SEGMENTS);
        let (failures, mut failed) = mpsc::unbounded_channel();
        // Dropped when draining: the mailman ends when the last lease has been answered.
        let mut answers = Some(Answers { pixels, failures, compress: self.compress });
        let mut mailman = JoinSet::new();
        mailman.spawn(send_finished(finished, self.sender.clone()));
        let (from_peers, mut passed) = mpsc::channel(UNREAD_CHUNKS);
        if let Some(Sharing { port, shelf }) = &self.sharing {
            shelf.clear();
            self.say(ToMaster::Sharing { port: *port }).await;
        }
        let mut draining = false;
        let mut has_asked_to_drain = false;
        let (mut silence, mut looks) = (Silence::default(), interval(LOOK_EVERY));
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            while let Some(effect) = self.desk.poll_effect() {
                match effect {
                    Effect::Drain => draining = true,
                    // What we asked for is no loss.
                    Effect::End { reason, reconnect: Reconnect::Now } if !has_asked_to_drain => {
                        return End::Lost(format!("it ends this session: {reason}"));
                    }
                    // One that was drained is meant to leave.
                    Effect::End { reason, reconnect: Reconnect::NextMaster }
                        if !has_asked_to_drain && !draining =>
                    {
                        return End::MasterEnded(reason);
                    }
                    Effect::End { reason, .. } => return End::Goodbye(reason),
                    Effect::Say(message) => {
                        if let (ToMaster::NeedAsset { id, .. }, Some(sharing)) = (&message, &self.sharing) {
                            sharing.shelf.expect(*id);
                        }
                        self.say(message).await;
                    }
                    effect => {
                        if let Err(why) = self.perform(effect, answers.as_ref(), &from_peers) {
                            return End::Lost(why);
                        }
                    }
                }
            }
            if draining && !self.desk.has_waiting() {
                answers = None;
            }
            tokio::select! {
                message = receiver.recv(), if self.work.len() < MAX_WORK => match message {
                    Some(Ok(message)) => self.desk.handle(Instant::now(), message),
                    Some(Err(error)) => return End::Lost(error.to_string()),
                    None => return End::Lost("the master closed the connection without a goodbye".to_owned()),
                },
                Some(done) = self.work.join_next() => match done {
                    Ok(Some(done)) => self.desk.done(done),
                    Ok(None) => {}
                    // Panics are caught inside, and nobody cancels: the runtime is shutting down.
                    Err(error) => tracing::debug!("work was not finished: {error}"),
                },
                Some(from) = passed.recv() => self.desk.passed(from),
                Some(_) = self.fetches.join_next() => {}
                Some((frame, reason)) = failed.recv() => self.desk.frame_failed(frame, reason),
                Some(_) = mailman.join_next(), if answers.is_none() => return End::Drained,
                () = self.ending.draining(), if !has_asked_to_drain => {
                    has_asked_to_drain = true;
                    // The master gives no more from now on, and says goodbye when it has got the rest.
                    self.say(ToMaster::Drain).await;
                }
                // While we do not listen it is our own silence.
                _ = looks.tick(), if self.work.len() < MAX_WORK => {
                    if let Some(Sharing { shelf, .. }) = &self.sharing {
                        shelf.tidy(Instant::now());
                    }
                    if silence.is_too_long(self.traffic.received_bytes()) {
                        return End::Lost(Silence::reason());
                    }
                }
            }
        }
    }

    fn perform(
        &mut self,
        effect: Effect<R>,
        answers: Option<&Answers>,
        from_peers: &mpsc::Sender<FromPeer>,
    ) -> Result<(), String> {
        match effect {
            Effect::Work(work) => {
                let renderer = Arc::clone(self.renderer);
                let builders = self.builders.clone();
                let disk = self.disk.map(|disk| Arc::clone(disk.cache()));
                if matches!(work, Work::Scene(SceneWork::Compile { .. })) {
                    self.work.spawn(compile_in_turn(renderer, builders, work));
                } else {
                    self.work.spawn_blocking(move || do_work(&*renderer, &builders, disk.as_deref(), work));
                }
            }
            Effect::Save(id, bytes) => {
                if let Some(disk) = self.disk {
                    disk.save(id, bytes);
                }
            }
            Effect::Fetch { id, size, peer } => {
                self.fetches.spawn(fetch(id, size, peer, from_peers.clone()));
            }
            Effect::Shelve(id, bytes) => {
                if let Some(Sharing { shelf, .. }) = &self.sharing {
                    shelf.put(id, bytes);
                }
            }
            Effect::Key(key) => {
                if let Some(Sharing { shelf, .. }) = &self.sharing {
                    shelf.set_key(key);
                }
            }
            Effect::Render { lease, rows, frame, arrived } => {
                let Some(answers) = answers else {
                    tracing::warn!("the master leases {lease} after it said that no more would come");
                    return Ok(());
                };
                if self.pool.len() >= MAX_LEASES {
                    return Err(format!("the master leases more than {MAX_LEASES} segments at a time"));
                }
                self.pool.submit(PoolJob::<R>::new(lease, rows, frame, answers.clone(), arrived));
            }
            Effect::CancelBefore(before) => self.pool.cancel(|frame| frame < before),
            Effect::CancelFrame(stale) => self.pool.cancel(|frame| frame == stale),
            // Dealt with by the caller.
            Effect::Say(_) | Effect::Drain | Effect::End { .. } => {}
        }
        Ok(())
    }

    async fn say(&self, message: ToMaster) {
        match self.sender.send(message).await {
            // What ended the session is the receiver's to tell.
            Ok(()) | Err(SendError::Closed) => {}
            Err(SendError::Invalid(error)) => tracing::error!("a message was not sent: {error}"),
        }
    }
}

/// Sends finished segments as fast as the master takes them, without anybody else waiting for it.
async fn send_finished(mut finished: mpsc::Receiver<ToMaster>, sender: Sender<ToMaster>) {
    while let Some(pixels) = finished.recv().await {
        match sender.send(pixels).await {
            Ok(()) | Err(SendError::Closed) => {}
            Err(SendError::Invalid(error)) => tracing::error!("a segment was not sent: {error}"),
        }
    }
}

/// Compiles when it is its turn. The session may end meanwhile: then the work does not begin, or keeps its turn until it
/// notices.
async fn compile_in_turn<R: Renderer>(
    renderer: Arc<R>,
    builders: BuildPool,
    work: Work<R>,
) -> Option<Done<R>> {
    let turn = builders.turn().await;
    let compile = move || {
        let _turn = turn;
        do_work(&*renderer, &builders, None, work)
    };
    // Panics are caught inside: otherwise the runtime is shutting down.
    tokio::task::spawn_blocking(compile).await.ok().flatten()
}

/// `None` where the result is not wanted any more.
fn do_work<R: Renderer>(
    renderer: &R,
    builders: &BuildPool,
    disk: Option<&DiskCache>,
    work: Work<R>,
) -> Option<Done<R>> {
    let done = match work {
        Work::Scene(SceneWork::Find { id }) => {
            Done::Scene(SceneDone::Found { id, size: disk.and_then(|disk| disk.find(id)) })
        }
        Work::Scene(SceneWork::Read { id, size }) => {
            Done::Scene(SceneDone::Read { id, bytes: disk.and_then(|disk| disk.read(id, size)) })
        }
        Work::Scene(SceneWork::DecodeScene { id, body }) => {
            let result = guarded(|| builders.run(|| renderer.decode_scene(&body))).flatten();
            Done::Scene(SceneDone::SceneDecoded { id, result })
        }
        Work::Scene(SceneWork::DecodePart { id, bytes }) => {
            let result = guarded(|| builders.run(|| renderer.decode_part(&bytes))).flatten();
            Done::Scene(SceneDone::PartDecoded { id, result })
        }
        Work::Scene(SceneWork::Compile { id, draft, parts, wanted }) => {
            let cancelled = || wanted.is_dropped();
            if cancelled() {
                return None;
            }
            let compile = || renderer.compile(draft, parts, &cancelled);
            let result = guarded(|| builders.run(compile)).flatten();
            if cancelled() {
                return None;
            }
            Done::Scene(SceneDone::Compiled { id, result })
        }
        Work::Prepare { announce, scene, wanted } => {
            let cancelled = || wanted.is_dropped();
            if cancelled() {
                return None;
            }
            let result = guarded(|| renderer.prepare(scene, &announce, &cancelled)).flatten();
            if cancelled() {
                return None;
            }
            let ready =
                |frame| ReadyFrame { narrow: renderer.is_narrow(&frame), width: announce.width, frame };
            Done::Prepared { frame: announce.frame, result: result.map(ready) }
        }
    };
    Some(done)
}
