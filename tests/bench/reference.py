#!/usr/bin/env python3
"""Measures the light of `nephele render` against path tracing: errors and seconds of clouds under suns in front, at the side and behind.

Usage: reference.py PROGRAM FOLDER [--what SET ...] [--do STEP ...] [--parts N] [--threads N] [--page docs/reference.md]

Sets (--what):
  angle    the cloud of Walt Disney Animation Studios, one free path per voxel, mean cosine 0.3, 0.85 and 0.877, three suns
  depth    the same cloud from 0.05 to 16 free paths per voxel, mean cosine 0.3 and 0.85: the mean, marched over traced
  disney   the same cloud in the light, the view and the phase function of pbrt's scene disney-cloud, one free path per voxel
  dense    the same at the density of that scene, 13 free paths per voxel
  cumulus, wisps, droplets   three clouds of this program's own making

Steps (--do; all of them, in this order, if none is given):
  trace    path traces the references: part after part of 64 samples, each with its own seed, until a picture has what its set wants
           (--parts says how many). Parts that are in FOLDER are kept, so that this can be stopped, resumed and extended.
  march    marches at --quality draft, good and final, again every time; the least seconds of --runs count. Traces at 16 samples, once.
  cycles   renders disney and cumulus with Blender's Cycles (Debian's blender), if it is installed; kept like parts.
  report   prints the tables as Markdown; with --page, puts tables into that page between <!-- table NAME --> and <!-- end of table -->,
           and plots and pictures into the folder pictures beside it.

Errors: `mean` is that of the mean luminance of the whole picture; `rms` and `worst` are of means of blocks of 16x16 pixels that the
cloud covers by half or more; relMSE is the mean over pixels and channels of (picture - reference)^2 / (reference^2 + 0.01). Squared
errors are products of the differences to two halves of the reference with other seeds, whose noise is independent, so that it cancels in
the mean. `noise` is the root mean square of the standard error of a block of the reference, which the differences of the halves in its
pixels tell; behind `worst` stands that of the worst block. Bright blocks have at least a tenth of the light of the brightest. Where a
picture is itself made of parts, it is compared with the other parts.

How accurate the light is, in two tables, with references that are in FOLDER; make them once by --do trace:
    reference.py build/bin/nephele FOLDER --what angle depth --do march report
Needs oiiotool (Debian's openimageio-tools), and for `cumulus` a mesh (--mesh).
"""

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import time

import compare_cycles
import reference_report
from reference_pictures import PART, SIZE, inside, load, save

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
SUNS = ("front", "side", "back")
VIEW = ["--view", "25,5"]
AZIMUTHS = {"front": "45,35", "side": "115,30", "back": "195,25"}
# pbrt's scene looks from azimuth 92; its own sun is the first. Its field of view is that of the shorter side.
DISNEY_VIEW = ["--camera-position=648.064,-82.473,-63.856", "--look-at=6.021,100.043,-43.679", "--up=0.273,0.962,-0.009", "--fov", "40.67"]
DISNEY_AZIMUTHS = {"front": "65,50", "side": "182,30", "back": "262,25"}
DEPTHS = (0.05, 0.3, 1, 2, 4, 8, 16)


class Scene:
    """One cloud in one light: the options of `render`, and how many parts its reference wants."""

    def __init__(self, name, group, sun, volume, medium, view=None, parts=4):
        self.name, self.group, self.sun, self.volume, self.parts = name, group, sun, volume, parts
        self.medium, self.view = medium, view or VIEW

    def command(self, options, picture):
        return [options.program, "render", self.volume, "-o", picture, "--size", "{}x{}".format(*SIZE), *self.view, *self.medium,
                "--aov", "none", "--quiet", "--overwrite", "--threads", str(options.threads)]


def medium(extinction, albedo, phase, sun, sky):
    values = ["--albedo", ",".join([str(albedo)] * 3), "--phase", phase, "--sun", sun, "--sky", sky]
    return values + (["--extinction", str(extinction)] if extinction else [])


