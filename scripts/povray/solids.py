"""Solids, materials, lights and cameras, each written for rayfarm (TOML) and for POV-Ray (its scene language).

Both have the same coordinates: POV-Ray's vector `right` of the camera is negative, which makes its system right-handed.
Rotations are by the same matrices in both.
"""

import math
from dataclasses import dataclass
from typing import Optional, Tuple, Union

Vector = Tuple[float, float, float]
Color = Tuple[float, float, float]


def toml_vector(numbers):
    return "[" + ", ".join(f"{number:.9g}" for number in numbers) + "]"


def pov_vector(numbers):
    return "<" + ", ".join(f"{number:.9g}" for number in numbers) + ">"


def toml_table(name, keys):
    """A table with the keys that are not None."""
    return "\n".join([name, *(f"{key} = {value}" for key, value in keys.items() if value is not None), ""])


@dataclass(frozen=True)
class Checker:
    """Cubes of two colours along the axes of the world; the cell that begins at the origin has the first colour."""

    colors: Tuple[Color, Color]
    size: float

    def toml(self):
        first, second = map(toml_vector, self.colors)
        return f'{{ checker = [{first}, {second}], size = {self.size:g}, space = "world" }}'

    def pov(self):
        first, second = map(pov_vector, self.colors)
        return f"checker color rgb {first} color rgb {second} scale {self.size:g}"


@dataclass(frozen=True)
class Material:
    """Shares of light: scattered, reflected, transmitted. Highlights are (N.H)^exponent times `specular` in both programs.

    Glass with `absorption` casts no shadow: POV-Ray tints the shadow by both shares, rayfarm by `transmit` alone.
    """

    name: str
    diffuse: Union[Color, Checker] = (0.0, 0.0, 0.0)
    specular: float = 0.0
    exponent: float = 50.0
    reflect: Color = (0.0, 0.0, 0.0)
    transmit: float = 0.0
    ior: float = 1.5
    # Exact shares of reflection and refraction; both are given as 1.
    fresnel: bool = False
    # Share that is left after one unit inside.
    absorption: Optional[Color] = None

    def casts_shadow(self):
        return self.absorption is None

    def toml(self):
        diffuse = self.diffuse.toml() if isinstance(self.diffuse, Checker) else toml_vector(self.diffuse)
        glass = self.transmit > 0.0
        keys = {
            "diffuse": diffuse,
            "specular": toml_vector([self.specular] * 3) if self.specular else None,
            "exponent": f"{self.exponent:g}" if self.specular else None,
            "reflect": toml_vector(self.reflect) if any(self.reflect) else None,
            "transmit": f"{self.transmit:g}" if glass else None,
            "ior": f"{self.ior:g}" if glass else None,
            "fresnel": "true" if self.fresnel else None,
            "absorption": toml_vector(self.absorption) if self.absorption else None,
            "casts_shadow": None if self.casts_shadow() else "false",
        }
        return toml_table(f"[material.{self.name}]", keys)

    def pov(self):
        """Modifiers of an object. The default `finish` is in `Scene.pov`."""
        return f"pigment {{ {self.pov_pigment()} }}{self.pov_finish()}{self.pov_interior()}"

    def pov_pigment(self):
        if self.transmit > 0.0:
            # The colour of the pigment does not tint what `transmit` lets through: that is for `filter`.
            return f"color rgbt <0, 0, 0, {self.transmit:g}>"
        return self.diffuse.pov() if isinstance(self.diffuse, Checker) else f"color rgb {pov_vector(self.diffuse)}"

    def pov_finish(self):
        parts = []
        if self.specular:
            parts.append(f"specular {self.specular:g} roughness {1.0 / self.exponent:.9g}")
        if self.fresnel:
            # `conserve_energy` multiplies the transmitted light by 1 - the reflected share.
            parts.append("reflection { 0, 1 fresnel on } conserve_energy")
        elif any(self.reflect):
            parts.append(f"reflection {{ rgb {pov_vector(self.reflect)} }}")
        return f" finish {{ {' '.join(parts)} }}" if parts else ""

    def pov_interior(self):
        if self.transmit == 0.0:
            return ""
        # A fade_power from 1000 is exponential: exp((c - 1) d) of a colour c is left after the distance d.
        color = [1.0 + math.log(share) for share in self.absorption or ()]
        fade = f" fade_distance 1 fade_power 1001 fade_color rgb {pov_vector(color)}" if color else ""
        return f" interior {{ ior {self.ior:g}{fade} }}{'' if self.casts_shadow() else ' no_shadow'}"


