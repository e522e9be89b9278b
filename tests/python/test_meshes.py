import pathlib
import pickle
import types
import unittest

import numpy as np

import nephele
from support import BALL, Case, cube


class Arrays(Case):
    def test_come_back_as_they_were(self):
        V, F = cube()
        mesh = nephele.Mesh(V, F)
        np.testing.assert_array_equal(mesh.V, V)
        np.testing.assert_array_equal(mesh.F, F)
        self.assertAlmostEqual(mesh.volume, 1)
        self.assertAlmostEqual(mesh.area, 6)
        self.assertEqual(mesh.box, ((0, 0, 0), (1, 1, 1)))
        self.assertTrue(mesh.diagnosis()["closed"])
        self.assertEqual(mesh.triangulated().F.shape, (12, 3))

    def test_are_seen_without_a_copy_and_stay(self):
        mesh = nephele.Mesh(*cube())
        V, F = mesh.V, mesh.F
        self.assertEqual(V.ctypes.data, mesh.V.ctypes.data)
        for view in (V, F):
            with self.assertRaises(ValueError):
                view[0, 0] = 1
        kept = V.copy()
        del mesh
        np.testing.assert_array_equal(V, kept)

    def test_may_have_any_type_and_strides(self):
        V, F = cube()
        for v in (V.astype(np.float32), np.asfortranarray(V), V[::-1][::-1], V.astype(int), V.tolist()):
            for f in (F.astype(np.uint8), np.asfortranarray(F), F.astype(np.int64), F.tolist()):
                mesh = nephele.Mesh(v, f)
                np.testing.assert_array_equal(mesh.V, V)
                np.testing.assert_array_equal(mesh.F, F)

    def test_of_faces_of_any_length(self):
        mesh = nephele.Mesh(cube()[0], [[0, 1, 3], [0, 3, 2], [4, 6, 7, 5]])
        self.assertEqual(mesh.face_start.tolist(), [0, 3, 6, 10])
        with self.assertRaisesRegex(nephele.Error, "number of corners"):
            mesh.F

    def test_that_are_no_mesh_are_refused(self):
        V, F = cube()
        for wrong in (F + 1, -F, F * 1000):
            with self.assertRaisesRegex(ValueError, "face .* has the vertex"):
                nephele.Mesh(V, wrong)
        with self.assertRaisesRegex(TypeError, "whole numbers"):
            nephele.Mesh(V, F.astype(float))
        with self.assertRaisesRegex(ValueError, "vertex 2 is not finite"):
            nephele.Mesh(np.where(np.arange(8)[:, None] == 2, np.nan, V), F)
        for wrong in (V[:, :2], V[0], np.zeros((2, 3, 3))):
            with self.assertRaisesRegex(ValueError, "rows of 3"):
                nephele.Mesh(wrong, F)
        for wrong in (V * 1j, "abc", None):
            with self.assertRaises(TypeError):
                nephele.Mesh(wrong, F)
        with self.assertRaises(ValueError):
            nephele.Mesh(V, F[0])
        with self.assertRaisesRegex(ValueError, "attribute 'a'"):
            nephele.Mesh(V, F, {"a": np.zeros(5)})

    def test_with_nothing_in_them(self):
        mesh = nephele.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
        self.assertEqual((mesh.V.shape, mesh.F.shape, len(mesh)), ((0, 3), (0, 3), 0))
        with self.assertRaisesRegex(nephele.Error, "no faces"):
            nephele.levelset(mesh)


class Attributes(Case):
    def test_come_back(self):
        V, F = cube()
        uv = np.random.default_rng(1).uniform(0, 1, (6, 4, 2)).astype(np.float32)
        mesh = nephele.Mesh(V, F, {"height": V[:, 1], "color": V, "uv": uv})
        np.testing.assert_array_equal(mesh.attributes["height"], V[:, 1])
        np.testing.assert_array_equal(mesh.attributes["color"], V)
        np.testing.assert_array_equal(mesh.attributes["uv"], uv)
        mesh.save(self.path("cube.obj"))
        np.testing.assert_allclose(nephele.read(self.path("cube.obj")).attributes["uv"], uv, atol=1e-6)


