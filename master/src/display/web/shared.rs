//! State that all requests and pages of one server share.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;
use tokio::sync::watch;

use super::access::Access;
use super::audience::Audience;
use super::commands::Commands;
use super::pictures::Pictures;
use super::status::{facts, status};
use super::steering::Steering;
use crate::display::SceneInfo;
use crate::viewer::ViewerHandle;

/// Most open pages at a time.
const MAX_CLIENTS: usize = 16;
/// Interval at which pages receive the state while the picture changes, and at rest.
const STATUS_EVERY: Duration = Duration::from_millis(250);
const RESTING_STATUS_EVERY: Duration = Duration::from_secs(1);

/// State of one server.
pub(super) struct Shared {
    pub(super) viewer: ViewerHandle,
    pub(super) access: Access,
    pub(super) commands: Arc<Commands>,
    pub(super) pictures: Pictures,
    pub(super) audience: Audience,
    pub(super) steering: Steering,
    /// Scene, knobs and version as JSON, which do not change while the server runs.
    pub(super) facts: Value,
    /// The newest state as JSON, for all pages; `None` before the first one.
    pub(super) published: watch::Sender<Option<Arc<str>>>,
}

impl Shared {
    /// State of a server of this view.
    pub(super) fn new(
        viewer: ViewerHandle,
        access: Access,
        commands: Commands,
        info: &SceneInfo,
    ) -> Arc<Self> {
        Arc::new(Self {
            viewer,
            access,
            commands: Arc::new(commands),
            pictures: Pictures::default(),
            audience: Audience::new(),
            steering: Steering::new(MAX_CLIENTS),
            facts: facts(info),
            published: watch::Sender::new(None),
        })
    }

    /// The state now.
    pub(super) fn status(&self) -> Value {
        let newest = self.viewer.clone().newest_frame();
        status(&self.viewer.statistics(), &self.viewer.status(), newest.as_deref())
    }

    /// Publishes the state at intervals while pages are open. A state that has not changed is not published again. Never returns.
    pub(super) async fn publish(&self) {
        loop {
            self.audience.is_there().await;
            let text: Arc<str> = self.status().to_string().into();
            self.published.send_if_modified(|newest| {
                let differs = newest.as_ref() != Some(&text);
                if differs {
                    *newest = Some(text);
                }
                differs
            });
            let is_resting = self.viewer.statistics().resting;
            tokio::time::sleep(if is_resting { RESTING_STATUS_EVERY } else { STATUS_EVERY }).await;
        }
    }
}
