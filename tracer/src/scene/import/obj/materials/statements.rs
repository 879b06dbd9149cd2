//! Statements of a material, as `tobj` is to read them, and warnings about those that are not supported.

use super::super::super::printed::excerpt;
use super::super::super::warnings::Warnings;
use super::super::lines::Line;
use super::values::{SMALLEST_EXPONENT, bounded, bounded_color, color, number, shortened};
use crate::material::MAX_EXPONENT;

/// Keywords in the spelling of the format; programs write them in upper and lower case.
const KEYWORDS: &[&str] = &[
    "newmtl",
    "Ka",
    "Kd",
    "Ks",
    "Ke",
    "Km",
    "Ns",
    "Ni",
    "Tf",
    "Tr",
    "d",
    "illum",
    "sharpness",
    "map_aat",
    "map_Ka",
    "map_Kd",
    "map_Ks",
    "map_Ke",
    "map_Ns",
    "map_Ni",
    "map_d",
    "map_Tr",
    "map_opacity",
    "map_bump",
    "bump",
    "norm",
    "map_Kn",
    "disp",
    "map_disp",
    "decal",
    "refl",
    "map_refl",
    "Pr",
    "Pm",
    "Ps",
    "Pc",
    "Pcr",
    "aniso",
    "anisor",
    "map_Pr",
    "map_Pm",
    "map_Ps",
    "map_RMA",
    "map_ORM",
];

/// Statements that are left out, and the consequence for the picture.
const LEFT_OUT: &[(&[&str], &str)] = &[
    (&["bump", "map_bump", "norm", "map_Kn"], "relief from pictures is not drawn"),
    (&["disp", "map_disp"], "displacement by pictures is not drawn"),
    (&["refl", "map_refl"], "reflected pictures are not drawn"),
    (&["decal"], "decals are not drawn"),
    (&["map_Ks", "map_Ns"], "highlights are alike all over a material"),
    (&["map_Tr", "map_opacity"], "only `map_d` cuts out: drawn opaque"),
    (
        &[
            "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor", "map_Pr", "map_Pm", "map_Ps", "map_RMA",
            "map_ORM",
        ],
        "metal, roughness, sheen and coat are not drawn: `Kd`, `Ks` and `Ns` are",
    ),
];

/// Statements that are left out without a warning: programs write them by default, or they describe how to render.
const WITHOUT_EFFECT: &[&str] = &["map_Ni", "Km", "sharpness", "map_aat"];

/// The keyword in the spelling of the format.
pub(super) fn spelled(keyword: &str) -> &str {
    KEYWORDS.iter().find(|known| keyword.eq_ignore_ascii_case(known)).copied().unwrap_or(keyword)
}

/// The line as `tobj` is to read it; empty for statements that it does not read.
pub(super) fn statement(keyword: &str, line: &Line<'_>, warnings: &mut Warnings) -> Result<String, String> {
    match keyword {
        "Kd" | "Ks" => {
            let [r, g, b] = bounded_color(color(line)?, keyword, line, warnings);
            Ok(format!("{keyword} {r} {g} {b}\n"))
        }
        "Ka" => {
            let [r, g, b] = color(line)?;
            Ok(format!("Ka {r} {g} {b}\n"))
        }
        "Ns" => {
            let exponent = bounded(number(line)?, f64::from(MAX_EXPONENT), line, warnings);
            if exponent > 0.0 && exponent < SMALLEST_EXPONENT {
                let message = format!(
                    "`{}`: a highlight this wide would whiten all that is lit, and is not drawn",
                    shortened(line)
                );
                warnings.at_line(line.number, message);
            }
            Ok(format!("Ns {exponent}\n"))
        }
        "illum" => {
            let model = number(line)?;
            Ok(format!("illum {}\n", if (0.0..=9.0).contains(&model) { model as u8 } else { 2 }))
        }
        // Usually the picture of `map_Kd` again: only its presence matters.
        "map_Ka" => Ok("map_Ka given\n".into()),
        "map_Kd" | "map_d" | "Ke" | "map_Ke" | "d" | "Tr" | "Tf" | "Ni" => Ok(String::new()),
        _ => {
            leave_out(keyword, line, warnings);
            Ok(String::new())
        }
    }
}

/// Reports an unsupported statement, if it would change the picture.
fn leave_out(keyword: &str, line: &Line<'_>, warnings: &mut Warnings) {
    if let Some((_, reason)) = LEFT_OUT.iter().find(|(keywords, _)| keywords.contains(&keyword)) {
        return warnings.once(keyword, line.number, format!("`{keyword}` is left out: {reason}"));
    }
    if !WITHOUT_EFFECT.contains(&keyword) {
        let name = excerpt(keyword, 20);
        warnings.once(&name, line.number, format!("unknown statement `{name}` is left out"));
    }
}
