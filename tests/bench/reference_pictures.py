"""Pictures that tests/bench/reference.py compares, what their errors are, and where they are kept."""
import array
import json
import math
import os
import subprocess
import sys

SIZE, BLOCK = (160, 120), 16
# Samples per pixel of a part of a reference.
PART = 64


class Picture:
    """Red, green, blue and opacity, row by row."""

    def __init__(self, planes):
        self.planes = planes
        r, g, b = planes[:3]
        self.luminance = [0.2126 * x + 0.7152 * y + 0.0722 * z for x, y, z in zip(r, g, b)]
        self.mean = sum(self.luminance) / len(self.luminance)
        self.blocks = self.block_means(self.luminance)

    @staticmethod
    def read(*paths):
        """One or all of them, by one run of oiiotool, which writes the four numbers of a pixel one after the other."""
        command, pictures = ["oiiotool"], []
        for path in paths:
            command += [path, "--ch", "R,G,B,A", "-d", "float", "-o", path + ".fits"]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        for path in paths:
            with open(path + ".fits", "rb") as file:
                values = array.array("f", file.read()[2880:2880 + 16 * SIZE[0] * SIZE[1]])
            os.remove(path + ".fits")
            if sys.byteorder == "little":
                values.byteswap()
            pictures.append(Picture([values[channel::4] for channel in range(4)]))
        return pictures[0] if len(pictures) == 1 else pictures

    @staticmethod
    def mean_of(parts):
        """Of (picture, samples), by samples."""
        shares = [samples / sum(n for _, n in parts) for _, samples in parts]
        return Picture([[sum(share * v for share, v in zip(shares, values)) for values in zip(*(p.planes[c] for p, _ in parts))]
                        for c in range(4)])

    @staticmethod
    def block_means(plane):
        w, h = SIZE
        return [sum(sum(plane[y * w + x:y * w + x + BLOCK]) for y in range(y0, y0 + BLOCK)) / BLOCK**2
                for y0 in range(0, h - BLOCK + 1, BLOCK) for x in range(0, w, BLOCK)]


class Reference:
    """What parts, (picture, samples), say together, and in two halves. One part alone counts as both."""

    def __init__(self, parts):
        halves = [[], []]
        for part in sorted(parts, key=lambda part: -part[1]):
            min(halves, key=lambda half: sum(n for _, n in half)).append(part)
        self.samples = sum(n for _, n in parts)
        self.whole = Picture.mean_of(parts)
        self.first, self.second = (Picture.mean_of(half) if half else self.whole for half in halves)
        first = sum(n for _, n in halves[0])
        # What the difference of the halves is to be multiplied by to be a standard error of the whole.
        self.share = math.sqrt(first * (self.samples - first)) / self.samples
        self.covered = [i for i, alpha in enumerate(Picture.block_means(self.whole.planes[3])) if alpha >= 0.5]
        brightest = max(self.whole.blocks[i] for i in self.covered)
        self.bright = [i for i in self.covered if self.whole.blocks[i] >= 0.1 * brightest]

        # The standard error of a block, relative, by what the halves differ by in its pixels.
        squares = Picture.block_means([(x - y)**2 for x, y in zip(self.first.luminance, self.second.luminance)])
        self.noise_of = [self.share * math.sqrt(s) / BLOCK / max(m, 1e-30) for s, m in zip(squares, self.whole.blocks)]

    def noise(self, blocks):
        """Root mean square of the relative standard error of a block."""
        return math.sqrt(sum(self.noise_of[i]**2 for i in blocks) / len(blocks))

    def errors(self, picture):
        """Of another picture; reference.py says what they are."""
        whole = self.whole
        found = {"mean": picture.mean / whole.mean - 1}
        for prefix, blocks in (("", self.covered), ("bright_", self.bright)):
            m, r, a, b = picture.blocks, whole.blocks, self.first.blocks, self.second.blocks
            squares = sum((m[i] - a[i]) * (m[i] - b[i]) / r[i]**2 for i in blocks) / len(blocks)
            worst = max(blocks, key=lambda i: abs(m[i] / r[i] - 1))
            found |= {prefix + "rms": math.sqrt(max(squares, 0)), prefix + "worst": m[worst] / r[worst] - 1,
                      prefix + "noise": self.noise_of[worst]}
        relative = count = 0
        for planes in zip(picture.planes[:3], whole.planes, self.first.planes, self.second.planes):
            relative += sum((m - a) * (m - b) / (r * r + 0.01) for m, r, a, b in zip(*planes))
            count += len(planes[0])
        return found | {"relmse": max(relative / count, 0)}

    def own_errors(self):
        """Standard errors of the whole reference, from the difference of its halves."""
        a, b, whole = self.first, self.second, self.whole
        relative = sum((x - y)**2 / (r * r + 0.01) for c in range(3) for x, y, r in zip(a.planes[c], b.planes[c], whole.planes[c]))
        squares = sum((x - y)**2 for x, y in zip(a.luminance, b.luminance))
        return {"mean": self.share * math.sqrt(squares) / len(a.luminance) / whole.mean, "rms": self.noise(self.covered),
                "worst": max(self.noise_of[i] for i in self.covered), "noise": 0,
                "relmse": self.share**2 * relative / (3 * len(whole.luminance))}


def inside(options, *parts):
    path = os.path.join(options.folder, *parts)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    return path


def save(path, value):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(value, file, indent=1)


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)
