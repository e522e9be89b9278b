#!/usr/bin/env python3
"""Runs every ```felt sample of pages as a script of its own, in a folder that has data/, and fails where one of them does.

Usage: felt_samples.py PROGRAM PAGE...
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def main(program, *pages):
    failed = 0
    for page in pages:
        samples = re.findall(r"^```felt\n(.*?)^```$", open(page, encoding="utf-8").read(), re.S | re.M)
        if not samples:
            print(f"{page}: has no sample")
            failed = 1
        for number, sample in enumerate(samples, 1):
            with tempfile.TemporaryDirectory(prefix="nephele_felt_") as folder:
                (Path(folder) / "data").symlink_to(Path("data").resolve())
                done = subprocess.run([program, "felt", "run", "-"], input=sample, text=True, capture_output=True, cwd=folder)
            if done.returncode or "error" in done.stderr:
                print(f"{page}, sample {number}:\n{done.stderr}")
                failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
