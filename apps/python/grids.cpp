// Grids from and to numpy's arrays. Arrays count voxels along x, y, z; what is made here has x fastest in
// memory, as bricks do.
#include <pybind11/stl.h>

#include <cstring>

#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::python {
namespace {

using pybind11::literals::operator""_a;
using Self = std::shared_ptr<PythonGrid>;
using Class = VdbGridInfo::Class;
using Bricks = std::vector<std::shared_ptr<const BrickGrid>>;

/// Numbers of an array of three axes, wherever they lie.
struct ArrayView {
  const char* data;
  std::array<py::ssize_t, 3> strides;
  Vec3i size;

  float at(int x, int y, int z) const {
    float value;
    // Arrays need not be aligned.
    std::memcpy(&value, data + x * strides[0] + y * strides[1] + z * strides[2], sizeof(float));
    return value;
  }
};

/// Whether a sample that brick `brick` stores differs from the background, `first` being the voxel of the
/// array's first number. Those of its neighbours count: what is interpolated in its cells reads them.
bool holdsAnything(const ArrayView& array, const Vec3i& first, const Vec3i& brick, float background) {
  const Vec3i own = brick * kBrickSide - first, before{1, 1, 1}, behind{10, 10, 10};
  const Vec3i low = max(own - before, {}), high = min(own + behind, array.size);
  for (int z = low.z; z < high.z; ++z)
    for (int y = low.y; y < high.y; ++y)
      for (int x = low.x; x < high.x; ++x)
        if (!(array.at(x, y, z) == background)) return true;
  return false;
}

/// Writes the samples of its own.
void fill(float* samples, const ArrayView& array, const Vec3i& first, const Vec3i& brick, float background) {
  const Vec3i own = brick * kBrickSide - first;
  for (int z = 0; z < kBrickSide; ++z)
    for (int y = 0; y < kBrickSide; ++y)
      for (int x = 0; x < kBrickSide; ++x) {
        const Vec3i at = own + Vec3i{x, y, z};
        const bool isThere = at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < array.size.x &&
                             at.y < array.size.y && at.z < array.size.z;
        samples[sampleOffset(x, y, z)] = isThere ? array.at(at.x, at.y, at.z) : background;
      }
}

std::shared_ptr<BrickGrid> bricksOf(const ArrayView& array, const Vec3i& first, const Lattice& lattice,
                                    float background, const Progress& progress) {
  // Bricks beside the array store samples of it, too.
  BrickBox places{brickOf(first - Vec3i{2, 2, 2}), {}};
  places.count = brickOf(first + array.size) - places.first + Vec3i{1, 1, 1};
  std::vector<std::uint8_t> isHeld(places.size());
  parallelFor(
      places.size(), 64,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          isHeld[i] = holdsAnything(array, first, places.at(i), background);
      },
      progress);
  auto grid = std::make_shared<BrickGrid>(lattice, places, background);
  std::vector<std::size_t> held;
  for (std::size_t i = 0; i < isHeld.size(); ++i)
    if (isHeld[i] != 0) held.push_back(i);
  if (held.empty()) return grid;
  const std::int32_t start = grid->append(held.size());
  parallelFor(
      held.size(), 64,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3i brick = places.at(held[i]);
          const std::int32_t pool = start + std::int32_t(i);
          fill(grid->brick(pool), array, first, brick, background);
          grid->place(brick, pool);
        }
      },
      progress);
  fillBorders(*grid);
  return grid;
}

Class classNamed(const std::string& name) {
  if (name == "fog") return Class::fogVolume;
  if (name == "level set") return Class::levelSet;
  if (name == "unknown") return Class::unknown;
  throw py::value_error("kind must be fog, level set or unknown, got '" + name + "'");
}

const char* nameOf(Class gridClass) {
  return gridClass == Class::fogVolume   ? "fog"
         : gridClass == Class::levelSet  ? "level set"
         : gridClass == Class::staggered ? "staggered"
                                         : "unknown";
}

