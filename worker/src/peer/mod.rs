//! Transfer of assets between workers: a server that sends assets of this worker's cache, and a client that fetches
//! assets from another worker.

mod address_rules;
mod cache;
mod client;
mod partial_asset;
mod server;
mod share_keys;
mod stall_clock;

pub(crate) use cache::PeerCache;
pub(crate) use client::{Fetch, PeerClient, PeerEvent, PeerSource};
pub(crate) use partial_asset::PartialAsset;
pub(crate) use server::{PeerServer, serve_peers};
pub(crate) use stall_clock::StallClock;
