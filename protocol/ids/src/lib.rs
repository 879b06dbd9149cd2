//! Names of assets, frames and leases, and the cost of a lease: plain data that the scheduler shares with the wire.
//!
//! Nothing here knows how a message is laid out: that is `rayfarm-protocol`, which exports these types again.

mod cost;
mod ids;

pub use cost::Cost;
pub use ids::{AssetId, FrameId, Lease};