@dataclass(frozen=True)
class Sphere:
    """A ball; glass may contain a bubble, as centre and radius."""

    center: Vector
    radius: float
    material: Material
    bubble: Optional[Tuple[Vector, float]] = None

    def toml(self):
        spheres = [(self.center, self.radius, None)]
        if self.bubble:
            spheres.append((*self.bubble, "true"))
        tables = (
            {
                "center": toml_vector(center),
                "radius": f"{radius:g}",
                "inside_out": inside_out,
                "material": f'"{self.material.name}"',
            }
            for center, radius, inside_out in spheres
        )
        return "\n".join(toml_table("[[sphere]]", table) for table in tables)

    def pov(self):
        body = f"{pov_vector(self.center)}, {self.radius:g}"
        if not self.bubble:
            return f"sphere {{ {body} {self.material.pov()} }}"
        center, radius = self.bubble
        bubble = f"{pov_vector(center)}, {radius:g}"
        return f"difference {{ sphere {{ {body} }} sphere {{ {bubble} }} {self.material.pov()} }}"


@dataclass(frozen=True)
class Box:
    """A box that is rotated about its centre, by degrees about x, then y, then z."""

    least: Vector
    greatest: Vector
    material: Material
    rotate: Vector = (0.0, 0.0, 0.0)

    def toml(self):
        keys = {
            "min": toml_vector(self.least),
            "max": toml_vector(self.greatest),
            "rotate": toml_vector(self.rotate),
            "material": f'"{self.material.name}"',
        }
        return toml_table("[[box]]", keys)

    def pov(self):
        center = [(low + high) / 2 for low, high in zip(self.least, self.greatest)]
        corner = [(high - low) / 2 for low, high in zip(self.least, self.greatest)]
        opposite = [-number for number in corner]
        sides = f"{pov_vector(opposite)}, {pov_vector(corner)}"
        placed = f"rotate {pov_vector(self.rotate)} translate {pov_vector(center)}"
        # The pigment comes last, so that a pattern is along the axes of the world.
        return f"box {{ {sides} {placed} {self.material.pov()} }}"


@dataclass(frozen=True)
class Plane:
    """The points whose coordinate on an axis (0, 1, 2) is `at`."""

    axis: int
    at: float
    material: Material

    def on_axis(self, number):
        return [number if axis == self.axis else 0.0 for axis in range(3)]

    def toml(self):
        keys = {
            "point": toml_vector(self.on_axis(self.at)),
            "normal": toml_vector(self.on_axis(1.0)),
            "material": f'"{self.material.name}"',
        }
        return toml_table("[[plane]]", keys)

    def pov(self):
        return f"plane {{ {pov_vector(self.on_axis(1.0))}, {self.at:g} {self.material.pov()} }}"


@dataclass(frozen=True)
class Light:
    """A point light without attenuation; with a radius its shadows are soft.

    rayfarm has 256 points on the disc that a surface sees. POV-Ray has a grid of 17 x 17 points: it divides the grid into halves
    that share their border, so the share of light is the trapezoidal rule over 16 x 16 cells.
    """

    position: Vector
    color: Color
    radius: float = 0.0

    def toml(self):
        soft = self.radius > 0.0
        keys = {
            "position": toml_vector(self.position),
            "color": toml_vector(self.color),
            "radius": f"{self.radius:g}" if soft else None,
            "shadow_samples": 256 if soft else None,
        }
        return toml_table("[[light]]", keys)

    def pov(self):
        side = 2 * self.radius
        grid = f" area_light <{side:g}, 0, 0>, <0, {side:g}, 0>, 17, 17 circular orient" if self.radius > 0.0 else ""
        return f"light_source {{ {pov_vector(self.position)} color rgb {pov_vector(self.color)}{grid} }}"


@dataclass(frozen=True)
class Camera:
    """A pinhole camera; `fov` is the horizontal angle of view in degrees."""

    position: Vector
    look_at: Vector
    fov: float

    def toml(self):
        keys = {
            "position": toml_vector(self.position),
            "look_at": toml_vector(self.look_at),
            "fov": f"{self.fov:g}",
            "fov_axis": '"horizontal"',
        }
        return toml_table("[camera]", keys)

    def pov(self, width, height):
        frame = f"right <-{width} / {height}, 0, 0> up <0, 1, 0> angle {self.fov:g}"
        return f"camera {{ location {pov_vector(self.position)} {frame} look_at {pov_vector(self.look_at)} }}"
