"""A scene without the features of one renderer: triangles, spheres, four kinds of material, a sky, a camera.

On disk it is two files: STEM.json, and STEM.npz with the vertices of the triangles of each mesh.
"""

import json
from dataclasses import asdict, dataclass, field

import numpy as np


@dataclass
class Material:
    """`kind` is "diffuse", "mirror", "glass" or "rough" (metallic-roughness)."""

    kind: str = "diffuse"
    color: list = field(default_factory=lambda: [0.7, 0.7, 0.7])
    ior: float = 1.5
    metallic: float = 0.0
    roughness: float = 0.5
    emission: list = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def emits(self):
        return any(channel > 0.0 for channel in self.emission)


@dataclass
class Ball:
    center: list
    radius: float
    material: str
    inside_out: bool = False


@dataclass
class Camera:
    """A pinhole, or a thin lens where `aperture`, its radius, is above 0. `fov` is vertical, in degrees."""

    position: list
    look_at: list
    up: list
    fov: float
    aperture: float = 0.0
    focus_distance: float = 1.0

    def axes(self):
        """Unit vectors to the right, upwards, and backwards."""
        back = np.subtract(self.position, self.look_at)
        back = back / np.linalg.norm(back)
        right = np.cross(self.up, back)
        right = right / np.linalg.norm(right)
        return right, np.cross(back, right), back


@dataclass
class Sky:
    """One colour, or a panorama (a file of linear light whose centre is at -Z), turned about +Y and multiplied."""

    color: list = field(default_factory=lambda: [0.0, 0.0, 0.0])
    panorama: str = ""
    rotate: float = 0.0
    strength: float = 1.0


@dataclass
class Scene:
    width: int
    height: int
    max_depth: int
    camera: Camera
    sky: Sky
    materials: dict
    balls: list
    # Name of a material: an array of triangles x corners x coordinates in world space, front counter-clockwise.
    meshes: dict

    def save(self, stem):
        text = {
            "width": self.width,
            "height": self.height,
            "max_depth": self.max_depth,
            "camera": asdict(self.camera),
            "sky": asdict(self.sky),
            "materials": {name: asdict(material) for name, material in self.materials.items()},
            "balls": [asdict(ball) for ball in self.balls],
        }
        with open(f"{stem}.json", "w", encoding="utf-8") as file:
            json.dump(text, file, indent=1)
        np.savez(f"{stem}.npz", **self.meshes)


def load(stem):
    """The scene that `Scene.save` wrote."""
    with open(f"{stem}.json", encoding="utf-8") as file:
        text = json.load(file)
    with np.load(f"{stem}.npz") as arrays:
        meshes = dict(arrays)
    return Scene(
        text["width"],
        text["height"],
        text["max_depth"],
        Camera(**text["camera"]),
        Sky(**text["sky"]),
        {name: Material(**values) for name, values in text["materials"].items()},
        [Ball(**values) for values in text["balls"]],
        meshes,
    )


def sphere_triangles(ball, columns=128, rows=64):
    """A ball as triangles, for renderers without spheres."""
    u = np.linspace(0.0, 2.0 * np.pi, columns + 1)
    v = np.linspace(0.0, np.pi, rows + 1)
    points = np.stack(
        [np.outer(np.sin(v), np.sin(u)), np.repeat(np.cos(v)[:, None], columns + 1, 1), np.outer(np.sin(v), np.cos(u))],
        axis=-1,
    )
    a, b = points[:-1, :-1], points[1:, :-1]
    c, d = points[1:, 1:], points[:-1, 1:]
    triangles = np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )
    if ball.inside_out:
        triangles = triangles[:, ::-1]
    return triangles * ball.radius + np.asarray(ball.center)
