//! Models of reflection, a file each.
//!
//! ```text
//!   blinn_phong   c_d N.L + c_s (N.H)^p
//!   binomial      powers of cosines by a series, for the fast exponent
//! ```

mod binomial;
mod blinn_phong;

pub(crate) use blinn_phong::eval;
