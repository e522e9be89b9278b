import pickle
import unittest

import numpy as np

import nephele
from support import BALL, Case, ball_grid, fog_grid


def numbers(shape=(13, 20, 9), seed=3):
    return np.random.default_rng(seed).uniform(0.1, 1, shape).astype(np.float32)


class Arrays(Case):
    def test_come_back_as_they_were(self):
        a = numbers()
        grid = nephele.Grid(a, 0.5)
        np.testing.assert_array_equal(grid.to_array(), a)
        self.assertEqual(grid.voxel_box, ((0, 0, 0), (13, 20, 9)))
        self.assertEqual((grid.name, grid.kind, grid.voxel_size), ("density", "fog", 0.5))

    def test_may_have_any_type_and_strides(self):
        a = numbers((8, 9, 10))
        wide = np.zeros((16, 9, 20), np.float32)
        wide[::2, :, 5:15] = a
        frozen = a.copy()
        frozen.flags.writeable = False
        unaligned = np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(np.float32).reshape(a.shape)
        packed = np.zeros(a.shape, dtype=[("mark", "u1"), ("value", "f4")])
        packed["value"] = a
        for same in (np.asfortranarray(a), wide[::2, :, 5:15], a[::-1][::-1], a.astype(np.float64), a.astype(">f4"), frozen,
                     packed["value"], unaligned, a.tolist()):
            np.testing.assert_array_equal(nephele.Grid(same).to_array(), a)
        np.testing.assert_array_equal(nephele.Grid(a.transpose(2, 0, 1)).to_array(), a.transpose(2, 0, 1))
        np.testing.assert_array_equal(nephele.Grid(a[::-1]).to_array(), a[::-1])
        whole = np.arange(60, dtype=np.uint8).reshape(3, 4, 5)
        np.testing.assert_array_equal(nephele.Grid(whole).to_array(), whole)
        np.testing.assert_array_equal(nephele.Grid(whole > 30).to_array(), whole > 30)
        np.testing.assert_array_equal(nephele.Grid(a.astype(np.float16)).to_array(), a.astype(np.float16))

    def test_of_strides_of_zero_are_one_value(self):
        a = np.broadcast_to(np.float32(2), (20, 20, 20))
        np.testing.assert_array_equal(nephele.Grid(a).to_array(), a)

    def test_of_vectors_come_back(self):
        a = numbers((9, 8, 7, 3))
        grid = nephele.Grid(a, name="v")
        self.assertTrue(grid.is_vector)
        np.testing.assert_array_equal(grid.to_array(), a)
        self.assertNear(grid((2, 3, 4)), a[2, 3, 4])
        grid.save(self.path("v.vdb"))
        np.testing.assert_array_equal(nephele.read(self.path("v.vdb")).to_array(((0, 0, 0), (9, 8, 7))), a)

    def test_stand_where_they_are_put(self):
        a = numbers((5, 5, 5))
        for origin in ((1, -2, 3), (0.13, 0.2, -0.7)):
            grid = nephele.Grid(a, 0.5, origin=origin)
            self.assertNear(grid(np.array(origin) + 0.5 * np.array([1, 2, 3])), a[1, 2, 3])
            np.testing.assert_array_equal(grid.to_array(), a)
            self.assertNear((grid.transform @ [*grid.voxel_box[0], 1])[:3], origin)

    def test_fade_to_the_background_on_all_sides(self):
        for first in (0, 1, 2, 3, 7, 8, -3, 0.3):
            for size in (6, 7, 8, 9):
                grid = nephele.Grid(np.ones((size,) * 3), 1, origin=(first,) * 3)
                middle = first + 3
                for axis in range(3):
                    points = np.full((2, 3), middle, float)
                    points[:, axis] = first - 0.5, first + size - 0.5
                    self.assertNear(grid(points), (0.5, 0.5))
                    self.assertNear(grid.field.gradient(points)[:, axis], (0.5, -0.5))
        # So they do inside of an array.
        a = np.zeros((40, 40, 40), np.float32)
        a[16:24, 16:24, 16:24] = 1
        self.assertNear(nephele.Grid(a)([(15.5, 18, 18), (23.5, 18, 18)]), (0.5, 0.5))

    def test_are_the_same_once_read_again(self):
        a = np.zeros((30, 30, 30), np.float32)
        a[8:17, 5:24, 16:19] = numbers((9, 19, 3))
        points = np.random.default_rng(1).uniform(0, 30, (20000, 3))
        for first in (0, -5, 9):
            grid = nephele.Grid(a, origin=(first,) * 3)
            grid.save(self.path("a.vdb"))
            again = nephele.read(self.path("a.vdb"))
            np.testing.assert_array_equal(again(points + first), grid(points + first))
            np.testing.assert_array_equal(again.field.gradient(points + first), grid.field.gradient(points + first))

    def test_have_a_background(self):
        a = np.full((10, 10, 10), -1, np.float32)
        a[4, 5, 6] = 2
        grid = nephele.Grid(a, background=-1, kind="unknown")
        self.assertEqual(grid.background, -1)
        self.assertEqual(grid((100, 0, 0)), -1)
        self.assertEqual(grid((4, 5, 6)), 2)
        self.assertEqual(grid.info()["active_voxels"], 1)

    def test_may_be_read_in_a_box(self):
        a = numbers()
        grid = nephele.Grid(a)
        np.testing.assert_array_equal(grid.to_array(((2, 3, 1), (9, 19, 8))), a[2:9, 3:19, 1:8])
        outside = grid.to_array(((-5, -5, -5), (-2, -1, 0)))
        np.testing.assert_array_equal(outside, np.zeros((3, 4, 5)))
        with self.assertRaisesRegex(ValueError, "end above first"):
            grid.to_array(((0, 0, 0), (0, 1, 1)))

    def test_outlive_what_they_were_made_from(self):
        def made():
            a = numbers()
            return nephele.Grid(a), a.copy()

        grid, a = made()
        np.testing.assert_array_equal(grid.to_array(), a)
        values = nephele.Grid(a).bricks[0]
        self.assertEqual(values.shape[1:], (11, 11, 11))
        self.assertTrue(np.isfinite(values).all())

    def test_that_are_no_numbers_are_refused(self):
        a = numbers()
        for wrong in (a[0], np.zeros((2, 2, 2, 2)), np.zeros((0, 3, 3)), 3.0):
            with self.assertRaises(ValueError):
                nephele.Grid(wrong)
        for wrong in (a * 1j, np.array([[["a"]]]), None, np.array([[[None]]], object)):
            with self.assertRaises(TypeError):
                nephele.Grid(wrong)
        for value in (np.nan, np.inf, -np.inf):
            b = a.copy()
            b[3, 4, 5] = value
            with self.assertRaisesRegex(nephele.Error, "not finite"):
                nephele.Grid(b)
        for size in (0, -1, np.nan, np.inf):
            with self.assertRaisesRegex(ValueError, "voxel_size must be > 0"):
                nephele.Grid(a, size)
        with self.assertRaisesRegex(ValueError, "kind must be"):
            nephele.Grid(a, kind="smoke")
        with self.assertRaisesRegex(ValueError, "origin"):
            nephele.Grid(a, origin=(0, np.nan, 0))


