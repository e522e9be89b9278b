#!/usr/bin/env python3
"""Measures what the module for Python costs beside C++: fields at 10^7 points, a grid of 512^3 as arrays, import, render.

Usage: python_bench.py BUILD_FOLDER, with BUILD_FOLDER/python on Python's path. Figures are those of the fastest of several
runs, in turn with what they are compared with; of fields, medians of 25 such pairs.
"""
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import nephele


def fastest(work, runs=7):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def fields(build):
    points = np.random.default_rng(1).uniform(-2, 2, (10_000_000, 3)).astype(np.float32)
    ball = nephele.sphere((0, 0, 0), 1)
    cloud = ball + 0.1 * abs(nephele.fractalsum(4, 3.0))
    columns, values = np.asfortranarray(points), np.zeros(len(points), np.float32)
    made = {"cloud, new_array": lambda: cloud(points), "sphere, new_array": lambda: ball(points),
            "sphere, written_again": lambda: ball(points, out=values), "sphere, columns_written_again": lambda: ball(columns, out=values)}
    pairs = {name: [] for name in made}
    for _ in range(25):
        lines = subprocess.run([os.path.join(build, "bin/python_peer")], capture_output=True, text=True, check=True).stdout
        its = dict(line.rsplit(" ", 1) for line in lines.splitlines())
        for name, work in made.items():
            pairs[name].append((fastest(work), float(its[name])))
    for name, times in pairs.items():
        mine, peer = (100 * statistics.median(column) for column in zip(*times))
        ratios = sorted(a / b for a, b in times)
        print(f"{name.replace('_', ' ')}, 10^7 points: {mine:.2f} ns per point, C++ {peer:.2f}, {statistics.median(ratios):.3f} times "
              f"({ratios[0]:.3f} to {ratios[-1]:.3f}), medians of {len(times)} pairs")


def grids():
    shell = nephele.shell(nephele.sphere((0, 0, 0), 1), 0.1)
    grid = nephele.mask(shell, 0.01).bake(2.1 / 512, (-1.05,) * 3, (1.05,) * 3, background=0)
    print(f"grid of 512^3, {grid.info()['active_voxels'] / 1e6:.1f} million active voxels")
    first = fastest(lambda: grid.bricks, 20)
    values = grid.bricks[0]
    print(f"  bricks: {values.nbytes / 1e6:.0f} MB seen in {1e6 * first:.0f} microseconds, no copy: {not values.flags.owndata}")
    box = ((-256,) * 3, (256,) * 3)
    dense = grid.to_array(box)
    copied, made = [], []
    for _ in range(5):
        copied.append(fastest(lambda: dense.copy(order="K"), 1))
        made.append(fastest(lambda: grid.to_array(box), 1))
    print(f"  dense array of {dense.nbytes / 1e6:.0f} MB: {min(made):.3f} s, copy of it by numpy: {min(copied):.3f} s, "
          f"{min(made) / min(copied):.2f} times")


def imports():
    def run(code):
        subprocess.run([sys.executable, "-c", code], check=True)

    run("import nephele")
    pairs = [(fastest(lambda: run("import nephele"), 1), fastest(lambda: run("import numpy"), 1), fastest(lambda: run(""), 1))
             for _ in range(9)]
    whole, numpy_alone, empty = (statistics.median(column) for column in zip(*pairs))
    print(f"import nephele: {whole - empty:.3f} s, of which numpy {numpy_alone - empty:.3f} s")


def renders(build):
    program = os.path.join(build, "bin/nephele")
    with tempfile.TemporaryDirectory() as folder:
        volume, picture = os.path.join(folder, "cloud.vdb"), os.path.join(folder, "cloud.exr")
        nephele.cloud(species="congestus", resolution=300, output=volume)
        command = [program, "render", volume, "-o", picture, "--size", "960x540", "--quiet"]
        mine, its = [], []
        for _ in range(5):
            its.append(fastest(lambda: subprocess.run(command, check=True), 1))
            mine.append(fastest(lambda: nephele.render(volume, size=(960, 540), output=picture), 1))
        print(f"render 960x540: {min(mine):.3f} s, program {min(its):.3f} s, {min(mine) / min(its):.3f} times")


def main(build):
    fields(build)
    grids()
    imports()
    renders(build)


if __name__ == "__main__":
    main(sys.argv[1])
