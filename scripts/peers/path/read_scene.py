"""Reads a scene file of this project as a neutral scene. What the comparison does not have is left out, with a note."""

import math
import tomllib
from pathlib import Path

import numpy as np

import placing
import read_obj
import sky_picture
from neutral import Ball, Camera, Material, Scene, Sky

NEUTRAL = Material()
ROUGH_KEYS = {"metallic", "roughness", "transmission", "specular_factor", "metallic_roughness_texture"}
LEFT_OUT = ("absorption", "thin", "normal_map", "specular_factor", "casts_shadow")
PLANE_HALF_SIDE = 1000.0


def load(path, stem, note, panorama=None):
    """The scene in the file `path`. A gradient becomes the panorama STEM-sky.hdr; `panorama` replaces the background."""
    path = Path(path).resolve()
    with open(path, "rb") as file:
        text = tomllib.load(file)
    if text.get("light") and panorama is None:
        note("lights without surface are left out")
    materials = {name: _material(keys, note) for name, keys in text.get("material", {}).items()}
    materials.setdefault("neutral", NEUTRAL)
    places = placing.of_groups(text.get("group", []))
    parts = _Parts(places)
    for model in text.get("model", []):
        file = path.parent / model["file"]
        own = read_obj.materials_of(file, note)
        for name, triangles in read_obj.triangles_of(file).items():
            prefix = f"{file.stem}-{name}"
            used = model.get("material", prefix if name in own else "neutral")
            if used == prefix:
                materials[used] = own[name]
            parts.add(used, triangles, model, placing.of_keys(model))
    _primitives(text, parts)
    render = text.get("render", {})
    camera = _camera(text["camera"])
    return Scene(
        render.get("width", 1024),
        render.get("height", 768),
        render.get("max_depth", 8),
        camera,
        _sky(text.get("background", {}), path, stem) if panorama is None else Sky(panorama=str(Path(panorama).resolve())),
        materials,
        _balls(text.get("sphere", []), places),
        {name: np.concatenate(pieces) for name, pieces in parts.meshes.items()},
    )


class _Parts:
    """Triangles in world space, collected by material."""

    def __init__(self, places):
        self.places, self.meshes = places, {}

    def add(self, material, triangles, keys, own=None):
        place = self.places.get(keys.get("name"), np.eye(4)) @ (np.eye(4) if own is None else own)
        self.meshes.setdefault(material, []).append(placing.apply(place, triangles))


def _primitives(text, parts):
    for keys in text.get("triangle", []):
        parts.add(keys.get("material", "neutral"), [keys["vertices"]], keys)
    for keys in text.get("rectangle", []):
        axis = "xyz".index(keys["axis"])
        parts.add(keys.get("material", "neutral"), _rectangle(axis, keys["at"], keys["ranges"]), keys)
    for keys in text.get("box", []):
        parts.add(keys.get("material", "neutral"), _box(keys), keys)
    for keys in text.get("plane", []):
        parts.add(keys.get("material", "neutral"), _flat(keys["point"], keys["normal"], PLANE_HALF_SIDE, 4), {})
    for keys in text.get("disk", []):
        parts.add(keys.get("material", "neutral"), _flat(keys["center"], keys["normal"], keys["radius"], 96), keys)


def _rectangle(axis, at, ranges):
    """Two triangles across an axis, their front on its positive side. Ranges are of the other axes in alphabetical order."""
    others = [other for other in range(3) if other != axis]
    corners = np.full((4, 3), float(at))
    for corner, (i, j) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)]):
        corners[corner, others] = ranges[0][i], ranges[1][j]
    order = [[0, 1, 2], [0, 2, 3]]
    # x cross z is -y.
    return corners[np.asarray(order)][:, ::-1] if axis == 1 else corners[np.asarray(order)]


def _box(keys):
    low, high = np.asarray(keys["min"], dtype=float), np.asarray(keys["max"], dtype=float)
    sides = []
    for axis in range(3):
        ranges = [[low[other], high[other]] for other in range(3) if other != axis]
        sides += [_rectangle(axis, high[axis], ranges), _rectangle(axis, low[axis], ranges)[:, ::-1]]
    middle = (low + high) / 2.0
    turn = placing.rotation(keys.get("rotate", [0.0, 0.0, 0.0]))
    return (np.concatenate(sides) - middle) @ turn.T + middle


