"""start.py PROGRAM [PROGRAM...]: how long short commands take, of the programs in turn: milliseconds, the median of 41 runs and the
span of all but a tenth at either end."""

import os
import statistics
import subprocess
import sys
import tempfile
import time

MESH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../data/sphere_uv.obj")
RUNS = 41


def milliseconds(command):
    start = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return 1000 * (time.perf_counter() - start)


def main():
    programs = sys.argv[1:]
    if not programs:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        volume = os.path.join(folder, "levels.vdb")
        for words in (
            ["--version"],
            ["info", MESH],
            ["levelset", MESH, "--resolution", "16", "-o", volume],
            ["info", volume],
        ):
            times = {program: [] for program in programs}
            for _ in range(RUNS):
                for program in programs:
                    times[program].append(milliseconds([program, *words]))
            for program in programs:
                ordered = sorted(times[program])
                edge = RUNS // 10
                print(
                    f"{words[0]:10} {os.path.basename(words[-1]):15} {program}: "
                    f"{statistics.median(ordered):.1f} ({ordered[edge]:.1f} to {ordered[-1 - edge]:.1f})"
                )


if __name__ == "__main__":
    main()
