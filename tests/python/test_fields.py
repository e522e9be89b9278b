import threading
import time
import unittest

import numpy as np

import nephele
from support import BALL, Case, random_points


class Values(Case):
    def test_are_those_of_the_closed_form(self):
        p = random_points(10000)
        self.assertNear(BALL(p), 1 - np.linalg.norm(p, axis=1))

    def test_have_the_shape_of_the_points(self):
        self.assertIsInstance(BALL((0, 0, 0)), float)
        self.assertEqual(BALL(np.zeros((4, 5, 3))).shape, (4, 5))
        self.assertEqual(BALL(np.zeros((0, 3))).shape, (0,))
        self.assertEqual(nephele.identity()(np.zeros((7, 3))).shape, (7, 3))
        self.assertEqual(nephele.grad(nephele.identity())(np.zeros((7, 3))).shape, (7, 3, 3))

    def test_are_the_same_for_any_type_and_strides(self):
        p = random_points(500)
        wanted = BALL(p)
        wide = np.zeros((1000, 6), np.float32)
        wide[::2, 1:6:2] = p
        packed = np.zeros(500, dtype=[("mark", "u1"), ("point", "f4", 3)])
        packed["point"] = p
        frozen = p.copy()
        frozen.flags.writeable = False
        same = [np.asfortranarray(p), wide[::2, 1:6:2], p[::-1][::-1], p.astype(np.float64), p.astype(">f4"),
                packed["point"], frozen, p.tolist(), p.T.copy().T]
        for points in same:
            np.testing.assert_array_equal(BALL(points), wanted)
        whole = np.array([[1, 2, 3], [0, 0, 0]], np.int16)
        self.assertNear(BALL(whole), [1 - 14 ** 0.5, 1])

    def test_are_written_where_they_are_wanted(self):
        p = random_points(5000)
        wanted = BALL(p)
        out = np.full(5000, 7, np.float32)
        self.assertIs(BALL(p, out=out), out)
        np.testing.assert_array_equal(out, wanted)
        np.testing.assert_array_equal(BALL(np.asfortranarray(p), out=out), wanted)
        vectors = np.zeros((4, 5, 3), np.float32)
        self.assertIs(nephele.identity()(np.ones((4, 5, 3)), out=vectors), vectors)
        self.assertTrue((vectors == 1).all())
        frozen = np.zeros(5000, np.float32)
        frozen.flags.writeable = False
        for wrong, error, text in ((np.zeros(4999, np.float32), ValueError, r"expected shape \(5000\)"),
                                   (np.zeros((5000, 1), np.float32), ValueError, "expected shape"),
                                   (frozen, ValueError, "read-only"), (p[:, 0].base.reshape(-1)[:5000], ValueError, "shares memory"),
                                   (np.zeros(5000), TypeError, "float32"), (np.zeros(10000, np.float32)[::2], TypeError, "one piece"),
                                   ([0] * 5000, TypeError, "float32")):
            with self.assertRaisesRegex(error, text):
                BALL(p, out=wrong)

    def test_of_strides_of_zero_are_those_of_one_point(self):
        one = np.broadcast_to(np.float32([1, 2, 2]), (1000, 3))
        np.testing.assert_array_equal(BALL(one), np.full(1000, -2, np.float32))

    def test_of_nan_are_nan(self):
        self.assertTrue(np.isnan(BALL((np.nan, 0, 0))))

    def test_do_not_depend_on_how_many_are_asked_for(self):
        field = nephele.perlin(3, 5) + nephele.square(BALL)
        p = random_points(300000)
        np.testing.assert_array_equal(field(p)[200000:200100], field(p[200000:200100]))

    def test_refuse_what_is_no_point(self):
        for wrong in (np.zeros((3, 2)), np.zeros(4), 1.0, np.zeros((2, 0))):
            with self.assertRaisesRegex(ValueError, "last axis must have 3"):
                BALL(wrong)
        for wrong in (np.zeros((2, 3), complex), ["a", "b", "c"], None, {}, np.array([[1, 2, None]], object)):
            with self.assertRaises(TypeError):
                BALL(wrong)
        with self.assertRaises((TypeError, ValueError)):
            BALL([[1, 2, 3], [1, 2]])

    def test_may_be_asked_for_from_many_threads(self):
        p = random_points(20000)
        wanted = BALL(p)
        results = [None] * 8

        def ask(i):
            results[i] = BALL(p)

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results:
            np.testing.assert_array_equal(result, wanted)

    def test_outlive_the_array_of_the_points(self):
        def points():
            return random_points(200000)

        self.assertEqual(BALL(points()).shape, (200000,))


