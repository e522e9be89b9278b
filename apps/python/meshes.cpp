// Meshes from and to numpy's arrays. What a mesh holds is seen without a copy, and cannot be written.
#include <pybind11/stl.h>

#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::python {
namespace {

using pybind11::literals::operator""_a;

Packed<std::int64_t> facesFrom(const py::handle& object) {
  return packedFrom<std::int64_t>(object, "F", Numbers::whole);
}

void setPositions(Mesh& mesh, const py::object& object) {
  const Packed<double> numbers = packedFrom<double>(object, "V");
  if (numbers.ndim() != 2 || numbers.shape(1) != 3)
    throw py::value_error("V: rows of 3 numbers are needed, got " + shapeText(numbers));
  const double* from = numbers.data();
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i, from += 3) {
    mesh.positions.emplace_back(from[0], from[1], from[2]);
    if (!isFinite(mesh.positions.back()))
      throw py::value_error("V: vertex " + std::to_string(i) + " is not finite");
  }
}

void addCorners(Mesh& mesh, const std::int64_t* from, std::size_t count, std::size_t face) {
  for (std::size_t i = 0; i < count; ++i) {
    if (from[i] < 0 || std::size_t(from[i]) >= mesh.positions.size())
      throw py::value_error("F: face " + std::to_string(face) + " has the vertex " + std::to_string(from[i]) +
                            ", but there are " + std::to_string(mesh.positions.size()));
    mesh.corners.push_back(std::uint32_t(from[i]));
  }
  mesh.faceStart.push_back(std::uint32_t(mesh.corners.size()));
}

/// Rows of equal length, or a list of faces of any.
void setFaces(Mesh& mesh, const py::object& object) {
  if (!py::isinstance<py::array>(object) && PySequence_Check(object.ptr())) {
    const auto faces = py::reinterpret_borrow<py::sequence>(object);
    bool isEven = true;
    for (std::size_t f = 0; f < faces.size() && isEven; ++f) {
      if (PySequence_Check(py::object(faces[f]).ptr()) == 0)
        throw py::value_error("F: one row for each face is needed, got a number as face " +
                              std::to_string(f));
      isEven = py::len(faces[f]) == py::len(faces[0]);
    }
    if (!isEven) {
      for (std::size_t f = 0; f < faces.size(); ++f) {
        const Packed<std::int64_t> face = facesFrom(faces[f]);
        addCorners(mesh, face.data(), std::size_t(face.size()), f);
      }
      return;
    }
  }
  const Packed<std::int64_t> faces = facesFrom(object);
  if (faces.size() == 0) return;
  if (faces.ndim() != 2) throw py::value_error("F: one row for each face is needed, got " + shapeText(faces));
  const auto width = std::size_t(faces.shape(1));
  for (py::ssize_t f = 0; f < faces.shape(0); ++f)
    addCorners(mesh, faces.data() + std::size_t(f) * width, width, std::size_t(f));
}

/// (n,) and (n, w) belong to vertices, (faces, corners, w) and a list of corners (c, w) to corners.
void addAttribute(Mesh& mesh, const std::string& name, const py::object& object) {
  const Packed<float> values = packedFrom<float>(object, "attribute '" + name + "'");
  MeshAttribute attribute{.name = name,
                          .values = std::vector<float>(values.data(), values.data() + values.size())};
  const auto rows = std::size_t(values.ndim() > 0 ? values.shape(0) : 0);
  const std::size_t vertices = mesh.positions.size(), corners = mesh.corners.size();
  if (values.ndim() == 3 && rows == mesh.faceCount() && rows * std::size_t(values.shape(1)) == corners) {
    attribute.domain = MeshAttribute::Domain::corner;
    attribute.width = int(values.shape(2));
  } else if ((values.ndim() == 1 || values.ndim() == 2) && (rows == vertices || rows == corners)) {
    attribute.domain = rows == vertices ? MeshAttribute::Domain::vertex : MeshAttribute::Domain::corner;
    attribute.width = values.ndim() == 1 ? 1 : int(values.shape(1));
  } else {
    throw py::value_error("attribute '" + name + "': got " + shapeText(values) + " for " +
                          std::to_string(vertices) + " vertices and " + std::to_string(mesh.faceCount()) +
                          " faces of " + std::to_string(corners) + " corners");
  }
  mesh.attributes.push_back(std::move(attribute));
}

