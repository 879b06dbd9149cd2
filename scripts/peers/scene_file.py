"""Reads the keys of a scene file that both tracers support, and refuses others.

Both tracers render the same few features: one point light with shadows and without attenuation, flat normals, one
material a model, models and triangles, a background of one colour, a pinhole camera.
"""

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

NEUTRAL = {"diffuse": [0.7, 0.7, 0.7], "specular": [0.2, 0.2, 0.2], "exponent": 32.0}


class SceneError(Exception):
    """A scene that cannot be compared, and why."""


@dataclass
class Model:
    file: Path
    material: str
    translate: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    rotate: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    scale: list = field(default_factory=lambda: [1.0, 1.0, 1.0])

    def columns(self):
        """The linear part and the translation, as four columns: scaled, turned about x, y and z, then moved."""
        (sx, cx), (sy, cy), (sz, cz) = (_sin_cos(degrees) for degrees in self.rotate)
        rows = [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ]
        return [[row[i] * self.scale[i] for row in rows] for i in range(3)] + [self.translate]


@dataclass
class Scene:
    width: int
    height: int
    samples: int
    camera: dict
    background: list
    ambient: list
    light: dict
    materials: dict
    triangles: list
    models: list


def _sin_cos(degrees):
    """Exact for quarter turns."""
    quarter, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        return [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][int(quarter) % 4]
    return math.sin(math.radians(degrees)), math.cos(math.radians(degrees))


def load(path, plain=False):
    """Reads a scene. One with other features is refused, or made `plain`: reduced to those that are compared."""
    path = Path(path).resolve()
    with open(path, "rb") as file:
        text = tomllib.load(file)
    refuse = (lambda _: None) if plain else _refuse(path)
    render = text.get("render", {})
    return Scene(
        width=render.get("width", 1024),
        height=render.get("height", 768),
        samples=render.get("samples", 1),
        camera=_camera(text.get("camera", {}), path),
        background=_background(text.get("background", {}), refuse),
        ambient=text.get("ambient", [0.0, 0.0, 0.0]),
        light=_light(text.get("light", []), path, refuse),
        materials=_materials(text.get("material", {}), refuse),
        triangles=text.get("triangle", []),
        models=[_model(model, path, refuse) for model in text.get("model", [])] + _no_more(text, refuse),
    )


def _refuse(path):
    def refuse(what):
        raise SceneError(f"{path}: {what}: the comparison has no such thing; --plain leaves it out")

    return refuse


def _no_more(text, refuse):
    for name in ("sphere", "plane"):
        if name in text:
            refuse(f"[[{name}]]")
    return []


def _camera(camera, path):
    if camera.get("kind", "pinhole") != "pinhole" or "look_at" not in camera or "position" not in camera:
        raise SceneError(f"{path}: [camera]: a pinhole camera with position and look_at is expected")
    # A zoom divides the view plane's size.
    half_height = math.tan(math.radians(camera.get("fov", 40.0) / 2.0)) / camera.get("zoom", 1.0)
    return {
        "position": camera["position"],
        "look_at": camera["look_at"],
        "up": camera.get("up", [0.0, 1.0, 0.0]),
        "fov": camera.get("fov", 40.0) if "zoom" not in camera else 2.0 * math.degrees(math.atan(half_height)),
    }


def _background(background, refuse):
    if "color" in background:
        return background["color"]
    refuse("[background] without a color")
    gradient = background.get("gradient")
    return gradient["top"] if gradient else [0.2, 0.3, 0.4]


def _light(lights, path, refuse):
    if len(lights) != 1:
        refuse(f"{len(lights)} lights")
    light = next((light for light in lights if "position" in light), None)
    if light is None:
        raise SceneError(f"{path}: a light with a position is expected")
    usual = {"kind": "point", "attenuation": "none", "shadows": True, "radius": 0.0}
    for key, value in usual.items():
        if light.get(key, value) != value:
            refuse(f"a light's {key} = {light[key]!r}")
    return {
        "position": light["position"],
        "color": light.get("color", [1.0, 1.0, 1.0]),
        "intensity": light.get("intensity", 1.0),
    }


def _materials(materials, refuse):
    found = {"neutral": NEUTRAL}
    for name, material in materials.items():
        for key in material.keys() - NEUTRAL.keys():
            refuse(f"[material.{name}] {key}")
        found[name] = {key: _number(material, name, key, refuse) for key in NEUTRAL}
    return found


def _number(material, name, key, refuse):
    missing = {"diffuse": NEUTRAL["diffuse"], "specular": [0.0, 0.0, 0.0], "exponent": NEUTRAL["exponent"]}
    value = material.get(key, missing[key])
    if isinstance(value, dict):
        refuse(f"[material.{name}] {key} with a texture")
        return missing[key]
    return value


def _model(model, path, refuse):
    file = (path.parent / model["file"]).resolve()
    if "material" not in model:
        refuse(f'model "{model["file"]}" with the materials of its file')
    if model.get("normals", "smooth") != "flat":
        refuse(f'model "{model["file"]}" with smooth normals')
    scale = model.get("scale", 1.0)
    found = Model(file, model.get("material", "neutral"))
    found.translate = model.get("translate", found.translate)
    found.rotate = model.get("rotate", found.rotate)
    found.scale = scale if isinstance(scale, list) else [scale] * 3
    return found
