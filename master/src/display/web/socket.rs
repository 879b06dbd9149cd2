//! The WebSocket of one page: pictures, state and replies go out; input, commands and acknowledgements come in.
//!
//! One picture at a time is on its way to a page: the next one is sent when the page has shown it, and it is the newest one then.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::json;
use tokio::sync::{mpsc, watch};

use super::access::Level;
use super::audience::Looking;
use super::message::ClientMessage;
use super::pictures::Format;
use super::shared::Shared;
use super::steering::{ClientId, SteeringState};
use crate::log_lines;
use crate::viewer::{InputAction, PresentedFrame, ViewerHandle};

/// Replies that wait for the connection. A page that sends more commands than it reads replies is not read until then.
const MAX_REPLIES: usize = 16;
/// Lines of the log that a page receives at once, the last ones.
const MAX_LOG_LINES: usize = 100;
/// Interval at which new lines of the log are sent.
const LOG_EVERY: Duration = Duration::from_secs(1);
/// Interval of pings, which browsers answer by themselves, and the longest silence of a page.
const PING_EVERY: Duration = Duration::from_secs(20);
const MAX_SILENCE: Duration = Duration::from_secs(60);
/// Longest time of sending one message.
const SEND_TIMEOUT: Duration = Duration::from_secs(60);
/// Time without another frame after which the newest one is sent with its exact bytes, even if the view is not at rest: all workers
/// may be paused.
const STILL: Duration = Duration::from_secs(1);

/// One page. It takes a place among all pages until it is dropped.
pub(super) struct Client {
    shared: Arc<Shared>,
    level: Level,
    id: ClientId,
}

/// State of a page that both directions of its connection use.
#[derive(Clone, Copy, Debug)]
struct Page {
    /// Whether the page can be seen.
    visible: bool,
    /// Time at which the page last became visible.
    visible_since: Instant,
    /// The picture that is on its way.
    sent: Option<Sent>,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    number: u32,
    /// Time of the input that the picture answers, unless another picture of the frame has been shown, or the frame is older than
    /// the page.
    input_at: Option<Instant>,
}

/// The last picture that was sent.
struct Last {
    frame: Weak<PresentedFrame>,
    format: Format,
    at: Instant,
}

/// The outgoing direction.
struct Writer<'a> {
    client: &'a Client,
    sink: SplitSink<WebSocket, Message>,
    page: &'a watch::Sender<Page>,
    replies: mpsc::Receiver<String>,
    steering: watch::Receiver<SteeringState>,
    published: watch::Receiver<Option<Arc<str>>>,
    viewer: ViewerHandle,
    last: Option<Last>,
    /// Lines of the log that were sent, counted from the start of the process.
    logged: u64,
}

/// The connection has ended.
#[derive(Debug)]
struct Ended;

impl Client {
    /// Takes a place for a page; `None` where there are too many.
    pub(super) fn join(shared: Arc<Shared>, level: Level, now: Instant) -> Option<Self> {
        let id = shared.steering.join(now)?;
        Some(Self { shared, level, id })
    }

    /// Serves the page until it or the viewer ends.
    pub(super) async fn run(self, socket: WebSocket) {
        let (sink, stream) = socket.split();
        let (replies_in, replies) = mpsc::channel(MAX_REPLIES);
        let page = watch::Sender::new(Page { visible: true, visible_since: Instant::now(), sent: None });
        let mut writer = Writer {
            client: &self,
            sink,
            page: &page,
            replies,
            steering: self.shared.steering.state(),
            published: self.shared.published.subscribe(),
            viewer: self.shared.viewer.clone(),
            last: None,
            logged: 0,
        };
        tokio::select! {
            () = self.read(stream, &replies_in, &page) => {}
            _ = writer.run() => {}
            () = self.shared.viewer.ended() => {}
        }
    }

