"""Clouds and level sets: fields, meshes, grids and pictures.

    import nephele
    hare = nephele.read("hare.obj")
    cloud = nephele.cloud(hare, resolution=128)
    picture = nephele.render(cloud, size=(640, 360))
    picture.save("cloud.png")

Shapes are positive inside. World units are metres, y is up. docs/python.md is the tour.
"""

from ._nephele import (
    Cancelled,
    Domain,
    Error,
    Grid,
    MatrixField,
    Mesh,
    Picture,
    ScalarField,
    VectorField,
    __version__,
    field,
    thread_count,
)
from ._objects import as_mesh, info, read, write
from ._verbs import (
    Session,
    advect,
    cloud,
    cut,
    levelset,
    mesh,
    options,
    render,
    transfer,
    transform,
    turntable,
    wisps,
)
from ._words import felt, words

_words.define(globals())

__all__ = [
    "Cancelled", "Domain", "Error", "Grid", "MatrixField", "Mesh", "Picture", "ScalarField", "Session",
    "VectorField",
    "advect", "as_mesh", "cloud", "cut", "felt", "field", "info", "levelset", "mesh", "options", "read", "render",
    "thread_count", "transfer", "transform", "turntable", "wisps", "words", "write",
]