class OtherLibraries(Case):
    def test_like_trimesh(self):
        V, F = cube()
        F = nephele.Mesh(V, F).triangulated().F
        like = types.SimpleNamespace(vertices=V, faces=F, visual=types.SimpleNamespace(uv=V[:, :2]))
        mesh = nephele.as_mesh(like)
        np.testing.assert_array_equal(mesh.F, F)
        np.testing.assert_allclose(mesh.attributes["uv"], V[:, :2])
        self.assertEqual(nephele.levelset(like, voxel_size=0.1).kind, "level set")

    def test_like_pyvista(self):
        V, F = cube()
        faces = np.hstack([np.full((6, 1), 4), F]).ravel()
        like = types.SimpleNamespace(points=V.astype(np.float32), faces=faces, point_data={"height": V[:, 1]})
        mesh = nephele.as_mesh(like)
        np.testing.assert_array_equal(mesh.F, F)
        np.testing.assert_array_equal(mesh.attributes["height"], V[:, 1])
        mixed = types.SimpleNamespace(points=V, faces=np.array([3, 0, 1, 3, 4, 4, 6, 7, 5]))
        self.assertEqual(len(nephele.as_mesh(mixed)), 2)

    def test_of_volumes_are_what_the_verb_makes(self):
        fog = nephele.Grid(np.pad(np.random.default_rng(2).uniform(0, 1, (8, 8, 8)), 2), 0.1)
        path = self.path("fog.vdb")
        fog.save(path)
        wanted = nephele.mesh(fog).volume
        self.assertEqual(nephele.as_mesh(path).volume, wanted)
        self.assertEqual(nephele.as_mesh(fog).volume, wanted)
        nephele.write(self.path("both.vdb"), {"a": fog, "b": fog})
        self.assertEqual(nephele.as_mesh(self.path("both.vdb")).volume, wanted)
        nephele.Picture(np.zeros((4, 4, 3))).save(pathlib.Path(self.path("a.png")))
        with self.assertRaisesRegex(nephele.Error, "a.png: "):
            nephele.as_mesh(self.path("a.png"))

    def test_names_and_faces_are_of_their_kind(self):
        V, F = cube()
        with self.assertRaisesRegex(TypeError, "the name of an attribute is a text, got 3"):
            nephele.Mesh(V, F, {3: V[:, 0]})
        with self.assertRaisesRegex(TypeError, "the name of a layer is a text, got 3"):
            nephele.Picture(np.zeros((4, 4, 3)), {3: np.zeros((4, 4))})
        with self.assertRaisesRegex(ValueError, "F: one row for each face"):
            nephele.Mesh(V, [0, 1, 2])

    def test_like_open3d_and_pairs(self):
        V, F = cube()
        self.assertEqual(len(nephele.as_mesh(types.SimpleNamespace(vertices=V, triangles=F[:, :3]))), 6)
        self.assertEqual(len(nephele.as_mesh((V, F))), 6)
        with self.assertRaisesRegex(TypeError, "a mesh is needed"):
            nephele.as_mesh(3)


class Pickles(Case):
    def test_are_the_meshes(self):
        V, F = cube()
        uv = np.random.default_rng(1).uniform(0, 1, (6, 4, 2)).astype(np.float32)
        for mesh in (nephele.Mesh(V, F, {"h": V[:, 0], "uv": uv}, groups=[("a", 0, 2)]),
                     nephele.Mesh(V, [[0, 1, 3], [4, 6, 7, 5]])):
            again = pickle.loads(pickle.dumps(mesh))
            np.testing.assert_array_equal(again.V, mesh.V)
            np.testing.assert_array_equal(again.corners, mesh.corners)
            np.testing.assert_array_equal(again.face_start, mesh.face_start)
            self.assertEqual(again.groups, mesh.groups)
            for name, values in mesh.attributes.items():
                np.testing.assert_array_equal(again.attributes[name], values)

    def test_keep_what_belongs_to_corners(self):
        # As many corners as vertices, which two arrays alone cannot tell.
        path = self.path("a.obj")
        with open(path, "w", encoding="ascii") as file:
            file.write("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 3 0 1\n"
                       "vt 0 0\nvt 1 0\nvt 1 1\ng a\nusemtl stone\nf 3/1 2/2 1/3\nf 7/3 6/2 5/1 4/2\n")
        mesh = nephele.read(path)
        mesh.save(self.path("b.obj"))
        pickle.loads(pickle.dumps(mesh)).save(self.path("c.obj"))
        with open(self.path("b.obj"), encoding="ascii") as b, open(self.path("c.obj"), encoding="ascii") as c:
            text = b.read()
            self.assertEqual(c.read(), text)
        self.assertIn("usemtl stone", text)


class WordsOfMeshes(Case):
    def test_take_and_give_them(self):
        mesh = nephele.ls2shape(BALL, 32)
        self.assertIsInstance(mesh, nephele.Mesh)
        self.assertNear(mesh.volume, 4 / 3 * np.pi, 0.05)
        self.assertNear(nephele.shape2ls(mesh, voxel=0.1)((0.95, 0, 0)), 0.05, 0.02)
        cloud = nephele.cumulo(mesh, 0.1, 2)
        self.assertGreater(cloud((0, 0, 0.9)), 0)


if __name__ == "__main__":
    unittest.main()