def clouds(options):
    """Volumes by name; those of our own are made if they are not there."""
    def made(name, *command):
        path = os.path.join(options.folder, name + ".vdb")
        if name in options.what and not os.path.exists(path):
            subprocess.run([options.program, *command, "-o", path, "--quiet"], check=True)
        return path

    return {
        "cumulus": made("cumulus", "cloud", options.mesh, "--layers", "3", "--billow", "1", "--resolution", "256"),
        "wisps": made("wisps", "wisps", "--seed", "1", "--dots", "600000", "--resolution", "256"),
        "droplets": made("droplets", "cloud", os.path.join(SOURCE, "data/cloud_base.obj"), "--resolution", "256", "--frequency", "7x",
                         "--billow", "0.7", "--seed", "7"),
    }


def scenes(options):
    volumes, found = clouds(options), []
    for g in ("0.3", "0.85", "0.877"):
        found += [Scene(f"angle_{g}_{sun}", "angle", sun, options.fog, medium(0.3, 0.9999, "hg:" + g, AZIMUTHS[sun] + ",3.6", "0,0,0"))
                  for sun in SUNS]
    for g in ("0.3", "0.85"):
        found += [Scene(f"depth_{g}_{depth}", "depth", "side", options.fog,
                        medium(depth / (10 / 3), 0.999, "hg:" + g, "90,38,3.6", "0,0,0"), parts=2) for depth in DEPTHS]
    for name, extinction in (("disney", 0.3), ("dense", 4)):
        found += [Scene(f"{name}_{sun}", name, sun, options.fog, medium(extinction, 1, "hg:0.877", DISNEY_AZIMUTHS[sun] + ",2.6,2.5,2.3",
                                                                        "0.03,0.07,0.23"), DISNEY_VIEW, 16) for sun in SUNS]
    usual = "0.1,0.17,0.28"
    ours = {"cumulus": (None, 0.99, "hg:0.3"), "wisps": (None, 0.999, "hg:0.85"), "droplets": (160, 0.9999, "mie:12")}
    for name, values in ours.items():
        found += [Scene(f"{name}_{sun}", name, sun, volumes[name], medium(*values, AZIMUTHS[sun] + ",3.6", usual), parts=16)
                  for sun in SUNS]
    return [scene for scene in found if scene.group in options.what]