Self makeGrid(const py::object& object, double voxelSize, const py::object& origin, const std::string& name,
              const std::optional<std::string>& kind, std::optional<double> background, bool half) {
  const py::array_t<float> array = floatsFrom(object, "grid");
  const bool isVector = array.ndim() == 4 && array.shape(3) == 3;
  if (array.ndim() != 3 && !isVector)
    throw py::value_error("grid: (nx, ny, nz) or (nx, ny, nz, 3) is needed, got " + shapeText(array));
  if (array.size() == 0) throw py::value_error("grid: the array is empty: " + shapeText(array));
  for (int axis = 0; axis < 3; ++axis)
    if (array.shape(axis) > 1 << 20) throw py::value_error("grid: more than 2^20 voxels along an axis");
  if (!(voxelSize > 0 && voxelSize < 1e30))
    throw py::value_error("grid: voxel_size must be > 0, got " + numberText(voxelSize));
  const Class gridClass = kind ? classNamed(*kind) : isVector ? Class::unknown : Class::fogVolume;
  if (gridClass == Class::levelSet && isVector)
    throw py::value_error("grid: a level set holds numbers, not vectors");
  const float outside = float(background.value_or(gridClass == Class::levelSet ? -3 * voxelSize : 0));
  const Vec3d corner = origin.is_none() ? Vec3d{} : vectorFrom(origin, "origin");
  if (!isFinite(corner)) throw py::value_error("grid: origin must be finite");
  // Voxels of the library stand at multiples of their size wherever that can be.
  const Vec3d steps = corner / voxelSize;
  const Vec3d whole{std::round(steps.x), std::round(steps.y), std::round(steps.z)};
  const bool isAligned = length(steps - whole) < 1e-4 && length(whole) < 1e9;
  Lattice lattice = Lattice::uniform(float(voxelSize));
  if (!isAligned) lattice = Lattice::of({Mat3f::scaling(float(voxelSize)), felt::toFloat(corner)});
  const Vec3i first = isAligned ? Vec3i(whole) : Vec3i{};
  const Vec3i size{int(array.shape(0)), int(array.shape(1)), int(array.shape(2))};
  Bricks bricks;
  Watch watch;
  watched(watch, py::none(), [&] {
    for (int c = 0; c < (isVector ? 3 : 1); ++c) {
      const ArrayView view{
          reinterpret_cast<const char*>(array.data()) + (isVector ? c * array.strides(3) : 0),
          {array.strides(0), array.strides(1), array.strides(2)},
          size};
      auto grid = bricksOf(view, first, lattice, outside, watch);
      for (const Interval& range : grid->ranges())
        require(std::isfinite(range.min) && std::isfinite(range.max),
                "grid: the array holds values that are not finite");
      bricks.push_back(std::move(grid));
    }
  });
  auto grid = std::make_shared<PythonGrid>(std::move(bricks), VdbGridLabel{name, gridClass, half});
  grid->setBox({first, size});
  return grid;
}

/// Values of voxels in a box, x fastest.
void fillDense(const BrickGrid& grid, const VoxelBox& box, float* to, std::size_t step,
               const Progress& progress) {
  const auto nx = std::size_t(box.size.x), ny = std::size_t(box.size.y);
  const int firstZ = brickOf(box.first.z), firstY = brickOf(box.first.y), firstX = brickOf(box.first.x);
  const int lastX = brickOf(box.first.x + box.size.x - 1), lastY = brickOf(box.first.y + box.size.y - 1);
  const int slabs = brickOf(box.first.z + box.size.z - 1) - firstZ + 1, rows = lastY - firstY + 1;
  const auto rowOf = [&](int y, int z, float* row) {
    for (int bx = firstX; bx <= lastX; ++bx) {
      const int begin = std::max(bx * kBrickSide, box.first.x),
                end = std::min((bx + 1) * kBrickSide, box.first.x + box.size.x);
      const std::int32_t pool = grid.poolIndex({bx, brickOf(y), brickOf(z)});
      float* place = row + std::size_t(begin - box.first.x) * step;
      if (pool == 0 && step == 1) {
        std::fill_n(place, end - begin, grid.background());
        continue;
      }
      const float* samples =
          grid.brick(pool) + sampleOffset(insideBrick(begin), insideBrick(y), insideBrick(z));
      if (step == 1 && end - begin == kBrickSide)
        std::memcpy(place, samples, kBrickSide * sizeof(float));
      else
        for (int i = 0; i < end - begin; ++i) place[std::size_t(i) * step] = samples[i];
    }
  };
  parallelFor(
      std::size_t(slabs) * std::size_t(rows), 8,
      [&](std::size_t first, std::size_t last) {
        for (std::size_t part = first; part < last; ++part) {
          const int bz = firstZ + int(part) / rows, by = firstY + int(part) % rows;
          for (int z = std::max(bz * kBrickSide, box.first.z);
               z < std::min((bz + 1) * kBrickSide, box.first.z + box.size.z); ++z)
            for (int y = std::max(by * kBrickSide, box.first.y);
                 y < std::min((by + 1) * kBrickSide, box.first.y + box.size.y); ++y)
              rowOf(y, z,
                    to + ((std::size_t(z - box.first.z) * ny + std::size_t(y - box.first.y)) * nx) * step);
        }
      },
      progress);
}