class Bricks(Case):
    def test_are_seen_without_a_copy(self):
        grid = ball_grid()
        values, table, first = grid.bricks
        again = grid.bricks[0]
        self.assertEqual(values.ctypes.data, again.ctypes.data)
        self.assertFalse(values.flags.writeable)
        with self.assertRaises(ValueError):
            values[0, 0, 0, 0] = 1
        with self.assertRaises(ValueError):
            values.flags.writeable = True
        # Sample (x, y, z) of a brick is values[b, z + 1, y + 1, x + 1].
        dense = grid.to_array()
        low = grid.voxel_box[0]
        voxel = np.array([5, -3, 2])
        brick = (voxel - first) // 8
        inside = (voxel - first) % 8 + 1
        number = table[brick[2], brick[1], brick[0]]
        self.assertEqual(values[number, inside[2], inside[1], inside[0]], dense[tuple(voxel - low)])

    def test_stay_after_their_grid(self):
        values = ball_grid().bricks[0]
        total = float(values.sum())
        fog_grid()
        self.assertEqual(float(values.sum()), total)


class Shapes(Case):
    def test_are_positive_inside(self):
        grid = ball_grid()
        self.assertEqual(grid.kind, "level set")
        self.assertGreater(grid((0.9, 0, 0)), 0)
        self.assertLess(grid((1.1, 0, 0)), 0)
        self.assertNear(grid.mesh().volume, 4 / 3 * np.pi, 0.05)
        grid.save(self.path("ball.vdb"))
        again = nephele.read(self.path("ball.vdb"))
        self.assertEqual(again.kind, "level set")
        self.assertNear(again((0.9, 0.1, 0)), grid((0.9, 0.1, 0)))
        x = np.linspace(-1.5, 1.5, 31)
        distance = 1 - np.sqrt((np.stack(np.meshgrid(x, x, x, indexing="ij")) ** 2).sum(0))
        made = nephele.Grid(distance.clip(-0.3, 0.3), 0.1, origin=(-1.5,) * 3, kind="level set", name="surface")
        self.assertNear(made.mesh().volume, 4 / 3 * np.pi, 0.05)

    def test_of_several_grids_are_a_dict(self):
        nephele.write(self.path("two.vdb"), [fog_grid(), ball_grid()])
        self.assertEqual(sorted(nephele.read(self.path("two.vdb"))), ["density", "surface"])

    def test_are_named_by_the_keys_of_a_dict(self):
        made = {"smoke": fog_grid(), "fire": nephele.Grid(numbers()), "v": nephele.Grid(numbers((3, 4, 5, 3)))}
        nephele.write(self.path("named.vdb"), made)
        again = nephele.read(self.path("named.vdb"))
        self.assertEqual(list(again), list(made))
        for name, grid in made.items():
            self.assertEqual(again[name].name, name)
            np.testing.assert_array_equal(again[name].to_array(grid.voxel_box), grid.to_array())
            self.assertEqual(again[name].kind, grid.kind)
        self.assertEqual([grid.name for grid in made.values()], ["density"] * 3)

    def test_of_one_name_are_refused(self):
        with self.assertRaisesRegex(nephele.Error, "density"):
            nephele.write(self.path("same.vdb"), [fog_grid(), fog_grid()])
        # Other programs write such files.
        nephele.write(self.path("same.vdb"), {"aaaa": fog_grid(), "bbbb": fog_grid()})
        with open(self.path("same.vdb"), "rb") as file:
            content = file.read()
        with open(self.path("same.vdb"), "wb") as file:
            file.write(content.replace(b"bbbb", b"aaaa"))
        with self.assertRaisesRegex(nephele.Error, "same.vdb: has two grids named 'aaaa'"):
            nephele.read(self.path("same.vdb"))

    def test_bake_what_fits(self):
        with self.assertRaisesRegex(nephele.Error, "voxel_size must be > 0"):
            BALL.bake(0, (-1,) * 3, (1,) * 3)
        with self.assertRaisesRegex(nephele.Error, "too small"):
            BALL.bake(1e-7, (-1,) * 3, (1,) * 3)


