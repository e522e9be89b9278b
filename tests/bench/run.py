#!/usr/bin/env python3
"""Runs every benchmark and writes what it measured: one Markdown file, and a plot of cost against size.

Usage: run.py BUILD_FOLDER RESULT_FOLDER [--mesh FILE]

Ratios come from commands run in turn (A B A B ...), so that they hold where the machine's speed drifts; every figure is a
median. vdb_tool and vdb_render (Debian's libopenvdb-tools) are the peers; where they are missing their rows are left out.
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def timed(command):
    """Wall seconds and peak memory (bytes) of one command."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    errors = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"failed: {' '.join(command)}\n{errors.decode(errors='replace')}")
    return time.perf_counter() - start, usage.ru_maxrss * 1024


def in_turn(ours, peer, runs=5):
    """Medians of both commands' seconds and of the ratio pair by pair, after one warm-up each."""
    timed(ours), timed(peer)
    pairs = [(timed(ours)[0], timed(peer)[0]) for _ in range(runs)]
    return (statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs),
            statistics.median(a / b for a, b in pairs))


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]) + "\n"


def google_benchmark(program):
    """(name, seconds per iteration, items per second) of every benchmark in `program`: medians of three repetitions."""
    text = subprocess.run([program, "--benchmark_format=json", "--benchmark_repetitions=3",
                           "--benchmark_report_aggregates_only=true", "--benchmark_min_time=0.05"],
                          capture_output=True, text=True, check=True).stdout
    unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    return [(b["run_name"], b["real_time"] * unit[b["time_unit"]], b.get("items_per_second"), b.get("label", ""))
            for b in json.loads(text)["benchmarks"] if b.get("aggregate_name") == "median"]


def micro(build):
    parts = []
    for name in sorted(os.listdir(os.path.join(build, "bin"))):
        if not name.endswith("_bench"):
            continue
        print(f"running {name}", file=sys.stderr)
        rows = [(run, f"{seconds * 1e6:.3g} us", f"{items / 1e6:.4g} M/s" if items else "", label)
                for run, seconds, items, label in google_benchmark(os.path.join(build, "bin", name))]
        parts.append(f"### {name[:-6]}\n" + table(["benchmark", "time", "items", ""], rows))
    return "\n".join(parts)


def statistics_of(command, folder):
    path = os.path.join(folder, "stats.json")
    seconds, memory = timed(command + ["--stats", path])
    with open(path) as file:
        return seconds, memory, json.load(file)


def whole_program(nephele, mesh, folder):
    rows = []
    tool = shutil.which("vdb_tool")
    cloud_options = ["--layers", "3", "--amplitude", "2.5%", "--frequency", "6x", "--resolution", "512"]
    ours_vdb, peer_vdb = os.path.join(folder, "ours.vdb"), os.path.join(folder, "peer.vdb")

    def peer(resolution):
        return [tool, "-read", mesh, "-mesh2ls", f"dim={resolution}", "-write", peer_vdb]

    if tool:
        for resolution in (256, 512):
            ours = [nephele, "levelset", mesh, "-o", ours_vdb, "--resolution", str(resolution)]
            a, b, ratio = in_turn(ours, peer(resolution))
            rows.append((f"levelset, resolution {resolution}", f"vdb_tool -mesh2ls dim={resolution}", f"{a:.2f} s",
                         f"{b:.2f} s", f"{ratio:.2f}", "at most 1.1"))
        a, b, ratio = in_turn([nephele, "cloud", mesh, "-o", ours_vdb] + cloud_options, peer(512))
        rows.append(("cloud, 3 layers, resolution 512", "vdb_tool -mesh2ls dim=512", f"{a:.2f} s", f"{b:.2f} s",
                     f"{ratio:.2f}", "at most 3"))
    return table(["ours", "peer", "ours, time", "peer, time", "ratio", "bar"], rows)


def growth(nephele, mesh, folder):
    rows, series = [], {"levelset": [], "cloud": [], "render": []}
    for resolution in (256, 512, 1024):
        vdb = os.path.join(folder, "growth.vdb")
        for verb in ("levelset", "cloud", "render"):
            if verb == "render":
                command = [nephele, "render", vdb, "-o", os.path.join(folder, "growth.exr"), "--size", "640x480"]
            else:
                command = [nephele, verb, mesh, "-o", vdb, "--resolution", str(resolution)]
            seconds, memory, stats = statistics_of(command, folder)
            if verb == "levelset":
                voxels = stats["grid"]["active_voxels"]
            elif verb == "cloud":
                voxels = stats["grid"]["active_voxels"]
            series[verb].append((voxels, seconds))
            rows.append((verb, resolution, f"{voxels / 1e6:.2f} M", f"{seconds:.2f} s",
                         f"{seconds / voxels * 1e9:.0f} ns", f"{memory / 1e9:.2f} GB"))
    rows.sort(key=lambda r: r[0])
    return table(["verb", "resolution", "active voxels", "time", "per active voxel", "peak memory"], rows), series


