//! Import of models and the tools that all importers share: finding and decoding files, recognising formats, warnings.

mod error;
mod foreign;
mod lookup;
mod obj;
mod options;
mod printed;
mod read;
mod text;
mod warnings;

pub use error::SceneError;
pub use options::{DEFAULT_CREASE_ANGLE, LoadOptions, Up};

pub(super) use error::shown;
pub(super) use foreign::{Wanted, recognised_file};
pub(super) use lookup::{Lookup, Missing};
pub(super) use obj::{Uvs, load_noting as load_obj};
pub(super) use printed::{escaped, excerpt};
pub(super) use read::{Kind, MAX_MODEL_BYTES, MAX_SCENE_BYTES, bytes};
pub(super) use warnings::Warnings;