class Gradients(Case):
    def test_are_those_of_the_closed_form(self):
        p = random_points(1000)
        values, gradients = BALL.value_and_gradient(p)
        np.testing.assert_array_equal(values, BALL(p))
        self.assertNear(gradients, -p / np.linalg.norm(p, axis=1, keepdims=True))
        np.testing.assert_array_equal(gradients, BALL.gradient(p))

    def test_of_vectors_are_jacobians(self):
        jacobian = (2 * nephele.identity()).gradient(np.zeros((5, 3)))
        np.testing.assert_array_equal(jacobian, np.broadcast_to(2 * np.eye(3), (5, 3, 3)))


class Ranges(Case):
    def test_contain_all_values(self):
        low, high = BALL.range((0, 0, 0), (1, 1, 1))
        values = BALL(np.random.default_rng(2).uniform(0, 1, (1000, 3)))
        self.assertLessEqual(low, values.min())
        self.assertGreaterEqual(high, values.max())

    def test_refuse_a_box_inside_out(self):
        with self.assertRaisesRegex(ValueError, "empty"):
            BALL.range((1, 0, 0), (0, 1, 1))


class Operators(Case):
    def test_do_what_numpy_does(self):
        a, b = BALL, nephele.box((0, 0, 0), (1, 1, 1))
        p = random_points(500)
        A, B = a(p), b(p)
        for made, wanted in [(a + b, A + B), (a - 2, A - 2), (2 - a, 2 - A), (a * b, A * B), (3 * a, 3 * A), (a / 4, A / 4),
                             (1 / (b * b + 1), 1 / (B * B + 1)), (-a, -A), (abs(a), np.abs(A)), (abs(a) ** 2, A ** 2),
                             (2 ** a, 2 ** A), (np.float64(2) * a, 2 * A), (a + np.float32(1), A + 1)]:
            self.assertNear(made(p), wanted)

    def test_of_vectors(self):
        v = nephele.identity()
        p = random_points(100)
        self.assertNear((v * 2 + (1, 0, 0))(p), p * 2 + [1, 0, 0])
        self.assertNear((v + np.array([0, 1, 0]))(p), p + [0, 1, 0])
        self.assertNear(v.y(p), p[:, 1])
        self.assertNear(v[2](p), p[:, 2])
        self.assertNear((BALL * v)(p), BALL(p)[:, None] * p)
        self.assertNear(nephele.length(v)(p), np.linalg.norm(p, axis=1))

    def test_of_what_does_not_go_together(self):
        for wrong in (lambda: BALL + "1", lambda: BALL + nephele.identity(), lambda: BALL * None, lambda: BALL + [1, 2],
                      lambda: np.zeros(5) * BALL):
            self.assertRaises((TypeError, ValueError), wrong)

    def test_may_not_be_nested_without_end(self):
        field = BALL
        with self.assertRaisesRegex(nephele.Error, "operations"):
            for _ in range(10000):
                field = field + 1


