#!/usr/bin/env python3
"""Renders a neutral scene with the path tracer of Embree's tutorials, and prints the time of a frame as a line of JSON.

Its light of the sky is even, with a sun. It finds that light by rays that hit nothing and by shadow rays, and adds both: pictures cannot be
compared, but the rays are those of other path tracers.
"""

import argparse
import json
import re
import subprocess
import time

import numpy as np

import neutral

SKY = (0.6, 0.65, 0.7)
# Where light goes, radiance, and half of the angle across.
SUN = ((0.54, -0.643, -0.543), (900.0, 900.0, 900.0), 1.5)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", help="STEM.json and STEM.npz of prepare.py")
    parser.add_argument("--program", default="pathtracer")
    parser.add_argument("--samples", type=int, required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=1)
    arguments = parser.parse_args()
    scene = neutral.load(arguments.stem)
    write_obj(scene, arguments.stem)
    started = time.perf_counter()
    done = subprocess.run(command(scene, arguments), stdout=subprocess.PIPE, text=True, check=True)
    whole = time.perf_counter() - started
    frames_per_second = float(re.search(r"(?m)^BENCHMARK_RENDER_AVG (\S+)", done.stdout)[1])
    million_rays = float(re.search(r"(?m)^BENCHMARK_RENDER_MRAYPS_AVG (\S+)", done.stdout)[1])
    paths = scene.width * scene.height * arguments.samples
    seconds = 1.0 / frames_per_second
    report = {"renderer": "Embree", "seconds": seconds, "whole_seconds": whole, "samples": arguments.samples, "paths": paths}
    print(json.dumps(report | {"rays": million_rays * 1e6 * seconds}))


def command(scene, arguments):
    camera = scene.camera
    options = [
        ("-i", f"{arguments.stem}-embree.obj"), ("--righthanded",), ("--vp", *camera.position), ("--vi", *camera.look_at),
        ("--vu", *camera.up), ("--fov", camera.fov), ("--size", scene.width, scene.height), ("--ambientlight", *SKY),
        ("--distantlight", *SUN[0], *SUN[1], SUN[2]), ("--spp", arguments.samples), ("--max-path-length", scene.max_depth),
        ("--threads", arguments.threads), ("--benchmark", 0, arguments.frames),
    ]
    return [arguments.program, *(str(word) for option in options for word in option)]


def write_obj(scene, stem):
    """Diffuse materials; mirrors and glass as Embree's loader of MTL has them."""
    meshes = dict(scene.meshes)
    for ball in scene.balls:
        triangles = [meshes[ball.material]] if ball.material in meshes else []
        meshes[ball.material] = np.concatenate([*triangles, neutral.sphere_triangles(ball)])
    with open(f"{stem}-embree.mtl", "w", encoding="ascii") as out:
        for number, name in enumerate(meshes):
            material = scene.materials[name]
            clear = material.kind == "glass"
            color = [0.0, 0.0, 0.0] if material.kind in ("mirror", "glass") else material.color
            mirror = material.color if material.kind == "mirror" else [0.0, 0.0, 0.0]
            numbers = [("Kd", color), ("Ks", mirror), ("Kt", [1.0, 1.0, 1.0] if clear else [0.0, 0.0, 0.0])]
            out.write(f"newmtl m{number}\nNs 10\n" + "".join(f"{key} {' '.join(map(str, value))}\n" for key, value in numbers))
    first = 1
    with open(f"{stem}-embree.obj", "w", encoding="ascii") as out:
        out.write(f"mtllib {stem.rsplit('/', 1)[-1]}-embree.mtl\n")
        for number, triangles in enumerate(meshes.values()):
            points, corners = np.unique(np.asarray(triangles).reshape(-1, 3), axis=0, return_inverse=True)
            out.write(f"usemtl m{number}\n")
            out.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
            out.writelines(f"f {a} {b} {c}\n" for a, b, c in (corners.reshape(-1, 3) + first).tolist())
            first += len(points)


if __name__ == "__main__":
    main()