py::array toArray(const Self& self,
                  const std::optional<std::pair<std::array<int, 3>, std::array<int, 3>>>& asked) {
  VoxelBox box;
  Bricks bricks;
  Watch watch;
  watched(watch, py::none(), [&] {
    bricks = self->bricks();
    box = self->box();
  });
  if (asked) {
    const auto& [low, high] = *asked;
    box = {{low[0], low[1], low[2]}, {high[0] - low[0], high[1] - low[1], high[2] - low[2]}};
    if (box.size.x <= 0 || box.size.y <= 0 || box.size.z <= 0)
      throw py::value_error("to_array: box must be (first, end) with end above first along all axes");
  }
  const auto step = py::ssize_t(bricks.size());
  std::vector<py::ssize_t> shape{box.size.x, box.size.y, box.size.z}, strides{4 * step};
  strides.push_back(strides[0] * shape[0]);
  strides.push_back(strides[1] * shape[1]);
  if (step > 1) {
    shape.push_back(3);
    strides.push_back(4);
  }
  py::array_t<float> array(shape, strides);
  if (array.size() == 0) return array;
  float* to = array.mutable_data();
  detail::adviseHugePages(to, to + array.size());
  watched(watch, py::none(), [&] {
    for (std::size_t c = 0; c < bricks.size(); ++c) fillDense(*bricks[c], box, to + c, bricks.size(), watch);
  });
  return array;
}

/// Made without the GIL where they are not there.
Bricks heldBricks(const Self& self) {
  Bricks bricks;
  Watch watch;
  atOnce(watch, [&] { bricks = self->bricks(); });
  return bricks;
}

std::shared_ptr<const BrickGrid> onlyBricks(const Self& self) {
  const Bricks bricks = heldBricks(self);
  if (bricks.size() != 1) throw py::type_error("a grid of vectors has bricks for each of its components");
  return bricks[0];
}

py::tuple bricksView(const Self& self) {
  const std::shared_ptr<const BrickGrid> grid = onlyBricks(self);
  constexpr py::ssize_t kRow = 4 * BrickLayout::kWidth, kSlab = kRow * BrickLayout::kWidth;
  const auto side = py::ssize_t(BrickLayout::kWidth);
  const py::array values = viewOf(grid->brick(0), {py::ssize_t(grid->poolSize()), side, side, side},
                                  {py::ssize_t(4 * BrickLayout::kVolume), kSlab, kRow, 4}, grid);
  const Vec3i count = grid->brickCount(), first = grid->firstBrick();
  const py::array table = viewOf(grid->table().data(), {count.z, count.y, count.x},
                                 {4 * py::ssize_t(count.x) * count.y, 4 * py::ssize_t(count.x), 4}, grid);
  return py::make_tuple(values, table,
                        py::make_tuple(first.x * kBrickSide, first.y * kBrickSide, first.z * kBrickSide));
}

py::object fieldOf(const Self& self) {
  const Bricks bricks = heldBricks(self);
  if (bricks.size() == 1) return toPython(felt::Value(gridField(bricks[0])));
  return toPython(felt::Value(gridField(VectorGrids{bricks[0], bricks[1], bricks[2]})));
}

