#!/usr/bin/env python3
"""Draws what advection_bench measures as an SVG: time and memory of a frame against the steps before it.

Usage: plot_advection.py PROGRAM OUT.svg
"""
import sys

import plot_svg


def main():
    program, path = sys.argv[1:]
    series = plot_svg.medians(program, "Frame", "real_time", "bytes")
    lines = [plot_svg.Line(name, colour, [(steps, time, held / 1e6) for steps, time, held in series[name + "Frame"]])
             for name, colour in (("gridless", "#c0392b"), ("selma", "#2471a3"))]
    for line in lines:
        for steps, milliseconds, megabytes in line.points:
            print(f"{line.label:9} {steps:3} steps {milliseconds:9.1f} ms {megabytes:7.1f} MB")
    plot_svg.write(path, lines, ["milliseconds per frame", "megabytes held"], "steps before the frame")


if __name__ == "__main__":
    main()