def against_cycles(nephele, folder):
    """One scattering in a fog, by compare_cycles.py."""
    fog = os.path.join(os.path.dirname(SOURCE), "shared/data/volumes/wdas_cloud_sixteenth_fog.vdb")
    missing = [name for name in ("blender", "oiiotool", "vdb_print") if not shutil.which(name)]
    if missing or not os.path.exists(fog):
        return f"Skipped: {', '.join(missing) or fog} is missing.\n"
    print("against Cycles", file=sys.stderr)
    script = os.path.join(SOURCE, "tests/bench/compare_cycles.py")
    return subprocess.run([sys.executable, script, os.path.abspath(nephele), os.path.join(folder, "cycles"), "--fog", fog, "--only",
                           "single"], capture_output=True, text=True, check=True).stdout


def plot(series, path):
    """A log-log plot as SVG."""
    import math
    points = [p for line in series.values() for p in line]
    x0, x1 = math.floor(math.log10(min(p[0] for p in points))), math.ceil(math.log10(max(p[0] for p in points)))
    y0, y1 = math.floor(math.log10(min(p[1] for p in points))), math.ceil(math.log10(max(p[1] for p in points)))
    left, top, width, height = 80, 30, 560, 340
    x = lambda v: left + (math.log10(v) - x0) / (x1 - x0) * width
    y = lambda v: top + height - (math.log10(v) - y0) / (y1 - y0) * height
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 780 440" font-family="sans-serif" font-size="13">',
           '<rect width="780" height="440" fill="#fff"/>']
    for e in range(x0, x1 + 1):
        out.append(f'<path d="M{x(10**e):.1f},{top} v{height}" stroke="#dde3e9"/>'
                   f'<text x="{x(10**e):.1f}" y="{top + height + 20}" text-anchor="middle">1e{e}</text>')
    for e in range(y0, y1 + 1):
        out.append(f'<path d="M{left},{y(10**e):.1f} h{width}" stroke="#dde3e9"/>'
                   f'<text x="{left - 8}" y="{y(10**e) + 4:.1f}" text-anchor="end">{10.0**e:g} s</text>')
    for colour, (name, line) in zip(("#3f8f6b", "#3c6fb0", "#b0763c"), series.items()):
        path_data = " ".join(f"{'M' if i == 0 else 'L'}{x(a):.1f},{y(b):.1f}" for i, (a, b) in enumerate(line))
        out.append(f'<path d="{path_data}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out += [f'<circle cx="{x(a):.1f}" cy="{y(b):.1f}" r="4" fill="{colour}"/>' for a, b in line]
        out.append(f'<text x="{x(line[-1][0]) + 10:.1f}" y="{y(line[-1][1]) + 4:.1f}" fill="{colour}">{name}</text>')
    out.append(f'<text x="{left + width / 2}" y="{top + height + 48}" text-anchor="middle">active voxels '
               '(resolution 256, 512, 1024)</text></svg>')
    with open(path, "w") as file:
        file.write("\n".join(out) + "\n")


def processor():
    with open("/proc/cpuinfo") as file:
        for line in file:
            if line.startswith("model name"):
                return line.split(":")[1].strip()
    return platform.processor()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build")
    parser.add_argument("results")
    parser.add_argument("--mesh")
    arguments = parser.parse_args()
    shared = os.path.join(os.path.dirname(SOURCE), "shared/data/meshes/bunny_60k.obj")
    mesh = arguments.mesh or (shared if os.path.exists(shared) else os.path.join(SOURCE, "data/cloud_base.obj"))
    nephele = os.path.join(arguments.build, "bin/nephele")
    os.makedirs(arguments.results, exist_ok=True)

    with tempfile.TemporaryDirectory() as folder:
        print("whole program", file=sys.stderr)
        programs = whole_program(nephele, mesh, folder)
        print("growth", file=sys.stderr)
        growth_table, series = growth(nephele, mesh, folder)
        cycles = against_cycles(nephele, folder)
    plot(series, os.path.join(arguments.results, "growth.svg"))
    report = "\n".join([
        f"Machine: {processor()}, {os.cpu_count()} cores. Mesh: {os.path.basename(mesh)}. Release build (-O3, no "
        "-march, SIMD chosen at run time).\n",
        "## Whole program against its peers\n", programs,
        "## Rendering against Cycles\n", cycles,
        "## Cost against size\n", growth_table,
        "## Parts\n", micro(arguments.build)])
    with open(os.path.join(arguments.results, "benchmarks.md"), "w") as file:
        file.write(report)
    print(report)


if __name__ == "__main__":
    main()