    /// Reads messages until the page ends, is silent for too long, or sends an invalid message.
    async fn read(
        &self,
        mut stream: SplitStream<WebSocket>,
        replies: &mpsc::Sender<String>,
        page: &watch::Sender<Page>,
    ) {
        let mut looking = Some(self.shared.audience.look());
        while let Ok(Some(Ok(message))) = tokio::time::timeout(MAX_SILENCE, stream.next()).await {
            let text = match &message {
                Message::Text(text) => text.as_str(),
                Message::Ping(_) | Message::Pong(_) => continue,
                Message::Binary(_) | Message::Close(_) => return,
            };
            let message = match ClientMessage::parse(text) {
                Ok(message) => message,
                Err(problem) => {
                    tracing::debug!("page {} sends an invalid message: {problem}", self.id);
                    return;
                }
            };
            if let Some(reply) = self.apply(message, page, &mut looking).await
                && replies.send(reply).await.is_err()
            {
                return;
            }
        }
    }

    /// Applies a message. Returns the reply, if it has one.
    async fn apply(
        &self,
        message: ClientMessage,
        page: &watch::Sender<Page>,
        looking: &mut Option<Looking>,
    ) -> Option<String> {
        let (steering, now) = (&self.shared.steering, Instant::now());
        match message {
            ClientMessage::Shown { picture } => self.shown(picture, page),
            ClientMessage::Input { moves } if steering.input(self.id, now) => {
                let actions = moves.into_iter().map(|it| it.action()).collect();
                if !self.shared.viewer.send(actions) {
                    return Some(json!({ "type": "busy" }).to_string());
                }
            }
            // A movement from before the handover.
            ClientMessage::Input { .. } => {}
            ClientMessage::Command { id, line } => {
                let reply = self.command(&line, now).await;
                return Some(format!("{{\"type\":\"reply\",\"id\":{id},\"reply\":{reply}}}"));
            }
            ClientMessage::Steer => steering.request(self.id, now),
            ClientMessage::HandOver { grant } => steering.answer(self.id, grant, now),
            ClientMessage::Visible { visible } => {
                *looking = visible.then(|| self.shared.audience.look());
                page.send_modify(|page| {
                    page.visible = visible;
                    page.visible_since = if visible { now } else { page.visible_since };
                });
            }
        }
        None
    }

    /// The reply to a control command. A change of the view needs the right to steer.
    async fn command(&self, line: &str, now: Instant) -> String {
        let sets = line.split_whitespace().next() == Some("set");
        if sets && !self.shared.steering.input(self.id, now) {
            let error = "another page steers: request to steer first";
            return json!({ "ok": false, "error": error }).to_string();
        }
        self.shared.commands.reply_of(line, self.level).await.into_line()
    }

    /// Records that a picture is on the screen, and with it the latency of the page that steers.
    fn shown(&self, number: u32, page: &watch::Sender<Page>) {
        let mut shown = None;
        page.send_if_modified(|page| {
            shown = page.sent.take_if(|sent| sent.number == number);
            shown.is_some()
        });
        let steers = self.shared.steering.state().borrow().steers == Some(self.id);
        if let Some(input_at) = shown.and_then(|sent| sent.input_at).filter(|_| steers) {
            self.shared.viewer.send(vec![InputAction::Presented { latency: input_at.elapsed() }]);
        }
    }

    /// The first message: the facts that do not change, and the access level of this page.
    fn hello(&self) -> String {
        let is_owner = self.level == Level::Owner;
        let join = is_owner.then(|| self.shared.viewer.entrance().reachable().commands());
        let mut hello = self.shared.facts.clone();
        hello["type"] = json!("hello");
        hello["client"] = json!(self.id);
        hello["owner"] = json!(is_owner);
        hello["join"] = json!(join);
        hello.to_string()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.shared.steering.leave(self.id, Instant::now());
    }
}

