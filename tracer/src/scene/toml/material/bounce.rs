//! Reflection and transmission of a material.

use glam::Vec3;

use super::super::Reading;
use super::super::fault::Read;
use super::super::table::Table;
use super::super::value::Value;
use crate::material::Material;
use crate::scene::validate::MAX_IOR;

pub(super) fn bounces(table: Table<'_>, base: Material) -> Read<Material> {
    let share = |value: Value<'_>| value.share();
    let switch = |value: Value<'_>| value.boolean();
    let most = f64::from(MAX_IOR);
    let ior = |value: Value<'_>| value.number("from 0.01 to 100", |n| (1.0 / most..=most).contains(&n));
    let fresnel = table.read("fresnel", switch)?.unwrap_or(false);
    let usual_reflect = if fresnel { Vec3::ONE } else { Vec3::ZERO };
    Ok(Material {
        reflect: table.read("reflect", share)?.unwrap_or(usual_reflect),
        transmit: table.read("transmit", share)?.unwrap_or(Vec3::ZERO),
        ior: table.read("ior", ior)?.map_or(base.ior, |n| (n as f32).clamp(1.0 / MAX_IOR, MAX_IOR)),
        thin: table.read("thin", switch)?.unwrap_or(false),
        fresnel,
        absorption: table.read("absorption", absorption)?.unwrap_or(Vec3::ONE),
        ..base
    })
}

/// The share of light that is left after one unit. Nothing at all would be no transmission.
fn absorption(value: Value<'_>) -> Read<Vec3> {
    let share = value.share()?;
    let expected = "above 0 in each channel: the share of light that is left after one unit";
    if share.min_element() > 0.0 { Ok(share) } else { Err(value.must_be(expected)) }
}

/// Warns about keys that change nothing of a material of reflection and transmission.
pub(super) fn warn_about_unused_keys(table: Table<'_>, material: &Material, reading: &mut Reading) {
    let transparent = material.is_transparent();
    if !transparent && !material.fresnel {
        reading.idle(table, "ior", "without `transmit` or `fresnel`");
    } else if material.thin && !material.fresnel {
        reading.idle(table, "ior", "on a thin material");
    }
    if !transparent {
        reading.idle(table, "absorption", "without `transmit`");
    } else if material.thin {
        reading.idle(table, "absorption", "on a thin material, which has no inside");
    }
    if material.thin && !transparent {
        reading.idle(table, "thin", "without `transmit`");
    }
    if material.fresnel && !material.bounces() {
        reading.idle(table, "fresnel", "where `reflect` and `transmit` are 0");
    }
}
