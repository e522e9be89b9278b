// What pickles keep of meshes, grids and pictures: all that they are.
#include <pybind11/stl.h>

#include <bit>

#include "apps/python/values.h"
#include "apps/python/watch.h"

namespace nephele::python {
namespace {

template <class T>
py::array_t<T> arrayOf(const T* data, std::size_t count) {
  return py::array_t<T>(py::ssize_t(count), data);
}

/// The numbers of a structure of floats, as an array and back.
template <class T>
using FloatsOf = std::array<float, sizeof(T) / sizeof(float)>;
template <class T>
py::array_t<float> numbersOf(const T& structure) {
  const auto numbers = std::bit_cast<FloatsOf<T>>(structure);
  return arrayOf(numbers.data(), numbers.size());
}
template <class T>
T structureOf(const py::handle& object) {
  return std::bit_cast<T>(object.cast<FloatsOf<T>>());
}

py::tuple tupleOf(const Vec3i& v) {
  return py::make_tuple(v.x, v.y, v.z);
}
Vec3i vectorOf(const py::handle& object) {
  const auto numbers = object.cast<std::array<int, 3>>();
  return {numbers[0], numbers[1], numbers[2]};
}

py::tuple stateOf(const BrickGrid& grid) {
  return py::make_tuple(numbersOf(grid.lattice()), tupleOf(grid.firstBrick()), tupleOf(grid.brickCount()),
                        grid.background(),
                        arrayOf(grid.brick(0), grid.poolSize() * std::size_t(BrickGrid::kVolume)),
                        arrayOf(grid.table().data(), grid.table().size()));
}

std::shared_ptr<const BrickGrid> bricksOf(const py::tuple& state) {
  const auto samples = state[4].cast<Packed<float>>();
  const auto table = state[5].cast<Packed<std::int32_t>>();
  const BrickBox places{vectorOf(state[1]), vectorOf(state[2])};
  const auto grid =
      std::make_shared<BrickGrid>(structureOf<Lattice>(state[0]), places, state[3].cast<float>());
  const std::size_t bricks = std::size_t(samples.size()) / BrickGrid::kVolume;
  grid->appendUnset(bricks - 1);
  std::copy_n(samples.data(), bricks * BrickGrid::kVolume, grid->brick(0));
  for (std::int32_t i = 0; i < std::int32_t(bricks); ++i) grid->setRange(i, rangeOfBrick(grid->brick(i)));
  grid->setTable({table.data(), table.data() + table.size()});
  return grid;
}

/// None of a grid in OpenVDB's form, which its files keep.
py::object stateOfGrid(const std::shared_ptr<PythonGrid>& self) {
  if (!self->isMadeOfBricks()) return py::none();
  py::list parts;
  for (const auto& bricks : self->bricks()) parts.append(stateOf(*bricks));
  VoxelBox box;
  Watch watch;
  watched(watch, py::none(), [&] { box = self->box(); });
  const VdbGridLabel& label = self->label();
  return py::make_tuple(parts, label.name, int(label.gridClass), label.halfFloat, tupleOf(box.first),
                        tupleOf(box.size));
}

std::shared_ptr<PythonGrid> gridOfState(const py::tuple& state) {
  std::vector<std::shared_ptr<const BrickGrid>> parts;
  for (const py::handle& part : state[0]) parts.push_back(bricksOf(part.cast<py::tuple>()));
  const auto grid = std::make_shared<PythonGrid>(
      std::move(parts), VdbGridLabel{state[1].cast<std::string>(), VdbGridInfo::Class(state[2].cast<int>()),
                                     state[3].cast<bool>()});
  grid->setBox({vectorOf(state[4]), vectorOf(state[5])});
  return grid;
}

py::tuple stateOfPicture(const std::shared_ptr<ExrContent>& self) {
  const Image& image = self->image;
  py::list channels;
  for (const Image::Channel& channel : image.channels)
    channels.append(
        py::make_tuple(channel.name, channel.half, arrayOf(channel.values.data(), channel.values.size())));
  py::object window = py::none();
  if (const auto& d = image.display) window = py::make_tuple(d->x, d->y, d->width, d->height);
  return py::make_tuple(image.width, image.height, window, channels, numbersOf(self->camera), self->metadata);
}

std::shared_ptr<ExrContent> pictureOfState(const py::tuple& state) {
  auto content = std::make_shared<ExrContent>();
  Image& image = content->image;
  image.width = state[0].cast<int>();
  image.height = state[1].cast<int>();
  if (!state[2].is_none()) {
    const auto d = state[2].cast<std::array<int, 4>>();
    image.display = Image::Display{d[0], d[1], d[2], d[3]};
  }
  for (const py::handle& item : state[3]) {
    const auto [name, isHalf, array] = item.cast<std::tuple<std::string, bool, Packed<float>>>();
    image.add(name, isHalf).values.assign(array.data(), array.data() + array.size());
  }
  content->camera = structureOf<ImageCamera>(state[4]);
  content->metadata = state[5].cast<std::map<std::string, std::string>>();
  image.check();
  return content;
}

py::tuple stateOfMesh(const std::shared_ptr<felt::Shape>& self) {
  const Mesh& mesh = self->mesh;
  py::list attributes, groups;
  for (const MeshAttribute& a : mesh.attributes)
    attributes.append(
        py::make_tuple(a.name, int(a.domain), a.width, arrayOf(a.values.data(), a.values.size())));
  for (const MeshGroup& g : mesh.groups)
    groups.append(py::make_tuple(g.name, g.firstFace, g.faceCount, g.material));
  return py::make_tuple(
      self->name, arrayOf(reinterpret_cast<const double*>(mesh.positions.data()), 3 * mesh.positions.size()),
      arrayOf(mesh.corners.data(), mesh.corners.size()),
      arrayOf(mesh.faceStart.data(), mesh.faceStart.size()), attributes, groups, mesh.materialFiles);
}

std::shared_ptr<felt::Shape> meshOfState(const py::tuple& state) {
  auto shape = std::make_shared<felt::Shape>();
  shape->name = state[0].cast<std::string>();
  Mesh& mesh = shape->mesh;
  const auto positions = state[1].cast<Packed<double>>();
  for (py::ssize_t i = 0; i + 3 <= positions.size(); i += 3)
    mesh.positions.emplace_back(positions.data()[i], positions.data()[i + 1], positions.data()[i + 2]);
  const auto corners = state[2].cast<Packed<std::uint32_t>>(),
             starts = state[3].cast<Packed<std::uint32_t>>();
  mesh.corners.assign(corners.data(), corners.data() + corners.size());
  mesh.faceStart.assign(starts.data(), starts.data() + starts.size());
  for (const py::handle& item : state[4]) {
    const auto [name, domain, width, array] = item.cast<std::tuple<std::string, int, int, Packed<float>>>();
    mesh.attributes.push_back({name, MeshAttribute::Domain(domain), width,
                               std::vector<float>(array.data(), array.data() + array.size())});
  }
  for (const py::handle& item : state[5]) {
    const auto [name, first, count, material] =
        item.cast<std::tuple<std::string, std::uint32_t, std::uint32_t, std::string>>();
    mesh.groups.push_back({name, first, count, material});
  }
  mesh.materialFiles = state[6].cast<std::vector<std::string>>();
  requireValid(mesh);
  return shape;
}

}  // namespace

void addPickles(py::module_& module) {
  module.def("_state_of_mesh", stateOfMesh);
  module.def("_mesh_of_state", meshOfState);
  module.def("_state_of_grid", stateOfGrid);
  module.def("_grid_of_state", gridOfState);
  module.def("_state_of_picture", stateOfPicture);
  module.def("_picture_of_state", pictureOfState);
}

}  // namespace nephele::python