def _flat(center, normal, radius, corners):
    """A regular polygon."""
    normal = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    side = np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.7 else [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    angles = 2.0 * np.pi * np.arange(corners + 1) / corners
    rim = np.asarray(center) + radius * (np.outer(np.cos(angles), side) + np.outer(np.sin(angles), np.cross(normal, side)))
    middle = np.broadcast_to(np.asarray(center, dtype=float), (corners, 3))
    return np.stack([middle, rim[:-1], rim[1:]], axis=1)


def _balls(spheres, places):
    found = []
    for keys in spheres:
        place = places.get(keys.get("name"), np.eye(4))
        center = place @ [*keys["center"], 1.0]
        radius = keys["radius"] * abs(np.linalg.det(place[:3, :3])) ** (1.0 / 3.0)
        found.append(Ball(list(center[:3]), radius, keys.get("material", "neutral"), keys.get("inside_out", False)))
    return found


def _material(keys, note):
    for key in LEFT_OUT:
        if key in keys:
            note(f"`{key}` of materials is left out")
    color = keys.get("diffuse", NEUTRAL.color)
    if isinstance(color, dict):
        note("textures and patterns are replaced by grey")
        color = [0.4, 0.4, 0.4]
    emission = keys.get("emission", [0.0, 0.0, 0.0])
    if isinstance(emission, dict):
        note("textures of emission are left out")
        emission = [0.0, 0.0, 0.0]
    strength = keys.get("emission_strength", 1.0)
    material = Material(color=list(color), emission=[strength * channel for channel in emission])
    material.ior = keys.get("ior", 1.5)
    if ROUGH_KEYS & keys.keys():
        material.metallic, material.roughness = keys.get("metallic", 0.0), keys.get("roughness", 0.5)
        material.kind = "glass" if keys.get("transmission", 0.0) > 0.5 else "rough"
    elif _most(keys.get("transmit", 0.0)) > 0.0:
        material.kind = "glass"
    elif _most(keys.get("reflect", 0.0)) > 0.0 or keys.get("fresnel"):
        if _most(color) > 0.05 or keys.get("fresnel"):
            note("reflection of materials that are diffuse as well is left out")
        else:
            material.kind, material.color = "mirror", list(np.broadcast_to(keys["reflect"], 3).astype(float))
    if _most(keys.get("specular", 0.0)) > 0.0:
        note("highlights of materials are left out")
    return material


def _most(value):
    return max(value) if isinstance(value, list) else value


def _camera(keys):
    if keys.get("kind", "pinhole") != "pinhole" or "look_at" not in keys or keys.get("fov_axis", "vertical") != "vertical":
        raise ValueError("[camera]: a pinhole camera with look_at and a vertical fov is expected")
    fov = 2.0 * math.degrees(math.atan(math.tan(math.radians(keys.get("fov", 40.0) / 2.0)) / keys.get("zoom", 1.0)))
    distance = float(np.linalg.norm(np.subtract(keys["position"], keys["look_at"])))
    up = keys.get("up", [0.0, 1.0, 0.0])
    focus = keys.get("focus_distance", distance)
    return Camera(keys["position"], keys["look_at"], up, fov, keys.get("aperture", 0.0), focus)


def _sky(keys, path, stem):
    strength = keys.get("strength", 1.0)
    if "panorama" in keys:
        return Sky(panorama=str(path.parent / keys["panorama"]), rotate=keys.get("rotate", 0.0), strength=strength)
    if "gradient" in keys:
        picture = f"{stem}-sky.hdr"
        sky_picture.write(picture, sky_picture.gradient(keys["gradient"]["bottom"], keys["gradient"]["top"]))
        return Sky(panorama=picture, strength=strength)
    return Sky(color=[strength * channel for channel in keys.get("color", [0.0, 0.0, 0.0])])
