//! One session: carries out what the [`Desk`] decides. Nothing in here takes long: whatever does, runs on the render
//! threads or on blocking ones, so a ping is answered at once.

use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::session::{self, Receiver, SendError, Sender};
use rayfarm_protocol::{ToMaster, ToWorker};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use crate::desk::{Desk, Done, Effect, Work};
use crate::guard::guarded;
use crate::render_pool::{Answers, PoolJob, RenderPool};
use crate::renderer::Renderer;
use crate::scene_loader::{SceneDone, SceneLoader, SceneWork};

/// Finished segments between the render threads and the session's own queue.
const UNSENT_SEGMENTS: usize = 8;

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
    pub(crate) loader: SceneLoader<R>,
}

/// How a session ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// The master said goodbye for good, and why.
    Goodbye(String),
    /// All leases are done and no more will come.
    Drained,
    /// We were told to stop.
    Stopped,
    /// Without a goodbye, or with one that asks us to come back.
    Lost(String),
}

/// Serves a master until one of the two has enough. Says goodbye if it is we.
pub(crate) async fn serve<R, S>(io: S, keep: &mut Keep<R>, stop: &CancellationToken) -> End
where
    R: Renderer,
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let (sender, receiver, _traffic) = session::spawn(io);
    let Keep { renderer, pool, loader } = keep;
    let duty = Duty { renderer, pool, desk: Desk::new(loader), sender: sender.clone(), work: JoinSet::new() };
    let end = tokio::select! {
        biased;
        () = stop.cancelled() => End::Stopped,
        end = duty.run(receiver) => end,
    };
    pool.cancel(|_| true);
    let farewell = match &end {
        End::Stopped => Some("this worker was told to stop"),
        End::Drained => Some("all its segments are done"),
        End::Goodbye(_) | End::Lost(_) => None,
    };
    if let Some(reason) = farewell {
        let goodbye = async {
            if sender.send(ToMaster::Goodbye { reason: reason.to_owned() }).await.is_ok() {
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
    desk: Desk<'a, R>,
    sender: Sender<ToMaster>,
    work: JoinSet<Done<R>>,
}

impl<R: Renderer> Duty<'_, R> {
    async fn run(mut self, mut receiver: Receiver<ToWorker>) -> End {
        let (pixels, finished) = mpsc::channel(UNSENT_SEGMENTS);
        let (failures, mut failed) = mpsc::unbounded_channel();
        // Dropped when draining: the mailman ends when the last lease has been answered.
        let mut answers = Some(Answers { pixels, failures });
        let mut mailman = JoinSet::new();
        mailman.spawn(send_finished(finished, self.sender.clone()));
        let mut draining = false;
        loop {
            while let Some(effect) = self.desk.poll_effect() {
                match effect {
                    Effect::Drain => draining = true,
                    Effect::End { reason, again: true } => {
                        return End::Lost(format!("it ends this session: {reason}"));
                    }
                    Effect::End { reason, again: false } => return End::Goodbye(reason),
                    Effect::Say(message) => self.say(message).await,
                    effect => {
                        if let Err(why) = self.perform(effect, answers.as_ref()) {
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
                    Some(Ok(message)) => self.desk.handle(message),
                    Some(Err(error)) => return End::Lost(error.to_string()),
                    None => return End::Lost("the master closed the connection without a goodbye".to_owned()),
                },
                Some(done) = self.work.join_next() => match done {
                    Ok(done) => self.desk.done(done),
                    // Panics are caught inside, and nobody cancels: the runtime is shutting down.
                    Err(error) => tracing::debug!("work was not finished: {error}"),
                },
                Some((frame, reason)) = failed.recv() => self.desk.frame_failed(frame, reason),
                Some(_) = mailman.join_next(), if answers.is_none() => return End::Drained,
            }
        }
    }

    fn perform(&mut self, effect: Effect<R>, answers: Option<&Answers>) -> Result<(), String> {
        match effect {
            Effect::Work(work) => {
                let renderer = Arc::clone(self.renderer);
                self.work.spawn_blocking(move || do_work(&*renderer, work));
            }
            Effect::Render { lease, rows, frame } => {
                let Some(answers) = answers else {
                    tracing::warn!("the master leases {lease} after it said that no more would come");
                    return Ok(());
                };
                if self.pool.len() >= MAX_LEASES {
                    return Err(format!("the master leases more than {MAX_LEASES} segments at a time"));
                }
                self.pool.submit(PoolJob::<R>::new(lease, rows, frame, answers.clone()));
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

fn do_work<R: Renderer>(renderer: &R, work: Work<R>) -> Done<R> {
    match work {
        Work::Scene(SceneWork::DecodeScene { id, body }) => {
            let result = guarded(|| renderer.decode_scene(&body)).flatten();
            Done::Scene(SceneDone::SceneDecoded { id, result })
        }
        Work::Scene(SceneWork::DecodePart { id, bytes }) => {
            let result = guarded(|| renderer.decode_part(&bytes)).flatten();
            Done::Scene(SceneDone::PartDecoded { id, result })
        }
        Work::Scene(SceneWork::Compile { id, draft, parts }) => {
            let result = guarded(|| renderer.compile(draft, parts)).flatten();
            Done::Scene(SceneDone::Compiled { id, result })
        }
        Work::Prepare { announce, scene } => {
            let result = guarded(|| renderer.prepare(scene, &announce)).flatten();
            Done::Prepared { frame: announce.frame, width: announce.width, result }
        }
    }
}
