"""The scenes that both programs render: mirrors, glass, a soft shadow."""

from dataclasses import dataclass
from typing import Tuple

from .solids import Box, Camera, Checker, Color, Light, Material, Plane, Sphere, pov_vector, toml_table, toml_vector

# Reflections and transmissions of a ray, and the least share of a ray that is traced. The share of a longer path is below half a
# step of 255 in these scenes.
MAX_DEPTH = 30
MIN_CONTRIBUTION = 0.0005


@dataclass(frozen=True)
class Scene:
    """A scene for both programs. The background is a gradient along y, linear in (d.y + 1) / 2 of the direction d."""

    name: str
    camera: Camera
    lights: Tuple[Light, ...]
    solids: tuple
    ambient: Color
    bottom: Color
    top: Color

    def materials(self):
        return list({solid.material.name: solid.material for solid in self.solids}.values())

    def toml(self, width, height):
        render = {
            "width": width,
            "height": height,
            "max_depth": MAX_DEPTH,
            "min_contribution": f"{MIN_CONTRIBUTION:g}",
        }
        gradient = f"{{ bottom = {toml_vector(self.bottom)}, top = {toml_vector(self.top)} }}"
        tables = [
            f"ambient = {toml_vector(self.ambient)}\n",
            toml_table("[render]", render),
            self.camera.toml(),
            toml_table("[background]", {"gradient": gradient}),
            *(part.toml() for part in (*self.lights, *self.materials(), *self.solids)),
        ]
        return "\n".join(tables)

    def pov(self, width, height):
        # Colours are linear. Without `specular`, a surface has no highlight.
        finish = f"ambient rgb {pov_vector(self.ambient)} diffuse 1"
        trace = f"max_trace_level {MAX_DEPTH + 1} adc_bailout {MIN_CONTRIBUTION:g}"
        gradient = f"gradient y color_map {{ [0 color rgb {pov_vector(self.bottom)}] [1 color rgb {pov_vector(self.top)}] }}"
        lines = [
            "#version 3.7;",
            f"global_settings {{ assumed_gamma 1.0 ambient_light rgb 1 {trace} }}",
            f"#default {{ finish {{ {finish} }} }}",
            self.camera.pov(width, height),
            f"sky_sphere {{ pigment {{ {gradient} scale 2 translate <0, -1, 0> }} }}",
            *(part.pov() for part in (*self.lights, *self.solids)),
        ]
        return "\n".join(lines) + "\n"


def mirror():
    """Two coloured balls with highlights between a mirror floor and a tilted, coloured mirror that reflect each other."""
    floor = Material("floor", diffuse=Checker(((0.30, 0.30, 0.28), (0.04, 0.06, 0.09)), 0.9), reflect=(0.5, 0.5, 0.5))
    silver = Material("silver", diffuse=(0.02, 0.02, 0.03), reflect=(0.85, 0.80, 0.70))
    red = Material("red", diffuse=(0.75, 0.12, 0.08), specular=0.4, exponent=40.0)
    blue = Material("blue", diffuse=(0.08, 0.20, 0.60), specular=0.4, exponent=150.0, reflect=(0.15, 0.15, 0.15))
    return Scene(
        name="mirror",
        camera=Camera(position=(0.3, 1.9, 5.2), look_at=(0.0, 0.9, 0.0), fov=46.0),
        lights=(
            Light(position=(3.5, 6.0, 4.5), color=(0.85, 0.82, 0.75)),
            Light(position=(-5.0, 3.0, 3.0), color=(0.15, 0.18, 0.25)),
        ),
        solids=(
            Plane(1, -0.001, floor),
            Box((-2.2, 0.05, -1.95), (2.2, 2.95, -1.85), silver, rotate=(11.0, 9.0, 0.0)),
            Sphere((-0.85, 0.7, 0.1), 0.7, red),
            Sphere((0.75, 0.5, 0.8), 0.5, blue),
        ),
        ambient=(0.12, 0.12, 0.12),
        bottom=(0.25, 0.22, 0.20),
        top=(0.20, 0.35, 0.65),
    )


def glass():
    """Glass in front of checkers and a bar: a grey ball that reflects a constant share, a box that reflects by Fresnel's
    equations, and a green ball with a bubble.

    The box and the bubble reflect totally. Their glass has `transmit` = 1, because the programs differ in the weight of a total
    reflection: `transmit` in rayfarm, 1 in POV-Ray.
    """
    floor = Material("floor", diffuse=Checker(((0.75, 0.72, 0.65), (0.12, 0.16, 0.20)), 0.6))
    wall = Material("wall", diffuse=Checker(((0.70, 0.30, 0.15), (0.80, 0.78, 0.70)), 0.75))
    bar = Material("bar", diffuse=(0.10, 0.45, 0.20))
    polished = Material("polished", reflect=(0.08, 0.08, 0.08), transmit=0.9)
    clear = Material("clear", reflect=(1.0, 1.0, 1.0), transmit=1.0, fresnel=True)
    green = Material("green", transmit=1.0, absorption=(0.45, 0.85, 0.60))
    return Scene(
        name="glass",
        camera=Camera(position=(0.2, 1.7, 5.5), look_at=(0.0, 0.85, 0.0), fov=46.0),
        lights=(Light(position=(2.5, 6.0, 5.0), color=(0.85, 0.85, 0.85)),),
        solids=(
            Plane(1, -0.001, floor),
            Plane(2, -3.1, wall),
            Box((-2.6, 0.0, -1.9), (2.6, 0.35, -1.5), bar, rotate=(0.0, 6.0, 0.0)),
            Sphere((-1.15, 1.0, 0.3), 0.95, polished),
            Box((0.75, 0.1, -0.35), (1.75, 1.3, 0.65), clear, rotate=(0.0, 33.0, 0.0)),
            Sphere((0.35, 0.52, 1.5), 0.5, green, bubble=((0.40, 0.55, 1.55), 0.25)),
        ),
        ambient=(0.15, 0.15, 0.15),
        bottom=(0.20, 0.20, 0.20),
        top=(0.20, 0.35, 0.65),
    )


def shadow():
    """A ball and two bars with soft shadows on the ground, by a light with a radius."""
    ground = Material("ground", diffuse=(0.75, 0.75, 0.72))
    red = Material("red", diffuse=(0.75, 0.15, 0.10))
    blue = Material("blue", diffuse=(0.12, 0.22, 0.55))
    return Scene(
        name="shadow",
        camera=Camera(position=(0.0, 3.2, 5.6), look_at=(0.1, 0.3, 0.0), fov=46.0),
        lights=(Light(position=(3.0, 6.0, 1.5), color=(0.9, 0.9, 0.9), radius=0.6),),
        solids=(
            Plane(1, 0.0, ground),
            Sphere((-0.6, 0.9, 0.2), 0.6, red),
            Box((1.3, 0.0, -1.2), (1.5, 1.8, -1.0), blue, rotate=(0.0, 25.0, 0.0)),
            Box((-2.3, 0.9, -1.4), (0.7, 1.05, -1.25), blue, rotate=(0.0, 12.0, 0.0)),
        ),
        ambient=(0.08, 0.08, 0.08),
        bottom=(0.2, 0.2, 0.2),
        top=(0.2, 0.3, 0.5),
    )


ALL = {scene.name: scene for scene in (mirror(), glass(), shadow())}