py::dict infoOf(const Self& self) {
  VdbGridInfo info;
  Watch watch;
  watched(watch, py::none(), [&] { info = describe(self->vdb()); });
  return py::dict(
      "name"_a = info.name, "type"_a = info.type, "kind"_a = nameOf(info.gridClass),
      "active_voxels"_a = info.activeVoxels,
      "index_box"_a = py::make_tuple(py::make_tuple(info.indexMin.x, info.indexMin.y, info.indexMin.z),
                                     py::make_tuple(info.indexMax.x, info.indexMax.y, info.indexMax.z)),
      "voxel_size"_a = info.voxelSize.x, "memory_bytes"_a = info.memoryBytes, "metadata"_a = info.metadata);
}

std::shared_ptr<felt::Shape> surfaceOf(const Self& self, double isovalue) {
  auto shape = std::make_shared<felt::Shape>();
  shape->name = self->label().name;
  Watch watch;
  const auto grid = onlyBricks(self);
  watched(watch, py::none(), [&] { shape->mesh = marchingCubes(*grid, float(isovalue), watch); });
  return shape;
}

py::list readGrids(const std::string& path) {
  std::vector<VdbGrid> grids;
  Watch watch;
  watched(watch, py::none(), [&] { grids = readVdbFile(path); });
  py::list all;
  for (const VdbGrid& grid : grids)
    if (valuesOf(grid) != VdbValues::other) all.append(std::make_shared<PythonGrid>(grid));
  return all;
}

void writeGrids(const std::string& path, const std::vector<Self>& grids,
                const std::map<std::string, std::string>& metadata) {
  Watch watch;
  watched(watch, py::none(), [&] {
    require(path.ends_with(".vdb") || path.ends_with(".VDB"),
            path + ": grids are written to files that end in .vdb");
    std::vector<VdbGrid> all;
    for (const Self& grid : grids) all.push_back(grid->vdb());
    writeVdbFile(path, all, metadata);
  });
}

/// The same values, which are not copied, under another name in files.
Self renamed(const Self& self, const std::string& name) {
  if (self->label().name == name) return self;
  Self result;
  Watch watch;
  watched(watch, py::none(), [&] {
    const MemoryFile file(name, ".vdb");
    // Where OpenVDB keeps names.
    writeVdbFile(file.path(), {self->vdb()}, {{"name", name}});
    result = std::make_shared<PythonGrid>(MemoryFile::contentOf<std::vector<VdbGrid>>(file.path())->front());
  });
  return result;
}

}  // namespace

PythonGrid::PythonGrid(VdbGrid grid)
    : label_(labelOf(grid)), isVector_(valuesOf(grid) == VdbValues::vector), vdb_(std::move(grid)) {}

PythonGrid::PythonGrid(Bricks bricks, VdbGridLabel label)
    : label_(std::move(label)),
      isVector_(bricks.size() == 3),
      isMadeOfBricks_(true),
      bricks_(std::move(bricks)) {}

const VdbGrid& PythonGrid::vdb() {
  const std::lock_guard lock(mutex_);
  if (!vdb_)
    vdb_ = isVector_ ? toVdb(VectorGrids{bricks_[0], bricks_[1], bricks_[2]}, label_)
                     : toVdb(*bricks_[0], label_);
  return *vdb_;
}

const Bricks& PythonGrid::bricks() {
  const std::lock_guard lock(mutex_);
  if (!bricks_.empty()) return bricks_;
  if (isVector_)
    for (const VdbGrid& part : vectorComponents(*vdb_)) bricks_.push_back(toBricks(part));
  else
    bricks_.push_back(toBricks(*vdb_));
  return bricks_;
}

VoxelBox PythonGrid::box() {
  {
    const std::lock_guard lock(mutex_);
    if (box_) return *box_;
  }
  const VdbGridInfo info = describe(vdb());
  const std::lock_guard lock(mutex_);
  box_ = VoxelBox{info.indexMin,
                  info.activeVoxels == 0 ? Vec3i{} : info.indexMax - info.indexMin + Vec3i{1, 1, 1}};
  return *box_;
}