def timed(command):
    """Seconds of the wall and of processors, and what the command printed."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    printed = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"failed: {' '.join(command)}\n{printed}")
    return {"wall": time.perf_counter() - start, "processor": usage.ru_utime + usage.ru_stime}, printed


def render(options, scene, name, extra, runs=1):
    """Makes FOLDER/NAME.exr, and FOLDER/NAME.json with the least seconds of `runs`."""
    picture, times = inside(options, name + ".exr"), []
    # Under another name until it is whole, so that what was stopped is made again.
    unfinished = inside(options, f"unfinished_{os.getpid()}.exr")
    for _ in range(runs):
        times.append(timed(scene.command(options, unfinished) + extra)[0])
    os.replace(unfinished, picture)
    save(inside(options, name + ".json"), {key: min(t[key] for t in times) for key in times[0]} | {"threads": options.threads})


def trace(options, scene):
    for part in range(options.parts or scene.parts):
        name = f"parts/{scene.name}_{part}"
        if not os.path.exists(inside(options, name + ".exr")):
            render(options, scene, name, ["--integrator", "path", "--samples", str(PART), "--seed", str(1 + part)])
            print(name, load(inside(options, name + ".json")), flush=True)


def march(options, scene):
    if scene.group in ("angle", "depth"):
        render(options, scene, f"march/{scene.name}_good", [])
        return
    for quality in ("draft", "good", "final"):
        render(options, scene, f"march/{scene.name}_{quality}", ["--quality", quality], options.runs)
    name = f"parts/{scene.name}_short"
    if not os.path.exists(inside(options, name + ".exr")):
        render(options, scene, name, ["--integrator", "path", "--samples", "16", "--seed", "1000"])


def camera_of(picture):
    """Extinction, eye and the axes right, up and forward, of a picture that `render` made."""
    listing = subprocess.run(["oiiotool", "--info", "-v", picture], capture_output=True, text=True, check=True).stdout
    extinction = float(re.search(r'extinction: "(.*)"', listing)[1])
    m = [float(x) for x in re.search(r"worldToCamera: (.*)", listing)[1].split(",")]
    rows, moved = [m[0:3], m[4:7], m[8:11]], m[12:15]
    return extinction, [-sum(row[i] * moved[i] for i in range(3)) for row in rows], [[row[i] for row in rows] for i in range(3)]


def cycles(options, scene):
    wanted = dict(zip(scene.medium[0::2], scene.medium[1::2]))
    if scene.group not in ("disney", "cumulus"):
        return
    shown = subprocess.run([options.program, "info", scene.volume], capture_output=True, text=True, check=True).stdout
    voxel = float(re.search(r"voxel_size: \(([^,]*)", shown)[1])
    extinction, eye, (_, up, forward) = camera_of(inside(options, f"parts/{scene.name}_0.exr"))
    azimuth, elevation, *sun = (float(x) for x in wanted["--sun"].split(","))
    azimuth, elevation = math.radians(azimuth), math.radians(elevation)
    fov = float(scene.view[scene.view.index("--fov") + 1]) if "--fov" in scene.view else 35.0
    for samples in options.cycles_samples:
        name = f"cycles/{scene.name}_{samples}"
        if os.path.exists(inside(options, name + ".json")):
            continue
        save(inside(options, "cycles/scene.json"), {
            "volume": scene.volume, "voxel": voxel, "size": SIZE, "camera": eye, "up": up,
            "target": [e + math.hypot(*eye) * f for e, f in zip(eye, forward)],
            "fov": fov, "towards_sun": [math.cos(elevation) * math.sin(azimuth), math.sin(elevation),
                                        math.cos(elevation) * math.cos(azimuth)],
            "irradiance": sun if len(sun) == 3 else sun[0], "sky": [float(x) for x in wanted["--sky"].split(",")],
            "extinction": extinction, "albedo": float(wanted["--albedo"].split(",")[0]),
            "g": float(wanted["--phase"][3:]), "samples": samples, "bounces": 1024, "step_rate": 1, "filter_width": 3.1, "seed": samples,
            "picture": inside(options, name + ".exr"), "threads": options.threads})
        seconds, printed = timed(["blender", "-b", "--factory-startup", "--python", os.path.join(HERE, "cycles_scene.py"), "--",
                                  inside(options, "cycles/scene.json")])
        seconds["inner"] = float(printed.split("render_seconds ")[1].split()[0])
        save(inside(options, name + ".json"), seconds | {"threads": options.threads})
        print(name, seconds, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    groups, steps = ("angle", "depth", "disney", "dense", "cumulus", "wisps", "droplets"), ("trace", "march", "cycles", "report")
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--what", nargs="+", choices=groups, default=groups)
    parser.add_argument("--do", nargs="+", choices=steps, default=steps)
    parser.add_argument("--parts", type=int, help="parts of 64 samples that a reference is to have")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=3, help="of what is marched; the least seconds count")
    parser.add_argument("--cycles-samples", type=int, nargs="+", default=[16, 64])
    parser.add_argument("--fog", default=os.path.join(compare_cycles.SHARED, "volumes/wdas_cloud_sixteenth_fog.vdb"))
    parser.add_argument("--mesh", default=os.path.join(compare_cycles.SHARED, "meshes/bunny_60k.obj"))
    parser.add_argument("--wall", action="store_true", help="seconds of what is marched are those of the wall, not half of the processors'")
    parser.add_argument("--page", help="Markdown page that the report goes into")
    options = parser.parse_args()
    options.program, options.folder = os.path.abspath(options.program), os.path.abspath(options.folder)
    os.makedirs(options.folder, exist_ok=True)
    if not shutil.which("oiiotool"):
        sys.exit("reference.py: oiiotool is not installed (Debian: openimageio-tools)")
    found = scenes(options)
    for step in (trace, march, cycles):
        if step.__name__ in options.do and (step is not cycles or shutil.which("blender")):
            for scene in found:
                step(options, scene)
    if "report" in options.do:
        reference_report.report(options, found)


if __name__ == "__main__":
    main()