class Files(Case):
    def test_that_cannot_be_read_say_why(self):
        for name in ("none.vdb", "none.nvdb", "none.obj", "none.exr"):
            with self.assertRaisesRegex(nephele.Error, name):
                nephele.read(self.path(name))
        with self.assertRaises(nephele.Error):
            fog_grid().save(self.path("fog.nvdb"))
        with self.assertRaises(nephele.Error):
            fog_grid().save(self.path("nowhere/fog.vdb"))
        with self.assertRaises(TypeError):
            nephele.write(self.path("x.vdb"), 3)

    def test_are_described(self):
        fog_grid().save(self.path("fog.vdb"))
        self.assertEqual(nephele.info(self.path("fog.vdb"))["kind"], "volume")


class Pickles(Case):
    def assertKept(self, grid):
        again = pickle.loads(pickle.dumps(grid))
        self.assertEqual(again.voxel_box, grid.voxel_box)
        self.assertEqual((again.name, again.kind, again.is_vector, again.voxel_size),
                         (grid.name, grid.kind, grid.is_vector, grid.voxel_size))
        np.testing.assert_array_equal(again.to_array(), grid.to_array())
        np.testing.assert_array_equal(again.transform, grid.transform)
        points = np.random.default_rng(1).uniform(-2, 10, (5000, 3))
        np.testing.assert_array_equal(again(points), grid(points))
        return again

    def test_of_grids_are_the_grids(self):
        distances = 20 - np.linalg.norm(np.indices((40, 40, 40)).T - 20, axis=-1)
        empty = np.zeros((20, 20, 20))
        bordered = empty.copy()
        bordered[9:12, 9, 9] = 1
        for grid in (fog_grid(), ball_grid(), nephele.Grid(numbers((5, 4, 3, 3)), name="v"), nephele.Grid(bordered),
                     nephele.Grid(distances, 0.1, origin=(0.13, 1, -2), kind="level set", name="surface"),
                     nephele.Grid(empty), nephele.Grid(np.ones((3, 3, 3)), background=1),
                     nephele.Grid(np.full((3, 3, 3), 1e6), half=True)):
            self.assertKept(self.assertKept(grid))
        self.assertEqual(self.assertKept(nephele.Grid(np.ones((3, 3, 3)), background=1, kind="unknown")).background, 1)

    def test_of_grids_that_were_read_are_the_grids(self):
        nephele.write(self.path("some.vdb"), [ball_grid(), fog_grid(), nephele.Grid(numbers((5, 4, 3, 3)), name="v")])
        for grid in nephele.read(self.path("some.vdb")).values():
            self.assertEqual(self.assertKept(grid).info(), grid.info())

    def test_of_fields_are_refused(self):
        with self.assertRaisesRegex(TypeError, "cannot be pickled"):
            pickle.dumps(BALL)


if __name__ == "__main__":
    unittest.main()
