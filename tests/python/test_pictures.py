import os
import pickle
import struct
import unittest
import zlib

import numpy as np

import nephele
from support import Case, ball_grid, cube, fog_grid


def pixels_of_png(data):
    """Size and bytes of a PNG that has no filters."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        assert zlib.crc32(data[at + 4:at + 8 + length]) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]
        at += 12 + length
    return width, height, zlib.decompress(packed)


class Pictures(Case):
    def test_come_from_arrays(self):
        a = np.random.default_rng(1).uniform(0, 1, (6, 9, 4)).astype(np.float32)
        picture = nephele.Picture(a, {"Z": a[..., 0], "N": a[..., :3]})
        np.testing.assert_array_equal(picture.array, a)
        np.testing.assert_array_equal(picture.layers["Z"], a[..., 0])
        again = pickle.loads(pickle.dumps(picture))
        np.testing.assert_array_equal(again.array, a)
        np.testing.assert_array_equal(again.layers["N"], a[..., :3])
        for wrong in (a[0], a[..., :2], np.zeros((0, 3, 4))):
            with self.assertRaises(ValueError):
                nephele.Picture(wrong)
        with self.assertRaises(ValueError):
            nephele.Picture(a, {"Z": a[:3, :, 0]})

    def test_are_pickled_with_all_that_they_are(self):
        made = nephele.render(fog_grid(), size=(32, 24), crop=(4, 4, 20, 16), quality="draft", aov="normal,Z,light", seed=7)
        for picture in (made, nephele.Picture(np.ones((4, 5, 3)), {"N": np.zeros((4, 5, 3)), "uv": np.ones((4, 5, 2))})):
            again = pickle.loads(pickle.dumps(picture))
            np.testing.assert_array_equal(again.array, picture.array)
            self.assertEqual(again.metadata, picture.metadata)
            self.assertEqual(list(again.layers), list(picture.layers))
            for name, layer in picture.layers.items():
                np.testing.assert_array_equal(again.layers[name], layer)
            picture.save(self.path("p.exr"))
            again.save(self.path("again.exr"))
            with open(self.path("p.exr"), "rb") as one, open(self.path("again.exr"), "rb") as other:
                self.assertEqual(one.read(), other.read())

    def test_have_a_camera_that_is_no_matrix_of_zeros(self):
        identity = np.eye(4, dtype="<f4").tobytes()
        nephele.Picture(np.ones((4, 5, 3))).save(self.path("p.exr"))
        with open(self.path("p.exr"), "rb") as file:
            self.assertEqual(file.read().count(identity), 2)
        nephele.render(fog_grid(), size=(32, 24), quality="draft", output=self.path("seen.exr"))
        nephele.read(self.path("seen.exr")).save(self.path("again.exr"))
        matrices = []
        for name in ("seen.exr", "again.exr"):
            with open(self.path(name), "rb") as file:
                content = file.read()
            matrices.append([content.split(name + b"\0m44f\0", 1)[1][:68] for name in (b"worldToCamera", b"worldToNDC")])
        self.assertEqual(*matrices)

    def test_of_the_screen_look_as_previews(self):
        fog = fog_grid()
        options = dict(size=(32, 20), quality="draft", exposure=2, view_transform="standard", background=(0.9, 0.1, 0.1))
        nephele.render(fog, **options, preview=self.path("preview.png"))
        wanted = nephele.read(self.path("preview.png")).array
        picture = nephele.render(fog, **options, output=self.path("output.png"))
        np.testing.assert_array_equal(nephele.read(self.path("output.png")).array, wanted)
        np.testing.assert_array_equal(picture.array, nephele.render(fog, **options).array)
        nephele.Session(fog).render(**options, output=self.path("both.png"), preview=self.path("other.png"))
        for name in ("both.png", "other.png"):
            np.testing.assert_array_equal(nephele.read(self.path(name)).array, wanted)
        nephele.render(fog, **options, wedge="seed=1,2", output=self.path("wedge.png"))
        self.assertEqual(sum(name.startswith("wedge") for name in os.listdir(self._folder.name)), 2)

    def test_are_saved_and_read(self):
        a = np.random.default_rng(1).uniform(0, 1, (6, 9, 4)).astype(np.float16).astype(np.float32)
        picture = nephele.Picture(a)
        picture.save(self.path("p.exr"))
        np.testing.assert_array_equal(nephele.read(self.path("p.exr")).array, a)
        picture.save(self.path("p.png"), view="standard")
        self.assertEqual(nephele.read(self.path("p.png")).array.shape, (6, 9, 4))
        with self.assertRaisesRegex(nephele.Error, "unknown picture format"):
            picture.save(self.path("p.jpg"))
        with self.assertRaisesRegex(ValueError, "view must be"):
            picture.save(self.path("p.png"), view="log")

    def test_show_themselves(self):
        picture = nephele.Picture(np.full((6, 9, 3), 0.18, np.float32))
        width, height, rows = pixels_of_png(picture._repr_png_())
        self.assertEqual((width, height), (9, 6))
        screen = np.frombuffer(rows, np.uint8).reshape(6, 1 + 27)[:, 1:].reshape(6, 9, 3)
        np.testing.assert_array_equal(screen, picture.screen())
        for thing in (nephele.Mesh(*cube()), fog_grid(), ball_grid()):
            self.assertGreater(len(thing._repr_png_()), 1000)
        self.assertIsNone(nephele.Grid(np.ones((4, 4, 4, 3)))._repr_png_())


if __name__ == "__main__":
    unittest.main()
