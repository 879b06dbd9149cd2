//! Vectors of sixteen lanes, with run-time dispatch to the machine's level of SIMD.
//!
//! Algorithms are written once, generic over the level `S`, and compiled for each level: AVX-512 holds sixteen lanes in one
//! register, AVX2 in two, SSE2 and NEON in four, the portable level one by one. The level is selected once, at run time.
//!
//! Two kinds of arithmetic, never mixed:
//! - *Filters* find what is certain within error bounds, and leave the rest to exact code. They may use [`fma`], which is fused
//!   on some levels only: it never changes a result, only how often the exact code runs.
//! - *Values* that reach a pixel use plain operations only (+, -, *, /, sqrt), which IEEE 754 defines to the last bit.

pub(crate) mod math;
pub(crate) mod vector;

use std::sync::LazyLock;

pub(crate) use fearless_simd::{Level, Simd, f32x16, i32x16, mask32x16, prelude::*, u8x64, u32x16};

/// Lanes of every vector.
pub(crate) const LANES: usize = 16;

/// Sixteen numbers in memory, aligned for a full-width load.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

impl Lanes {
    pub(crate) const ZERO: Lanes = Lanes([0.0; LANES]);

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> f32x16<S> {
        f32x16::load_array_ref(simd, &self.0)
    }

    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, value: f32x16<S>) {
        value.store_array(&mut self.0);
    }
}

/// Sixteen indices in memory, aligned for a full-width load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(64))]
pub(crate) struct Indices(pub(crate) [u32; LANES]);

impl Indices {
    pub(crate) const ZERO: Indices = Indices([0; LANES]);

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> u32x16<S> {
        u32x16::load_array_ref(simd, &self.0)
    }

    /// Puts a number into the lanes of a mask.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, simd: S, lanes: mask32x16<S>, number: u32) {
        self.store(select_indices(lanes, u32x16::splat(simd, number), self.load(simd)));
    }

    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, value: u32x16<S>) {
        value.store_array(&mut self.0);
    }

    /// Bits of the lanes that hold a number.
    #[inline(always)]
    pub(crate) fn equal<S: Simd>(&self, simd: S, number: u32) -> u32 {
        bits(self.load(simd).simd_eq(u32x16::splat(simd, number)))
    }
}

/// a * b + c, rounded once or twice, for filters only.
#[inline(always)]
pub(crate) fn fma<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>) -> f32x16<S> {
    a.mul_add(b, c)
}

/// A number in all lanes.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, value: f32) -> f32x16<S> {
    f32x16::splat(simd, value)
}

/// `a` in the lanes of the mask, else `b`.
#[inline(always)]
pub(crate) fn select<S: Simd>(mask: mask32x16<S>, a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    mask.select(a, b)
}

/// `a` in the lanes of the mask, else `b`.
#[inline(always)]
pub(crate) fn select_indices<S: Simd>(mask: mask32x16<S>, a: u32x16<S>, b: u32x16<S>) -> u32x16<S> {
    mask.select(a, b)
}

/// The mask with these bits.
#[inline(always)]
pub(crate) fn mask_of<S: Simd>(simd: S, bits: u32) -> mask32x16<S> {
    mask32x16::from_bitmask(simd, u64::from(bits))
}

/// The bits of a mask, one a lane.
#[inline(always)]
pub(crate) fn bits<S: Simd>(mask: mask32x16<S>) -> u32 {
    mask.to_bitmask() as u32
}

/// Prefetches a value into the cache. Compiles to nothing on machines without such an instruction.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let line = std::ptr::from_ref(value).cast::<i8>().wrapping_add(offset);
        // SAFETY: a prefetch neither reads nor faults, whatever the address; SSE is part of x86-64.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line) };
    }
}

/// Iterates over the set bits, lowest first.
#[inline(always)]
pub(crate) fn each_bit(bits: u32) -> Bits {
    Bits(bits)
}

/// Iterator of [`each_bit`].
pub(crate) struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let next = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(next)
    }
}

/// `three!(i => f(i))` is `[f(0), f(1), f(2)]`. Unlike the closure of `array::map`, it is always compiled for the level: a call
/// that is not inlined spills all vector registers.
macro_rules! three {
    ($i:ident => $value:expr) => {
        [
            {
                let $i = 0_usize;
                $value
            },
            {
                let $i = 1_usize;
                $value
            },
            {
                let $i = 2_usize;
                $value
            },
        ]
    };
}
pub(crate) use three;

/// Compiles an operation for each level that is used, and runs the copy for [`used`] of `level`. The macro of `fearless_simd`
/// also compiles SSE4.2: a fourth copy of the tracer, for x86 processors without AVX2, which use SSE2 here.
macro_rules! dispatch {
    ($level:expr, $simd:pat => $op:expr) => {
        match $crate::simd::used($level) {
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Avx512(token) => $crate::simd::run!(token, $simd => $op),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Avx2(token) => $crate::simd::run!(token, $simd => $op),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Sse2(token) => $crate::simd::run!(token, $simd => $op),
            #[cfg(target_arch = "aarch64")]
            $crate::simd::Level::Neon(token) => $crate::simd::run!(token, $simd => $op),
            #[cfg(any(feature = "portable", not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
            $crate::simd::Level::Fallback(token) => $crate::simd::run!(token, $simd => $op),
            _ => unreachable!("`used` returns no other level"),
        }
    };
}
pub(crate) use dispatch;

/// Runs an operation with the instructions of a level.
macro_rules! run {
    ($token:ident, $simd:pat => $op:expr) => {{
        let $simd = $token;
        $crate::simd::Simd::vectorize(
            $token,
            #[inline(always)]
            || $op,
        )
    }};
}
pub(crate) use run;

/// The level itself, or the compiled one below it.
#[inline]
pub(crate) fn used(level: Level) -> Level {
    #[cfg(target_arch = "x86_64")]
    if let Level::Sse4_2(_) = level {
        return level.as_sse2().map_or(level, Level::Sse2);
    }
    level
}

/// The best level of this machine.
pub(crate) fn best() -> Level {
    static BEST: LazyLock<Level> = LazyLock::new(|| used(Level::new()));
    *BEST
}

/// Name of the best level of this machine, as workers report it.
pub fn best_name() -> &'static str {
    name(best())
}

/// Name of a level.
pub(crate) fn name(level: Level) -> &'static str {
    dispatch!(level, simd => name_of(simd))
}

fn name_of<S: Simd>(_: S) -> &'static str {
    let full = std::any::type_name::<S>();
    match full.rsplit("::").next() {
        Some("Avx512") => "AVX-512",
        Some("Avx2") => "AVX2",
        Some("Sse2") => "SSE2",
        Some("Neon") => "NEON",
        _ => "portable",
    }
}

/// All levels of this machine, the lowest last, for tests that compare them. With the feature `portable` the last one computes
/// lanes one by one.
pub(crate) fn all() -> Vec<Level> {
    let mut levels = vec![best()];
    #[cfg(target_arch = "x86_64")]
    {
        let best = best();
        levels.extend(best.as_avx2().map(Level::Avx2));
        levels.extend(best.as_sse2().map(Level::Sse2));
    }
    levels.push(Level::baseline());
    #[cfg(feature = "portable")]
    levels.push(Level::fallback());
    levels
}
