//! The options that say how the files of models are read.

use clap::Args;
use rayfarm_tracer::scene::{LoadOptions, Up};

use super::picture::one_of;
use super::values::{Size, crease_angle};

/// How the files of models are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args)]
pub(crate) struct ModelArgs {
    /// Take pictures that the materials of models name outside of the model's folder too: above it, as in
    /// ../textures/wood.png, and where links lead.
    #[arg(long)]
    allow_parent_textures: bool,
    /// The axis of the model that points up; a scene file has up in [[model]] instead [default: y].
    #[arg(long, value_name = "y|z", value_parser = one_of(&Up::WORDS))]
    up: Option<Up>,
    /// Where a model has neither normals nor smoothing groups, faces that meet at this angle at most are smooth; a scene
    /// file has crease_angle in [[model]] instead [default: 40].
    #[arg(long, value_name = "DEGREES", value_parser = crease_angle)]
    crease_angle: Option<f64>,
}

impl ModelArgs {
    /// The same, as the tracer knows it, for a picture of this size.
    pub(crate) fn load_options(self, size: Option<Size>) -> LoadOptions {
        let Self { allow_parent_textures, up, crease_angle } = self;
        LoadOptions {
            allow_parent_textures,
            up,
            crease_angle,
            size: size.map(|size| (size.width, size.height)),
        }
    }

    /// The option that names a property of a model by itself, if one is given.
    pub(crate) fn of_a_model(self) -> Option<&'static str> {
        self.up.map(|_| "--up").or(self.crease_angle.map(|_| "--crease-angle"))
    }
}
