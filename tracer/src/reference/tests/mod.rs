//! Pictures with known values, computed by the oracle.
