"""Tables, plots and pictures of tests/bench/reference.py."""
import math
import os
import subprocess
import sys
from dataclasses import dataclass

import plot_svg
from reference_pictures import BLOCK, PART, SIZE, Picture, Reference, inside, load

COLOURS = {"march": "#c0392b", "path": "#2471a3", "Cycles": "#229954"}
# What the pictures of a set are multiplied by for the screen.
EXPOSURE = {"disney": 1.0, "dense": 1.0, "cumulus": 0.8, "wisps": 1.0, "droplets": 0.8}


@dataclass
class Row:
    """One way to make a picture of a scene: seconds on two cores and errors."""
    kind: str
    label: str
    seconds: float
    errors: dict


def parts_of(options, scene):
    """[(picture, samples)], and the processor seconds of each."""
    paths = []
    while os.path.exists(path := inside(options, f"parts/{scene.name}_{len(paths)}.exr")):
        paths.append(path)
    if not paths:
        sys.exit(f"no reference of {scene.name}: --do trace makes it")
    told = [load(path[:-3] + "json") if os.path.exists(path[:-3] + "json") else {} for path in paths]
    pictures = Picture.read(*paths) if len(paths) > 1 else [Picture.read(paths[0])]
    return list(zip(pictures, (t.get("samples", PART) for t in told))), [t.get("processor", math.nan) for t in told]


def rows_of(options, scene):
    parts, seconds = parts_of(options, scene)
    reference, rows = Reference(parts), []
    names = [("march", f"`--quality {quality}`", f"march/{scene.name}_{quality}") for quality in ("draft", "good", "final")]
    names += [("path", "path, 16 samples", f"parts/{scene.name}_short")]
    names += [("Cycles", f"Cycles, {samples} samples", f"cycles/{scene.name}_{samples}") for samples in options.cycles_samples]
    names = [(kind, label, inside(options, name)) for kind, label, name in names if os.path.exists(inside(options, name + ".json"))]
    pictures = Picture.read(*(path + ".exr" for _, _, path in names)) if len(names) > 1 else []
    for (kind, label, path), picture in zip(names, pictures):
        times = load(path + ".json")
        taken = times["wall"] if options.wall and kind == "march" else times["processor"] / 2
        rows.append(Row(kind, label, taken, reference.errors(picture)))
    for count in (1, 4):
        if len(parts) >= count + 2:
            errors = Reference(parts[count:]).errors(Picture.mean_of(parts[:count]))
            rows.append(Row("path", f"path, {PART * count} samples", sum(seconds[:count]) / 2, errors))
    if len(parts) > 1:
        rows.append(Row("path", f"path, {reference.samples} samples (the reference)", sum(seconds) / 2, reference.own_errors()))
    return rows


def percent(value):
    return f"{100 * value:+.1f}"


def size(rms):
    """What is left of the square of an error may be negative where the noise of the reference is larger."""
    return f"{100 * rms:.1f}" if rms > 0 else "< noise"


def cells(errors):
    noise = f" ± {100 * errors['noise']:.1f}" if errors["noise"] else ""
    return f"{percent(errors['mean'])} / {size(errors['rms'])} / {percent(errors['worst'])}{noise} | {errors['relmse']:.2g}"


def cloud_table(by_sun):
    """Rows of the same label side by side, seconds averaged over the suns."""
    labels = list(dict.fromkeys(row.label for kind in COLOURS for rows in by_sun.values() for row in rows if row.kind == kind))
    lines = ["| | seconds | " + " | ".join(f"{sun}: mean / rms / worst, % | relMSE" for sun in by_sun) + " |",
             "|---" * (2 + 2 * len(by_sun)) + "|"]
    for label in labels:
        found = [next((row for row in rows if row.label == label), None) for rows in by_sun.values()]
        seconds = [row.seconds for row in found if row]
        lines.append(f"| {label} | {sum(seconds) / len(seconds):.2f} | " +
                     " | ".join(cells(row.errors) if row else "|" for row in found) + " |")
    return lines


