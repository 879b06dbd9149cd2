//! The colours of the room: rust and teal, oak and brass.

use crate::generator::shape::Material;

/// Oak of the floor, five tones.
pub(crate) static FLOOR: [Material; 5] = [
    Material::glossy("floor_a", [0.330, 0.185, 0.090], 0.10, 60.0),
    Material::glossy("floor_b", [0.370, 0.212, 0.105], 0.10, 60.0),
    Material::glossy("floor_c", [0.295, 0.160, 0.076], 0.10, 60.0),
    Material::glossy("floor_d", [0.410, 0.245, 0.128], 0.10, 60.0),
    Material::glossy("floor_e", [0.350, 0.190, 0.088], 0.10, 60.0),
];
/// Between the boards.
pub(crate) static GAP: Material = Material::matt("gap", [0.060, 0.032, 0.018]);
/// Upper walls.
pub(crate) static WALL: Material = Material::matt("wall", [0.120, 0.205, 0.190]);
/// Panelling, doors, window frames.
pub(crate) static WOODWORK: Material = Material::glossy("woodwork", [0.640, 0.615, 0.550], 0.05, 30.0);
/// Ceiling and plaster.
pub(crate) static PLASTER: Material = Material::matt("plaster", [0.720, 0.690, 0.630]);
/// Curtains.
pub(crate) static LINEN: Material = Material::matt("linen", [0.660, 0.570, 0.430]);
/// Sofa.
pub(crate) static RUST: Material = Material::glossy("rust", [0.430, 0.125, 0.045], 0.03, 8.0);
/// The sofa's piping.
pub(crate) static RUST_DARK: Material = Material::matt("rust_dark", [0.250, 0.065, 0.025]);
/// Armchair cushions.
pub(crate) static CREAM: Material = Material::glossy("cream", [0.660, 0.580, 0.450], 0.02, 6.0);
/// The armchairs' piping.
pub(crate) static CREAM_DARK: Material = Material::matt("cream_dark", [0.420, 0.340, 0.230]);
/// Pillows.
pub(crate) static MUSTARD: Material = Material::matt("mustard", [0.580, 0.330, 0.045]);
/// Pillows and book covers.
pub(crate) static TEAL: Material = Material::matt("teal", [0.030, 0.125, 0.130]);
/// Furniture.
pub(crate) static WALNUT: Material = Material::glossy("walnut", [0.165, 0.078, 0.036], 0.18, 45.0);
/// Lighter furniture.
pub(crate) static OAK: Material = Material::glossy("oak", [0.400, 0.235, 0.110], 0.12, 40.0);
/// Fittings.
pub(crate) static BRASS: Material = Material::metal("brass", [0.360, 0.230, 0.070], [0.85, 0.62, 0.28], 70.0);
/// Lamp stands, rods.
pub(crate) static IRON: Material = Material::glossy("iron", [0.030, 0.030, 0.032], 0.35, 40.0);
/// Lamp shades, inside and out.
pub(crate) static ENAMEL: Material = Material::glossy("enamel", [0.780, 0.740, 0.640], 0.15, 50.0);
/// Light bulbs.
pub(crate) static BULB: Material = Material::matt("bulb", [1.0, 0.95, 0.82]);
/// Tea things.
pub(crate) static PORCELAIN: Material = Material::glossy("porcelain", [0.740, 0.730, 0.690], 0.45, 140.0);
/// Bands on the tea things.
pub(crate) static GLAZE: Material = Material::glossy("glaze", [0.030, 0.130, 0.220], 0.45, 140.0);
/// Tea.
pub(crate) static TEA: Material = Material::glossy("tea", [0.260, 0.080, 0.015], 0.35, 200.0);
/// Plant pots.
pub(crate) static TERRACOTTA: Material = Material::matt("terracotta", [0.470, 0.180, 0.085]);
/// Earth in the pots.
pub(crate) static EARTH: Material = Material::matt("earth", [0.045, 0.028, 0.018]);
/// Stems.
pub(crate) static BARK: Material = Material::matt("bark", [0.170, 0.110, 0.060]);
/// Leaves, three greens.
pub(crate) static LEAVES: [Material; 3] = [
    Material::glossy("leaf_a", [0.055, 0.190, 0.050], 0.14, 25.0),
    Material::glossy("leaf_b", [0.085, 0.240, 0.060], 0.14, 25.0),
    Material::glossy("leaf_c", [0.040, 0.145, 0.050], 0.14, 25.0),
];
/// The rug's yarns.
pub(crate) static YARN: [Material; 6] = [
    Material::matt("yarn_ivory", [0.520, 0.430, 0.300]),
    Material::matt("yarn_red", [0.235, 0.038, 0.024]),
    Material::matt("yarn_navy", [0.022, 0.036, 0.070]),
    Material::matt("yarn_ochre", [0.360, 0.190, 0.050]),
    Material::matt("yarn_teal", [0.050, 0.115, 0.110]),
    Material::matt("yarn_rose", [0.330, 0.105, 0.060]),
];
/// Paper.
pub(crate) static PAPER: Material = Material::matt("paper", [0.620, 0.560, 0.430]);
/// Book covers.
pub(crate) static COVERS: [Material; 9] = [
    Material::glossy("cover_red", [0.300, 0.040, 0.030], 0.08, 20.0),
    Material::glossy("cover_green", [0.045, 0.140, 0.070], 0.08, 20.0),
    Material::glossy("cover_navy", [0.022, 0.040, 0.085], 0.08, 20.0),
    Material::glossy("cover_sand", [0.400, 0.280, 0.145], 0.08, 20.0),
    Material::glossy("cover_rust", [0.430, 0.140, 0.045], 0.08, 20.0),
    Material::glossy("cover_plum", [0.120, 0.035, 0.055], 0.08, 20.0),
    Material::glossy("cover_black", [0.035, 0.032, 0.030], 0.12, 20.0),
    Material::glossy("cover_sky", [0.120, 0.210, 0.230], 0.08, 20.0),
    Material::glossy("cover_ivory", [0.480, 0.420, 0.310], 0.08, 20.0),
];
/// Picture frames.
pub(crate) static GILT: Material = Material::metal("gilt", [0.410, 0.270, 0.090], [0.55, 0.40, 0.18], 40.0);
/// Colours of the pictures: sky, sun, far to near hills, foreground.
pub(crate) static PICTURE: [Material; 7] = [
    Material::matt("picture_sky", [0.640, 0.500, 0.330]),
    Material::matt("picture_sun", [0.640, 0.190, 0.055]),
    Material::matt("picture_haze", [0.400, 0.330, 0.260]),
    Material::matt("picture_far", [0.190, 0.250, 0.240]),
    Material::matt("picture_middle", [0.080, 0.165, 0.170]),
    Material::matt("picture_near", [0.035, 0.085, 0.100]),
    Material::matt("picture_mount", [0.680, 0.640, 0.560]),
];
/// Cypresses outside the windows.
pub(crate) static CYPRESS: Material = Material::matt("cypress", [0.050, 0.085, 0.040]);
/// Hills outside the windows, far to near.
pub(crate) static HILLS: [Material; 3] = [
    Material::matt("hill_far", [0.430, 0.450, 0.540]),
    Material::matt("hill_middle", [0.270, 0.360, 0.320]),
    Material::matt("hill_near", [0.200, 0.240, 0.100]),
];
