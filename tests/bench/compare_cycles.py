#!/usr/bin/env python3
"""Compares `nephele render` with Blender's Cycles on the CPU: the same density, camera, sun and medium.

Usage: compare_cycles.py NEPHELE FOLDER [--fog FILE.vdb] [--mesh FILE.obj] [--only single|bunny] [--threads N] [--passes N]

single: one scattering (volume bounces 0) in a fog, black sky. Both are measured against converged pictures of their own kind, because
their pixel filters differ (ours a tent two pixels wide, Cycles' a box of one), and these against each other. Prints errors and times,
and the ratio of times where Cycles' error is ours. bunny: a cloud of the mesh with billow 0.67 and 2 under sun and sky, many
scatterings: times, noise (with --reference at that of another path traced picture), brightness from shade to light, and bunny.jpg,
Cycles on the left.

Pictures and times stay in FOLDER; what is there is not made again. Needs Blender (Debian's `blender`) and oiiotool.
"""

import argparse
import array
import json
import math
import os
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(HERE))), "shared/data")
BLOCKS = (8, 16, 32)


class Plane:
    """One channel of a picture."""

    def __init__(self, path, channel="G"):
        fits = path + ".fits"
        subprocess.run(["oiiotool", path, "--ch", channel, "-d", "float", "-o", fits], check=True, stderr=subprocess.DEVNULL)
        with open(fits, "rb") as file:
            content = file.read()
        os.remove(fits)
        cards = {content[i:i + 8].strip(): content[i + 10:i + 30].strip() for i in range(0, 2880, 80)}
        self.width, self.height = int(cards[b"NAXIS1"]), int(cards[b"NAXIS2"])
        self.values = array.array("f", content[2880:2880 + 4 * self.width * self.height])
        if sys.byteorder == "little":
            self.values.byteswap()

    def mean(self):
        return sum(self.values) / len(self.values)

    def blocks(self, size):
        """Means of squares of `size` pixels."""
        w = self.width
        return [sum(sum(self.values[y * w + x:y * w + x + size]) for y in range(y0, y0 + size)) / size**2
                for y0 in range(0, self.height - size + 1, size) for x in range(0, w - size + 1, size)]

    def noise(self, least):
        """Root mean square of what is not linear within 3x3 pixels, relative to their mean, where that is at least `least`: pure
        noise of standard deviation s gives s (mask 1 -2 1, -2 4 -2, 1 -2 1)."""
        w, a, squares, count = self.width, self.values, 0.0, 0
        for y in range(1, self.height - 1):
            for i in range(y * w + 1, y * w + w - 1):
                corners = a[i - w - 1] + a[i - w + 1] + a[i + w - 1] + a[i + w + 1]
                sides = a[i - w] + a[i - 1] + a[i + 1] + a[i + w]
                mean = (corners + sides + a[i]) / 9
                if mean >= least:
                    squares += ((corners - 2 * sides + 4 * a[i]) / (6 * mean))**2
                    count += 1
        return math.sqrt(squares / max(count, 1))


def mean_square(a, b):
    return sum((x - y)**2 for x, y in zip(a.values, b.values)) / len(a.values)


class Reference:
    """A converged picture from two halves, whose difference tells its noise."""

    def __init__(self, first, second):
        a, self.plane = Plane(first), Plane(second)
        self.noise = mean_square(a, self.plane) / 4
        self.plane.values = array.array("f", ((x + y) / 2 for x, y in zip(a.values, self.plane.values)))

    def error(self, path):
        """Root mean square error, less the reference's own noise."""
        return math.sqrt(max(mean_square(Plane(path), self.plane) - self.noise, 0))


def block_errors(plane, reference):
    """Relative errors of block means, root mean square and worst, in blocks of more than 2 % of the brightest."""
    text = []
    for size in BLOCKS:
        pairs = list(zip(plane.blocks(size), reference.blocks(size)))
        least = 0.02 * max(b for _, b in pairs)
        errors = [a / b - 1 for a, b in pairs if b > least]
        text.append(f"{size}x{size}: {100 * math.sqrt(sum(e * e for e in errors) / len(errors)):.1f} % rms, "
                    f"{100 * max(map(abs, errors)):.1f} % worst")
    return "; ".join(text)


