//! Who renders which rows, and what happens when somebody does not.

pub mod policy;
