//! Models of reflection, a file each.
//!
//! ```text
//!   blinn_phong   (N.H)^p
//!   binomial      powers of cosines by a series, for the fast exponent
//! ```

mod binomial;
mod blinn_phong;

pub(crate) use blinn_phong::highlight;
