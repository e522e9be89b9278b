#!/usr/bin/env python3
"""Draws what pieces_bench measures as an SVG: time against the number of planes, beside the pieces there are.

The time is that of all processors together, which other programs do not change much.

Usage: plot_cutting.py PROGRAM OUT.svg
"""
import sys

import plot_svg


def main():
    program, path = sys.argv[1:]
    series = plot_svg.medians(program, "^(planes|exactPlanes)/", "cpu_time", "pieces")
    lines = [plot_svg.Line("level sets", "#2471a3", series["planes"]),
             plot_svg.Line("exact meshes", "#c0392b", series["exactPlanes"])]
    for line in lines:
        for planes, milliseconds, pieces in line.points:
            print(f"{line.label:13} {planes:3} planes {milliseconds:9.1f} ms {pieces:6.0f} pieces")
    plot_svg.write(path, lines, ["milliseconds, all processors together", "pieces"], "planes", "2^N")


if __name__ == "__main__":
    main()
