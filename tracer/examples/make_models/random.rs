//! Variation without a generator's state: a number depends on its key, not on the numbers drawn before.

/// Integer hash (the finaliser of splitmix64 over the two inputs).
fn hash(kind: u64, index: u64) -> u64 {
    let mut x = kind.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index.wrapping_mul(0xD1B5_4A32_D192_ED03);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A number in [0, 1) for the `index`-th thing of a `kind`.
pub(crate) fn uniform(kind: u64, index: u64) -> f64 {
    // 53 bits fit a f64 exactly.
    (hash(kind, index) >> 11) as f64 / (1u64 << 53) as f64
}

/// A number in [low, high).
pub(crate) fn between(kind: u64, index: u64, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(kind, index)
}

/// One of `choices`.
pub(crate) fn pick<T: Copy>(kind: u64, index: u64, choices: &[T]) -> T {
    choices[(hash(kind, index) % choices.len() as u64) as usize]
}