std::shared_ptr<felt::Shape> makeMesh(
    const py::object& positions, const py::object& faces, const std::optional<py::dict>& attributes,
    const std::vector<std::tuple<std::string, std::uint32_t, std::uint32_t>>& groups,
    const std::string& name) {
  auto shape = std::make_shared<felt::Shape>();
  shape->name = name;
  setPositions(shape->mesh, positions);
  setFaces(shape->mesh, faces);
  if (attributes)
    for (const auto& [key, value] : *attributes)
      addAttribute(shape->mesh, nameFrom(key, "an attribute"), py::reinterpret_borrow<py::object>(value));
  for (const auto& [group, first, count] : groups) shape->mesh.groups.push_back({group, first, count});
  requireValid(shape->mesh);
  return shape;
}

constexpr py::ssize_t bytes(std::size_t count) {
  return py::ssize_t(count);
}

py::array positionsOf(const std::shared_ptr<felt::Shape>& self) {
  const auto& p = self->mesh.positions;
  return viewOf(reinterpret_cast<const double*>(p.data()), {bytes(p.size()), 3},
                {sizeof(Vec3d), sizeof(double)}, self);
}

/// Corners of every face, where all have as many; else 0.
std::size_t evenSide(const Mesh& mesh) {
  if (mesh.faceCount() == 0) return 0;
  const std::size_t side = mesh.face(0).size();
  for (std::size_t f = 1; f < mesh.faceCount(); ++f)
    if (mesh.face(f).size() != side) return 0;
  return side;
}

/// Faces as rows, where all have as many corners.
py::object facesOf(const std::shared_ptr<felt::Shape>& self) {
  const Mesh& mesh = self->mesh;
  const std::size_t count = mesh.faceCount(), width = count == 0 ? 3 : evenSide(mesh);
  if (width == 0)
    throw Error(
        "the faces differ in their number of corners; ask for corners and face_start, or for "
        "triangulated().F");
  return viewOf(mesh.corners.data(), {bytes(count), bytes(width)}, {bytes(4 * width), 4}, self);
}

py::dict attributesOf(const std::shared_ptr<felt::Shape>& self) {
  py::dict all;
  const Mesh& mesh = self->mesh;
  for (const MeshAttribute& attribute : mesh.attributes) {
    const auto width = std::size_t(attribute.width);
    const std::size_t rows = attribute.values.size() / std::max<std::size_t>(width, 1);
    const py::ssize_t row = bytes(4 * width);
    std::vector<py::ssize_t> shape{bytes(rows)}, strides{row};
    const std::size_t side = evenSide(mesh);
    const bool isEven = attribute.domain == MeshAttribute::Domain::corner && side > 0;
    if (isEven) {
      shape = {bytes(mesh.faceCount()), bytes(side)};
      strides = {bytes(side) * row, row};
    }
    if (width > 1 || isEven) {
      shape.push_back(bytes(width));
      strides.push_back(4);
    }
    all[py::cast(attribute.name)] = viewOf(attribute.values.data(), shape, strides, self);
  }
  return all;
}

std::shared_ptr<felt::Shape> withMesh(const std::shared_ptr<felt::Shape>& self, Mesh mesh) {
  auto shape = std::make_shared<felt::Shape>();
  shape->mesh = std::move(mesh);
  shape->name = self->name;
  return shape;
}

py::dict diagnosisOf(const std::shared_ptr<felt::Shape>& self) {
  MeshDiagnosis is;
  Watch watch;
  watched(watch, py::none(), [&] { is = diagnose(self->mesh, watch); });
  return py::dict("vertices"_a = is.vertices, "faces"_a = is.faces, "triangles"_a = is.triangles,
                  "closed"_a = is.closed(), "manifold"_a = is.manifold(), "components"_a = is.components,
                  "euler"_a = is.eulerCharacteristic, "volume"_a = is.volume, "area"_a = is.area,
                  "problems"_a = is.problems());
}

