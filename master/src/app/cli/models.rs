//! Options for reading models.

use clap::Args;
use rayfarm_tracer::scene::{LoadOptions, Up};

use super::values::{Size, crease_angle, one_of};

/// Options for reading models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args)]
pub(crate) struct ModelArgs {
    /// Allow textures outside of the model's folder: above it, as in ../textures/wood.png, and through links.
    #[arg(long)]
    allow_parent_textures: bool,
    /// Axis of the model that points up; a scene file has up in [[model]] instead [default: y].
    #[arg(long, value_name = "y|z", value_parser = one_of(&Up::WORDS))]
    up: Option<Up>,
    /// Largest angle between smooth faces, for a model without normals and smoothing groups; a scene file has crease_angle in
    /// [[model]] instead [default: 40].
    #[arg(long, value_name = "DEGREES", value_parser = crease_angle)]
    crease_angle: Option<f64>,
}

impl ModelArgs {
    /// Options of the tracer for a picture of this size.
    pub(crate) fn load_options(self, size: Option<Size>) -> LoadOptions {
        let Self { allow_parent_textures, up, crease_angle } = self;
        LoadOptions {
            allow_parent_textures,
            up,
            crease_angle,
            size: size.map(|size| (size.width, size.height)),
        }
    }

    /// The given option that applies to a bare model only, if there is one.
    pub(crate) fn of_a_model(self) -> Option<&'static str> {
        self.up.map(|_| "--up").or(self.crease_angle.map(|_| "--crease-angle"))
    }
}