class Words(Case):
    def test_are_those_of_felt(self):
        p = random_points(200)
        scripted = nephele.felt("scalarfield f = blend(sphere((0,0,0), 1), perlin(3, 7), 0.2);").f
        np.testing.assert_array_equal(nephele.blend(BALL, nephele.perlin(3, 7), 0.2)(p), scripted(p))

    def test_take_names_lists_and_arrays(self):
        p = random_points(100)
        wanted = nephele.fractalsum(3, 2.0)(p)
        np.testing.assert_array_equal(nephele.fractalsum(octaves=3, frequency=np.float32(2))(p), wanted)
        np.testing.assert_array_equal(nephele.sphere([0, 0, 0], 1)(p), BALL(p))
        np.testing.assert_array_equal(nephele.sphere(np.zeros(3), radius=1)(p), BALL(p))
        ramp = nephele.ramp(nephele.identity().y, [-1, 0, 1], [0, 1, 0])
        self.assertNear(ramp(((0, 0, 0), (0, 0.5, 0))), [1, 0.5])
        layers = nephele.cumulo(BALL, [0.1 * nephele.perlin(4)])
        self.assertTrue((layers(p) >= BALL(p) - 1e-6).all())

    def test_give_numbers_of_numbers(self):
        self.assertEqual(nephele.clamp(3, 0, 1), 1)
        np.testing.assert_array_equal(nephele.rotation((0, 1, 0), 90).round(6) @ [1, 0, 0], [0, 0, -1])

    def test_say_what_they_take(self):
        with self.assertRaisesRegex(TypeError, "no 'sphere' takes.*scalarfield sphere\\(vector center, float radius\\)"):
            nephele.sphere(1, 2)
        with self.assertRaisesRegex(TypeError, "did you mean `radius`"):
            nephele.sphere((0, 0, 0), radus=1)
        with self.assertRaisesRegex(TypeError, "argument 1: cannot be a dict"):
            nephele.sphere({}, 1)
        with self.assertRaisesRegex(TypeError, "nephele.field\\(function\\)"):
            nephele.abs(lambda p: p)
        with self.assertRaisesRegex(nephele.Error, "radius must be > 0"):
            nephele.sphere((0, 0, 0), -1)
        with self.assertRaises(ValueError):
            nephele.perlin(1, 2 ** 70)
        with self.assertRaises(nephele.Error):
            nephele.noise("nonsense")

    def test_have_documentation(self):
        for name in nephele.words():
            self.assertIn(name + "(", getattr(nephele, name).__doc__, name)


