#!/usr/bin/env python3
"""Draws what pieces_bench measures as an SVG: time against the number of planes, beside the pieces there are.

The time is that of all processors together, which other programs do not change much.

Usage: plot_cutting.py PROGRAM OUT.svg
"""
import json
import subprocess
import sys

WIDTH, HEIGHT, LEFT, TOP = 330, 250, 70, 50
SERIES = {"planes": ("level sets", "#2471a3"), "exactPlanes": ("exact meshes", "#c0392b")}


def measure(program):
    """{benchmark: [(planes, milliseconds, pieces)]}, medians of three."""
    arguments = [program, "--benchmark_filter=^(planes|exactPlanes)/", "--benchmark_format=json",
                 "--benchmark_repetitions=3", "--benchmark_min_time=0.1", "--benchmark_report_aggregates_only=true"]
    runs = json.loads(subprocess.run(arguments, check=True, capture_output=True, text=True).stdout)["benchmarks"]
    series = {}
    for run in runs:
        if run["aggregate_name"] != "median":
            continue
        name, planes = run["run_name"].split("/")[:2]
        series.setdefault(name, []).append((int(planes), run["cpu_time"], run["pieces"]))
    return series


def panel(series, column, title, left):
    top_value = 1.08 * max(point[column] for points in series.values() for point in points)
    last = max(point[0] for points in series.values() for point in points)
    x = lambda planes: left + WIDTH * planes / last
    y = lambda value: TOP + HEIGHT * (1 - value / top_value)
    out = [f'<text x="{left + WIDTH / 2}" y="{TOP - 16}" text-anchor="middle">{title}</text>',
           f'<path d="M{left} {TOP}V{TOP + HEIGHT}H{left + WIDTH}" fill="none" stroke="#444"/>']
    for i in range(5):
        value = top_value * i / 4
        out.append(f'<path d="M{left} {y(value):.1f}h{WIDTH}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.0f}</text>')
    for planes in range(0, last + 1, 10):
        out.append(f'<text x="{x(planes):.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{planes}</text>')
    out.append(f'<text x="{left + WIDTH / 2}" y="{TOP + HEIGHT + 38}" text-anchor="middle">planes</text>')
    if column == 2:
        doubling = " ".join(f"{x(n / 8):.1f},{y(2 ** (n / 8)):.1f}" for n in range(8 * 40) if 2 ** (n / 8) < top_value)
        out.append(f'<polyline points="{doubling}" fill="none" stroke="#888" stroke-dasharray="4 3"/>')
        out.append(f'<text x="{x(13):.1f}" y="{TOP + 14}" fill="#666">2^N</text>')
    for name, points in series.items():
        label, colour = SERIES[name]
        line = " ".join(f"{x(p[0]):.1f},{y(p[column]):.1f}" for p in points)
        out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out += [f'<circle cx="{x(p[0]):.1f}" cy="{y(p[column]):.1f}" r="3" fill="{colour}"/>' for p in points]
        row = TOP + 16 + 18 * list(SERIES).index(name)
        out.append(f'<text x="{left + 12}" y="{row}" fill="{colour}">{label}</text>')
    return out


def main():
    program, path = sys.argv[1:]
    series = measure(program)
    for name, points in series.items():
        for planes, milliseconds, pieces in points:
            print(f"{SERIES[name][0]:13} {planes:3} planes {milliseconds:9.1f} ms {pieces:6.0f} pieces")
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 360" font-family="sans-serif" font-size="13">',
           '<rect width="880" height="360" fill="white"/>']
    out += panel(series, 1, "milliseconds, all processors together", LEFT)
    out += panel(series, 2, "pieces", 2 * LEFT + WIDTH + 60)
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out + ["</svg>"]) + "\n")


if __name__ == "__main__":
    main()
