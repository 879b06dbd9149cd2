"""The metallic-roughness model of this project as a material of Mitsuba, whose `principled` is another model.

With the base colour b, the share of metal m, F(x) = (x + (1 - x) (1 - v.h)^5) (1 + x (s(v) s(l) - 1)), d = ((ior - 1) / (ior + 1))^2 and
c = 1 - E, the share that the dielectric leaves, with the mean C:

    f = f1 (m F(b) + (1 - m) F(d)) + (1 - m) b c(v) c(l) / (pi C)

f1 is GGX with height-correlated masking. The table of s and E is read from the source of the tracer.
"""

import re
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

TABLE = Path(__file__).resolve().parents[3] / "tracer/src/bsdf/scattering/albedo_table.rs"
LEAST_ALPHA = 1e-3


def table():
    """Scale s and the terms a and b of 1 - E = (1 - F0) (a + F0 b), by sqrt(alpha) and sqrt(cos)."""
    text = TABLE.read_text(encoding="utf-8").split("TABLE", 1)[1].split("=", 1)[1]
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", text)]
    side = round((len(numbers) / 3) ** 0.5)
    return np.asarray(numbers).reshape(side, side, 3)


def row_of(alpha):
    """The row of an alpha, and the means of a and b over the cosine-weighted hemisphere."""
    whole = table()
    steps = len(whole) - 1
    place = alpha**0.5 * steps
    first = min(int(place), steps - 1)
    row = whole[first] + (place - first) * (whole[first + 1] - whole[first])
    x = (np.arange(1 << 16) + 0.5) / (1 << 16)
    weight = 4.0 * x**3 / len(x)
    return row, [float(np.sum(weight * np.interp(x * steps, range(steps + 1), row[:, k]))) for k in (1, 2)]


class MetallicRoughness(mi.BSDF):
    """Opaque, from both sides; `color` is three numbers."""

    def __init__(self, properties):
        super().__init__(properties)
        self.base = mi.Color3f(*(properties[channel] for channel in ("red", "green", "blue")))
        self.metallic = properties["metallic"]
        self.alpha = max(properties["roughness"] ** 2, LEAST_ALPHA)
        self.dielectric = ((properties["ior"] - 1.0) / (properties["ior"] + 1.0)) ** 2
        row, means = row_of(self.alpha)
        self.steps = len(row) - 1
        self.terms = [mi.Float(row[:, k]) for k in range(3)]
        self.mean_left = (1.0 - self.dielectric) * (means[0] + self.dielectric * means[1])
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.DiffuseReflection | sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def _term(self, k, cosine):
        place = dr.sqrt(dr.clip(cosine, 0.0, 1.0)) * self.steps
        first = dr.minimum(mi.UInt32(place), self.steps - 1)
        low, high = (dr.gather(mi.Float, self.terms[k], first + step) for step in (0, 1))
        return low + (place - mi.Float(first)) * (high - low)

    def _left(self, cosine):
        return (1.0 - self.dielectric) * (self._term(1, cosine) + self.dielectric * self._term(2, cosine))

    def _lobe_share(self, cosine):
        """Probability of the lobe."""
        left = self._left(cosine) * (1.0 - self.metallic)
        diffuse = left * dr.mean(self.base)
        reflected = self.metallic * dr.mean(self.base) + (1.0 - self.metallic) * (1.0 - self._left(cosine))
        return dr.clip(reflected / (reflected + diffuse), 0.05, 1.0)

    def _smith(self, cosine):
        square = self.alpha**2
        return dr.sqrt(square + (1.0 - square) * cosine * cosine)

    def _evaluated(self, viewer, light):
        """f cos and the density of a direction above the surface."""
        half = dr.normalize(viewer + light)
        square = self.alpha**2
        slope = (half.x**2 + half.y**2) / square + half.z**2
        distribution = 1.0 / (dr.pi * square * slope**2)
        of_viewer, of_light = self._smith(viewer.z), self._smith(light.z)
        single = distribution * light.z / (2.0 * (light.z * of_viewer + viewer.z * of_light))
        edge = (1.0 - dr.clip(dr.dot(viewer, half), 0.0, 1.0)) ** 5
        more = self._term(0, viewer.z) * self._term(0, light.z) - 1.0

        def fresnel(straight):
            return (straight + (1.0 - straight) * edge) * (1.0 + straight * more)

        lobe = self.metallic * fresnel(self.base) + (1.0 - self.metallic) * fresnel(mi.Color3f(self.dielectric))
        left = self._left(viewer.z) * self._left(light.z) / self.mean_left
        below = (1.0 - self.metallic) * self.base * left * light.z / dr.pi
        share = self._lobe_share(viewer.z)
        density = share * distribution / (2.0 * (viewer.z + of_viewer)) + (1.0 - share) * light.z / dr.pi
        return lobe * single + below, density

    def eval_pdf(self, context, interaction, direction, active=True):
        viewer = mi.Vector3f(interaction.wi)
        side = dr.sign(viewer.z)
        viewer.z, light = viewer.z * side, mi.Vector3f(direction)
        light.z *= side
        active = mi.Mask(active) & (light.z > 0.0) & (viewer.z > 0.0)
        viewer.z, light.z = dr.maximum(viewer.z, 1e-6), dr.maximum(light.z, 1e-6)
        value, density = self._evaluated(viewer, light)
        return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    def eval(self, context, interaction, direction, active=True):
        return self.eval_pdf(context, interaction, direction, active)[0]

    def pdf(self, context, interaction, direction, active=True):
        return self.eval_pdf(context, interaction, direction, active)[1]

    def sample(self, context, interaction, part, place, active=True):
        viewer = mi.Vector3f(interaction.wi)
        side = dr.sign(viewer.z)
        viewer.z = dr.maximum(viewer.z * side, 1e-6)
        of_lobe = part < self._lobe_share(viewer.z)
        facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        half, _ = facets.sample(viewer, place)
        light = dr.select(of_lobe, mi.reflect(viewer, half), mi.warp.square_to_cosine_hemisphere(place))
        found = mi.BSDFSample3f()
        found.wo = mi.Vector3f(light.x, light.y, light.z * side)
        found.eta = 1.0
        found.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        found.sampled_component = mi.UInt32(0)
        value, found.pdf = self.eval_pdf(context, interaction, found.wo, active)
        usable = found.pdf > 0.0
        return found, dr.select(usable, value / dr.select(usable, found.pdf, 1.0), 0.0)

    def to_string(self):
        return "MetallicRoughness[]"


def register():
    """Makes the material known as `metallic-roughness`; after the variant is set."""
    mi.register_bsdf("metallic-roughness", MetallicRoughness)
