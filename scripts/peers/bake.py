"""Conversion of instances to plain meshes: all triangles in world space, one OBJ per material."""

from scene_file import Model


def bake(scene, stem):
    """Writes STEM-MATERIAL.obj for each material in use, and returns the models that replace all of the scene."""
    by_material = {}
    for model in scene.models:
        by_material.setdefault(model.material, []).append(model)
    return [_bake_one(models, material, f"{stem}-{material}.obj") for material, models in by_material.items()]


def _bake_one(models, material, path):
    meshes = {model.file: None for model in models}
    for file in meshes:
        meshes[file] = _read(file)
    with open(path, "w", encoding="ascii") as out:
        before = 0
        for model in models:
            positions, faces = meshes[model.file]
            x, y, z, origin = model.columns()
            out.writelines(
                "v {!r} {!r} {!r}\n".format(*(x[i] * p[0] + y[i] * p[1] + z[i] * p[2] + origin[i] for i in range(3)))
                for p in positions
            )
            out.writelines("f " + " ".join(str(corner + before) for corner in face) + "\n" for face in faces)
            before += len(positions)
    return Model(path, material)


def _read(path):
    """Positions, and faces as numbers of positions counted from one."""
    positions, faces = [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            word, *rest = line.split() or [""]
            if word == "v":
                positions.append([float(number) for number in rest[:3]])
            elif word == "f":
                corners = (int(corner.split("/", 1)[0]) for corner in rest)
                faces.append([corner if corner > 0 else len(positions) + 1 + corner for corner in corners])
    return positions, faces
