//! The numbers by which a material scatters light.

use crate::scene::Material;
use crate::simd::{Simd, f32x16, mask32x16, select, splat, three};

/// The numbers of a material, or those of sixteen points. Switches are 0 or 1. All colours but the base are linear RGB.
#[derive(Clone, Copy)]
pub(super) struct Recipe<T> {
    /// Whether the model is metallic-roughness.
    pub metallic_roughness: T,
    /// Width of the lobe.
    pub alpha: T,
    /// Metallic-roughness: shares of metal, and of transmission in the rest.
    pub metallic: T,
    pub transmission: T,
    /// Metallic-roughness: factor of the reflectance of the opaque dielectric, and its reflectance at straight incidence.
    pub specular_factor: T,
    pub dielectric: T,
    /// Blinn-Phong: reflectance of the lobe at straight incidence.
    pub specular: [T; 3],
    /// Perfectly smooth parts: shares of mirrored and of refracted light, and whether Fresnel shares are factors of both.
    pub reflect: [T; 3],
    pub transmit: [T; 3],
    pub fresnel: T,
    /// 1 / ior, and whether the material is a sheet.
    pub inverse_ior: T,
    pub thin: T,
}

impl Recipe<f32> {
    /// The numbers of a material. `highlights` is whether the frame shows Blinn-Phong highlights.
    pub(super) fn of(material: &Material, highlights: bool) -> Self {
        let switch = |on: bool| if on { 1.0 } else { 0.0 };
        let root = (material.ior - 1.0) / (material.ior + 1.0);
        let base = Self {
            metallic_roughness: 0.0,
            alpha: 0.0,
            metallic: 0.0,
            transmission: 0.0,
            specular_factor: 0.0,
            dielectric: root * root,
            specular: [0.0; 3],
            reflect: [0.0; 3],
            transmit: [0.0; 3],
            fresnel: switch(material.is_transparent() || material.fresnel),
            inverse_ior: 1.0 / material.ior,
            thin: switch(material.thin),
        };
        if let Some(model) = &material.metallic_roughness {
            return Self {
                metallic_roughness: 1.0,
                alpha: model.roughness * model.roughness,
                metallic: model.metallic,
                transmission: model.transmission,
                specular_factor: model.specular_factor,
                ..base
            };
        }
        let most = material.reflect.max(material.transmit);
        let reflect = if material.is_transparent() { most } else { material.reflect };
        Self {
            alpha: (2.0 / (material.exponent + 2.0)).sqrt(),
            specular: if highlights { material.specular.to_array() } else { [0.0; 3] },
            reflect: reflect.to_array(),
            transmit: material.transmit.to_array(),
            ..base
        }
    }

    /// Whether the material is more than a diffuse surface.
    pub(super) fn is_more_than_diffuse(&self) -> bool {
        let any = |color: &[f32; 3]| color.iter().any(|&channel| channel > 0.0);
        self.metallic_roughness > 0.0 || any(&self.specular) || any(&self.reflect) || any(&self.transmit)
    }
}

impl<T: Copy> Recipe<T> {
    /// Applies a function to each pair of numbers.
    #[inline(always)]
    fn zip<U: Copy, V>(&self, other: &Recipe<U>, of: impl Fn(T, U) -> V) -> Recipe<V> {
        Recipe {
            metallic_roughness: of(self.metallic_roughness, other.metallic_roughness),
            alpha: of(self.alpha, other.alpha),
            metallic: of(self.metallic, other.metallic),
            transmission: of(self.transmission, other.transmission),
            specular_factor: of(self.specular_factor, other.specular_factor),
            dielectric: of(self.dielectric, other.dielectric),
            specular: three!(i => of(self.specular[i], other.specular[i])),
            reflect: three!(i => of(self.reflect[i], other.reflect[i])),
            transmit: three!(i => of(self.transmit[i], other.transmit[i])),
            fresnel: of(self.fresnel, other.fresnel),
            inverse_ior: of(self.inverse_ior, other.inverse_ior),
            thin: of(self.thin, other.thin),
        }
    }
}

impl<S: Simd> Recipe<f32x16<S>> {
    /// The numbers of one material at all points.
    #[inline(always)]
    pub(super) fn splat(simd: S, recipe: &Recipe<f32>) -> Self {
        recipe.zip(
            recipe,
            #[inline(always)]
            |number, _| splat(simd, number),
        )
    }

    /// Puts the numbers of a material into some lanes.
    #[inline(always)]
    pub(super) fn put(&mut self, simd: S, lanes: mask32x16<S>, recipe: &Recipe<f32>) {
        *self = self.zip(
            recipe,
            #[inline(always)]
            |old, number| select(lanes, splat(simd, number), old),
        );
    }
    /// Multiplies the roughness and the share of metal.
    #[inline(always)]
    pub(super) fn multiply(&mut self, [roughness, metal]: [f32x16<S>; 2]) {
        self.alpha *= roughness * roughness;
        self.metallic *= metal;
    }
}
