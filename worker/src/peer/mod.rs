//! Transfer of assets between workers: a server that sends assets of this worker's cache, and a client that fetches
//! assets from another worker.

mod cache;
mod client;
mod partial_asset;
mod server;

pub(crate) use cache::PeerCache;
pub(crate) use client::{PeerEvent, PeerSource, fetch_from_peer};
pub(crate) use partial_asset::PartialAsset;
pub(crate) use server::{PeerServer, serve_peers};