class Scene:
    """What both programs render."""

    def __init__(self, options, **values):
        self.options, self.values = options, values

    def towards_sun(self):
        azimuth, elevation = (math.radians(angle) for angle in self.values["sun"])
        return [math.cos(elevation) * math.sin(azimuth), math.sin(elevation), math.cos(elevation) * math.cos(azimuth)]

    def ours(self, name, extra, runs=3):
        """(picture, seconds of the whole program, seconds of reading, light and march): best of `runs`."""
        v, picture = self.values, os.path.join(self.options.folder, name + ".exr")
        triple = ",".join([repr(v["albedo"])] * 3)
        command = [self.options.nephele, "render", v["volume"], "-o", picture, "--size", "{}x{}".format(*v["size"]),
                   "--camera-position=" + ",".join(map(repr, v["camera"])), "--look-at=" + ",".join(map(repr, v["target"])),
                   "--fov", repr(v["fov"]), "--sun", "{},{},{}".format(*v["sun"], v["irradiance"]),
                   "--sky", ",".join(map(repr, v["sky"])), "--extinction", repr(v["extinction"]), "--albedo", triple,
                   "--phase", f"hg:{v['g']}", "--aov", "none", "--quiet", "--overwrite", "--threads", str(self.options.threads)]
        return picture, *self.timed(name, command + extra, runs, lambda output, stats: stats["seconds"])

    def cycles(self, name, runs=1, **settings):
        """(picture, seconds of Blender, seconds of bpy.ops.render.render)."""
        picture = os.path.join(self.options.folder, name + ".exr")
        values = {**self.values, "towards_sun": self.towards_sun(), "picture": picture, "threads": self.options.threads, "seed": 0,
                  **settings}
        scene = os.path.join(self.options.folder, "scene.json")
        with open(scene, "w") as file:
            json.dump(values, file)
        command = ["blender", "-b", "--factory-startup", "--python", os.path.join(HERE, "cycles_scene.py"), "--", scene]
        return picture, *self.timed(name, command, runs,
                                    lambda output, stats: float(output.split("render_seconds ")[1].split()[0]))

    def timed(self, name, command, runs, inner):
        path = os.path.join(self.options.folder, name + ".times.json")
        if os.path.exists(path):
            with open(path) as file:
                return json.load(file)
        stats, best = os.path.join(self.options.folder, "stats.json"), [math.inf, math.inf]
        is_ours = command[0] == self.options.nephele
        for _ in range(runs):
            start = time.perf_counter()
            done = subprocess.run(command + (["--stats", stats] if is_ours else []), capture_output=True, text=True)
            whole = time.perf_counter() - start
            if done.returncode != 0 or not os.path.exists(os.path.join(self.options.folder, name + ".exr")):
                sys.exit(f"failed: {' '.join(command)}\n{done.stdout}{done.stderr}")
            measured = {}
            if is_ours:
                with open(stats) as file:
                    measured = json.load(file)
            best = [min(best[0], whole), min(best[1], inner(done.stdout, measured))]
        with open(path, "w") as file:
            json.dump(best, file)
        return best


def seconds_at(curve, error):
    """Where the best of a curve of (seconds, error) passes `error`, straight in logarithms; None if it does not."""
    best = []
    for seconds, e in sorted(curve):
        if not best or e < best[-1][1]:
            best.append((seconds, e))
    if error >= best[0][1]:
        return best[0][0]
    for (t0, e0), (t1, e1) in zip(best, best[1:]):
        if e1 <= error <= e0:
            share = math.log(e0 / error) / math.log(e0 / e1)
            return t0 * (t1 / t0)**share
    return None