def angle_table(options, found):
    lines = ["| mean cosine | sun | mean, % | rms | worst | noise | rms of bright blocks | worst | noise |", "|---" * 9 + "|"]
    for scene in found:
        reference = Reference(parts_of(options, scene)[0])
        e = reference.errors(Picture.read(inside(options, f"march/{scene.name}_good.exr")))
        cells = [scene.name.split("_")[1], scene.sun, percent(e["mean"])]
        for prefix, blocks in (("", reference.covered), ("bright_", reference.bright)):
            cells += [size(e[prefix + "rms"]), f"{percent(e[prefix + 'worst'])} ± {100 * e[prefix + 'noise']:.1f}",
                      f"{100 * reference.noise(blocks):.1f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def depth_table(options, found):
    ratios, depths = {}, list(dict.fromkeys(scene.name.split("_")[2] for scene in found))
    for scene in found:
        traced = Picture.mean_of(parts_of(options, scene)[0])
        ratios.setdefault(scene.name.split("_")[1], []).append(
            Picture.read(inside(options, f"march/{scene.name}_good.exr")).mean / traced.mean)
    return ["| optical depth of a voxel | " + " | ".join(depths) + " |", "|---" * (len(depths) + 1) + "|"] + [
        f"| mean cosine {g} | " + " | ".join(f"{ratio:.3f}" for ratio in row) + " |" for g, row in ratios.items()]


def plot(path, tables):
    """Root mean square of blocks and relMSE against seconds, means of the suns, a row of two panels for each cloud."""
    panels = []
    for group, by_sun in tables.items():
        for title, value in (("rms of blocks", lambda e: e["rms"]), ("relMSE", lambda e: e["relmse"])):
            lines = []
            for kind, colour in COLOURS.items():
                points = {}
                for rows in by_sun.values():
                    for row in rows:
                        if row.kind == kind:
                            points.setdefault(row.label, []).append((row.seconds, value(row.errors)))
                if points:
                    lines.append(plot_svg.Line(kind, colour, sorted(
                        (sum(s for s, _ in found) / len(found), sum(e for _, e in found) / len(found)) for found in points.values())))
            panels.append((f"{group}: {title}", lines))
    plot_svg.write_logarithmic(path, panels, "seconds on two cores")


def sheet(options, group, suns, out):
    """Row by row the suns; side by side path traced, marched, rendered by Cycles, and the error of what is marched by blocks: red is too
    bright, blue too dark, full at 20 %."""
    parts, width, height = [], *SIZE
    by_cycles = [""] * len(suns)
    for samples in sorted(options.cycles_samples):
        found = [inside(options, f"cycles/{scene.name}_{samples}.exr") for scene in suns]
        by_cycles = found if all(map(os.path.exists, found)) else by_cycles
    for scene, theirs in zip(suns, by_cycles):
        traced, _ = parts_of(options, scene)
        reference, marched = Reference(traced), inside(options, f"march/{scene.name}_good.exr")
        files = [inside(options, f"parts/{scene.name}_{i}.exr") for i in range(len(traced))]
        mean = inside(options, "sheet/mean.exr")
        sums = files[:1] + [word for file in files[1:] for word in (file, "--add")]
        subprocess.run(["oiiotool", *sums, "--mulc", repr(1 / len(files)), "-o", mean], check=True)
        sky = dict(zip(scene.medium[0::2], scene.medium[1::2]))["--sky"]
        for source in [mean, marched] + [theirs] * bool(theirs):
            parts.append(inside(options, f"sheet/{len(parts)}.exr"))
            subprocess.run(["oiiotool", source, "--ch", "R,G,B,A", "--pattern", f"constant:color={sky},1", f"{width}x{height}", "4",
                            "--over", "--ch", "R,G,B", "--mulc", repr(EXPOSURE[group]), "--colorconvert", "linear", "sRGB",
                            "--clamp:min=0:max=1", "--resize:filter=box", f"{2 * width}x{2 * height}", "-o", parts[-1]], check=True)
        errors, colours = Picture.read(marched), []
        for y in range(height):
            for x in range(width):
                i = y // BLOCK * -(-width // BLOCK) + x // BLOCK
                if i in reference.covered:
                    error = max(-1, min(1, (errors.blocks[i] / reference.whole.blocks[i] - 1) / 0.2))
                    colours += [int(255 * min(1, 1 + error)), int(255 * (1 - abs(error))), int(255 * min(1, 1 - error))]
                else:
                    colours += [128, 128, 128]
        with open(inside(options, "sheet/errors.ppm"), "wb") as file:
            file.write(b"P6 %d %d 255\n" % (width, height) + bytes(colours))
        parts.append(inside(options, f"sheet/{len(parts)}.exr"))
        subprocess.run(["oiiotool", inside(options, "sheet/errors.ppm"), "--resize:filter=box", f"{2 * width}x{2 * height}", "-d", "float",
                        "-o", parts[-1]], check=True)
    subprocess.run(["oiiotool", *parts, "--mosaic:pad=4", f"{len(parts) // len(suns)}x{len(suns)}", "-d", "uint8", "--quality", "88",
                    "-o", out], check=True)


def put(page, name, lines):
    """Between <!-- table NAME --> and <!-- end of table -->."""
    with open(page, encoding="utf-8") as file:
        text = file.read()
    start = text.find(f"<!-- table {name} -->\n")
    if start < 0:
        return
    start = text.index("\n", start) + 1
    end = text.index("<!-- end of table -->", start)
    with open(page, "w", encoding="utf-8") as file:
        file.write(text[:start] + "\n".join(lines) + "\n" + text[end:])


def report(options, found):
    tables = {}
    for group in dict.fromkeys(scene.group for scene in found):
        suns = [scene for scene in found if scene.group == group]
        if group in ("angle", "depth"):
            lines = (angle_table if group == "angle" else depth_table)(options, suns)
        else:
            tables[group] = {scene.sun: rows_of(options, scene) for scene in suns}
            lines = cloud_table(tables[group])
        print(f"{group}\n" + "\n".join(lines) + "\n")
        if options.page:
            put(options.page, group, lines)
    if options.page and tables:
        pictures = os.path.join(os.path.dirname(os.path.abspath(options.page)), "pictures")
        plot(os.path.join(pictures, "reference_errors.svg"), tables)
        for group in tables:
            sheet(options, group, [scene for scene in found if scene.group == group],
                  os.path.join(pictures, f"reference_{group}.jpg"))
