"""Renders one density by one sun with Blender's Cycles; run by compare_cycles.py and reference.py.

    blender -b --factory-startup --python cycles_scene.py -- SCENE.json

SCENE.json: volume, picture (.exr), size [w, h], camera, target, up ([0, 1, 0] if it is not there), fov (horizontal, degrees),
towards_sun, irradiance (a number or [r, g, b]), sky [r, g, b], extinction, albedo, g, samples, bounces (of volumes), step_rate (steps in
voxels), filter_width (of a Blackman-Harris filter; without it a box of one pixel), threads, seed. World space is the file's own: y up
or not makes no difference.
"""

import json
import math
import os
import sys
import time

import bpy
from mathutils import Matrix, Vector

scene_file = sys.argv[sys.argv.index("--") + 1]
with open(scene_file) as file:
    wanted = json.load(file)

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene

bpy.ops.object.volume_import(filepath=wanted["volume"], directory=os.path.dirname(wanted["volume"]),
                             files=[{"name": os.path.basename(wanted["volume"])}])
volume = bpy.context.object
# Cycles reads the value of voxel i at i + 1/2, OpenVDB means it at i.
volume.matrix_world = Matrix.Translation([-wanted["voxel"] / 2] * 3)
volume.data.render.precision = "FULL"
material = bpy.data.materials.new("medium")
material.use_nodes = True
nodes = material.node_tree.nodes
nodes.clear()
# Extinction = density of the node * that of the grid; of it the share `albedo` is scattered.
medium = nodes.new("ShaderNodeVolumePrincipled")
medium.inputs["Color"].default_value = (*[wanted["albedo"]] * 3, 1)
medium.inputs["Density"].default_value = wanted["extinction"]
medium.inputs["Anisotropy"].default_value = wanted["g"]
medium.inputs["Absorption Color"].default_value = (0, 0, 0, 1)
medium.inputs["Temperature Attribute"].default_value = ""
out = nodes.new("ShaderNodeOutputMaterial")
material.node_tree.links.new(medium.outputs[0], out.inputs["Volume"])
material.cycles.volume_interpolation = "LINEAR"
volume.data.materials.append(material)


def looking(eye, along, upwards=(0, 1, 0)):
    """At `eye`, with -z along `along` and y as near `upwards` as can be."""
    back = -Vector(along).normalized()
    right = Vector(upwards).cross(back).normalized()
    up = back.cross(right)
    matrix = Matrix((right, up, back)).transposed().to_4x4()
    matrix.translation = eye
    return matrix


def add(name, data, matrix):
    thing = bpy.data.objects.new(name, data)
    thing.matrix_world = matrix
    scene.collection.objects.link(thing)
    return thing


camera = bpy.data.cameras.new("camera")
camera.sensor_fit = "HORIZONTAL"
camera.angle = math.radians(wanted["fov"])
distance = (Vector(wanted["target"]) - Vector(wanted["camera"])).length
camera.clip_start, camera.clip_end = distance / 1000, distance * 10
scene.camera = add("camera", camera, looking(wanted["camera"], Vector(wanted["target"]) - Vector(wanted["camera"]),
                                             wanted.get("up", (0, 1, 0))))

sun = bpy.data.lights.new("sun", "SUN")
irradiance = wanted["irradiance"] if isinstance(wanted["irradiance"], list) else [wanted["irradiance"]] * 3
sun.energy = max(irradiance)
sun.color = [value / sun.energy for value in irradiance]
sun.angle = 0
add("sun", sun, looking((0, 0, 0), -Vector(wanted["towards_sun"])))

world = bpy.data.worlds.new("world")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs[0].default_value = (*wanted["sky"], 1)
scene.world = world

render = scene.render
render.engine = "CYCLES"
render.resolution_x, render.resolution_y = wanted["size"]
render.resolution_percentage = 100
render.film_transparent = True
render.threads_mode, render.threads = "FIXED", wanted["threads"]
render.filepath = wanted["picture"]
render.image_settings.file_format = "OPEN_EXR"
render.image_settings.color_mode = "RGBA"
render.image_settings.color_depth = "32"
scene.view_settings.view_transform = "Raw"

cycles = scene.cycles
cycles.device = "CPU"
cycles.samples = wanted["samples"]
cycles.seed = wanted["seed"]
cycles.use_adaptive_sampling = False
cycles.use_denoising = False
cycles.pixel_filter_type = "BLACKMAN_HARRIS" if "filter_width" in wanted else "BOX"
cycles.filter_width = wanted.get("filter_width", 1)
cycles.light_sampling_threshold = 0
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
cycles.max_bounces = max(wanted["bounces"], 1)
cycles.volume_bounces = wanted["bounces"]
cycles.volume_step_rate = wanted["step_rate"]
cycles.volume_max_steps = 65536

start = time.perf_counter()
bpy.ops.render.render(write_still=True)
print(f"render_seconds {time.perf_counter() - start:.4f}")
