//! Lights in eye space: the unoccluded radiance I_j A_j B_j of the shading equation, sixteen points at a time.
//!
//! ```text
//!   extent   the points on a light with a radius
//!   table    lights of paths, selected at random
//! ```

pub(crate) mod extent;
pub(crate) mod table;

use glam::{DVec3, Vec3};

use crate::scene::{Attenuation, Light, LightKind, Quality};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, SimdFloat, bits, f32x16, select, splat, three};
use extent::Extent;

/// Upper end of a shadow ray, as a fraction of the distance to the light. A surface that contains the light does not
/// occlude it: points are `f32`, so a surface within the last 2^-18 cannot be distinguished from the light's position.
pub(crate) const SHADOW_T_MAX: f64 = 1.0 - 1.0 / (1 << 18) as f64;

/// A light of one frame.
#[derive(Clone, Debug)]
pub(crate) struct EyeLight {
    pub(crate) emitter: Emitter,
    color: Vec3,
    attenuation: Attenuation,
    /// World units per eye unit: attenuation is defined in world units.
    unit: f64,
    /// Whether shadow rays are traced to the light.
    pub(crate) shadows: bool,
    /// The ball of a light whose shadows are soft. All other terms are those of its centre.
    pub(crate) extent: Option<Extent>,
}

/// Kind and place of a light in eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Emitter {
    Point { position: DVec3 },
    Spot { position: DVec3, axis: Vec3, cone: Cone },
    Directional { to_light: DVec3 },
}

impl Emitter {
    /// The place of the light; a directional one has none.
    pub(crate) fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }
}

/// The edge of a beam as 1 - cosine of the angle to its axis, a form that stays precise for narrow beams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    outer: f32,
    inner: f32,
}

/// Unoccluded light at sixteen points.
pub(crate) struct Incidence<S: Simd> {
    /// Unit vectors to the light.
    pub(crate) direction: Vec3x16<S>,
    /// I_j A_j B_j, linear RGB.
    pub(crate) radiance: Vec3x16<S>,
    /// Bits of the points inside the cone and not at the light's position.
    pub(crate) reached: u32,
}

impl EyeLight {
    /// Places a light. `to_eye` maps positions of the world to eye space, whose unit is `unit` world units.
    pub(crate) fn new(light: &Light, to_eye: impl Fn(DVec3) -> DVec3, unit: f64) -> Self {
        let emitter = match light.kind {
            LightKind::Point { position } => Emitter::Point { position: to_eye(position) },
            LightKind::Spot { position, direction, beam_angle, penumbra } => Emitter::Spot {
                position: to_eye(position),
                axis: direction.normalize_or_zero().as_vec3(),
                cone: Cone::new(beam_angle, penumbra),
            },
            LightKind::Directional { direction } => {
                Emitter::Directional { to_light: -direction.normalize_or_zero() }
            }
        };
        let extent = match emitter {
            Emitter::Point { position } | Emitter::Spot { position, .. } if light.shadows => {
                let samples = light.shadow_samples.unwrap_or(Quality::default().shadow_samples);
                (light.radius > 0.0).then(|| Extent::new(position, light.radius / unit, samples))
            }
            _ => None,
        };
        let (color, attenuation, shadows) = (light.color, light.attenuation, light.shadows);
        Self { emitter, color, attenuation, unit, shadows, extent }
    }

    /// The unoccluded light at sixteen points in eye space.
    #[inline(always)]
    pub(crate) fn incidence<S: Simd>(&self, simd: S, points: Vec3x16<S>) -> Incidence<S> {
        let color = Vec3x16::splat(simd, self.color.to_array());
        let (position, beam) = match self.emitter {
            Emitter::Directional { to_light } => {
                let direction = Vec3x16::splat(simd, to_light.as_vec3().to_array());
                return Incidence { direction, radiance: color, reached: u32::MAX };
            }
            Emitter::Point { position } => (position, None),
            Emitter::Spot { position, axis, cone } => (position, Some((axis, cone))),
        };
        let to_light = Vec3x16::splat(simd, position.as_vec3().to_array()).sub(points);
        let size = to_light.size();
        let direction = to_light.normalize(simd);
        let share = match beam {
            None => splat(simd, 1.0),
            Some((axis, cone)) => cone.share(simd, direction, axis),
        };
        let attenuation = match self.attenuation {
            Attenuation::None => splat(simd, 1.0),
            attenuation => {
                let scaled = to_light.scale(splat(simd, 1.0) / size);
                attenuate(simd, attenuation, size * scaled.dot(scaled).sqrt() * splat(simd, self.unit as f32))
            }
        };
        let strength = attenuation * share;
        let reached = size.simd_gt(splat(simd, 0.0)) & strength.simd_gt(splat(simd, 0.0));
        // Clamped: infinity times a colour of zero is NaN.
        let brightest = splat(simd, f32::MAX);
        let radiance = color.scale(strength);
        Incidence {
            direction,
            radiance: Vec3x16(three!(i => radiance.0[i].min(brightest))),
            reached: bits(reached & strength.is_finite()),
        }
    }
}

