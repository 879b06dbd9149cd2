//! Metallic-roughness materials as the direct integrator shows them: by its highlights, mirrors and glass.
//!
//! ```text
//! alpha      roughness^2
//! F0         mix(specular_factor ((n - 1) / (n + 1))^2, base, metallic)
//! mirror     max(0, 1 - 2 roughness)^2: rougher surfaces than 1/2 show no image
//!
//! diffuse    base (1 - metallic) (1 - transmission)
//! exponent   2 / alpha^2 - 2, a whole number from 1 to 1e6
//! specular   F0 (exponent + 2) / 8, at most 1 in the brightest channel
//! transmit   base (1 - metallic) transmission
//! reflect    specular_factor mirror, with Fresnel shares, where nothing is metal or something is transmitted; else F0 mirror
//! ```
//!
//! The Blinn-Phong lobe with that exponent has the width of the GGX lobe at its peak (Walter et al. 2007), and that factor
//! gives it the same height. Sharper highlights than a peak of 1 allows keep their width and are darker. Transmitted light is sharp
//! at any roughness. Textures of roughness and metal have no effect.

use glam::Vec3;

use super::{MAX_EXPONENT, Material, MetallicRoughness};

impl Material {
    /// A metallic-roughness material: its diffuse colour remains the base colour, and the other terms are those of
    /// [`Material::shown_directly`]. With a texture, c_t is the most that any of its texels transmits.
    #[must_use]
    pub fn with_metallic_roughness(self, model: MetallicRoughness) -> Self {
        let material = Self { metallic_roughness: Some(model), ..self };
        let shown = Self { diffuse: self.diffuse, checker: self.checker, ..material.shown_directly() };
        if model.texture.is_some() {
            // Where the texture has no metal.
            return Self { transmit: self.diffuse * model.transmission, ..shown };
        }
        shown
    }

    /// The material as the direct integrator shows it: itself, unless it is metallic-roughness.
    #[must_use]
    pub fn shown_directly(&self) -> Self {
        let Some(model) = self.metallic_roughness else { return *self };
        let base = self.diffuse;
        let bare = 1.0 - model.metallic;
        let through = bare * model.transmission;
        let scattered = bare * (1.0 - model.transmission);
        let normal_share = (self.ior - 1.0) / (self.ior + 1.0);
        let dielectric = Vec3::splat(model.specular_factor * normal_share * normal_share);
        let f0 = dielectric * bare + base * model.metallic;
        let exponent = exponent_of(model.roughness);
        let mirror = mirror_share(model.roughness);
        let fresnel = model.metallic == 0.0 || through > 0.0;
        // A pattern takes the place of the colour.
        let checker = self.checker.map(|mut pattern| {
            pattern.colors = pattern.colors.map(|color| color * scattered);
            pattern
        });
        Self {
            diffuse: if checker.is_some() { base } else { base * scattered },
            checker,
            specular: highlight(f0, exponent),
            exponent,
            reflect: if fresnel { Vec3::splat(model.specular_factor * mirror) } else { f0 * mirror },
            transmit: base * through,
            fresnel,
            ..*self
        }
    }
}

/// The exponent whose lobe is as wide as that of GGX.
fn exponent_of(roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    let exponent = 2.0 / (alpha * alpha) - 2.0;
    exponent.clamp(1.0, MAX_EXPONENT).round()
}

/// The colour of a highlight as high as that of GGX, at most 1 in its brightest channel.
fn highlight(f0: Vec3, exponent: f32) -> Vec3 {
    let brightest = f0.max_element();
    if brightest > 0.0 {
        (f0 * ((exponent + 2.0) / 8.0).min(1.0 / brightest)).min(Vec3::ONE)
    } else {
        Vec3::ZERO
    }
}

