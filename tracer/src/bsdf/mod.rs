//! Models of reflection, a file each.
//!
//! ```text
//!   blinn_phong   c_d N.L + c_s (N.H)^p
//!   binomial      powers of cosines by a series, for the fast exponent
//!   specular      mirror reflection, refraction, Fresnel shares
//!   media         the transparent bodies around a ray
//!   scattering    random directions of paths
//! ```

mod binomial;
mod blinn_phong;
mod media;
pub(crate) mod scattering;
mod specular;

pub(crate) use blinn_phong::eval;
pub(crate) use media::Media;
pub(crate) use specular::{fresnel, fresnel_of_sheet, on_side_of, reflected, refracted};
