//! A client for HTTP and WebSocket of a few lines, which shows the bytes as they are.

use std::collections::HashMap;
use std::net::SocketAddr;

use serde_json::Value;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;

use super::PATIENCE;

/// A response.
#[derive(Debug)]
pub(super) struct Response {
    pub(super) status: u16,
    /// Headers by name in lower case.
    pub(super) headers: HashMap<String, String>,
    pub(super) body: Vec<u8>,
}

impl Response {
    pub(super) fn text(&self) -> &str {
        std::str::from_utf8(&self.body).unwrap()
    }

    pub(super) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }
}

/// Sends a request to `path` with these headers, or without a Host header where it is empty, and reads the response.
pub(super) async fn request(
    address: SocketAddr,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> Response {
    let mut stream = BufReader::new(TcpStream::connect(address).await.unwrap());
    send_head(&mut stream, method, path, headers, body).await;
    tokio::time::timeout(PATIENCE, read_response(&mut stream)).await.expect("no response arrives")
}

/// As [`request`], with GET and the right Host header.
pub(super) async fn fetch(address: SocketAddr, path: &str, headers: &[(&str, &str)]) -> Response {
    let host = address.to_string();
    request(address, "GET", path, &[&[("Host", host.as_str())], headers].concat(), b"").await
}

async fn send_head(
    stream: &mut BufReader<TcpStream>,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) {
    let mut head = format!("{method} {path} HTTP/1.1\r\n");
    for (name, value) in headers {
        head += &format!("{name}: {value}\r\n");
    }
    if !body.is_empty() {
        head += &format!("Content-Length: {}\r\n", body.len());
    }
    head += "\r\n";
    // The server may refuse the request before its end.
    let _ = stream.write_all(head.as_bytes()).await;
    let _ = stream.write_all(body).await;
}

async fn read_response(stream: &mut BufReader<TcpStream>) -> Response {
    let mut line = String::new();
    stream.read_line(&mut line).await.unwrap();
    let status = line.split(' ').nth(1).unwrap_or_else(|| panic!("no response: {line:?}")).parse().unwrap();
    let mut headers = HashMap::new();
    loop {
        line.clear();
        stream.read_line(&mut line).await.unwrap();
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.insert(name.to_ascii_lowercase(), value.to_owned());
    }
    let length = headers.get("content-length").map_or(0, |length| length.parse().unwrap());
    let mut body = vec![0; length];
    stream.read_exact(&mut body).await.unwrap();
    Response { status, headers, body }
}

/// A message of the server.
#[derive(Debug)]
pub(super) enum Message {
    Json(Value),
    /// A picture with its header.
    Picture(Vec<u8>),
    /// The connection was closed.
    Closed,
}

/// An open WebSocket.
pub(super) struct Socket(BufReader<TcpStream>);

impl Socket {
    /// Opens a WebSocket with these headers. Returns the status where the server refuses it.
    pub(super) async fn open(address: SocketAddr, headers: &[(&str, &str)]) -> Result<Self, u16> {
        let mut stream = BufReader::new(TcpStream::connect(address).await.unwrap());
        let host = address.to_string();
        let own = [
            ("Host", host.as_str()),
            ("Connection", "Upgrade"),
            ("Upgrade", "websocket"),
            ("Sec-WebSocket-Version", "13"),
            ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
        ];
        send_head(&mut stream, "GET", "/ws", &[&own[..], headers].concat(), b"").await;
        let response = tokio::time::timeout(PATIENCE, read_response(&mut stream)).await.unwrap();
        match response.status {
            101 => Ok(Self(stream)),
            status => Err(status),
        }
    }

    /// Sends a text, masked with zeros.
    pub(super) async fn send(&mut self, text: &str) {
        let length = u16::try_from(text.len()).unwrap();
        let mut frame = vec![0x81];
        match length {
            0..=125 => frame.push(0x80 | length as u8),
            _ => {
                frame.push(0x80 | 126);
                frame.extend_from_slice(&length.to_be_bytes());
            }
        }
        frame.extend_from_slice(&[0; 4]);
        frame.extend_from_slice(text.as_bytes());
        // The server may have closed the connection.
        let _ = self.0.write_all(&frame).await;
    }

    /// The next message; pings are skipped.
    pub(super) async fn next(&mut self) -> Message {
        tokio::time::timeout(PATIENCE, self.read()).await.expect("no message arrives")
    }

    async fn read(&mut self) -> Message {
        loop {
            let Ok(head) = self.0.read_u16().await else { return Message::Closed };
            let length = match head & 0x7f {
                126 => u64::from(self.0.read_u16().await.unwrap()),
                127 => self.0.read_u64().await.unwrap(),
                length => u64::from(length),
            };
            let mut body = vec![0; usize::try_from(length).unwrap()];
            if self.0.read_exact(&mut body).await.is_err() {
                return Message::Closed;
            }
            match head >> 8 & 0xf {
                1 => return Message::Json(serde_json::from_slice(&body).unwrap()),
                2 => return Message::Picture(body),
                8 => return Message::Closed,
                _ => {}
            }
        }
    }

    /// The next message of a type.
    pub(super) async fn next_of(&mut self, kind: &str) -> Value {
        loop {
            match self.next().await {
                Message::Json(message) if message["type"] == kind => return message,
                Message::Closed => panic!("closed before a message {kind}"),
                _ => {}
            }
        }
    }

    /// The next picture with its header.
    pub(super) async fn next_picture(&mut self) -> Vec<u8> {
        loop {
            match self.next().await {
                Message::Picture(picture) => return picture,
                Message::Closed => panic!("closed before a picture"),
                Message::Json(_) => {}
            }
        }
    }
}