/// The share of the reflected light that forms an image.
fn mirror_share(roughness: f32) -> f32 {
    let smooth = (1.0 - 2.0 * roughness).max(0.0);
    smooth * smooth
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::material::{Checker, CheckerSpace};

    const PLASTIC: MetallicRoughness = MetallicRoughness {
        metallic: 0.0,
        roughness: 0.5,
        transmission: 0.0,
        specular_factor: 1.0,
        texture: None,
    };

    fn shown(diffuse: Vec3, model: MetallicRoughness) -> Material {
        let material = Material { diffuse, specular: Vec3::ZERO, ..Material::NEUTRAL };
        material.with_metallic_roughness(model).shown_directly()
    }

    #[test]
    fn other_materials_are_shown_as_they_are() {
        let glass = Material { transmit: Vec3::ONE, fresnel: true, ..Material::NEUTRAL };
        assert_eq!(glass.shown_directly(), glass);
    }

    #[test]
    fn plastic_scatters_its_base_colour_below_a_highlight() {
        let base = Vec3::new(0.8, 0.4, 0.2);
        let plastic = shown(base, PLASTIC);
        // alpha is 1/4 and F0 is 0.04.
        assert_eq!((plastic.diffuse, plastic.exponent), (base, 30.0));
        assert!((plastic.specular - Vec3::splat(0.04 * 32.0 / 8.0)).abs().max_element() < 1e-6);
        assert!(!plastic.bounces(), "too rough for an image");
        let polished = shown(base, MetallicRoughness { roughness: 0.0, ..PLASTIC });
        assert_eq!((polished.reflect, polished.fresnel), (Vec3::ONE, true));
        assert_eq!(polished.exponent, MAX_EXPONENT);
        assert!((polished.specular - Vec3::ONE).abs().max_element() < 1e-6);
        let matt = shown(base, MetallicRoughness { roughness: 1.0, specular_factor: 0.0, ..PLASTIC });
        assert!(!matt.is_specular() && !matt.bounces());
    }

    #[test]
    fn metal_has_no_diffuse_part_and_colours_what_it_reflects() {
        let gold = Vec3::new(1.0, 0.75, 0.25);
        let metal = shown(gold, MetallicRoughness { metallic: 1.0, roughness: 0.25, ..PLASTIC });
        assert_eq!(metal.diffuse, Vec3::ZERO);
        assert_eq!((metal.specular, metal.reflect), (gold, gold * 0.25));
        assert!(!metal.fresnel && !metal.is_transparent());
    }

    #[test]
    fn glass_transmits_its_base_colour() {
        let green = Vec3::new(0.5, 1.0, 0.5);
        let glass = shown(green, MetallicRoughness { roughness: 0.0, transmission: 1.0, ..PLASTIC });
        assert_eq!((glass.diffuse, glass.transmit, glass.reflect), (Vec3::ZERO, green, Vec3::ONE));
        assert!(glass.fresnel);
        let half = shown(green, MetallicRoughness { transmission: 0.5, ..PLASTIC });
        assert_eq!((half.diffuse, half.transmit), (green * 0.5, green * 0.5));
    }

    #[test]
    fn the_loaded_material_keeps_its_base_colour() {
        let model = MetallicRoughness { metallic: 0.75, ..PLASTIC };
        let pattern = Checker { colors: [Vec3::ONE, Vec3::ZERO], size: 1.0, space: CheckerSpace::World };
        let checkered = Material { diffuse: Vec3::ONE, checker: Some(pattern), ..Material::NEUTRAL };
        let loaded = checkered.with_metallic_roughness(model);
        assert_eq!((loaded.diffuse, loaded.checker), (Vec3::ONE, Some(pattern)));
        let shown = loaded.shown_directly();
        let dark = Checker { colors: [Vec3::splat(0.25), Vec3::ZERO], ..pattern };
        assert_eq!((shown.diffuse, shown.checker), (Vec3::ONE, Some(dark)));
        assert_eq!((loaded.specular, loaded.reflect), (shown.specular, shown.reflect));
    }

    /// A share, often one at an end of its range.
    fn share() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0_f32), Just(1.0), Just(1e-20), 0.0..=1.0_f32]
    }

    proptest! {
        #[test]
        fn all_numbers_stay_within_their_bounds(
            base in prop::array::uniform3(share()),
            (metallic, roughness) in (share(), share()),
            (transmission, specular_factor) in (share(), share()),
            ior in 0.01..=100.0_f32,
        ) {
            let model = MetallicRoughness { metallic, roughness, transmission, specular_factor, texture: None };
            let base = Vec3::from_array(base);
            let material = Material { diffuse: base, ior, ..Material::NEUTRAL };
            let shown = material.with_metallic_roughness(model).shown_directly();
            for color in [shown.diffuse, shown.specular, shown.reflect, shown.transmit] {
                prop_assert!(color.to_array().iter().all(|c| (0.0..=1.0).contains(c)), "{shown:?}");
            }
            prop_assert!((1.0..=MAX_EXPONENT).contains(&shown.exponent));
            // What is scattered and what is transmitted is at most the base colour.
            prop_assert!((shown.diffuse + shown.transmit).cmple(base + 1e-6).all());
        }
    }
}
