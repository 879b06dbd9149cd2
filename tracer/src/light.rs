//! Lights in eye space: what reaches a point, were nothing in the way.
//!
//! I_j A_j B_j of the shading equation. Angles are compared by their cosines; `libm` makes them the same everywhere.

use glam::{DVec3, Vec3};

use crate::scene::{Attenuation, Light, LightKind};

/// Where a shadow ray ends, in shares of the way to the light. A surface that holds the light, up to rounding, does not
/// hide it.
const JUST_BEFORE: f64 = 1.0 - 1.0 / (1 << 30) as f64;

/// A light of one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EyeLight {
    emitter: Emitter,
    color: Vec3,
    attenuation: Attenuation,
    /// World units per unit of eye space: attenuation is told in world units.
    unit: f64,
    /// Whether shadow rays are traced to it.
    pub shadows: bool,
}

#[derive(Clone, Copy, Debug)]
enum Emitter {
    Point { position: DVec3 },
    Spot { position: DVec3, axis: DVec3, cone: Cone },
    Directional { to_light: DVec3 },
}

/// The edge of a beam as cosines of the angle to its axis.
#[derive(Clone, Copy, Debug)]
struct Cone {
    outer: f64,
    inner: f64,
}

/// What a light does for one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Incidence {
    /// Unit vector to the light.
    pub direction: Vec3,
    /// From the point to the light; a direction of any length for directional lights.
    pub to_light: DVec3,
    /// Where on the way along `to_light` the light begins: just before 1, or infinitely far for a directional light.
    pub t_light: f64,
    /// I_j A_j B_j, linear RGB.
    pub radiance: Vec3,
}

impl EyeLight {
    /// `to_eye` takes world positions to eye space, of which one unit is `unit` world units.
    pub(crate) fn new(light: &Light, to_eye: impl Fn(DVec3) -> DVec3, unit: f64) -> Self {
        let emitter = match light.kind {
            LightKind::Point { position } => Emitter::Point { position: to_eye(position) },
            LightKind::Spot { position, direction, beam_angle, penumbra } => Emitter::Spot {
                position: to_eye(position),
                axis: direction.normalize_or_zero(),
                cone: Cone::new(beam_angle, penumbra),
            },
            LightKind::Directional { direction } => {
                Emitter::Directional { to_light: -direction.normalize_or_zero() }
            }
        };
        Self { emitter, color: light.color, attenuation: light.attenuation, unit, shadows: light.shadows }
    }

    /// What reaches `point`; `None` where nothing does: outside the cone, or in the light's own place.
    pub(crate) fn incidence(&self, point: DVec3) -> Option<Incidence> {
        let (position, beam) = match self.emitter {
            Emitter::Directional { to_light } => {
                return Some(Incidence {
                    direction: to_light.as_vec3(),
                    to_light,
                    t_light: f64::INFINITY,
                    radiance: self.color,
                });
            }
            Emitter::Point { position } => (position, None),
            Emitter::Spot { position, axis, cone } => (position, Some((axis, cone))),
        };
        let to_light = position - point;
        let distance = to_light.length();
        let direction = to_light / distance;
        if !direction.is_finite() {
            return None;
        }
        let beam = beam.map_or(1.0, |(axis, cone)| cone.share(-direction.dot(axis)));
        if beam == 0.0 {
            return None;
        }
        let radiance = self.color * (attenuate(self.attenuation, distance * self.unit) * beam) as f32;
        radiance.is_finite().then_some(Incidence {
            direction: direction.as_vec3(),
            to_light,
            t_light: JUST_BEFORE,
            radiance,
        })
    }
}

/// A_j at distance r in world units.
fn attenuate(attenuation: Attenuation, r: f64) -> f64 {
    match attenuation {
        Attenuation::None => 1.0,
        Attenuation::InverseSquare => 1.0 / (r * r),
        Attenuation::Polynomial { constant, linear, quadratic } => {
            1.0 / (constant + linear * r + quadratic * r * r)
        }
    }
}

impl Cone {
    /// `beam_angle` is the full angle in degrees, `penumbra` how many degrees within it fade.
    fn new(beam_angle: f64, penumbra: f64) -> Self {
        let half_angle = beam_angle / 2.0;
        let cosine = |degrees: f64| libm::cos(degrees.clamp(0.0, 180.0).to_radians());
        Self { outer: cosine(half_angle), inner: cosine(half_angle - penumbra) }
    }

    /// B_j: 1 inside, 0 outside, smooth (3s^2 - 2s^3 in the cosine) over the penumbra.
    fn share(&self, cosine: f64) -> f64 {
        if cosine <= self.outer {
            return 0.0;
        }
        if cosine >= self.inner {
            return 1.0;
        }
        let s = (cosine - self.outer) / (self.inner - self.outer);
        s * s * (3.0 - 2.0 * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: LightKind, attenuation: Attenuation) -> EyeLight {
        let light = Light { kind, color: Vec3::ONE, attenuation, shadows: true };
        EyeLight::new(&light, |p| p, 1.0)
    }

    #[test]
    fn light_weakens_as_its_attenuation_says() {
        let at = |attenuation| {
            let point = LightKind::Point { position: DVec3::new(0.0, 4.0, 0.0) };
            light(point, attenuation).incidence(DVec3::ZERO).unwrap().radiance.x
        };
        assert_eq!(at(Attenuation::None), 1.0);
        assert_eq!(at(Attenuation::InverseSquare), 1.0 / 16.0);
        let polynomial = Attenuation::Polynomial { constant: 1.0, linear: 0.5, quadratic: 0.25 };
        assert_eq!(at(polynomial), 1.0 / 7.0);
    }

    #[test]
    fn a_spot_lights_its_cone_and_fades_over_the_penumbra() {
        let spot = |penumbra| {
            let (position, direction) = (DVec3::new(0.0, 1.0, 0.0), DVec3::NEG_Y);
            light(LightKind::Spot { position, direction, beam_angle: 60.0, penumbra }, Attenuation::None)
        };
        let at = |light: &EyeLight, degrees: f64| {
            let x = libm::tan(degrees.to_radians());
            light.incidence(DVec3::new(x, 0.0, 0.0)).map_or(0.0, |incidence| incidence.radiance.x)
        };
        let hard = spot(0.0);
        assert_eq!([at(&hard, 0.0), at(&hard, 29.9), at(&hard, 30.1), at(&hard, 80.0)], [1.0, 1.0, 0.0, 0.0]);
        let soft = spot(10.0);
        assert_eq!([at(&soft, 19.9), at(&soft, 30.1)], [1.0, 0.0]);
        let middle = at(&soft, 25.0);
        assert!(middle > 0.3 && middle < 0.7, "{middle}");
    }

    #[test]
    fn a_point_in_the_light_gets_none_of_it() {
        let point = LightKind::Point { position: DVec3::ONE };
        assert!(light(point, Attenuation::InverseSquare).incidence(DVec3::ONE).is_none());
    }
}
