#!/usr/bin/env python3
"""Compares `nephele transfer` with Blender's Data Transfer modifier on the same pairs of meshes, by the same measures.

Usage: compare_data_transfer.py NEPHELE MEASURE_TRANSFER FOLDER [--only NAME]... [--meshes FOLDER]

Blender (headless, Debian's `blender`) transfers per face corner by "nearest face interpolated". The reference gets two UV layers that
hold the positions of its vertices, x and y, z and 0, which the modifier carries over as it does any UV layer: so the object's corners
learn where on the reference their texture coordinates come from, and flips, stretch and coverage follow from these points by the
library's own transferQuality. nephele's numbers are those of --stats. Blender does not align, so turned copies are hard on it.

Prints a table in Markdown; seconds are of the whole program for nephele, without pictures, and of the modifier alone for Blender.
"""

import argparse
import json
import os
import subprocess
import sys
import time

try:
    import bpy
except ImportError:
    bpy = None

HERE = os.path.dirname(os.path.abspath(__file__))
OWN = os.path.join(os.path.dirname(os.path.dirname(HERE)), "data")
SHARED = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(HERE))), "shared/data/meshes")
METHODS = {
    "closest": ["--method", "closest"],
    "fast": ["--quality", "fast"],
    "balanced": ["--quality", "balanced"],
    "best": ["--quality", "best"],
}


def in_blender(reference_path, object_path, images_path):
    import numpy

    def load(path, name):
        with open(path, "rb") as file:
            vertices, faces = numpy.fromfile(file, numpy.uint64, 2)
            positions = numpy.fromfile(file, numpy.float64, 3 * int(vertices)).reshape(-1, 3)
            corners = numpy.fromfile(file, numpy.uint32, 3 * int(faces)).reshape(-1, 3)
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(positions.tolist(), [], corners.tolist())
        item = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(item)
        return item, positions, corners.ravel()

    source, positions, corners = load(reference_path, "reference")
    target, _, target_corners = load(object_path, "object")
    for name, columns in (("xy", (0, 1)), ("z", (2, 2))):
        values = positions[corners][:, columns].astype(numpy.float32)
        source.data.uv_layers.new(name=name).data.foreach_set("uv", values.ravel())
        target.data.uv_layers.new(name=name)
    modifier = target.modifiers.new("transfer", "DATA_TRANSFER")
    modifier.object = source
    modifier.use_loop_data = True
    modifier.data_types_loops = {"UV"}
    modifier.loop_mapping = "POLYINTERP_NEAREST"
    modifier.layers_uv_select_src = "ALL"
    modifier.layers_uv_select_dst = "NAME"
    start = time.perf_counter()
    result = target.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    seconds = time.perf_counter() - start
    count = len(target_corners)
    assert len(result.loops) == count
    images = numpy.zeros((count, 3))
    for name, columns in (("xy", (0, 1)), ("z", (2, 2))):
        values = numpy.zeros(2 * count, numpy.float32)
        result.uv_layers[name].data.foreach_get("uv", values)
        for k, column in enumerate(columns):
            images[:, column] = values[k::2]
    images.tofile(images_path)
    print("SECONDS", seconds)


def blender(measure, folder, reference, item):
    paths = [os.path.join(folder, name) for name in ("reference.bin", "object.bin", "images.bin")]
    for mesh, path in zip((reference, item), paths):
        subprocess.run([measure, "dump", mesh, path], check=True)
    # Another Python first in the path would become Blender's, without numpy.
    environment = dict(os.environ, PATH="/usr/bin:/bin:" + os.environ["PATH"])
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", os.path.abspath(__file__), "--"] + paths,
                          check=True, stdout=subprocess.PIPE, text=True, env=environment)
    seconds = [float(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("SECONDS")][0]
    numbers = json.loads(subprocess.run([measure, "measure", reference, item, paths[2]], check=True, stdout=subprocess.PIPE).stdout)
    numbers["seconds"] = seconds
    return numbers


def nephele(program, folder, reference, item, options):
    stats = os.path.join(folder, "stats.json")
    subprocess.run([program, "transfer", "--from", reference, "--to", item, "-o", os.path.join(folder, "out.obj"), "--attributes", "uv",
                    "--stats", stats, "--quiet"] + options, check=True, stderr=subprocess.DEVNULL)
    with open(stats) as file:
        return json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("nephele")
    parser.add_argument("measure")
    parser.add_argument("folder")
    parser.add_argument("--only", action="append")
    parser.add_argument("--meshes", default=SHARED)
    options = parser.parse_args()
    os.makedirs(options.folder, exist_ok=True)
    stretch = lambda value: "%.2f" % value if value < 1000 else "> 1000"
    shared = lambda name: os.path.join(options.meshes, name)
    pairs = [("sphere to tori and cone", os.path.join(OWN, "sphere_uv.obj"), os.path.join(OWN, "linked_tori_and_cone.obj")),
             ("spot to its remesh", shared("spot_uv.obj"), shared("spot_remesh_23k.obj"))]
    for degrees, scale in ((30, 1.4), (90, 0.5), (150, 2.0)):
        path = os.path.join(options.folder, "spot_turned_%d.obj" % degrees)
        subprocess.run([options.measure, "turn", shared("spot_uv.obj"), str(degrees), str(scale), path], check=True)
        pairs.append(("spot turned %d°, times %g" % (degrees, scale), shared("spot_uv.obj"), path))
    pairs += [("sphere to bunny", os.path.join(OWN, "sphere_uv.obj"), shared("bunny_60k.obj")),
              ("bob to torus", shared("bob_uv_genus1.obj"), shared("torus_genus1.obj")),
              ("spot to bob", shared("spot_uv.obj"), shared("bob_uv_genus1.obj")),
              ("bunny 28k to bunny 60k", shared("bunny_28k_uv.ply"), shared("bunny_60k.obj"))]
    print("| pair | method | turned over | collapsed | stretch median | stretch 95 % | coverage | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    for name, reference, item in pairs:
        if options.only and not any(text in name for text in options.only):
            continue
        rows = [("Blender", blender(options.measure, options.folder, reference, item))]
        rows += [(method, nephele(options.nephele, options.folder, reference, item, more)) for method, more in METHODS.items()]
        for method, n in rows:
            print("| %s | %s | %.2f %% | %.2f %% | %s | %s | %.1f %% | %.2f |" % (
                name if method == "Blender" else "", method, 100 * n["flipped_fraction"], 100 * n["degenerate_fraction"],
                stretch(n["stretch_median"]), stretch(n["stretch_p95"]), 100 * n["coverage"], n["seconds"]))
        sys.stdout.flush()


if bpy:
    in_blender(*sys.argv[sys.argv.index("--") + 1:])
else:
    main()
