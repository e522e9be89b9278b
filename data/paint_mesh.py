#!/usr/bin/env python3
"""Writes a copy of an OBJ mesh as PLY, with vertex attributes painted by formulas.

usage: paint_mesh.py IN.obj OUT.ply "NAME = FORMULA"...

    python3 data/paint_mesh.py data/cloud_base.obj painted.ply \\
        "billow = ramp(h, 0.3, 0.7)" "amplitude = 1 - brush(-0.2, 1.1, 0, 0.6)"

A formula is a Python expression of
    x, y, z          the vertex in world units
    h                its height: 0 at the lowest vertex, 1 at the highest
    ramp(t, a, b)    0 for t <= a, 1 for t >= b, smooth between; a > b falls
    brush(x, y, z, r)  1 at that point, 0 from distance r on, smooth between
    sin cos exp sqrt abs min max pi, and attributes painted before
The names red, green, blue and alpha make a vertex colour of 8 bits per channel (0 to 1 in the formula); any
other name makes an attribute of 32-bit floats under that name.
"""
import math
import struct
import sys

COLOURS = ("red", "green", "blue", "alpha")


def read_obj(path):
    """Positions and faces (tuples of vertex numbers from 0) of an OBJ file."""
    positions, faces = [], []
    with open(path) as lines:
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                positions.append(tuple(float(word) for word in words[1:4]))
            elif words[0] == "f":
                numbers = [int(word.split("/")[0]) for word in words[1:]]
                faces.append(tuple(n - 1 if n > 0 else len(positions) + n for n in numbers))
    if not faces:
        raise SystemExit(f"{path}: no faces")
    return positions, faces


def ramp(t, a, b):
    s = min(max((t - a) / (b - a), 0.0), 1.0)
    return s * s * (3 - 2 * s)


def paint(positions, formulas):
    """Lists of values by name, in the order of `formulas`, which are pairs of name and expression."""
    low = min(p[1] for p in positions)
    height = max(p[1] for p in positions) - low
    known = {name: getattr(math, name) for name in ("sin", "cos", "exp", "sqrt", "pi")}
    known.update(ramp=ramp, abs=abs, min=min, max=max, __builtins__={})
    code = [(name, compile(text, name, "eval")) for name, text in formulas]
    values = {name: [] for name, _ in formulas}
    for x, y, z in positions:
        here = dict(known, x=x, y=y, z=z, h=(y - low) / height if height > 0 else 0.0)
        here["brush"] = lambda bx, by, bz, r: ramp(math.dist((x, y, z), (bx, by, bz)), r, 0)
        for name, expression in code:
            here[name] = float(eval(expression, here))
            values[name].append(here[name])
    return values


def write_ply(path, positions, faces, values):
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"property {'uchar' if name in COLOURS else 'float'} {name}" for name in values]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    with open(path, "wb") as out:
        out.write(("\n".join(header) + "\n").encode())
        for v, position in enumerate(positions):
            out.write(struct.pack("<3f", *position))
            for name, column in values.items():
                if name in COLOURS:
                    out.write(struct.pack("<B", round(255 * min(max(column[v], 0.0), 1.0))))
                else:
                    out.write(struct.pack("<f", column[v]))
        for face in faces:
            out.write(struct.pack(f"<B{len(face)}i", len(face), *face))


def main(arguments):
    if len(arguments) < 3:
        raise SystemExit(__doc__)
    formulas = []
    for argument in arguments[2:]:
        name, equals, text = (part.strip() for part in argument.partition("="))
        if not equals or not name.isidentifier() or name in ("x", "y", "z", "h"):
            raise SystemExit(f"'{argument}' is not NAME = FORMULA with a name of its own")
        formulas.append((name, text))
    positions, faces = read_obj(arguments[0])
    try:
        values = paint(positions, formulas)
    except Exception as error:
        raise SystemExit(f"a formula fails: {error}") from error
    write_ply(arguments[1], positions, faces, values)


if __name__ == "__main__":
    main(sys.argv[1:])
