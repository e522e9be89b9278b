"""Two panels side by side as an SVG: what a benchmark measures against a count."""
import json
import math
import subprocess
from dataclasses import dataclass

WIDTH, HEIGHT, LEFT, TOP, GAP = 330, 250, 70, 50, 60


@dataclass
class Line:
    label: str
    colour: str
    # (count, value of the left panel, value of the right panel)
    points: list


def medians(program, pattern, time, extra):
    """{benchmark: [(count, time, extra)]}, medians of three runs."""
    arguments = [program, f"--benchmark_filter={pattern}", "--benchmark_format=json", "--benchmark_repetitions=3",
                 "--benchmark_min_time=0.1", "--benchmark_report_aggregates_only=true"]
    runs = json.loads(subprocess.run(arguments, check=True, capture_output=True, text=True).stdout)["benchmarks"]
    series = {}
    for run in runs:
        if run["aggregate_name"] == "median":
            name, count = run["run_name"].split("/")[:2]
            series.setdefault(name, []).append((int(count), run[time], run[extra]))
    return series


def curve(points, colour):
    """A line through places on the picture, with a dot at each."""
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return [f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>',
            *(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points)]


def panel(lines, column, title, counted, left, doubling=None):
    top_value = 1.08 * max(point[column] for line in lines for point in line.points)
    last = max(point[0] for line in lines for point in line.points)
    x = lambda count: left + WIDTH * count / last
    y = lambda value: TOP + HEIGHT * (1 - value / top_value)
    out = [f'<text x="{left + WIDTH / 2}" y="{TOP - 16}" text-anchor="middle">{title}</text>',
           f'<path d="M{left} {TOP}V{TOP + HEIGHT}H{left + WIDTH}" fill="none" stroke="#444"/>']
    for i in range(5):
        value = top_value * i / 4
        out.append(f'<path d="M{left} {y(value):.1f}h{WIDTH}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.0f}</text>')
    for count in range(0, last + 1, 10):
        out.append(f'<text x="{x(count):.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{count}</text>')
    out.append(f'<text x="{left + WIDTH / 2}" y="{TOP + HEIGHT + 38}" text-anchor="middle">{counted}</text>')
    if doubling:
        path = " ".join(f"{x(n / 8):.1f},{y(2 ** (n / 8)):.1f}" for n in range(8 * last) if 2 ** (n / 8) < top_value)
        out.append(f'<polyline points="{path}" fill="none" stroke="#888" stroke-dasharray="4 3"/>')
        out.append(f'<text x="{x(13):.1f}" y="{TOP + 14}" fill="#666">{doubling}</text>')
    for row, line in enumerate(lines):
        out += curve([(x(p[0]), y(p[column])) for p in line.points], line.colour)
        out.append(f'<text x="{left + 12}" y="{TOP + 16 + 18 * row}" fill="{line.colour}">{line.label}</text>')
    return out


def write(path, lines, titles, counted, doubling=None):
    """`doubling`: the label of a curve 2^count in the right panel."""
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 360" font-family="sans-serif" font-size="13">',
           '<rect width="880" height="360" fill="white"/>']
    out += panel(lines, 1, titles[0], counted, LEFT)
    out += panel(lines, 2, titles[1], counted, 2 * LEFT + WIDTH + GAP, doubling)
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out + ["</svg>"]) + "\n")


def logarithmic_panel(lines, title, counted, left, top):
    """As `panel`, of (x, y), both in powers of ten; what is not above zero is left out."""
    kept = [Line(line.label, line.colour, [p for p in line.points if min(p) > 0]) for line in lines]
    spans = []
    for column in (0, 1):
        logs = [math.log10(point[column]) for line in kept for point in line.points]
        spans.append((math.floor(min(logs) - 0.05), math.ceil(max(logs) + 0.05)))
    (x0, x1), (y0, y1) = spans
    x = lambda value: left + WIDTH * (math.log10(value) - x0) / (x1 - x0)
    y = lambda value: top + HEIGHT * (1 - (math.log10(value) - y0) / (y1 - y0))
    out = [f'<text x="{left + WIDTH / 2}" y="{top - 16}" text-anchor="middle">{title}</text>',
           f'<path d="M{left} {top}V{top + HEIGHT}H{left + WIDTH}" fill="none" stroke="#444"/>']
    for power in range(y0, y1 + 1):
        at = y(10.0**power)
        out.append(f'<path d="M{left} {at:.1f}h{WIDTH}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{at + 4:.1f}" text-anchor="end">{10.0**power:g}</text>')
    for power in range(x0, x1 + 1):
        at = x(10.0**power)
        out.append(f'<path d="M{at:.1f} {top}v{HEIGHT}" stroke="#ddd"/>'
                   f'<text x="{at:.1f}" y="{top + HEIGHT + 18}" text-anchor="middle">{10.0**power:g}</text>')
    out.append(f'<text x="{left + WIDTH / 2}" y="{top + HEIGHT + 36}" text-anchor="middle">{counted}</text>')
    for row, line in enumerate(kept):
        out += curve([(x(p[0]), y(p[1])) for p in line.points], line.colour)
        out.append(f'<text x="{left + WIDTH - 8}" y="{top + 18 + 18 * row}" text-anchor="end" fill="{line.colour}">{line.label}</text>')
    return out


def write_logarithmic(path, panels, counted):
    """`panels`, (title, lines), in rows of two."""
    height = (len(panels) + 1) // 2 * (HEIGHT + 100) + 10
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 {height}" font-family="sans-serif" font-size="13">',
           f'<rect width="880" height="{height}" fill="white"/>']
    for i, (title, lines) in enumerate(panels):
        out += logarithmic_panel(lines, title, counted, LEFT + i % 2 * (LEFT + WIDTH + GAP), TOP + i // 2 * (HEIGHT + 100))
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out + ["</svg>"]) + "\n")