def single(options):
    once = ["--octaves", "1"]
    scene = Scene(options, volume=options.fog, voxel=10 / 3, size=[240, 180], camera=[-11.7, 72.0, 900.0], target=[-11.7, 71.7, -45.0],
                  fov=32.0, sun=[68.0, 33.0], irradiance=3.6, sky=[0.0, 0.0, 0.0], extinction=0.3, albedo=0.99, g=0.3, bounces=0)
    paths = [scene.ours(f"paths_{seed}", ["--integrator", "path", "--scatterings", "1", "--samples", "1024", "--seed", str(seed)], 1)[0]
             for seed in (1, 2)]
    converged = [scene.cycles(f"cycles_converged_{seed}", samples=64, step_rate=0.25, seed=seed)[0] for seed in (1, 2)]
    ours_reference, cycles_reference = Reference(*paths), Reference(*converged)
    lit = [v for v in ours_reference.plane.values if v > 0]
    typical = sum(lit) / len(lit)
    print(f"One scattering, {scene.values['size'][0]}x{scene.values['size'][1]}, {options.threads} threads; mean radiance of the "
          f"fog {typical:.4f}.")
    print(f"References, Cycles / ours: mean {cycles_reference.plane.mean() / ours_reference.plane.mean():.4f}; "
          f"{block_errors(cycles_reference.plane, ours_reference.plane)}\n")
    print("| picture | error | of the mean | whole program | without start |\n|---|---|---|---|---|")

    def row(name, error, whole, inner):
        print(f"| {name} | {error:.5f} | {100 * error / typical:.1f} % | {whole:.3f} s | {inner:.3f} s |")

    curves = [[], []]
    for step_rate in (1, 0.5):
        for samples in (1, 2, 4, 8, 16, 32, 64):
            picture, *seconds = scene.cycles(f"cycles_{step_rate}_{samples}", 2 if samples < 16 else 1, samples=samples,
                                             step_rate=step_rate)
            error = cycles_reference.error(picture)
            for curve, s in zip(curves, seconds):
                curve.append((s, error))
            row(f"Cycles, step rate {step_rate}, {samples} samples", error, *seconds)
    ours = []
    for samples in (1, 2, 4, 8, 16):
        picture, *seconds = scene.ours(f"ours_{samples}", once + ["--samples", str(samples)], 5)
        ours.append((samples, picture, ours_reference.error(picture), seconds))
        row(f"nephele, {samples} samples", ours[-1][2], *seconds)
    print()
    for samples, picture, error, seconds in ours:
        ratios = []
        for curve, s in zip(curves, seconds):
            theirs = seconds_at(curve, error)
            ratios.append(f"{theirs / s:.0f}" if theirs else f"more than {max(t for t, _ in curve) / s:.0f}")
        plane = Plane(picture)
        print(f"nephele, {samples} samples: Cycles takes {ratios[0]} times as long for the same error, {ratios[1]} times without "
              f"start. Mean {plane.mean() / ours_reference.plane.mean():.4f}; {block_errors(plane, ours_reference.plane)}")


def shade(picture, reference):
    """By how many per cent `picture` is brighter in the thirds of opaque blocks of 16x16, darkest first."""
    size, opaque = 16, Plane(reference, "A").blocks(16)
    blocks = sorted((y, x) for x, y, a in zip(Plane(picture).blocks(size), Plane(reference).blocks(size), opaque) if a > 0.99)
    third = len(blocks) // 3
    parts = (blocks[:third], blocks[third:2 * third], blocks[2 * third:])
    return ", ".join(f"{100 * (sum(x for _, x in part) / sum(y for y, _ in part) - 1):+.1f} %" for part in parts)


