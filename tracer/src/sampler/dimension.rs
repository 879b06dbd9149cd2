//! The uses of random numbers along a path.

/// One use of two random numbers of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Dimension(u32);

/// The uses at a vertex of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Vertex {
    /// First the part of the material that scatters, then roulette.
    Lobe,
    /// The scattered direction.
    Direction,
    /// First the light, then the part of it where it has parts.
    Light,
    /// The point on the light, or the direction to the sky.
    LightPoint,
    /// The free path in volumes before the vertex.
    Medium,
}

/// Number of the uses at a vertex.
const USES: u32 = 5;

impl Dimension {
    /// The place in the pixel.
    pub(crate) const PIXEL: Self = Self(0);
    /// The place on the lens.
    pub(crate) const LENS: Self = Self(1);
    /// First the time between the opening and the closing of the shutter.
    pub(crate) const TIME: Self = Self(2);
    /// Dimensions before those of the first vertex.
    const OF_CAMERA: u32 = 4;

    /// A use at the vertex after a number of bounces.
    pub(crate) const fn of(bounce: u32, vertex: Vertex) -> Self {
        Self(Self::OF_CAMERA + USES * bounce + vertex as u32)
    }

    /// The dimension as bits that differ widely between dimensions: multiples of the golden ratio.
    pub(super) const fn salt(self) -> u32 {
        (self.0 + 1).wrapping_mul(0x9e37_79b9)
    }
}