void addGrids(py::module_& module) {
  py::class_<PythonGrid, Self>(module, "Grid",
                               "Numbers or vectors on sparse voxels, which never change. Shapes are positive "
                               "inside, also those of files, where "
                               "OpenVDB's sign is the other one.")
      .def(py::init(&makeGrid), "array"_a, "voxel_size"_a = 1.0, py::kw_only(), "origin"_a = py::none(),
           "name"_a = "density", "kind"_a = py::none(), "background"_a = py::none(), "half"_a = false,
           "From (nx, ny, nz) numbers or (nx, ny, nz, 3) vectors of any type and strides, read where they "
           "lie if they "
           "are 32 bit floats and copied once. array[i, j, k] stands at origin + voxel_size (i, j, k). "
           "`kind` is fog "
           "(the default), level set (positive inside) or unknown; what equals `background` takes no memory.")
      .def("to_array", toArray, "box"_a = py::none(),
           "Values as (nx, ny, nz), or (nx, ny, nz, 3) of vectors, in memory with x fastest; a copy. `box` "
           "are the "
           "first voxel and the one behind the last; left out, that of the array it was made from or of its "
           "active "
           "voxels, `voxel_box`.")
      .def_property_readonly(
          "voxel_box",
          [](const Self& s) {
            VoxelBox box;
            Watch watch;
            watched(watch, py::none(), [&] { box = s->box(); });
            const Vec3i end = box.first + box.size;
            return py::make_tuple(py::make_tuple(box.first.x, box.first.y, box.first.z),
                                  py::make_tuple(end.x, end.y, end.z));
          },
          "The first voxel and the one behind the last of to_array().")
      .def_property_readonly("bricks", bricksView,
                             "What the grid is made of, read-only, without a copy: (values, table, first). "
                             "values[b] are the samples of "
                             "brick b in the order z, y, x, 11 along each axis: 8 of its own behind one of "
                             "its neighbour, and two of "
                             "the next. table[z, y, x] is the brick at that place, bricks of one value "
                             "standing at many; first is the "
                             "first voxel of the table.")
      .def_property_readonly("field", fieldOf,
                             "The grid as a field: trilinear between voxels, the background outside.")
      .def(
          "__call__", [](const Self& s, const py::object& points) { return fieldOf(s)(points); }, "points"_a,
          "Interpolated values at points.")
      .def_property_readonly(
          "name", [](const Self& s) { return s->label().name; }, "Its name in files.")
      .def_property_readonly(
          "kind", [](const Self& s) { return nameOf(s->label().gridClass); },
          "fog, level set, staggered or unknown.")
      .def_property_readonly(
          "is_vector", [](const Self& s) { return s->isVector(); }, "Whether it holds vectors.")
      .def_property_readonly(
          "voxel_size", [](const Self& s) { return heldBricks(s)[0]->voxelSize(); },
          "Edge of a voxel, world units.")
      .def_property_readonly(
          "background", [](const Self& s) { return heldBricks(s)[0]->background(); }, "The value outside.")
      .def_property_readonly(
          "transform",
          [](const Self& s) {
            const Affine map = heldBricks(s)[0]->indexToWorld();
            py::array_t<double> matrix(std::vector<py::ssize_t>{4, 4});
            auto m = matrix.mutable_unchecked<2>();
            for (int r = 0; r < 4; ++r)
              for (int c = 0; c < 4; ++c)
                m(r, c) = r == 3   ? double(c == 3)
                          : c == 3 ? double(map.translation[r])
                                   : double(map.linear(r, c));
            return matrix;
          },
          "From voxels to the world, (4, 4) for column vectors.")
      .def("info", infoOf, "What a file would say of it, as a dict.")
      .def("mesh", surfaceOf, "isovalue"_a = 0.0, "The surface at a value, by marching cubes, closed.")
      .def("__repr__", [](const Self& s) {
        return "<nephele.Grid '" + s->label().name + "', " + nameOf(s->label().gridClass) + ">";
      });
  module.def("_read_grids", readGrids, "path"_a);
  module.def("_renamed", renamed, "grid"_a, "name"_a);
  module.def("_write_grids", writeGrids, "path"_a, "grids"_a, "metadata"_a);
}

}  // namespace nephele::python
