#!/usr/bin/env python3
"""Renders a neutral scene with Cycles, and prints the time as a line of JSON.

The time contains the building of the scene: the difference of two runs with different numbers of samples does not.
"""

import argparse
import json
import time

import bpy
import numpy as np
from mathutils import Matrix

import neutral


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", help="STEM.json and STEM.npz of prepare.py")
    parser.add_argument("--samples", type=int, required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", required=True, help="picture as .npy: linear, rows from the top")
    arguments = parser.parse_args()
    scene = neutral.load(arguments.stem)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _settings(scene, arguments)
    _camera(scene.camera)
    _sky(scene.sky)
    materials = {name: _material(name, material) for name, material in scene.materials.items()}
    for name, triangles in scene.meshes.items():
        _mesh(name, triangles, materials[name], smooth=False)
    for number, ball in enumerate(scene.balls):
        _mesh(f"ball{number}", neutral.sphere_triangles(ball), materials[ball.material], smooth=True)
    picture = arguments.out + ".exr"
    bpy.context.scene.render.filepath = picture
    started, started_cpu = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=True)
    seconds, cpu_seconds = time.perf_counter() - started, time.process_time() - started_cpu
    np.save(arguments.out, _pixels(picture, scene))
    paths = scene.width * scene.height * arguments.samples
    report = {"renderer": "Cycles", "version": bpy.app.version_string, "seconds": seconds, "cpu_seconds": cpu_seconds}
    print("\n" + json.dumps(report | {"samples": arguments.samples, "paths": paths}))


def _settings(scene, arguments):
    settings = bpy.context.scene
    settings.render.engine = "CYCLES"
    settings.render.resolution_x, settings.render.resolution_y = scene.width, scene.height
    settings.render.resolution_percentage = 100
    settings.render.threads_mode, settings.render.threads = "FIXED", arguments.threads
    settings.render.image_settings.file_format = "OPEN_EXR"
    settings.render.image_settings.color_depth = "32"
    settings.render.use_persistent_data = False
    settings.view_settings.view_transform = "Raw"
    cycles = settings.cycles
    cycles.device, cycles.samples, cycles.seed = "CPU", arguments.samples, arguments.seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    # Cycles counts scattering after the first vertex.
    bounces = scene.max_depth - 1
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.transmission_bounces = cycles.transparent_max_bounces = bounces
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True


def _camera(camera):
    """Blender's cameras look along -Z with +Y upwards, as those of this project: no coordinate is exchanged."""
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle_y = "VERTICAL", np.radians(camera.fov)
    data.clip_start, data.clip_end = 1e-3, 1e5
    if camera.aperture > 0.0:
        data.dof.use_dof, data.dof.focus_distance = True, camera.focus_distance
        data.dof.aperture_fstop = data.lens / 1000.0 / (2.0 * camera.aperture)
    placed = bpy.data.objects.new("camera", data)
    placed.location = camera.position
    placed.rotation_mode = "QUATERNION"
    placed.rotation_quaternion = Matrix(np.column_stack(camera.axes()).tolist()).to_quaternion()
    bpy.context.scene.collection.objects.link(placed)
    bpy.context.scene.camera = placed


def _sky(sky):
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = [*sky.color, 1.0]
    background.inputs["Strength"].default_value = 1.0
    if not sky.panorama:
        return
    background.inputs["Strength"].default_value = sky.strength
    image = nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(sky.panorama)
    links.new(image.outputs["Color"], background.inputs["Color"])
    links.new(_panorama_direction(nodes, links, sky.rotate), image.inputs["Vector"])


def _panorama_direction(nodes, links, rotate):
    """Blender's panoramas are about +Z with the centre at +X, ours about +Y with the centre at -Z: (-z, -x, y), turned back."""
    s, c = np.sin(np.radians(rotate)), np.cos(np.radians(rotate))
    unturned_x, unturned_z = (c, 0.0, -s), (s, 0.0, c)
    rows = [[-value for value in unturned_z], [-value for value in unturned_x], (0.0, 1.0, 0.0)]
    direction = nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    combined = nodes.new("ShaderNodeCombineXYZ")
    for row, coordinate in zip(rows, "XYZ"):
        product = nodes.new("ShaderNodeVectorMath")
        product.operation = "DOT_PRODUCT"
        product.inputs[1].default_value = row
        links.new(direction, product.inputs[0])
        links.new(product.outputs["Value"], combined.inputs[coordinate])
    return combined.outputs["Vector"]


def _material(name, material):
    found = bpy.data.materials.new(name)
    found.use_nodes = True
    nodes, links = found.node_tree.nodes, found.node_tree.links
    nodes.clear()
    surface = nodes.new(
        {"glass": "ShaderNodeBsdfGlass", "mirror": "ShaderNodeBsdfGlossy", "rough": "ShaderNodeBsdfPrincipled"}.get(
            material.kind, "ShaderNodeBsdfDiffuse"
        )
    )
    values = {"Roughness": material.roughness if material.kind == "rough" else 0.0, "IOR": material.ior,
              "Metallic": material.metallic}
    for key, value in values.items():
        if key in surface.inputs:
            surface.inputs[key].default_value = value
    color = [1.0, 1.0, 1.0] if material.kind == "glass" else material.color
    surface.inputs["Base Color" if material.kind == "rough" else "Color"].default_value = [*color, 1.0]
    shown = surface.outputs[0]
    if material.emits():
        shown = _front_emission(nodes, links, shown, material.emission)
    links.new(shown, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return found


def _front_emission(nodes, links, surface, color):
    """The surface, and on its front the emission as well."""
    emission, black = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = [*color, 1.0]
    black.inputs["Strength"].default_value = 0.0
    side, total = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeAddShader")
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], side.inputs[0])
    links.new(emission.outputs[0], side.inputs[1])
    links.new(black.outputs[0], side.inputs[2])
    links.new(surface, total.inputs[0])
    links.new(side.outputs[0], total.inputs[1])
    return total.outputs[0]


def _mesh(name, triangles, material, smooth):
    points, corners = np.unique(np.asarray(triangles).reshape(-1, 3).round(9), axis=0, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], corners.reshape(-1, 3).tolist())
    mesh.validate()
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def _pixels(path, scene):
    image = bpy.data.images.load(path)
    image.colorspace_settings.is_data = True
    flat = np.empty(scene.width * scene.height * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(scene.height, scene.width, 4)[::-1, :, :3]


if __name__ == "__main__":
    main()
