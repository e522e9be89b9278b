#!/usr/bin/env python3
"""Drives `nephele look` through its protocol and prints how long pictures take: first ones, drags, changes.

Usage: look.py PROGRAM INPUT [OPTIONS of look ...]
"""
import http.client
import json
import random
import statistics
import struct
import subprocess
import sys
import threading
import time
import urllib.parse


class Viewer:
    """A running `nephele look` and one page of it."""

    def __init__(self, program, arguments):
        self.started = time.time()
        self.process = subprocess.Popen([program, "look", *arguments, "--no-browser", "--port", "8200"],
                                        stdout=subprocess.PIPE, text=True)
        self.address = urllib.parse.urlparse(self.process.stdout.readline().strip())
        self.revision = 0
        self.messages = []
        self.changed = threading.Condition()
        self.poster = http.client.HTTPConnection(self.address.hostname, self.address.port)
        self.reader = http.client.HTTPConnection(self.address.hostname, self.address.port)
        self.reader.request("GET", self.address.path + "stream?page=bench")
        self.response = self.reader.getresponse()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        try:
            while True:
                head = self.response.read(8)
                if len(head) < 8:
                    return
                text, payload = struct.unpack("<II", head)
                message = json.loads(self.response.read(text)) if text else {}
                message["payload"] = self.response.read(payload) if payload else b""
                message["at"] = time.time()
                with self.changed:
                    self.messages.append(message)
                    self.changed.notify_all()
        except (http.client.HTTPException, OSError, ValueError, AttributeError):
            return

    def post(self, name, body):
        # The server ends connections that rest, which they do while a picture is waited for.
        self.poster.close()
        self.poster.request("POST", self.address.path + name, json.dumps(body), {"Content-Type": "application/json"})
        response = self.poster.getresponse()
        return response.status, json.loads(response.read())

    def ask(self, settings, size=(640, 360), hurry=False, show=None):
        self.revision += 1
        at = time.time()
        status, answer = self.post("settings", {"page": "bench", "revision": self.revision, "settings": settings,
                                                "size": list(size), "hurry": hurry, "show": show or {}})
        if status != 200:
            raise SystemExit(f"{status}: {answer}")
        return self.revision, at

    def wait(self, kind, revision, test=lambda message: True, seconds=60):
        end = time.time() + seconds
        with self.changed:
            while True:
                for message in self.messages:
                    if message.get("revision") == revision and message.get("type") == "error":
                        raise SystemExit(message["message"])
                    if message.get("type") == kind and message.get("revision") == revision and test(message):
                        return message
                if not self.changed.wait(end - time.time()):
                    raise SystemExit(f"no {kind} of {revision}")

    def picture(self, settings, **how):
        revision, at = self.ask(settings, **how)
        return self.wait("picture", revision)["at"] - at

    def final(self, settings, **how):
        revision, at = self.ask(settings, **how)
        return self.wait("picture", revision, lambda message: message["final"])["at"] - at

    def processor(self):
        with open(f"/proc/{self.process.pid}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / 100

    def peak(self):
        with open(f"/proc/{self.process.pid}/status") as file:
            return [int(line.split()[1]) / 1024 for line in file if line.startswith("VmHWM")][0]

    def end(self):
        at = time.time()
        self.process.terminate()
        self.process.wait()
        return time.time() - at


def dragged(viewer, what, settings):
    """How long pictures of surfaces take while their view is dragged."""
    how = {"size": (1280, 720), "show": {"what": what}}
    viewer.final(settings, **how)
    views = [viewer.picture({**settings, "render": {"view": f"{25 + 3 * i},5"}}, hurry=True, **how) for i in range(15)]
    size = [f"{m['width']}x{m['height']}" for m in viewer.messages if m.get("type") == "picture"][-1]
    print(f"{what + ' dragged':16}         {1000 * statistics.median(views):7.1f} ms in the median, "
          f"{len(views) / sum(views):.1f} a second, {size}")


def cancelling(viewer):
    """How long work takes to give up, of every kind and at random moments of it, for what is newer."""
    moments = random.Random(1)
    kinds = {"cloud": (20, lambda i: {"settings": {"cloud": {"amplitude": f"{3 + i / 100}%"}}}),
             "shape": (6, lambda i: {"settings": {"cloud": {"subdivide": str(i % 2), "amplitude": f"{5 + i / 100}%"}}}),
             "sun": (8, lambda i: {"settings": {"render": {"sun": [f"{30 + 7 * i},30"]}}}),
             "camera": (8, lambda i: {"settings": {"render": {"view": f"{10 + 7 * i},5"}}, "size": (1920, 1080)}),
             "surface": (6, lambda i: {"settings": {"cloud": {"amplitude": f"{4 + i / 100}%"}}, "size": (1280, 720),
                                        "show": {"what": "surface"}}),
             "pieces": (8, lambda i: {"settings": {"cut": {"voronoi": f"{20 + i}"}}, "show": {"what": "pieces"}})}
    every = []
    for name, (count, change) in kinds.items():
        viewer.final(**change(0))
        whole, waits = viewer.final(**change(1)), []
        for i in range(2, count + 2):
            viewer.ask(**change(i))
            time.sleep(moments.uniform(0, whole))
            newer, _ = viewer.ask({"render": {"exposure": str(i / 10)}}, hurry=True)
            waits.append(1000 * viewer.wait("picture", newer)["waited"])
        every += waits
        print(f"ended for newer, {name:8}{statistics.median(waits):7.1f} ms in the median, {max(waits):.1f} at most, "
              f"of {count}")
    print(f"ended for newer, all     {statistics.median(every):7.1f} ms in the median, {max(every):.1f} at most, of {len(every)}")


def main():
    program, arguments = sys.argv[1], sys.argv[2:]
    viewer = Viewer(program, arguments)
    first, at = viewer.ask({})
    message = viewer.wait("picture", first)
    print(f"first picture            {message['at'] - viewer.started:7.3f} s after the start ({message['stage']}, "
          f"{message['width']}x{message['height']})")
    message = viewer.wait("picture", first, lambda message: message["final"])
    print(f"final picture            {message['at'] - viewer.started:7.3f} s")
    camera = message["camera"]

    drags = []
    for i in range(40):
        angle = 25 + 2 * i
        drags.append(viewer.picture({"render": {"view": f"{angle},5"}}, hurry=True))
    sizes = [f"{m['width']}x{m['height']}" for m in viewer.messages if m.get("type") == "picture"][-1]
    print(f"camera drag              {1000 * statistics.median(drags):7.1f} ms in the median, {1000 * max(drags):.0f} at most, "
          f"{len(drags) / sum(drags):.1f} a second, {sizes}")
    print(f"camera, at rest          {1000 * viewer.final({'render': {'view': '25,5'}}):7.1f} ms")
    suns = [viewer.picture({"render": {"sun": [f"{60 + i},{30 + i}"]}}, hurry=True) for i in range(10)]
    print(f"sun drag                 {1000 * statistics.median(suns):7.1f} ms in the median")
    print(f"sun, at rest             {1000 * viewer.final({'render': {'sun': ['120,25']}}):7.1f} ms")
    exposures = [viewer.picture({"render": {"sun": ["120,25"], "exposure": str(i / 10)}}, hurry=True) for i in range(10)]
    print(f"exposure                 {1000 * statistics.median(exposures):7.1f} ms in the median")
    if "volume" not in json.dumps(viewer.messages[:1], default=str) and not arguments[0].endswith((".vdb", ".felt")):
        shapes = [viewer.picture({"cloud": {"amplitude": f"{2 + i / 10}%"}}, hurry=True) for i in range(8)]
        print(f"amplitude drag           {1000 * statistics.median(shapes):7.1f} ms in the median")
        print(f"amplitude, at rest       {1000 * viewer.final({'cloud': {'amplitude': '3%'}}):7.1f} ms")
        print(f"billow, at rest          {1000 * viewer.final({'cloud': {'amplitude': '3%', 'billow': '0.7'}}):7.1f} ms")
        print(f"edge, at rest            {1000 * viewer.final({'cloud': {'amplitude': '3%', 'edge-thickness': '0.5%'}}):7.1f} ms")
        for what in ("surface", "checker", "pieces"):
            dragged(viewer, what, {"cut": {"random-planes": "6"}} if what == "pieces" else {})
        cancelling(viewer)
    before = viewer.processor()
    time.sleep(3)
    print(f"idle                     {(viewer.processor() - before) / 3:7.3f} of a core")
    print(f"memory                   {viewer.peak():7.0f} MB at most")
    print(f"end                      {1000 * viewer.end():7.1f} ms after SIGTERM")


if __name__ == "__main__":
    main()