/// A_j at distances r in world units.
#[inline(always)]
fn attenuate<S: Simd>(simd: S, attenuation: Attenuation, r: f32x16<S>) -> f32x16<S> {
    let one = splat(simd, 1.0);
    match attenuation {
        Attenuation::None => one,
        Attenuation::InverseSquare => one / (r * r),
        Attenuation::Polynomial { constant, linear, quadratic } => {
            let (c, l, q) =
                (splat(simd, constant as f32), splat(simd, linear as f32), splat(simd, quadratic as f32));
            one / (c + l * r + q * r * r)
        }
    }
}

impl Cone {
    /// The cone of a full `beam_angle` and a `penumbra` inside it, both in degrees.
    fn new(beam_angle: f64, penumbra: f64) -> Self {
        let half_angle = beam_angle / 2.0;
        // 1 - cos x = 2 sin^2 (x / 2)
        let versine = |degrees: f64| {
            let sine = libm::sin(degrees.clamp(0.0, 180.0).to_radians() / 2.0);
            (2.0 * sine * sine) as f32
        };
        Self { outer: versine(half_angle), inner: versine(half_angle - penumbra) }
    }

    /// B_j: 1 inside, 0 outside, smooth (3s^2 - 2s^3 in the cosine) over the penumbra. `direction` points to the light.
    #[inline(always)]
    fn share<S: Simd>(&self, simd: S, direction: Vec3x16<S>, axis: Vec3) -> f32x16<S> {
        // |l - a|^2 / 2 = 1 - l.a for unit vectors.
        let apart = direction.add(Vec3x16::splat(simd, axis.to_array()));
        let versine = apart.dot(apart) * splat(simd, 0.5);
        let (outer, inner) = (splat(simd, self.outer), splat(simd, self.inner));
        let s = (outer - versine) / (outer - inner);
        let smooth = s * s * (splat(simd, 3.0) - s - s);
        let lit = select(versine.simd_le(inner), splat(simd, 1.0), smooth);
        select(versine.simd_lt(outer), lit, splat(simd, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{best, dispatch};

    fn light(kind: LightKind, attenuation: Attenuation) -> EyeLight {
        let light =
            Light { kind, color: Vec3::ONE, attenuation, shadows: true, radius: 0.0, shadow_samples: None };
        EyeLight::new(&light, |p| p, 1.0)
    }

    #[inline(always)]
    fn red<S: Simd>(simd: S, light: &EyeLight, point: Vec3) -> f32 {
        let incidence = light.incidence(simd, Vec3x16::splat(simd, point.to_array()));
        if incidence.reached & 1 == 1 { incidence.radiance.0[0][0] } else { 0.0 }
    }

    fn radiance(light: &EyeLight, point: Vec3) -> f32 {
        dispatch!(best(), simd => red(simd, light, point))
    }

    #[test]
    fn each_attenuation_has_its_formula() {
        let at = |attenuation| {
            let point = LightKind::Point { position: DVec3::new(0.0, 4.0, 0.0) };
            radiance(&light(point, attenuation), Vec3::ZERO)
        };
        assert_eq!(at(Attenuation::None), 1.0);
        assert_eq!(at(Attenuation::InverseSquare), 1.0 / 16.0);
        let polynomial = Attenuation::Polynomial { constant: 1.0, linear: 0.5, quadratic: 0.25 };
        assert_eq!(at(polynomial), 1.0 / 7.0);
    }

    #[test]
    fn spots_light_their_cone_and_fade_over_the_penumbra() {
        let spot = |penumbra| {
            let (position, direction) = (DVec3::new(0.0, 1.0, 0.0), DVec3::NEG_Y);
            light(LightKind::Spot { position, direction, beam_angle: 60.0, penumbra }, Attenuation::None)
        };
        let at = |light: &EyeLight, degrees: f64| {
            radiance(light, Vec3::new(libm::tan(degrees.to_radians()) as f32, 0.0, 0.0))
        };
        let hard = spot(0.0);
        assert_eq!([at(&hard, 0.0), at(&hard, 29.9), at(&hard, 30.1), at(&hard, 80.0)], [1.0, 1.0, 0.0, 0.0]);
        let soft = spot(10.0);
        assert_eq!([at(&soft, 19.9), at(&soft, 30.1)], [1.0, 0.0]);
        let middle = at(&soft, 25.0);
        assert!(middle > 0.3 && middle < 0.7, "{middle}");
    }

    #[test]
    fn a_point_at_the_light_is_unlit() {
        let point = LightKind::Point { position: DVec3::ONE };
        assert_eq!(radiance(&light(point, Attenuation::InverseSquare), Vec3::ONE), 0.0);
        assert_eq!(radiance(&light(point, Attenuation::None), Vec3::ONE), 0.0);
    }
}
