//! Models of reflection, a file each.
//!
//! ```text
//!   blinn_phong   c_d N.L + c_s (N.H)^p
//!   binomial      powers of cosines by a series, for the fast exponent
//!   specular      mirror reflection, refraction, Fresnel shares
//! ```

mod binomial;
mod blinn_phong;
mod specular;

pub(crate) use blinn_phong::eval;
pub(crate) use specular::{fresnel, fresnel_of_sheet, on_side_of, reflected, refracted};
