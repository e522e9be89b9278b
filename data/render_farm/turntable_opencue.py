#!/usr/bin/env python3
"""A turntable as an OpenCue job: a layer that makes the frames in chunks, and one that makes the movie of them.

    turntable_opencue.py cloud.vdb frames/cloud.####.exr 1-48 cloud.mp4

Needs pyoutline (the package opencue-pyoutline) and a Cuebot that CUEBOT_HOSTS names. Paths must be the same on all
hosts. The last chunk may reach beyond the last frame; --only takes what is in the range.
"""
import os
import sys

import outline
import outline.cuerun
from outline.modules.shell import Shell

CHUNK = 4


def main(volume, frames, frame_range, movie):
    turntable = ["nephele", "turntable", os.path.abspath(volume), "-o", os.path.abspath(frames),
                 "--frames", frame_range, "--skip-existing"]
    job = outline.Outline("turntable", show="testing", shot="clouds", user=os.environ["USER"])
    render = Shell("frames", type="Render", range=frame_range, chunk=CHUNK, threads=4, threadable=True,
                   command=turntable + ["--only", "#FRAME_START#-#FRAME_END#"])
    job.add_layer(render)
    # One task for the whole range: all frames are there, so only the movie is made.
    last = Shell("movie", type="Util", range="1-1", command=turntable + ["--movie", os.path.abspath(movie)])
    last.depend_all(render)
    job.add_layer(last)
    outline.cuerun.launch(job, use_pycuerun=False)


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
