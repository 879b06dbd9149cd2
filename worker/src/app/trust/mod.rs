//! What a worker keeps and reads to join a farm: its own key, join lines, and the masters that it remembers.

mod identity;
mod join_input;
mod masters;
mod private_file;
mod state_folder;

pub(super) use identity::load_identity;
pub(super) use join_input::{JOIN_VARIABLE, JoinInput, read_line};
pub(super) use masters::{MasterList, RememberedMaster};
pub(super) use state_folder::state_folder;
