"""What the tests of the module share."""

import os
import tempfile
import unittest

import numpy as np

import nephele

# The sphere of radius 1 about the origin: its values, gradients and volumes are known in closed form.
BALL = nephele.sphere((0, 0, 0), 1)


def cube():
    """The unit cube as quads, counter-clockwise from outside."""
    V = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    F = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return V, F


def ball_grid(voxel_size=0.1, **options):
    return BALL.bake(voxel_size, (-1.5,) * 3, (1.5,) * 3, level_set=True, name="surface", **options)


def fog_grid(voxel_size=0.1):
    """A ball of density 1 with a soft edge."""
    return nephele.mask(BALL, 0.2).bake(voxel_size, (-1.5,) * 3, (1.5,) * 3, background=0)


def random_points(count, seed=1):
    return np.random.default_rng(seed).uniform(-2, 2, (count, 3)).astype(np.float32)


class Case(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory()
        self.addCleanup(self._folder.cleanup)

    def path(self, name):
        return os.path.join(self._folder.name, name)

    def assertNear(self, a, b, tolerance=1e-5):
        np.testing.assert_allclose(a, b, atol=tolerance, rtol=tolerance)
