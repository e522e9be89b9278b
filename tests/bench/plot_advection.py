#!/usr/bin/env python3
"""Draws what advection_bench measures as an SVG: time and memory of a frame against the steps before it.

Usage: plot_advection.py PROGRAM OUT.svg
"""
import json
import subprocess
import sys

WIDTH, HEIGHT, LEFT, TOP = 330, 250, 70, 50
COLOURS = {"gridless": "#c0392b", "selma": "#2471a3"}


def measure(program):
    """{method: [(steps, milliseconds, megabytes)]}, medians of three."""
    arguments = [program, "--benchmark_filter=Frame", "--benchmark_format=json",
                 "--benchmark_repetitions=3", "--benchmark_min_time=0.1",
                 "--benchmark_report_aggregates_only=true"]
    runs = json.loads(subprocess.run(arguments, check=True, capture_output=True, text=True).stdout)["benchmarks"]
    series = {}
    for run in runs:
        if run["aggregate_name"] != "median":
            continue
        name, steps = run["run_name"].split("/")[:2]
        series.setdefault(name.replace("Frame", ""), []).append((int(steps), run["real_time"], run["bytes"] / 1e6))
    return series


def panel(series, column, title, left):
    top_value = 1.08 * max(point[column] for points in series.values() for point in points)
    last = max(point[0] for points in series.values() for point in points)
    x = lambda steps: left + WIDTH * steps / last
    y = lambda value: TOP + HEIGHT * (1 - value / top_value)
    out = [f'<text x="{left + WIDTH / 2}" y="{TOP - 16}" text-anchor="middle">{title}</text>',
           f'<path d="M{left} {TOP}V{TOP + HEIGHT}H{left + WIDTH}" fill="none" stroke="#444"/>']
    for i in range(5):
        value = top_value * i / 4
        out.append(f'<path d="M{left} {y(value):.1f}h{WIDTH}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.0f}</text>')
    for steps in range(0, last + 1, 10):
        out.append(f'<text x="{x(steps):.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{steps}</text>')
    out.append(f'<text x="{left + WIDTH / 2}" y="{TOP + HEIGHT + 38}" text-anchor="middle">steps before the frame</text>')
    for name, points in series.items():
        line = " ".join(f"{x(p[0]):.1f},{y(p[column]):.1f}" for p in points)
        out.append(f'<polyline points="{line}" fill="none" stroke="{COLOURS[name]}" stroke-width="2"/>')
        out += [f'<circle cx="{x(p[0]):.1f}" cy="{y(p[column]):.1f}" r="3" fill="{COLOURS[name]}"/>' for p in points]
        end = points[-1]
        out.append(f'<text x="{x(end[0]) - 6:.1f}" y="{y(end[column]) - 8:.1f}" text-anchor="end" '
                   f'fill="{COLOURS[name]}">{name}</text>')
    return out


def main():
    program, path = sys.argv[1:]
    series = measure(program)
    for name, points in series.items():
        for steps, milliseconds, megabytes in points:
            print(f"{name:9} {steps:3} steps {milliseconds:9.1f} ms {megabytes:7.1f} MB")
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 360" font-family="sans-serif" font-size="13">',
           '<rect width="880" height="360" fill="white"/>']
    out += panel(series, 1, "milliseconds per frame", LEFT)
    out += panel(series, 2, "megabytes held", 2 * LEFT + WIDTH + 60)
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out + ["</svg>"]) + "\n")


if __name__ == "__main__":
    main()
