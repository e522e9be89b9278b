"""Meshes, grids and pictures: files, other libraries, notebooks, pickles."""

import os
import struct
import tempfile
import zlib

from . import _nephele
from ._nephele import Error, Grid, Mesh, Picture

_MESHES = (".obj", ".ply", ".stl", ".off", ".gltf", ".glb")
_VOLUMES = (".vdb", ".nvdb")
# Names of files; what is no UTF-8 is read as os.fsdecode does.
PATHS = (str, bytes, os.PathLike)


def _extension(path):
    return os.path.splitext(path)[1].lower()


def grids_of(grids, file):
    """One grid as it is, several as a dict by name."""
    if len(grids) == 1:
        return grids[0]
    named = {}
    for grid in grids:
        if grid.name in named:
            raise Error(f"{file}: has two grids named '{grid.name}', and a dict holds one of each name")
        named[grid.name] = grid
    return named


def named_grids(grids):
    """The grids of a dict under the names that it gives them."""
    return [_nephele._renamed(grid, name) for name, grid in grids.items()]


def read(path):
    """What is in a file: a Mesh (.obj .ply .stl .off .gltf .glb), a Grid or a dict of them by name (.vdb .nvdb), or a
    Picture (.exr .png .hdr). Raises Error naming the path, also where two grids have one name."""
    path = os.fsdecode(path)
    if _extension(path) in _VOLUMES:
        grids = _nephele._read_grids(path)
        if not grids:
            raise Error(f"{path}: no grid of numbers or vectors")
        return grids_of(grids, path)
    if _extension(path) in _MESHES:
        return _nephele._read_mesh(path)
    return _nephele._read_picture(path)


def write(path, thing):
    """Writes a Mesh (.obj .ply .stl), a Grid, a list of them or a dict by name (.vdb), or a Picture (.exr .png);
    whole or not at all. Raises Error naming the path."""
    path = os.fsdecode(path)
    if isinstance(thing, Picture):
        thing.save(path)
    elif isinstance(thing, Grid):
        _nephele._write_grids(path, [thing], {})
    elif isinstance(thing, dict):
        _nephele._write_grids(path, named_grids(thing), {})
    elif isinstance(thing, list) and all(isinstance(item, Grid) for item in thing):
        _nephele._write_grids(path, thing, {})
    else:
        _nephele._write_mesh(path, as_mesh(thing))


def info(path):
    """What `nephele info` says of a file, as a dict."""
    return _nephele._info(os.fsdecode(path))


def as_mesh(thing):
    """A Mesh of what other libraries hold: anything with vertices and faces (trimesh, open3d: triangles), points and
    faces (pyvista), a pair (V, F), an
    array (n, 3) of points, or the path of a file. A Mesh is itself; of volumes it is what the verb mesh makes."""
    import numpy

    if isinstance(thing, Mesh):
        return thing
    if isinstance(thing, Grid) or isinstance(thing, PATHS) and _extension(os.fsdecode(thing)) in _VOLUMES:
        from ._verbs import mesh

        return mesh(thing)
    if isinstance(thing, PATHS):
        return _nephele._read_mesh(os.fsdecode(thing))
    if isinstance(thing, numpy.ndarray) and thing.ndim == 2:
        return Mesh(thing, numpy.zeros((0, 3), int))
    if isinstance(thing, (tuple, list)) and len(thing) == 2:
        return Mesh(*thing)
    vertices = getattr(thing, "vertices", None)
    faces = getattr(thing, "faces", None)
    if faces is None:
        faces = getattr(thing, "triangles", None)
    attributes = {}
    if vertices is None and hasattr(thing, "points"):
        vertices = thing.points
        faces = _faces_of_vtk(numpy.asarray(faces))
        attributes = {name: values for name, values in getattr(thing, "point_data", {}).items()
                      if getattr(values, "ndim", 0) in (1, 2) and values.dtype.kind in "fiu"}
    if vertices is None or faces is None:
        raise TypeError(f"a mesh is needed, with vertices and faces, not a {type(thing).__name__}")
    uv = getattr(getattr(thing, "visual", None), "uv", None)
    if uv is not None:
        attributes["uv"] = uv
    return Mesh(numpy.asarray(vertices), numpy.asarray(faces) if not isinstance(faces, list) else faces, attributes)


def _faces_of_vtk(flat):
    """VTK's list: the number of corners before each face."""
    if flat.ndim == 2:
        return flat
    faces, at = [], 0
    if len(flat) and len(flat) % (flat[0] + 1) == 0:
        rows = flat.reshape(-1, flat[0] + 1)
        if (rows[:, 0] == flat[0]).all():
            return rows[:, 1:]
    while at < len(flat):
        faces.append(flat[at + 1:at + 1 + flat[at]])
        at += flat[at] + 1
    return faces


def png(pixels):
    """The bytes of a PNG file of (height, width, 3) bytes."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + pixels[y].tobytes() for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b"")


def _picture_of_grid(grid):
    """A quick picture: fog in the sun, level sets as surfaces; nothing of vectors."""
    if grid.is_vector:
        return None
    if grid.kind == "level set":
        return grid.mesh().picture()
    from ._verbs import render

    return render(grid, size=(480, 270), quality="draft")


def _show(self):
    picture = self if isinstance(self, Picture) else _picture_of_grid(self) if isinstance(self, Grid) else self.picture()
    return None if picture is None else png(picture.screen())


def _mesh_of_state(*state):
    return _nephele._mesh_of_state(state)


def _reduced_mesh(self):
    return _mesh_of_state, _nephele._state_of_mesh(self)


def _grid_of_state(*state):
    return _nephele._grid_of_state(state)


def _grid_of_file(data):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "grid.vdb")
        with open(path, "wb") as file:
            file.write(data)
        return _nephele._read_grids(path)[0]


def _reduced_grid(self):
    state = _nephele._state_of_grid(self)
    if state is not None:
        return _grid_of_state, state
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "grid.vdb")
        write(path, self)
        with open(path, "rb") as file:
            return _grid_of_file, (file.read(),)


def _picture_of_state(*state):
    return _nephele._picture_of_state(state)


def _reduced_picture(self):
    return _picture_of_state, _nephele._state_of_picture(self)


def _saved(self, path):
    """Writes it to a file, whole or not at all."""
    write(path, self)


for _kind, _reduce in ((Mesh, _reduced_mesh), (Grid, _reduced_grid), (Picture, _reduced_picture)):
    _kind.__reduce__ = _reduce
    _kind._repr_png_ = _show
Mesh.save = _saved
Grid.save = _saved
