//! Mirrors and glass of a material: `illum`, `d`, `Tr`, `Tf`, `Ni`.
//!
//! Programs write many of these statements by default, so only combinations that mean something are followed:
//!
//! ```text
//! opacity     d, or 1 - Tr; 1 where everything would be invisible
//! illum 3, 8  reflect = Ks
//! illum 5, 7  reflect = Ks with Fresnel shares, if opaque
//! illum 6, 7  refracting glass: transmit = (1 - opacity) Tf, or Tf, with Ni and Fresnel shares
//! others      transmit = 1 - opacity, straight on; times Tf with illum 4 and 9
//! ```

use glam::Vec3;

use super::super::super::warnings::Warnings;
use super::super::lines::Line;
use super::values::{bounded, color, number, shortened};
use crate::material::Material;

/// Transmitted shares below this are opaque: less than one step of a byte.
const LEAST_SHARE: f32 = 1.0 / 256.0;

/// Smallest exponent of a mirror. With a wider highlight the surface is rough, and shows no image.
const SMALLEST_MIRROR: f64 = 64.0;

/// Index of refraction of a coat whose material has none.
const USUAL_IOR: f32 = 1.5;

/// The largest index of refraction that is read; the smallest is its reciprocal.
const MAX_IOR: f64 = 100.0;

/// Statements about mirrors and glass, with the numbers of their lines.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Optics {
    model: u8,
    opacity: Option<(f32, usize)>,
    transparency: Option<(f32, usize)>,
    filter: Option<(Vec3, usize)>,
    ior: Option<f32>,
}

/// Properties of the rest of a material that affect its optics.
#[derive(Clone, Copy)]
pub(super) struct Rest {
    /// Whether there is no highlight: `Ks` does not count.
    pub(super) matt: bool,
    /// `Ns`, if there is one.
    pub(super) exponent: Option<f64>,
    /// Whether `map_d` decides what is opaque.
    pub(super) cut_out: bool,
    /// Line of `newmtl`.
    pub(super) line: usize,
}

impl Optics {
    /// Reads one of these statements; ignores all others.
    pub(super) fn read(
        &mut self,
        keyword: &str,
        line: &Line<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), String> {
        match keyword {
            "illum" => {
                let model = number(line)?;
                if !(0.0..=9.0).contains(&model) {
                    let message = format!("`{}`: read as `illum 2`", shortened(line));
                    warnings.at_line(line.number, message);
                }
                self.model = if (0.0..=9.0).contains(&model) { model as u8 } else { 2 };
            }
            "d" => self.opacity = Some((share(line, warnings)?, line.number)),
            "Tr" => self.transparency = Some((share(line, warnings)?, line.number)),
            "Tf" => {
                let [r, g, b] = color(line)?.map(|channel| channel.clamp(0.0, 1.0) as f32);
                self.filter = Some((Vec3::new(r, g, b), line.number));
            }
            // 0 is no index; some programs write it for none.
            "Ni" => {
                let ior = number(line)?;
                self.ior =
                    (ior > 0.0).then(|| bounded(ior, MAX_IOR, line, warnings).max(1.0 / MAX_IOR) as f32);
            }
            _ => {}
        }
        Ok(())
    }

    /// A material with its mirror or glass.
    pub(super) fn applied(&self, material: Material, rest: Rest, warnings: &mut Warnings) -> Material {
        let transmitted = 1.0 - self.opacity(rest, warnings);
        let bent = self.bent();
        let filter = self.filter.map(|(filter, _)| filter).filter(|filter| *filter != Vec3::ZERO);
        let is_glass = matches!(self.model, 4 | 6 | 7 | 9);
        let transmit = match filter {
            _ if transmitted >= LEAST_SHARE && is_glass => filter.unwrap_or(Vec3::ONE) * transmitted,
            Some(filter) if bent.is_some() => filter,
            _ => Vec3::splat(if transmitted >= LEAST_SHARE { transmitted } else { 0.0 }),
        };
        let through = if transmitted >= LEAST_SHARE { transmitted } else { transmit.max_element() };
        self.warn_about_filter(is_glass && transmit != Vec3::ZERO, warnings);
        let material = Material { transmit, diffuse: material.diffuse * (1.0 - through), ..material };
        match bent {
            _ if transmit == Vec3::ZERO => self.mirror(material, rest, warnings),
            Some(ior) => Material { reflect: Vec3::ONE, fresnel: true, ior, ..material },
            None => {
                let sheet = Material { thin: true, ior: 1.0, ..material };
                let mirror = self.mirror(sheet, rest, warnings);
                // The shares of Fresnel are those of bent light.
                if mirror.fresnel {
                    sheet
                } else {
                    Material { reflect: mirror.reflect * (1.0 - through), ..mirror }
                }
            }
        }
    }

    /// The index of refraction, where light is bent.
    fn bent(&self) -> Option<f32> {
        self.ior.filter(|ior| *ior != 1.0 && matches!(self.model, 6 | 7))
    }

    /// The opaque share. Where nothing would be visible, all is opaque: programs write `d 0` and `Tr 1` for that, too.
    fn opacity(&self, rest: Rest, warnings: &mut Warnings) -> f32 {
        let (opacity, line) = match (self.opacity, self.transparency) {
            (Some((opacity, _)), Some((transparency, line)))
                if (opacity + transparency - 1.0).abs() > 0.01 =>
            {
                warnings.at_line(line, "`Tr` contradicts `d`: `d` counts");
                (opacity, line)
            }
            (Some(opacity), _) => opacity,
            (None, Some((transparency, line))) => (1.0 - transparency, line),
            (None, None) => return 1.0,
        };
        if opacity < LEAST_SHARE && (self.bent().is_none() || rest.cut_out) {
            if !rest.cut_out {
                warnings.at_line(line, "nothing of this material would be visible: drawn opaque");
            }
            return 1.0;
        }
        opacity
    }

    /// The reflection of `illum` 3, 5, 7 and 8.
    fn mirror(&self, material: Material, rest: Rest, warnings: &mut Warnings) -> Material {
        if rest.matt || !material.is_specular() || !matches!(self.model, 3 | 5 | 7 | 8) {
            return material;
        }
        if rest.exponent.is_some_and(|exponent| exponent < SMALLEST_MIRROR) {
            let message = format!(
                "`illum {}` with `Ns` below {SMALLEST_MIRROR}: a rough surface shows no mirror image, and none is drawn",
                self.model
            );
            warnings.at_line(rest.line, message);
            return material;
        }
        let reflect = material.specular;
        if matches!(self.model, 3 | 8) {
            return Material { reflect, ..material };
        }
        let ior = self.ior.filter(|ior| *ior != 1.0).unwrap_or(USUAL_IOR);
        Material { reflect, fresnel: true, ior, ..material }
    }

    /// Warns about a `Tf` that has no effect. Black and white are defaults of programs.
    fn warn_about_filter(&self, used: bool, warnings: &mut Warnings) {
        if let Some((filter, line)) = self.filter
            && !used
            && filter != Vec3::ZERO
            && filter != Vec3::ONE
        {
            warnings.once(
                "Tf",
                line,
                "`Tf` is left out: it colours glass, which is `illum` 4, 6, 7 or 9 with `d` below 1",
            );
        }
    }
}

fn share(line: &Line<'_>, warnings: &mut Warnings) -> Result<f32, String> {
    if line.rest().split_ascii_whitespace().any(|word| word.eq_ignore_ascii_case("-halo")) {
        warnings.at_line(line.number, "the option `-halo` is left out: all sides are equally transparent");
    }
    Ok(bounded(number(line)?, 1.0, line, warnings) as f32)
}