class Functions(Case):
    def test_are_called_with_blocks(self):
        sizes = []

        def function(points):
            sizes.append(points.shape)
            return points[:, 0] ** 2

        field = nephele.field(function)
        p = random_points(3000)
        self.assertNear(field(p), p[:, 0] ** 2)
        self.assertLess(len(sizes), 20)
        self.assertTrue(all(len(shape) == 2 and shape[1] == 3 and shape[0] <= 256 for shape in sizes))
        self.assertNear((2 * field + BALL)(p), 2 * p[:, 0] ** 2 + BALL(p))
        self.assertNear(field.gradient(p)[:, 0], 2 * p[:, 0], 1e-2)

    def test_may_give_vectors_numbers_and_any_type(self):
        p = random_points(600)
        self.assertNear(nephele.field(lambda q: q * 2, "vector")(p), p * 2)
        self.assertNear(nephele.field(lambda q: np.float64(3))(p), np.full(600, 3))
        self.assertNear(nephele.field(lambda q: (q[:, 0] > 0))(p), p[:, 0] > 0)
        matrix = nephele.field(lambda q: np.broadcast_to(np.eye(3), (len(q), 3, 3)), "matrix")
        self.assertNear((matrix * nephele.identity())(p), p)

    def test_may_be_baked_and_rendered(self):
        field = nephele.field(lambda q: 1 - np.linalg.norm(q, axis=1), range=(-10, 1))
        grid = field.bake(0.2, (-1.2,) * 3, (1.2,) * 3, level_set=True)
        self.assertNear(grid.mesh().volume, 4 / 3 * np.pi, 0.1)

    def test_raise_what_they_raise(self):
        def function(points):
            raise KeyError("mine")

        for points in (random_points(10), random_points(300000)):
            with self.assertRaisesRegex(KeyError, "mine"):
                nephele.field(function)(points)
        with self.assertRaisesRegex(KeyError, "mine"):
            nephele.field(function).bake(0.2, (-1,) * 3, (1,) * 3)

    def test_work_in_threads_that_worked_for_others(self):
        # Slow, so that other threads come to help.
        def first(points):
            time.sleep(1e-4)
            return points[:, 0]

        def failing(points):
            time.sleep(1e-4)
            raise KeyError("mine")

        p = random_points(6000)
        for _ in range(40):
            BALL.bake(0.1, (-1,) * 3, (1,) * 3)
            np.testing.assert_array_equal(nephele.field(first)(p), p[:, 0])
            with self.assertRaisesRegex(KeyError, "mine"):
                nephele.field(failing)(p)

    def test_that_call_themselves_end(self):
        endless = nephele.field(lambda q: endless(q))
        around = nephele.field(lambda q: around(np.tile(q, (3000 // len(q), 1)))[:len(q)])
        for points in (np.zeros(3), random_points(6000), random_points(200000)):
            with self.assertRaisesRegex(RecursionError, "too deep"):
                endless(points)
        with self.assertRaisesRegex(RecursionError, "too deep"):
            around(np.zeros(3))
        nested = BALL
        for _ in range(15):
            nested = nephele.field(lambda q, inner=nested: inner(q))
        self.assertEqual(nested((0, 0, 0)), 1)

    def test_that_return_nonsense_are_refused(self):
        p = random_points(10)
        for wrong in (lambda q: q, lambda q: q[:3, 0], lambda q: np.zeros((len(q), 1))):
            with self.assertRaisesRegex(ValueError, "one value for each of its points"):
                nephele.field(wrong)(p)
        for wrong in (lambda q: "text", lambda q: None, lambda q: q[:, 0] * 1j):
            with self.assertRaises(TypeError):
                nephele.field(wrong)(p)
        with self.assertRaises(TypeError):
            nephele.field(3)
        with self.assertRaisesRegex(ValueError, "kind must be"):
            nephele.field(lambda q: q, "tensor")
        with self.assertRaisesRegex(ValueError, "step must be > 0"):
            nephele.field(lambda q: q, step=0)
        with self.assertRaisesRegex(ValueError, "low <= high"):
            nephele.field(lambda q: q, range=(1, 0))

    def test_of_two_threads_keep_their_own_exceptions(self):
        def failing(points):
            raise KeyError("mine")

        seen = {}

        def ask(name, field):
            try:
                seen[name] = field(random_points(200000)).shape
            except KeyError as error:
                seen[name] = error.args[0]

        fields = {"good": nephele.field(lambda q: q[:, 0]), "bad": nephele.field(failing)}
        threads = [threading.Thread(target=ask, args=item) for item in fields.items()]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(seen, {"good": (200000,), "bad": "mine"})


class Scripts(Case):
    def test_give_their_variables(self):
        made = nephele.felt('param float r = 1 in [0, 4] "radius";\nscalarfield s = sphere((0,0,0), r);\nint n = 3;\n'
                            'string t = "a";\nvector v = (1,2,3);\nfloat[] list = [1, 2];', r=2)
        self.assertEqual((made.n, made.t, made.list), (3, "a", [1, 2]))
        self.assertEqual(made.s((0, 0, 0)), 2)
        np.testing.assert_array_equal(made.v, [1, 2, 3])

    def test_tell_their_faults(self):
        with self.assertRaisesRegex(nephele.Error, "felt:1:1[45]: error"):
            nephele.felt("scalarfield s sphere((0,0,0), 1);")
        with self.assertRaisesRegex(nephele.Error, "did you mean 'radius'"):
            nephele.felt("param float radius = 1;", radus=1)
        with self.assertRaisesRegex(nephele.Error, "0.*4|range"):
            nephele.felt('param float r = 1 in [0, 4] "radius";', r=9)
        with self.assertRaises(TypeError):
            nephele.felt(b"int n = 1;")
        with self.assertRaises(TypeError):
            nephele.felt("param float r = 1;", r=object())


if __name__ == "__main__":
    unittest.main()
