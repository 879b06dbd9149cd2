//! Requests and their responses: the page, the interface for programs, and the way to a WebSocket.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Extension, Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{Response, StatusCode};
use axum::middleware::{self, Next};
use axum::response::IntoResponse;
use axum::routing::{get, post};
use serde_json::Value;

use super::access::{Level, Refusal};
use super::commands::{MAX_COMMAND_BYTES, Reply};
use super::message::MAX_MESSAGE_BYTES;
use super::metrics::{self, metrics};
use super::pictures::{Format, HEADER_BYTES};
use super::shared::Shared;
use super::socket;
use crate::viewer::PresentedFrame;

/// Time for the body of a request.
const BODY_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait for the first picture.
const PICTURE_TIMEOUT: Duration = Duration::from_secs(60);
/// Bytes of a message to a client that wait for its connection, next to the picture that is being sent.
const MAX_WAITING_BYTES: usize = 64 << 20;

/// Headers of all responses. Everything on the page comes from this server, and no other page shows it in a frame.
const HEADERS: [(HeaderName, &str); 7] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

const TEXT: &str = "text/plain; charset=utf-8";
const JSON: &str = "application/json";

/// All routes.
pub(super) fn router(shared: Arc<Shared>) -> Router {
    let page = |kind, text| get(move || async move { with_type(kind, text) });
    Router::new()
        .route("/", get(index))
        .route("/style.css", page("text/css; charset=utf-8", include_str!("page/style.css")))
        .route("/app.js", page("text/javascript; charset=utf-8", include_str!("page/app.js")))
        // Browsers request it for every page.
        .route("/favicon.ico", get(async || StatusCode::NO_CONTENT))
        .route("/ws", get(upgrade))
        .route("/api/status", get(status))
        .route("/api/frame.png", get(frame))
        .route("/api/command", post(command))
        .route("/metrics", get(all_metrics))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

/// Refuses requests that are not for this server or have no right to it, and adds the headers of all responses.
async fn guard(State(shared): State<Arc<Shared>>, mut request: Request, next: Next) -> Response<Body> {
    let mut response = match shared.access.level(request.headers(), request.uri()) {
        Ok(level) => {
            request.extensions_mut().insert(level);
            match entered(&shared, &request) {
                Some(response) => response,
                None => next.run(request).await,
            }
        }
        Err(Refusal::Token) => {
            entered(&shared, &request).unwrap_or_else(|| Refusal::Token.response().into_response())
        }
        Err(refusal) => refusal.response().into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// The response to an address with the token: a cookie, and the address without it, which may be read by others on the screen.
fn entered(shared: &Shared, request: &Request) -> Option<Response<Body>> {
    let is_page = request.uri().path() == "/";
    let cookie = shared.access.cookie_for(request.uri()).filter(|_| is_page)?;
    let headers = [(header::SET_COOKIE, cookie.as_str()), (header::LOCATION, "/")];
    Some((StatusCode::SEE_OTHER, headers).into_response())
}

fn with_type(kind: &'static str, text: impl IntoResponse) -> Response<Body> {
    ([(header::CONTENT_TYPE, kind)], text).into_response()
}

async fn index() -> Response<Body> {
    with_type("text/html; charset=utf-8", include_str!("page/index.html"))
}

async fn upgrade(
    State(shared): State<Arc<Shared>>,
    Extension(level): Extension<Level>,
    upgrade: WebSocketUpgrade,
) -> Response<Body> {
    let Some(client) = socket::Client::join(shared, level, Instant::now()) else {
        let text = "There are too many open pages: close one of them.\n";
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    };
    upgrade
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES)
        .max_write_buffer_size(MAX_WAITING_BYTES)
        .on_upgrade(|socket| client.run(socket))
}

async fn status(State(shared): State<Arc<Shared>>) -> Response<Body> {
    let mut status = shared.status();
    status["scene"] = shared.facts["scene"].clone();
    status["version"] = shared.facts["version"].clone();
    with_type(JSON, format!("{status}\n"))
}

async fn all_metrics(State(shared): State<Arc<Shared>>) -> Response<Body> {
    let (viewer, clients) = (&shared.viewer, shared.steering.clients());
    let text = metrics(&viewer.statistics(), &viewer.status(), &shared.pictures.work(), clients);
    with_type(metrics::CONTENT_TYPE, text)
}

/// The newest frame as PNG. Where there is none, frames are requested until the first one is complete.
async fn frame(State(shared): State<Arc<Shared>>, request: Request) -> Response<Body> {
    let unavailable = |text: &str| (StatusCode::SERVICE_UNAVAILABLE, text.to_owned()).into_response();
    let Ok(frame) = tokio::time::timeout(PICTURE_TIMEOUT, newest(&shared)).await else {
        let problem =
            shared.viewer.statistics().problem.clone().unwrap_or_else(|| "no frame is complete".to_owned());
        return unavailable(&format!("There is no picture yet: {problem}.\n"));
    };
    let encoded = match shared.pictures.of(&frame, Format::Png).await {
        Ok(encoded) => encoded,
        Err(problem) => return unavailable(&format!("The picture cannot be encoded: {problem}.\n")),
    };
    let mut response = with_type("image/png", encoded.message.slice(HEADER_BYTES..));
    if request.uri().query() == Some("download") {
        let name = format!("attachment; filename=\"frame-{}.png\"", frame.frame.frame.0);
        if let Ok(name) = HeaderValue::from_str(&name) {
            response.headers_mut().insert(header::CONTENT_DISPOSITION, name);
        }
    }
    response
}

async fn newest(shared: &Shared) -> Arc<PresentedFrame> {
    let mut viewer = shared.viewer.clone();
    let _looking = shared.audience.look();
    loop {
        if let Some(frame) = viewer.newest_frame() {
            return frame;
        }
        viewer.frame_changed().await;
    }
}

/// Executes a control command: the body is its line.
async fn command(
    State(shared): State<Arc<Shared>>,
    Extension(level): Extension<Level>,
    body: Body,
) -> Response<Body> {
    let body = tokio::time::timeout(BODY_TIMEOUT, axum::body::to_bytes(body, MAX_COMMAND_BYTES));
    let refuse =
        |status: StatusCode, text: String| (status, [(header::CONTENT_TYPE, TEXT)], text).into_response();
    let body: Bytes = match body.await {
        Ok(Ok(body)) => body,
        Ok(Err(_)) => {
            let text = format!("A command has at most {MAX_COMMAND_BYTES} bytes.\n");
            return refuse(StatusCode::PAYLOAD_TOO_LARGE, text);
        }
        Err(_) => {
            return refuse(StatusCode::REQUEST_TIMEOUT, "The command takes too long to arrive.\n".to_owned());
        }
    };
    let line = match std::str::from_utf8(&body).map(str::trim) {
        Ok(line) if !line.contains(['\n', '\r']) => line,
        _ => {
            return refuse(
                StatusCode::BAD_REQUEST,
                "The body must be one line of text, such as: status\n".to_owned(),
            );
        }
    };
    let (code, reply) = match shared.commands.reply_of(line, level).await {
        Reply::Executed(reply) => {
            let ok = serde_json::from_str(&reply).is_ok_and(|reply: Value| reply["ok"] == true);
            (if ok { StatusCode::OK } else { StatusCode::BAD_REQUEST }, reply)
        }
        Reply::Forbidden(reply) => (StatusCode::UNAUTHORIZED, reply),
        Reply::Busy(reply) => (StatusCode::TOO_MANY_REQUESTS, reply),
    };
    (code, [(header::CONTENT_TYPE, JSON)], format!("{reply}\n")).into_response()
}