impl Writer<'_> {
    /// Sends until the connection ends.
    async fn run(&mut self) -> Result<(), Ended> {
        let mut seen = self.page.subscribe();
        let mut pings = tokio::time::interval(PING_EVERY);
        let mut logs = tokio::time::interval(LOG_EVERY);
        self.text(self.client.hello()).await?;
        self.steering.mark_changed();
        self.published.mark_changed();
        loop {
            tokio::select! {
                reply = self.replies.recv() => self.text(reply.ok_or(Ended)?).await?,
                changed = self.steering.changed() => {
                    changed.map_err(|_| Ended)?;
                    let state = *self.steering.borrow_and_update();
                    self.text(json!({ "type": "steering", "steering": state }).to_string()).await?;
                }
                changed = self.published.changed() => {
                    changed.map_err(|_| Ended)?;
                    let status = self.published.borrow_and_update().clone();
                    if let Some(status) = status {
                        self.text(format!("{{\"type\":\"status\",\"status\":{status}}}")).await?;
                    }
                }
                (frame, format) = next_picture(&mut self.viewer, &mut seen, self.last.as_ref()) => {
                    self.picture(&frame, format).await?;
                }
                _ = logs.tick() => self.log().await?,
                _ = pings.tick() => self.send(Message::Ping(Default::default())).await?,
            }
        }
    }

    /// Sends a picture of a frame.
    async fn picture(&mut self, frame: &Arc<PresentedFrame>, format: Format) -> Result<(), Ended> {
        let is_new = self.last.as_ref().is_none_or(|last| last.frame.as_ptr() != Arc::as_ptr(frame));
        let encoded = self.client.shared.pictures.of(frame, format).await;
        self.last = Some(Last { frame: Arc::downgrade(frame), format, at: Instant::now() });
        match encoded {
            Ok(encoded) => {
                // A frame that is older than the visibility of the page has no latency.
                let is_current = is_new && frame.completed_at > self.page.borrow().visible_since;
                let input_at = is_current.then_some(frame.input_at);
                let sent = Sent { number: encoded.number, input_at };
                self.page.send_modify(|page| page.sent = Some(sent));
                self.send(Message::Binary(encoded.message)).await
            }
            Err(problem) => {
                tracing::warn!("a picture cannot be sent to a page: {problem}");
                Ok(())
            }
        }
    }

    /// Sends new lines of the log, to an owner only, because they may contain secrets.
    async fn log(&mut self) -> Result<(), Ended> {
        if self.client.level != Level::Owner {
            return Ok(());
        }
        let (lines, logged) = log_lines::after(self.logged, MAX_LOG_LINES);
        self.logged = logged;
        if lines.is_empty() {
            return Ok(());
        }
        self.text(json!({ "type": "log", "lines": lines }).to_string()).await
    }

    async fn text(&mut self, text: String) -> Result<(), Ended> {
        self.send(Message::Text(text.into())).await
    }

    async fn send(&mut self, message: Message) -> Result<(), Ended> {
        match tokio::time::timeout(SEND_TIMEOUT, self.sink.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Ended),
        }
    }
}

/// Waits until a page is to receive a picture: it can be seen, none is on its way, and the newest frame has not been sent, or not
/// with its exact bytes although it rests.
async fn next_picture(
    viewer: &mut ViewerHandle,
    page: &mut watch::Receiver<Page>,
    last: Option<&Last>,
) -> (Arc<PresentedFrame>, Format) {
    loop {
        let Page { visible, sent, .. } = *page.borrow_and_update();
        if !visible || sent.is_some() {
            page_changed(page).await;
            continue;
        }
        let Some(frame) = viewer.newest_frame() else {
            tokio::select! {
                () = viewer.frame_changed() => {}
                () = page_changed(page) => {}
            }
            continue;
        };
        let rests = viewer.statistics().resting;
        match last.filter(|last| last.frame.as_ptr() == Arc::as_ptr(&frame)) {
            None if rests => return (frame, Format::Png),
            None => return (frame, Format::Jpeg),
            Some(Last { format: Format::Jpeg, at, .. }) if rests || at.elapsed() >= STILL => {
                return (frame, Format::Png);
            }
            Some(Last { format: Format::Jpeg, at, .. }) => {
                let still_at = *at + STILL;
                drop(frame);
                changed(viewer, page, still_at).await;
            }
            Some(Last { format: Format::Png, .. }) => {
                drop(frame);
                tokio::select! {
                    () = viewer.frame_changed() => {}
                    () = page_changed(page) => {}
                }
            }
        }
    }
}

/// Waits for a change of frames, statistics or page, until a time at most.
async fn changed(viewer: &mut ViewerHandle, page: &mut watch::Receiver<Page>, until: Instant) {
    // Both borrow the handle, so they are not waited for at the same time.
    let mut frames = viewer.clone();
    tokio::select! {
        () = frames.frame_changed() => {}
        () = viewer.statistics_changed() => {}
        () = page_changed(page) => {}
        () = tokio::time::sleep_until(until.into()) => {}
    }
}

async fn page_changed(page: &mut watch::Receiver<Page>) {
    if page.changed().await.is_err() {
        std::future::pending().await
    }
}