def bunny(options):
    run = lambda *command: subprocess.run(["oiiotool", *command], check=True)
    inside = lambda name: os.path.join(options.folder, name)
    sky, parts, per_pass = [0.12, 0.2, 0.33], [], 16
    wanted = None
    if options.reference:
        run(options.reference, "--ch", "R,G,B", "--colorconvert", "sRGB", "linear", "-d", "float", "-o", inside("reference.exr"))
        wanted = Plane(inside("reference.exr")).noise(0.3)
    for billow in ("0.67", "2"):
        cloud = inside(f"bunny_{billow}.vdb")
        if not os.path.exists(cloud):
            subprocess.run([options.nephele, "cloud", options.mesh, "-o", cloud, "--layers", "4", "--amplitude", "2.5%", "--frequency",
                            "4.4x", "--roughness", "0.55", "--lacunarity", "2.1", "--billow", billow, "--billow-scale", "1",
                            "--resolution", "420", "--quiet"], check=True)
        listing = subprocess.run(["vdb_print", "-l", cloud], capture_output=True, text=True, check=True).stdout
        scene = Scene(options, volume=cloud, voxel=float(listing.split("voxel size:")[1].split()[0]), size=[560, 420],
                      camera=[1.364748, 0.379026, 3.749614], target=[0.02, 0.1, 0.0], fov=29.0, sun=[100.0, 44.0], irradiance=3.2,
                      sky=sky, extinction=120 / 0.775, albedo=0.98, g=0.3, bounces=16)
        passes = [scene.cycles(f"bunny_{billow}_cycles_{i}", samples=per_pass, step_rate=1, seed=i) for i in range(options.passes)]
        theirs, sums = inside(f"bunny_{billow}_cycles.exr"), [passes[0][0]]
        for picture, *_ in passes[1:]:
            sums += [picture, "--add"]
        run(*sums, "--mulc", repr(1 / len(passes)), "-o", theirs)
        inner = sum(p[2] for p in passes)
        whole = inner + min(p[1] - p[2] for p in passes)
        ours, *seconds = scene.ours(f"bunny_{billow}_ours", [], 3)
        paths = scene.ours(f"bunny_{billow}_paths", ["--integrator", "path", "--samples", "16"], 1)[0]
        noise = Plane(theirs).noise(0.3)
        print(f"Billow {billow}, 560x420, {options.threads} threads. Cycles, 16 bounces, {per_pass * len(passes)} samples: {whole:.1f} s, "
              f"{inner:.1f} s without start, noise {100 * noise:.1f} % where it is lit. nephele: {seconds[0]:.2f} s, {seconds[1]:.2f} s "
              f"without start, noise and structure {100 * Plane(ours).noise(0.3):.1f} %. Ratio {whole / seconds[0]:.1f}, "
              f"{inner / seconds[1]:.1f} without start.")
        if wanted:
            more = (noise / wanted)**2
            print(f"  At the noise of the reference picture, {100 * wanted:.1f} %, which falls with the root of the samples: Cycles "
                  f"{inner * more:.0f} s, ratio {inner * more / seconds[1]:.0f}.")
        print(f"  Brighter than Cycles by {shade(ours, theirs)} (darkest to brightest third); than paths without an end by "
              f"{shade(ours, paths)}; Cycles than these by {shade(theirs, paths)}.")
        for source in (theirs, ours):
            parts.append(inside(f"part_{len(parts)}.exr"))
            run(source, "--ch", "R,G,B,A", "--pattern", "constant:color={},{},{},1".format(*sky), "560x420", "4", "--over", "--ch", "R,G,B",
                "-o", parts[-1])
    run(*parts, "--mosaic:pad=4", "2x2", "--colorconvert", "linear", "sRGB", "-d", "uint8", "--quality", "88", "-o", inside("bunny.jpg"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nephele")
    parser.add_argument("folder")
    parser.add_argument("--fog", default=os.path.join(SHARED, "volumes/wdas_cloud_sixteenth_fog.vdb"))
    parser.add_argument("--mesh", default=os.path.join(SHARED, "meshes/bunny_7k.obj"))
    parser.add_argument("--reference", help="path traced picture (.png) whose noise Cycles is to have")
    parser.add_argument("--only", choices=("single", "bunny"))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--passes", type=int, default=4, help="of 16 samples, for bunny")
    options = parser.parse_args()
    for tool in ("blender", "oiiotool", "vdb_print"):
        if not shutil.which(tool):
            sys.exit(f"compare_cycles.py: {tool} is not installed (Debian: blender, openimageio-tools, libopenvdb-tools)")
    options.folder = os.path.abspath(options.folder)
    options.fog, options.mesh = os.path.abspath(options.fog), os.path.abspath(options.mesh)
    os.makedirs(options.folder, exist_ok=True)
    if options.only != "bunny":
        single(options)
    if options.only != "single":
        bunny(options)


if __name__ == "__main__":
    main()
