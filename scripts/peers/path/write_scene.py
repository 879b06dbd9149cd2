"""Writes a neutral scene in the format of this project: STEM.toml, and an OBJ for each material."""

import numpy as np


def write(scene, stem, samples):
    """All meshes have flat normals, as those of the peers."""
    camera = scene.camera
    parts = [
        _table("[render]", {"integrator": "path", "width": scene.width, "height": scene.height,
                            "samples": samples, "max_depth": scene.max_depth}),
        _table("[camera]", {"position": camera.position, "look_at": camera.look_at, "up": camera.up, "fov": camera.fov}
               | ({"aperture": camera.aperture, "focus_distance": camera.focus_distance} if camera.aperture > 0.0 else {})),
        _table("[background]", _background(scene.sky)),
    ]
    used = {ball.material for ball in scene.balls} | scene.meshes.keys()
    parts += [_table(f'[material."{name}"]', _material(scene.materials[name])) for name in sorted(used)]
    for ball in scene.balls:
        keys = {"center": ball.center, "radius": ball.radius, "material": ball.material}
        parts.append(_table("[[sphere]]", keys | ({"inside_out": True} if ball.inside_out else {})))
    for number, (name, triangles) in enumerate(scene.meshes.items()):
        file = f"{stem}-{number}.obj"
        _write_obj(file, triangles)
        parts.append(_table("[[model]]", {"file": file, "material": name, "normals": "flat"}))
    with open(f"{stem}.toml", "w", encoding="utf-8") as out:
        out.write("\n".join(parts))


def _background(sky):
    if sky.panorama:
        return {"panorama": sky.panorama, "rotate": sky.rotate, "strength": sky.strength}
    most = max(1.0, *sky.color)
    return {"color": [channel / most for channel in sky.color], "strength": most}


def _material(material):
    emission = {"emission": material.emission} if material.emits() else {}
    black = {"diffuse": [0.0, 0.0, 0.0]}
    if material.kind == "mirror":
        return black | {"reflect": material.color} | emission
    if material.kind == "glass":
        return black | {"transmit": 1.0, "fresnel": True, "ior": material.ior} | emission
    if material.kind == "rough":
        rough = {"metallic": material.metallic, "roughness": material.roughness, "ior": material.ior}
        return {"diffuse": material.color} | rough | emission
    return {"diffuse": material.color} | emission


def _write_obj(path, triangles):
    points, corners = np.unique(np.asarray(triangles).reshape(-1, 3), axis=0, return_inverse=True)
    with open(path, "w", encoding="ascii") as out:
        out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
        out.writelines(f"f {a} {b} {c}\n" for a, b, c in (corners.reshape(-1, 3) + 1).tolist())


def _table(head, keys):
    return "\n".join([head, *(f"{key} = {_toml(value)}" for key, value in keys.items()), ""])


def _toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_toml(float(item)) for item in value) + "]"
    return repr(value)
