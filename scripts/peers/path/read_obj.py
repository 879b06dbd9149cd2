"""Triangles of an OBJ file, by the name of their material, and the materials of its libraries."""

from pathlib import Path

import numpy as np

from neutral import Material


def triangles_of(path):
    """{material: triangles}, polygons as fans."""
    positions, material, found = [], "neutral", {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            word, *rest = line.split() or [""]
            if word == "v":
                positions.append([float(number) for number in rest[:3]])
            elif word == "usemtl":
                material = rest[0]
            elif word == "f":
                corners = [int(corner.split("/", 1)[0]) for corner in rest]
                corners = [corner - 1 if corner > 0 else len(positions) + corner for corner in corners]
                fans = found.setdefault(material, [])
                fans += [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]
    points = np.asarray(positions)
    return {name: points[np.asarray(corners)] for name, corners in found.items()}


def materials_of(path, note):
    """{name: material} of the libraries that an OBJ file names. Only diffuse and emitted colours are read."""
    found = {}
    with open(path, encoding="utf-8") as file:
        libraries = [line.split(maxsplit=1)[1].strip() for line in file if line.startswith("mtllib ")]
    for library in libraries:
        with open(Path(path).parent / library, encoding="utf-8") as file:
            name = ""
            for line in file:
                word, *rest = line.split() or [""]
                if word == "newmtl":
                    name = rest[0]
                    found[name] = Material()
                elif word == "Kd":
                    found[name].color = [float(number) for number in rest]
                elif word == "Ke":
                    found[name].emission = [float(number) for number in rest]
                elif word == "Ks" and any(float(number) > 0.0 for number in rest):
                    note("highlights of materials are left out")
                elif word.startswith("map_"):
                    note("textures are left out")
    return found
