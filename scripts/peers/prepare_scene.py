#!/usr/bin/env python3
"""Writes one scene for both tracers: STEM.toml for rayfarm and STEM.txt, plain numbers, for embree_tracer."""

import argparse
import sys
from pathlib import Path

import bake
import scene_file


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", help="a scene file (.toml)")
    parser.add_argument("stem", help="where to write: STEM.toml and STEM.txt")
    parser.add_argument("--plain", action="store_true", help="leave out what the comparison does not have")
    parser.add_argument("--bake", action="store_true", help="make meshes of instances: STEM-MATERIAL.obj")
    parser.add_argument("--bounces", action="store_true", help="a mirror of the triangles, glass of a model: see bouncing")
    arguments = parser.parse_args()
    try:
        scene = scene_file.load(arguments.scene, arguments.plain)
    except (scene_file.SceneError, OSError, ValueError, KeyError) as error:
        sys.exit(f"prepare_scene.py: {error}")
    if arguments.bounces:
        bouncing(scene)
    if arguments.bake:
        scene.models = bake.bake(scene, Path(arguments.stem).resolve())
    Path(arguments.stem + ".toml").write_text(toml_of(scene), encoding="utf-8")
    Path(arguments.stem + ".txt").write_text(numbers_of(scene), encoding="utf-8")


def bouncing(scene):
    """Makes the materials of triangles mirrors, and one model glass: the middle one of the first half."""
    for triangle in scene.triangles:
        scene.materials[triangle["material"]]["reflect"] = [0.4, 0.4, 0.4]
    ones, zeros = [1.0] * 3, [0.0] * 3
    glass = {"diffuse": zeros, "specular": zeros, "reflect": ones, "transmit": ones, "ior": 1.5, "fresnel": True}
    scene.materials["glass"] = {"exponent": 32.0, **glass}
    scene.models[len(scene.models) // 4].material = "glass"


def toml_of(scene):
    """The scene in rayfarm's format; all keys are written, so that no default matters."""

    def table(head, values):
        keys = (f"{key} = {_toml(value)}" for key, value in values.items())
        return "\n".join([head, *keys, ""])

    light = {"kind": "point", **scene.light, "attenuation": "none", "shadows": True}
    parts = [
        f"ambient = {_toml(scene.ambient)}\n",
        table("[render]", {"width": scene.width, "height": scene.height, "samples": scene.samples}),
        table("[camera]", scene.camera),
        table("[background]", {"color": scene.background}),
        table("[[light]]", light),
        *(table(f"[material.{name}]", material) for name, material in scene.materials.items()),
        *(table("[[triangle]]", _without_uvs(triangle)) for triangle in scene.triangles),
        *(table("[[model]]", {"normals": "flat", **vars(model)}) for model in scene.models),
    ]
    return "\n".join(parts)


def _without_uvs(triangle):
    return {key: value for key, value in triangle.items() if key != "uvs"}


def _toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, Path)):
        return '"' + str(value).replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(value)


def numbers_of(scene):
    """A word a line, then its numbers; see scene_text.hpp."""
    names = list(scene.materials)
    meshes = list(dict.fromkeys(str(model.file) for model in scene.models))
    camera, light = scene.camera, scene.light
    lines = [
        ("size", scene.width, scene.height, scene.samples),
        ("camera", camera["position"], camera["look_at"], camera["up"], camera["fov"]),
        ("background", scene.background),
        ("ambient", scene.ambient),
        ("light", light["position"], [channel * light["intensity"] for channel in light["color"]]),
    ]
    for material in scene.materials.values():
        lines.append(("material", material["diffuse"], material["specular"], material["exponent"]))
    for triangle in scene.triangles:
        lines.append(("triangle", names.index(triangle["material"]), triangle["vertices"]))
    lines += [("mesh", mesh) for mesh in meshes]
    for model in scene.models:
        lines.append(("instance", meshes.index(str(model.file)), names.index(model.material), model.columns()))
    return "".join(" ".join(_flat(line)) + "\n" for line in lines)


def _flat(value):
    if isinstance(value, (list, tuple)):
        return [word for item in value for word in _flat(item)]
    return [value if isinstance(value, str) else repr(value)]


if __name__ == "__main__":
    main()
