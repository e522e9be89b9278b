#!/usr/bin/env python3
"""Runs the commands of a page as they are printed, at small sizes, and fails where one of them does.

Usage: docs_commands.py PROGRAM EXAMPLES PAGE...

Commands are blocks of ```sh, indented blocks in which a line begins with `nephele `, and the example at the end of a help text. All of a page
run one after the other in a folder of its own that has data/, docs/recipes/ and examples/ as a checkout has them after `make examples`.
A block after the line <!-- not run: WHY --> is left out.
"""
import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NOT_RUN = re.compile(r"<!-- not run: \S.*-->")

# Counts are at most these; where they are not given, these are added.
LARGEST = {"--resolution": 40, "--set cells": 24, "--dots": 2000, "--guides": 12, "--samples": 2, "--layers": 1, "--faces": 3000, "--iterations": 2,
           "--bake-samples": 1}
ADDED = {
    "cloud": {"--resolution": "40", "--layers": "1"},
    "levelset": {"--resolution": "40"},
    "wisps": {"--resolution": "40", "--dots": "2000"},
    "cut": {"--size": "64x48"},
    "transfer": {"--resolution": "40", "--size": "64x32", "--quality": "fast"},
    "render": {"--size": "64x36", "--quality": "draft"},
    "turntable": {"--size": "64x36", "--quality": "draft"},
}
# Without a picture these verbs refuse a size.
MAY_HAVE_PICTURE = ("cut", "transfer")
# Where the second is given, the first is not added.
OTHERS = {"--resolution": "--voxel-size"}


def blocks(lines):
    """First line (from 0), and lines of each block of commands without its indent."""
    skip = False
    i = 0
    while i < len(lines):
        line = lines[i]
        start = i
        if line.startswith("```"):
            i += 1
            while i < len(lines) and not lines[i].startswith("```"):
                i += 1
            body = lines[start + 1:i]
            i += 1
            if line == "```sh" and not skip:
                yield start + 1, body
            elif line == "```text" and "Example:" in body:
                at = body.index("Example:") + 1
                yield start + 1 + at, [l.strip() for l in body[at:]]
        elif line.startswith("    ") and (i == 0 or not lines[i - 1].strip() or NOT_RUN.fullmatch(lines[i - 1])):
            while i < len(lines) and (lines[i].startswith("    ") or not lines[i].strip()):
                i += 1
            body = [l[4:] for l in lines[start:i]]
            if any(l.lstrip().startswith("nephele ") for l in body) and not skip:
                yield start, body
        else:
            i += 1
            if line.strip():
                skip = NOT_RUN.fullmatch(line) is not None
            continue
        skip = False


def first_two(frames):
    """The first two frames of a range such as 1-48 or 1001-1100x2."""
    match = re.fullmatch(r"(-?\d+)-(-?\d+)(x(\d+))?", frames)
    if not match:
        return frames
    first, last, step = int(match[1]), int(match[2]), int(match[4] or 1)
    return f"{first}-{min(last, first + step)}" + (match[3] or "")


def smaller(option, value, width):
    if option in LARGEST and value.isdigit():
        return str(min(int(value), LARGEST[option]))
    if option == "--set" and "=" in value:
        name, number = value.split("=", 1)
        return f"{name}={smaller(f'--set {name}', number, width)}"
    if option in ("--size", "--bake-size") and re.fullmatch(r"\d+x\d+", value):
        wide, high = map(int, value.split("x"))
        return f"{width}x{max(1, width * high // wide)}" if wide > width else value
    if option in ("--frames", "--only"):
        return first_two(value)
    if option in ("--quality", "--light-quality"):
        return {"best": "fast", "balanced": "fast", "good": "draft", "final": "draft"}.get(value, value)
    return value


def small_arguments(arguments):
    verb = arguments[0] if arguments else ""
    # Scripts may move their fields without a grid, which takes as many evaluations for each sample as they have steps.
    width = 20 if any(a.endswith(".felt") for a in arguments) else 64
    small = []
    for argument in arguments:
        before = small[-1] if small else ""
        if "=" in argument and argument.startswith("--"):
            option, value = argument.split("=", 1)
            small.append(f"{option}={smaller(option, value, width)}")
        else:
            small.append(smaller(before, argument, width))
    given = {a.split("=")[0] for a in small}
    for option, value in ADDED.get(verb, {}).items():
        if option in given or OTHERS.get(option) in given:
            continue
        if option == "--size" and verb in MAY_HAVE_PICTURE and not given & {"--preview", "--contact-sheet"}:
            continue
        small += [option, value]
    return small


def run(program, examples, page):
    """Whether all commands of `page` did what they should."""
    lines = page.read_text().split("\n")
    script = [""] * (len(lines) + 1)
    for start, body in blocks(lines):
        script[start:start + len(body)] = body
    # Line N of the script is line N of the page.
    script[0] = 'trap \'echo "$LINENO" >"$FAILED_LINE"\' ERR; set -eE; ' + script[0]
    with tempfile.TemporaryDirectory(prefix="nephele_docs_") as folder:
        work = Path(folder) / "work"
        (work / "docs").mkdir(parents=True)
        (work / "data").symlink_to(ROOT / "data")
        (work / "docs" / "recipes").symlink_to(ROOT / "docs" / "recipes")
        (work / "examples").symlink_to(examples)
        wrapper = Path(folder) / "bin" / "nephele"
        wrapper.parent.mkdir()
        wrapper.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{__file__}" --run "{program}" "$@"\n')
        wrapper.chmod(0o755)
        (Path(folder) / "script").write_text("\n".join(script))
        failed_line = Path(folder) / "failed_line"
        environment = {**os.environ, "PATH": f"{wrapper.parent}:{os.environ['PATH']}", "FAILED_LINE": str(failed_line)}
        result = subprocess.run(["bash", str(Path(folder) / "script")], cwd=work, env=environment, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if result.returncode == 0:
            return True
        line = failed_line.read_text().strip() if failed_line.exists() else "?"
        print(f"{page}:{line}: this command fails: {lines[int(line) - 1].strip() if line.isdigit() else ''}")
        print("\n".join(result.stdout.split("\n")[-12:]))
        return False


def look(program, arguments):
    """Starts the viewer, and ends it once it has said its address."""
    with subprocess.Popen([program, "look", "--no-browser", *arguments], stdout=subprocess.PIPE, text=True) as child:
        address = child.stdout.readline()
        if not address:
            return child.wait()
        print(address, end="")
        child.send_signal(signal.SIGINT)
        child.stdout.read()
    return 0 if address.startswith("http://") else 1


def main():
    if sys.argv[1] == "--run":
        program = sys.argv[2]
        if sys.argv[3:4] == ["look"]:
            return look(program, small_arguments(sys.argv[3:])[1:])
        os.execv(program, [program, *small_arguments(sys.argv[3:])])
    program, examples = (Path(a).resolve() for a in sys.argv[1:3])
    good = [run(program, examples, Path(page)) for page in sys.argv[3:]]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
