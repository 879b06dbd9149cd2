//! Energy: white surfaces in white light, and the shares of mirrors and glass.

use super::{
    BLACK, Seen, albedo, at, blinn_phong, eval, glass, metallic_roughness, normal, samples, seen, turned,
    white,
};
use crate::scene::Material;
use crate::simd::LANES;
use glam::Vec3;

const ROUGHNESSES: [f32; 8] = [0.0, 0.04, 0.1, 0.2, 0.33, 0.5, 0.7, 1.0];
const COSINES: [f64; 5] = [0.07, 0.2, 0.45, 0.8, 1.0];

#[test]
fn white_models_pass_the_furnace() {
    for roughness in ROUGHNESSES {
        for cosine in COSINES {
            for (metallic, transmission) in [(1.0, 0.0), (0.0, 0.0), (0.4, 0.0)] {
                let material = metallic_roughness(metallic, roughness, transmission);
                let found = albedo(&seen(material, cosine, 1.0), 1024);
                let at = format!("metal {metallic}, roughness {roughness}, cosine {cosine}");
                // Next to the horizon of smooth metals the table is coarse.
                let most = if cosine < 0.1 && roughness < 0.2 { 0.016 } else { 0.01 };
                assert!((found - 1.0).abs() < most, "{at}: {found}");
            }
        }
    }
    for eta in [1.0 / 1.5, 1.5] {
        for cosine in COSINES {
            assert!((albedo(&seen(glass(), cosine, eta), 64) - 1.0).abs() < 1e-3);
            let sheet = Material { thin: true, ..glass() };
            assert!((albedo(&seen(sheet, cosine, 1.0), 64) - 1.0).abs() < 1e-3);
        }
    }
}

#[test]
fn white_models_with_a_texture_pass_the_furnace() {
    for (roughness, metal) in ROUGHNESSES.into_iter().flat_map(|r| [0.0, 0.3, 1.0].map(|m| (r, m))) {
        for cosine in COSINES {
            let textured =
                Seen { factors: [roughness, metal], ..seen(metallic_roughness(1.0, 0.9, 0.0), cosine, 1.0) };
            let found = albedo(&textured, 1024);
            let most = if cosine < 0.1 && roughness < 0.2 { 0.016 } else { 0.01 };
            assert!((found - 1.0).abs() < most, "{roughness}, {metal}, cosine {cosine}: {found}");
        }
    }
}

#[test]
fn a_texture_changes_the_numbers_of_the_material() {
    let textured = Seen { factors: [0.5, 0.25], ..seen(metallic_roughness(0.8, 0.9, 0.5), 0.6, 1.0) };
    let plain = seen(metallic_roughness(0.2, 0.45, 0.5), 0.6, 1.0);
    for direction in [(0.3, 2.0), (0.6, 3.8), (0.9, 4.0)].map(|(cosine, turn)| turned(at(cosine, turn))) {
        let ([value, density], [expected, its_density]) =
            (eval(&textured, direction), eval(&plain, direction));
        assert!((value / expected - 1.0).abs() < 1e-4 && (density / its_density - 1.0).abs() < 1e-4);
    }
}

#[test]
fn white_rough_glass_passes_the_furnace_from_either_side() {
    for roughness in ROUGHNESSES {
        for (eta, cosine) in [1.0 / 1.5, 1.5].into_iter().flat_map(|eta| COSINES.map(|c| (eta, c))) {
            let material = metallic_roughness(0.0, roughness, 1.0);
            let found = albedo(&seen(material, cosine, eta), 4096);
            assert!((found - 1.0).abs() < 0.02, "roughness {roughness}, eta {eta}, cosine {cosine}: {found}");
        }
        let sheet = Material { thin: true, ..metallic_roughness(0.0, roughness, 1.0) };
        let found = albedo(&seen(sheet, 0.6, 1.0), 4096);
        assert!((found - 1.0).abs() < 0.02, "sheet of roughness {roughness}: {found}");
    }
}

#[test]
fn blinn_phong_adds_no_energy_where_the_colours_do_not() {
    for exponent in [0.0, 3.0, 50.0, 1e4, 1e6] {
        for cosine in COSINES {
            let of = |diffuse, specular| {
                albedo(&seen(blinn_phong(diffuse, specular, exponent), cosine, 1.0), 1024)
            };
            for specular in [0.04, 0.3, 0.7, 1.0] {
                let full = of(1.0 - specular, specular);
                assert!((full - 1.0).abs() < 0.016, "{exponent} {specular} {cosine}: {full}");
                assert!(specular == 1.0 || of(0.5 * (1.0 - specular), specular) < full);
            }
            // Seen from above, a faint highlight leaves the diffuse colour as it is.
            if cosine == 1.0 && exponent >= 50.0 {
                assert!((of(0.6, 0.02) - 0.62).abs() < 0.01);
            }
        }
    }
}

#[test]
fn mirrors_and_glass_have_their_shares() {
    let mirror = Material { reflect: Vec3::splat(0.9), ..BLACK };
    assert!((albedo(&seen(mirror, 0.5, 1.0), 16) - 0.9).abs() < 1e-5);
    for (cosine, eta) in [(0.2, 1.0 / 1.5), (0.9, 1.5), (0.5, 1.5)] {
        let seen = seen(Material { transmit: Vec3::splat(0.5), ..BLACK }, cosine, eta);
        let share = crate::bsdf::fresnel(cosine, f64::from(eta));
        for found in samples(&seen, 16).filter(|sample| sample.alive) {
            assert!(found.density.is_infinite());
            let expected = if found.refracted {
                crate::bsdf::refracted(-seen.viewer, normal(), f64::from(eta)).unwrap()
            } else {
                crate::bsdf::reflected(-seen.viewer, normal())
            };
            assert!((found.direction - expected).length() < 2e-6);
        }
        let through: f64 = samples(&seen, 64).filter(|s| s.refracted).map(|s| f64::from(s.weight[0])).sum();
        let through = through / (64 * LANES) as f64;
        assert!((through - 0.5 * (1.0 - share)).abs() < 2e-3, "{through} at {cosine}");
    }
    // Varnish: the exact share of the mirrored light, and the diffuse colour.
    let varnish = Material { reflect: Vec3::ONE, fresnel: true, ..white(0.5) };
    let expected = 0.5 + crate::bsdf::fresnel(0.3, 1.0 / 1.5);
    assert!((albedo(&seen(varnish, 0.3, 1.0 / 1.5), 64) - expected).abs() < 2e-3);
}
