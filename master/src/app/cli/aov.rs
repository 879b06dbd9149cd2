//! Auxiliary pictures of a rendered frame (arbitrary output variables).

use clap::ValueEnum;
use rayfarm_tracer::image::Channels;
use rayfarm_tracer::scene::Shading;

/// An auxiliary picture, a layer of an OpenEXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Aov {
    /// Diffuse colour.
    Albedo,
    /// Shading normal on the viewer's side, along the axes of the world, from -1 to 1.
    Normal,
    /// Distance along the ray in world units; infinite where nothing is hit.
    Depth,
    /// Number of the model or primitive, from 1; 0 where nothing is hit.
    Item,
}

impl Aov {
    /// The picture that the tracer renders for it.
    pub(crate) fn shading(self) -> Shading {
        match self {
            Self::Albedo => Shading::Albedo,
            Self::Normal => Shading::Normals,
            Self::Depth => Shading::Depth,
            Self::Item => Shading::Item,
        }
    }

    /// Name of its layer.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Item => "item",
        }
    }

    /// Channels of its layer.
    pub(crate) fn channels(self) -> Channels {
        match self {
            Self::Albedo => Channels::Color,
            Self::Normal => Channels::Vector,
            Self::Depth => Channels::Single("Z"),
            Self::Item => Channels::Single("id"),
        }
    }
}
