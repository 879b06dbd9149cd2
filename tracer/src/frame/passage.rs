//! How light passes the surfaces of an item along shadow rays.

use glam::Vec3;

use crate::scene::Material;

/// How light passes an item or plane along shadow rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passage {
    /// All surfaces are opaque.
    Blocked,
    /// Some light passes some surfaces.
    Dimmed,
    /// All light passes all surfaces: shadow rays need not test the item.
    Free,
}

impl Passage {
    /// The passage of an item with surfaces of some materials.
    pub(super) fn of<'m>(materials: impl Iterator<Item = &'m Material>) -> Self {
        let of_all = materials.map(|material| {
            if !material.casts_shadow || material.transmit == Vec3::ONE {
                Self::Free
            } else if material.is_transparent() {
                Self::Dimmed
            } else {
                Self::Blocked
            }
        });
        of_all.reduce(|a, b| if a == b { a } else { Self::Dimmed }).unwrap_or(Self::Blocked)
    }

    /// The same for paths: glass is an occluder, because light passes it on paths that are scattered there.
    pub(super) fn of_paths<'m>(mut materials: impl Iterator<Item = &'m Material>) -> Self {
        if materials.all(|material| !material.casts_shadow) { Self::Free } else { Self::Blocked }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_items_without_any_occluder_are_free() {
        let opaque = Material::NEUTRAL;
        let clear = Material { transmit: Vec3::ONE, ..opaque };
        let shadowless = Material { casts_shadow: false, ..opaque };
        let tinted = Material { transmit: Vec3::new(1.0, 1.0, 0.5), ..opaque };
        let of = |materials: &[Material]| Passage::of(materials.iter());
        assert_eq!(of(&[opaque, opaque]), Passage::Blocked);
        assert_eq!(of(&[clear, shadowless]), Passage::Free);
        for mixed in [[clear, opaque], [opaque, clear], [clear, tinted], [tinted, opaque], [tinted, tinted]] {
            assert_eq!(of(&mixed), Passage::Dimmed, "{mixed:?}");
        }
        assert_eq!(of(&[]), Passage::Blocked);
        let of_paths = |materials: &[Material]| Passage::of_paths(materials.iter());
        assert_eq!(of_paths(&[shadowless, shadowless]), Passage::Free);
        assert_eq!(of_paths(&[clear]), Passage::Blocked);
        assert_eq!(of_paths(&[shadowless, opaque]), Passage::Blocked);
    }
}
