//! Scenes on a worker: loading by hash, caches of assets in memory and on the disk, and the threads that decode and
//! compile.

mod asset_store;
mod build_pool;
mod disk_cache;
mod disk_writer;
mod loader;
mod transfer;

pub(crate) use build_pool::BuildPool;
pub(crate) use disk_cache::{DiskCache, user_cache_folder};
pub(crate) use disk_writer::DiskWriter;
pub(crate) use loader::{AssetRequest, SceneLoader, SceneResult, SceneWork, Step};
