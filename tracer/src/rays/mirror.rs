//! Tiles of a plane mirror: the reflected rays of a tile of the camera, which seem to start at the eye's mirror image.
//!
//! Seen from there the scene has the places of the camera's picture, if the scene is mirrored at the plane first. So the reflected
//! rays of one plane are a tile again, whose rays start at a depth of their own: on the mirror.

use glam::{DMat3, DVec3};

use super::{
    BATCH, BLOCKS, EyeTile, PictureTile, PrimitiveId, Projection, ROUNDING, Ray, RaySource, SurfaceSource,
    TileRays,
};
use crate::frame::{Affine, Instance, PreparedFrame};
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, f32x16};

/// Error bound of the places of mirrored rays, in samples: they are computed from the mirror's points, not from the picture.
const PLACE_ERROR: f32 = 1.0 / (1 << 18) as f32;

/// The rays of a tile that one plane reflects.
pub(crate) struct MirrorTile<'a> {
    frame: &'a PreparedFrame,
    /// The primitive that all rays start on.
    mirror: PrimitiveId,
    rays: TileRays,
    live: [u32; BLOCKS],
    projection: Projection,
    /// Map from eye space, mirrored, to the tile's picture.
    picture: Affine,
    /// See `EyeTile`.
    drift: [f32; 2],
    reflected: &'a [MirroredRay; BATCH],
    /// Bounds of the closeness of the rays' starts.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
}

/// A reflected ray, and where it starts.
#[derive(Clone, Copy)]
pub(crate) struct MirroredRay {
    pub ray: Ray,
    /// Depth of its start, seen from the eye's mirror image.
    pub start: f64,
    /// Depth along the ray, per t.
    pub speed: f64,
}

impl MirroredRay {
    /// A ray that is not live.
    pub(crate) const NONE: Self =
        Self { ray: Ray { origin: DVec3::ZERO, direction: DVec3::X }, start: 1.0, speed: 1.0 };
}

impl<'a> MirrorTile<'a> {
    /// The rays of the lanes `live` of a tile, which the plane n . x = `offset` of the primitive `mirror` reflects.
    pub(crate) fn new<S: Simd>(
        simd: S,
        eye: &EyeTile<'a>,
        mirror: PrimitiveId,
        (normal, offset): (DVec3, f64),
        live: [u32; BLOCKS],
        reflected: &'a [MirroredRay; BATCH],
    ) -> Self {
        let frame = eye.of_frame();
        // x -> x - 2 (n.x - offset) n.
        let columns = [0, 1, 2].map(|i| DVec3::AXES[i] - normal * (2.0 * normal[i]));
        let at_plane =
            Affine::new(DMat3::from_cols(columns[0], columns[1], columns[2]), normal * (2.0 * offset));
        let picture = eye.map().after(&at_plane);
        let drift = eye.drift();
        let projection = Projection::new(picture, 1.0, false).drifting(drift, 2.0 * frame.coarsest);
        let mut rays = eye.places().clone();
        rays.bound(simd, &live);
        rays.widen(simd, PLACE_ERROR);
        let (mut low, mut high) = ([Lanes::ZERO; BLOCKS], [Lanes::ZERO; BLOCKS]);
        for (index, mirrored) in reflected.iter().enumerate() {
            let closeness = (1.0 / mirrored.start) as f32;
            low[index / LANES].0[index % LANES] = closeness * (1.0 - ROUNDING);
            high[index / LANES].0[index % LANES] = closeness * (1.0 + ROUNDING);
        }
        Self { frame, mirror, rays, live, projection, picture, drift, reflected, low, high }
    }
}

impl RaySource for MirrorTile<'_> {
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.live[block]
    }

    fn ray(&self, block: usize, lane: usize) -> Ray {
        self.reflected[block * LANES + lane].ray
    }

    fn starts_on(&self, _: usize, _: usize) -> Option<PrimitiveId> {
        Some(self.mirror)
    }
}

impl PictureTile for MirrorTile<'_> {
    const PARALLEL: bool = false;
    const STARTS: bool = true;

    #[inline(always)]
    fn picture(&self) -> &TileRays {
        &self.rays
    }

    #[inline(always)]
    fn projection(&self) -> &Projection {
        &self.projection
    }

    #[inline(always)]
    fn projection_of(&self, instance: &Instance) -> Projection {
        Projection::new(self.picture.after(&instance.placement), 1.0, false)
            .drifting(self.drift, f64::from(instance.drift))
    }

    fn depth(&self, block: usize, lane: usize, t: f64) -> f64 {
        let MirroredRay { start, speed, .. } = self.reflected[block * LANES + lane];
        start + speed * t
    }

    #[inline(always)]
    fn is_start(&self, primitive: PrimitiveId) -> bool {
        self.mirror == primitive
    }

    #[inline(always)]
    fn started<S: Simd>(&self, simd: S, block: usize, low: f32x16<S>, high: f32x16<S>) -> [u32; 2] {
        let [least, most] = [self.low[block].load(simd), self.high[block].load(simd)];
        // All that is not before the start for certain, even if a number is NaN.
        [0xffff & !bits(low.simd_gt(most)), bits(high.simd_lt(least))]
    }
}
