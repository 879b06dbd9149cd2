#!/usr/bin/env python3
"""Renders a neutral scene with Mitsuba, and prints the time without loading and compilation as a line of JSON."""

import argparse
import json
import os
import time
from glob import glob

import numpy as np

import neutral

# Paths in flight at once: Mitsuba keeps all of them in memory.
PATHS_PER_PASS = 1 << 23


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", help="STEM.json and STEM.npz of prepare.py")
    parser.add_argument("--samples", type=int, required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--variant", help="default: llvm_ad_rgb where LLVM is found, else scalar_rgb")
    parser.add_argument("--out", help="picture as .npy: linear, rows from the top")
    arguments = parser.parse_args()
    mi, variant = _mitsuba(arguments.variant, arguments.threads)
    scene = neutral.load(arguments.stem)
    if variant.startswith("llvm"):
        import metallic_roughness

        metallic_roughness.register()
    loaded = mi.load_dict(description(mi, scene, variant))
    integrator = mi.load_dict({"type": "path", "max_depth": scene.max_depth + 1})
    pixels = scene.width * scene.height
    per_pass = max(1, min(arguments.samples, PATHS_PER_PASS // pixels))
    passes = -(-arguments.samples // per_pass)

    def one(turn):
        seed = arguments.seed * 65536 + turn
        return np.array(mi.render(loaded, integrator=integrator, spp=per_pass, seed=seed))

    if variant.startswith("llvm"):
        one(65535)  # compiles the kernel
    started, started_cpu = time.perf_counter(), time.process_time()
    picture = sum(one(turn) for turn in range(passes)) / passes
    seconds, cpu_seconds = time.perf_counter() - started, time.process_time() - started_cpu
    if arguments.out:
        np.save(arguments.out, picture[..., :3].astype(np.float32))
    report = {"renderer": "Mitsuba", "version": mi.__version__, "variant": variant, "seconds": seconds}
    report["cpu_seconds"] = cpu_seconds
    print(json.dumps(report | {"samples": per_pass * passes, "paths": pixels * per_pass * passes}))


def _mitsuba(variant, threads):
    """The module with a variant. Dr.Jit finds LLVM by an environment variable only where its name has a version."""
    libraries = sorted(glob("/usr/lib/*/libLLVM.so*") + glob("/usr/lib/*/libLLVM-1[0-9].so*"), reverse=True)
    if libraries:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", libraries[0])
    import mitsuba as mi

    if variant is None:
        try:
            mi.set_variant("llvm_ad_rgb")
            variant = "llvm_ad_rgb"
        except ImportError:
            variant = "scalar_rgb"
    mi.set_variant(variant)
    if variant.startswith("llvm"):
        import drjit

        drjit.set_thread_count(threads)
    else:
        mi.Thread.thread().logger().set_log_level(mi.LogLevel.Warn)
        mi.util.core_count = lambda: threads
    return mi, variant


def description(mi, scene, variant):
    """The dictionary that `mitsuba.load_dict` takes."""
    found = {"type": "scene", "sensor": _sensor(mi, scene)}
    sky = _sky(mi, scene.sky)
    if sky:
        found["sky"] = sky
    materials = {name: _bsdf(material, variant) for name, material in scene.materials.items()}
    for number, (name, triangles) in enumerate(scene.meshes.items()):
        found[f"mesh{number}"] = _mesh(mi, f"mesh{number}", triangles, materials[name], scene.materials[name])
    for number, ball in enumerate(scene.balls):
        material = scene.materials[ball.material]
        shape = {"type": "sphere", "center": ball.center, "radius": ball.radius, "bsdf": materials[ball.material]}
        found[f"ball{number}"] = shape | {"flip_normals": ball.inside_out} | _emitter(material)
    return found


def _sensor(mi, scene):
    camera = scene.camera
    film = {"type": "hdrfilm", "width": scene.width, "height": scene.height, "pixel_format": "rgb",
            "component_format": "float32", "filter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": camera.fov, "fov_axis": "y", "film": film, "near_clip": 1e-3, "far_clip": 1e5,
              "to_world": mi.ScalarTransform4f().look_at(camera.position, camera.look_at, camera.up),
              "sampler": {"type": "independent"}}
    if camera.aperture > 0.0:
        sensor |= {"type": "thinlens", "aperture_radius": camera.aperture, "focus_distance": camera.focus_distance}
    return sensor


def _sky(mi, sky):
    if sky.panorama:
        # Mitsuba has the centre of the picture at +Z.
        turn = mi.ScalarTransform4f().rotate([0, 1, 0], 180.0 + sky.rotate)
        return {"type": "envmap", "filename": sky.panorama, "scale": sky.strength, "to_world": turn}
    return {"type": "constant", "radiance": _rgb(sky.color)} if any(sky.color) else None


def _rgb(color):
    return {"type": "rgb", "value": list(color)}


def _emitter(material):
    return {"emitter": {"type": "area", "radiance": _rgb(material.emission)}} if material.emits() else {}


def _bsdf(material, variant):
    if material.kind == "glass":
        return {"type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0}
    if material.kind == "mirror":
        inner = {"type": "conductor", "material": "none", "specular_reflectance": _rgb(material.color)}
    elif material.kind == "rough" and variant.startswith("llvm"):
        base = dict(zip(("red", "green", "blue"), material.color))
        return {"type": "metallic-roughness", "metallic": material.metallic, "roughness": material.roughness, "ior": material.ior} | base
    elif material.kind == "rough":
        # Another model: materials in Python are slow without LLVM.
        inner = {"type": "principled", "base_color": _rgb(material.color), "metallic": material.metallic,
                 "roughness": material.roughness, "eta": material.ior}
    else:
        inner = {"type": "diffuse", "reflectance": _rgb(material.color)}
    return {"type": "twosided", "bsdf": inner}


def _mesh(mi, name, triangles, bsdf, material):
    """Three vertices a triangle, without normals: flat."""
    count = len(triangles)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    if material.emits():
        properties["emitter"] = mi.load_dict(_emitter(material)["emitter"])
    mesh = mi.Mesh(name, 3 * count, count, properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.asarray(triangles, dtype=np.float32).ravel()
    parameters["faces"] = np.arange(3 * count, dtype=np.uint32)
    parameters.update()
    return mesh


if __name__ == "__main__":
    main()