std::shared_ptr<ExrContent> pictureOf(const std::shared_ptr<felt::Shape>& self, int width, int height,
                                      double azimuth, double elevation) {
  auto picture = std::make_shared<ExrContent>();
  Watch watch;
  watched(watch, py::none(), [&] {
    picture->image = pictureSurfaces({{.mesh = self->mesh, .colour = kShapeColour}},
                                     {.width = width,
                                      .height = height,
                                      .azimuthDegrees = float(azimuth),
                                      .elevationDegrees = float(elevation),
                                      .samples = 4},
                                     watch);
  });
  return picture;
}

}  // namespace

void addMeshes(py::module_& module) {
  using Self = std::shared_ptr<felt::Shape>;
  py::class_<felt::Shape, Self>(module, "Mesh",
                                "Polygons with named attributes, which never change: V (n, 3) 64 bit floats, "
                                "F (m, k) 32 bit indices, both seen "
                                "without a copy. World units, counter-clockwise front faces.")
      .def(py::init(&makeMesh), "V"_a, "F"_a, "attributes"_a = py::none(), py::kw_only(),
           "groups"_a = py::list(), "name"_a = "mesh",
           "Vertices in rows of 3; faces in rows of indices, or a list of faces of any length. Attributes by "
           "name: "
           "(n,) or (n, w) for vertices, (m, k, w) for the corners of faces. Groups: (name, first face, "
           "number of "
           "faces). Everything is copied.")
      .def_property_readonly("V", positionsOf, "Vertices, (n, 3), read-only, without a copy.")
      .def_property_readonly("F", facesOf,
                             "Faces, (m, k), read-only, without a copy. Raises Error where faces differ "
                             "in their number of corners.")
      .def_property_readonly(
          "corners",
          [](const Self& s) {
            return viewOf(s->mesh.corners.data(), {bytes(s->mesh.corners.size())}, {4}, s);
          },
          "Vertices of all faces, one face after the other, without a copy.")
      .def_property_readonly(
          "face_start",
          [](const Self& s) {
            return viewOf(s->mesh.faceStart.data(), {bytes(s->mesh.faceStart.size())}, {4}, s);
          },
          "Where in `corners` each face begins, and the end.")
      .def_property_readonly(
          "attributes", attributesOf,
          "Arrays by name, without copies: of vertices (n,) or (n, w), of corners (m, 3, w) or (c, w).")
      .def_property_readonly(
          "groups",
          [](const Self& s) {
            py::list all;
            for (const MeshGroup& g : s->mesh.groups)
              all.append(py::make_tuple(g.name, g.firstFace, g.faceCount));
            return all;
          },
          "Runs of faces under a name: (name, first face, number of faces).")
      .def_property_readonly(
          "name", [](const Self& s) { return s->name; }, "What messages call it.")
      .def_property_readonly(
          "box",
          [](const Self& s) {
            const Box box = boundingBox(s->mesh);
            return py::make_tuple(py::make_tuple(box.min.x, box.min.y, box.min.z),
                                  py::make_tuple(box.max.x, box.max.y, box.max.z));
          },
          "Lowest and highest corner of the box around all faces.")
      .def_property_readonly(
          "volume", [](const Self& s) { return massProperties(s->mesh).volume; },
          "Enclosed volume; meaningful where closed.")
      .def_property_readonly(
          "area", [](const Self& s) { return surfaceArea(s->mesh); }, "Area of all faces.")
      .def(
          "triangulated", [](const Self& s) { return withMesh(s, triangulated(s->mesh)); },
          "The same surface with triangles only.")
      .def("diagnosis", diagnosisOf, "What it is and what is wrong with it, as a dict.")
      .def("picture", &pictureOf, "width"_a = 640, "height"_a = 360, "azimuth"_a = 25, "elevation"_a = 14,
           "A quick picture of it, from a camera that frames it.")
      .def("__len__", [](const Self& s) { return s->mesh.faceCount(); })
      .def("__repr__", [](const Self& s) {
        return "<nephele.Mesh of " + std::to_string(s->mesh.positions.size()) + " vertices and " +
               std::to_string(s->mesh.faceCount()) + " faces>";
      });
}

}  // namespace nephele::python
