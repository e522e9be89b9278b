// Fields: values, gradients and ranges at arrays of points, and functions of Python as fields.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <atomic>
#include <cstring>
#include <string_view>

#include "apps/python/values.h"
#include "apps/python/watch.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/system.h"

namespace nephele::python {
namespace {

using pybind11::literals::operator""_a;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
/// Points that a thread evaluates at a time, and those from which on interrupts are looked for.
constexpr std::size_t kPiece = 2048, kMany = 100'000;
/// Functions of Python that call each other through fields end here, before the stack of a thread does.
constexpr int kDeepest = 20;

/// Fields that are functions of Python: where there are none, threads that help need not know whose work it
/// is.
std::atomic<int> functionsOfPython{0};

/// Points as rows of three floats, at any strides.
struct Points {
  py::array_t<float> array;
  std::vector<py::ssize_t> shape;  // without the last axis
  std::size_t count;
};

Points pointsFrom(const py::object& object) {
  Points points{floatsFrom(object, "points"), {}, 1};
  const py::array& array = points.array;
  if (array.ndim() == 0 || array.shape(array.ndim() - 1) != 3)
    throw py::value_error("points: the last axis must have 3 numbers, got " + shapeText(array));
  for (py::ssize_t axis = 0; axis + 1 < array.ndim(); ++axis) {
    points.shape.push_back(array.shape(axis));
    points.count *= std::size_t(array.shape(axis));
  }
  if (array.ndim() != 2)
    points.array = points.array.reshape(std::vector<py::ssize_t>{py::ssize_t(points.count), 3});
  return points;
}

/// Points of an array as three lanes. Those of a plain array are gathered several at a time.
void gather(const char* from, py::ssize_t row, py::ssize_t column, std::size_t count, float* x, float* y,
            float* z) {
  const bool isPlain = row == 3 * sizeof(float) && column == sizeof(float) &&
                       reinterpret_cast<std::uintptr_t>(from) % alignof(float) == 0;
  if (isPlain) {
    const float* p = reinterpret_cast<const float*>(from);
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = p[3 * i];
      y[i] = p[3 * i + 1];
      z[i] = p[3 * i + 2];
    }
    return;
  }
  for (std::size_t i = 0; i < count; ++i, from += row) {
    // Arrays need not be aligned.
    std::memcpy(x + i, from, sizeof(float));
    std::memcpy(y + i, from + column, sizeof(float));
    std::memcpy(z + i, from + 2 * column, sizeof(float));
  }
}

/// Whether the three columns of an array lie in memory as lanes do, as in arrays of Fortran's order.
bool areLanes(const char* from, py::ssize_t row, py::ssize_t column) {
  return row == sizeof(float) && column % py::ssize_t(alignof(float)) == 0 &&
         reinterpret_cast<std::uintptr_t>(from) % alignof(float) == 0;
}

/// body(first, count, x y z) for pieces of the points, on all threads.
template <class Body>
void forPieces(const Points& points, Watch& watch, const Body& body) {
  const char* data = reinterpret_cast<const char*>(points.array.data());
  const py::ssize_t row = points.array.strides(0), column = points.array.strides(1);
  const auto work = [&] {
    parallelFor(
        points.count, kPiece,
        [&](std::size_t begin, std::size_t end) {
          const std::size_t count = end - begin;
          const char* first = data + py::ssize_t(begin) * row;
          if (areLanes(first, row, column)) {
            const auto lane = [&](int axis) {
              return std::span(reinterpret_cast<const float*>(first + axis * column), count);
            };
            body(begin, count, PointSpans{lane(0), lane(1), lane(2)});
            return;
          }
          float x[kPiece], y[kPiece], z[kPiece];
          gather(first, row, column, count, x, y, z);
          body(begin, count, PointSpans{{x, count}, {y, count}, {z, count}});
        },
        watch);
  };
  if (points.count >= kMany)
    watched(watch, py::none(), work);
  else if (points.count > kPiece && functionsOfPython > 0)
    atOnceOnAllThreads(watch, work);
  else
    atOnce(watch, work);
}

/// Room for values that threads will write first.
py::array_t<float> newArray(const std::vector<py::ssize_t>& shape) {
  py::array_t<float> array(shape);
  detail::adviseHugePages(array.mutable_data(), array.mutable_data() + array.size());
  return array;
}

/// Where values go: `out` if there is one, else a new array.
py::array_t<float> arrayFor(const std::vector<py::ssize_t>& shape, const py::object& out,
                            const Points& points) {
  if (out.is_none()) return newArray(shape);
  if (!py::isinstance<py::array_t<float, py::array::c_style>>(out))
    throw py::type_error("out: expected an array of float32 that lies in one piece, in C's order");
  auto array = py::reinterpret_borrow<py::array_t<float>>(out);
  if (std::size_t(array.ndim()) != shape.size() || !std::equal(shape.begin(), shape.end(), array.shape()))
    throw py::value_error(
        fmt::format("out: expected shape ({}), got {}", fmt::join(shape, ", "), shapeText(array)));
  if (!array.writeable()) throw py::value_error("out: the array is read-only");
  if (py::module_::import("numpy").attr("may_share_memory")(array, points.array).cast<bool>())
    throw py::value_error("out: the array shares memory with the points");
  return array;
}

/// Spans of `count` floats each, one after the other in `buffer`.
template <int N>
Spans<N> lanesOf(std::vector<float>& buffer, std::size_t count) {
  buffer.resize(N * count);
  if constexpr (N == 1) {
    return Spans<1>(buffer);
  } else {
    Spans<N> spans;
    for (std::size_t c = 0; c < N; ++c) spans.lanes[c] = std::span(buffer).subspan(c * count, count);
    return spans;
  }
}

/// Puts lanes one point after the other.
void interleave(const std::vector<float>& lanes, std::size_t count, float* to) {
  const std::size_t components = lanes.size() / count;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < components; ++c) to[i * components + c] = lanes[c * count + i];
}

std::vector<py::ssize_t> joined(std::vector<py::ssize_t> shape, std::initializer_list<py::ssize_t> more) {
  shape.insert(shape.end(), more);
  return shape;
}

template <class T>
std::vector<py::ssize_t> shapeOfValues(const Points& points) {
  return joined(points.shape, std::initializer_list<py::ssize_t>(
                                  std::is_same_v<T, float>   ? std::initializer_list<py::ssize_t>{}
                                  : std::is_same_v<T, Vec3f> ? std::initializer_list<py::ssize_t>{3}
                                                             : std::initializer_list<py::ssize_t>{3, 3}));
}

/// A number of Python for one point of a scalar field, else the array.
py::object result(const py::array_t<float>& values) {
  if (values.ndim() == 0) return py::float_(*values.data());
  return values;
}

template <class T>
py::object valuesAt(const PythonField<T>& self, const py::object& object, const py::object& out) {
  constexpr int kLanes = kComponents<T>;
  const Points points = pointsFrom(object);
  py::array_t<float> values = arrayFor(shapeOfValues<T>(points), out, points);
  float* to = values.mutable_data();
  const Field<T> field = self.field();
  Watch watch;
  forPieces(points, watch, [&](std::size_t first, std::size_t count, const PointSpans& xyz) {
    if constexpr (kLanes == 1) {
      field.eval(xyz, Spans<1>(std::span(to + first, count)));
    } else {
      std::vector<float> lanes;
      field.eval(xyz, lanesOf<kLanes>(lanes, count));
      interleave(lanes, count, to + first * kLanes);
    }
  });
  return out.is_none() ? result(values) : py::object(out);
}

template <class T>
py::tuple valuesAndGradientsAt(const PythonField<T>& self, const py::object& object) {
  constexpr int kLanes = kComponents<T>;
  const Points points = pointsFrom(object);
  py::array_t<float> values = newArray(shapeOfValues<T>(points));
  py::array_t<float> gradients = newArray(joined(shapeOfValues<T>(points), {3}));
  float *to = values.mutable_data(), *gradientsTo = gradients.mutable_data();
  const Field<T> field = self.field();
  Watch watch;
  forPieces(points, watch, [&](std::size_t first, std::size_t count, const PointSpans& xyz) {
    std::vector<float> lanes, derivatives;
    const Spans<kLanes> valueLanes = lanesOf<kLanes>(lanes, count);
    field.evalGrad(xyz, valueLanes, lanesOf<3 * kLanes>(derivatives, count));
    interleave(lanes, count, to + first * kLanes);
    interleave(derivatives, count, gradientsTo + first * 3 * kLanes);
  });
  return py::make_tuple(result(values), gradients);
}

Box boxFrom(const py::object& low, const py::object& high) {
  const Box box{felt::toFloat(vectorFrom(low, "low")), felt::toFloat(vectorFrom(high, "high"))};
  if (box.isEmpty()) throw py::value_error("the box is empty: low must not be above high");
  return box;
}

template <class T>
py::object rangeOf(const PythonField<T>& self, const py::object& low, const py::object& high) {
  const Box box = boxFrom(low, high);
  RangeOf<T> range{};
  Watch watch;
  atOnce(watch, [&] { range = self.field().range(box); });
  if constexpr (std::is_same_v<T, float>) {
    return py::make_tuple(range.min, range.max);
  } else {
    py::list all;
    for (const Interval& each : range) all.append(py::make_tuple(each.min, each.max));
    return all;
  }
}

std::shared_ptr<PythonGrid> baked(const PythonScalarField& self, double voxelSize, const py::object& low,
                                  const py::object& high, std::optional<double> band,
                                  std::optional<double> background, const std::string& name, bool isLevelSet,
                                  const py::object& progress) {
  BakeOptions options{.voxelSize = float(voxelSize), .box = boxFrom(low, high)};
  if (isLevelSet && !band) band = 3;
  if (band) options.band = {-float(*band * voxelSize), float(*band * voxelSize)};
  if (background) options.background = float(*background);
  std::shared_ptr<BrickGrid> grid;
  Watch watch;
  watched(watch, progress, [&] {
    const double places = double(options.box.size().x) * options.box.size().y * options.box.size().z /
                          std::pow(kBrickSide * voxelSize, 3);
    require(voxelSize > 0, "bake: voxel_size must be > 0, got " + numberText(voxelSize));
    require(places < 2e9, "bake: voxels of " + numberText(voxelSize) + " are too small for that box");
    grid = bakeGrid(self.field(), options, watch);
  });
  return std::make_shared<PythonGrid>(
      std::vector<std::shared_ptr<const BrickGrid>>{grid},
      VdbGridLabel{name, isLevelSet ? VdbGridInfo::Class::levelSet : VdbGridInfo::Class::fogVolume});
}

/// A function of Python, called with up to 256 points at a time.
template <class T>
class FunctionOfPython final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  FunctionOfPython(py::function function, float step, const RangeOf<T>& range)
      : function_(new py::function(std::move(function))), step_(step), range_(range) {
    ++functionsOfPython;
  }
  ~FunctionOfPython() override {
    --functionsOfPython;
    // At the end of the program there is nobody to give it back to.
    if (!Py_IsInitialized()) return;
    const py::gil_scoped_acquire acquire;
    delete function_;
  }

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch&) const override {
    for (int c = 0; c < kLanes; ++c) std::fill_n(values[c], points.count, kNan);
    const Watch* watch = watchOfThisThread();
    if (watch && watch->cancelled()) return;
    const py::gil_scoped_acquire acquire;
    if (watch && watch->depth() > kDeepest) {
      PyErr_SetString(PyExc_RecursionError, "field: functions of Python call each other too deep");
      keep(watch);
      return;
    }
    try {
      call(points, values);
    } catch (py::error_already_set& error) {
      error.restore();
      keep(watch);
    } catch (const py::builtin_exception& error) {
      error.set_error();
      keep(watch);
    } catch (const std::exception& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
      keep(watch);
    }
  }
  RangeOf<T> range(const Box&, RangeMemo&) const override { return range_; }
  float differenceStep() const override { return step_; }

 private:
  static void keep(const Watch* watch) {
    if (watch)
      watch->keepPythonError();
    else
      PyErr_WriteUnraisable(nullptr);
  }

  void call(const PointBlock& points, const BlockLanes<kLanes>& values) const {
    py::array_t<float> array(std::vector<py::ssize_t>{points.count, 3});
    float* to = array.mutable_data();
    for (int i = 0; i < points.count; ++i) {
      to[3 * i] = points.x[i];
      to[3 * i + 1] = points.y[i];
      to[3 * i + 2] = points.z[i];
    }
    const py::array_t<float> got = floatsFrom((*function_)(array), "what a field's function returns");
    std::vector<py::ssize_t> wanted{points.count};
    if constexpr (kLanes == 3) wanted = {points.count, 3};
    if constexpr (kLanes == 9) wanted = {points.count, 3, 3};
    const bool isScalar = kLanes == 1 && got.ndim() == 0;
    if (!isScalar &&
        (std::size_t(got.ndim()) != wanted.size() || !std::equal(wanted.begin(), wanted.end(), got.shape())))
      throw py::value_error("a field's function must return one value for each of its points: got " +
                            shapeText(got) + " for " + std::to_string(points.count) + " points");
    const auto flat = Packed<float>::ensure(got);
    for (int i = 0; i < points.count; ++i)
      for (int c = 0; c < kLanes; ++c) values[c][i] = flat.data()[isScalar ? 0 : i * kLanes + c];
  }

  py::function* function_;
  float step_;
  RangeOf<T> range_;
};

template <class T>
py::object functionField(const py::function& function, double step,
                         const std::optional<std::pair<float, float>>& range) {
  if (!(step > 0)) throw py::value_error("field: step must be > 0, got " + numberText(step));
  Interval bounds;
  if (range) bounds = {range->first, range->second};
  if (range && !(bounds.min <= bounds.max))
    throw py::value_error("field: range must be (low, high) with low <= high");
  RangeOf<T> all;
  if constexpr (std::is_same_v<T, float>)
    all = bounds;
  else
    all.fill(bounds);
  const Field<T> field(std::make_shared<const FunctionOfPython<T>>(function, float(step), all));
  return py::cast(PythonField<T>{felt::Value(field)});
}

template <class T>
py::class_<PythonField<T>> addField(py::module_& module, const char* name, const char* text) {
  using Self = PythonField<T>;
  return py::class_<Self>(module, name, text)
      .def(
          "__call__", valuesAt<T>, "points"_a, py::kw_only(), "out"_a = py::none(),
          "Values at points, an array of any shape that ends in 3; any dtype and strides, read where it lies "
          "if it holds 32 bit floats, else converted; in Fortran's order, three columns, nothing is moved. "
          "`out`, an array of float32 of the result's shape, is written and returned in place of a new one. "
          "All threads; the GIL is released.")
      .def(
          "gradient",
          [](const Self& self, const py::object& points) -> py::object {
            return valuesAndGradientsAt(self, points)[1];
          },
          "points"_a, "Derivatives by x, y, z along a last axis of their own.")
      .def("value_and_gradient", valuesAndGradientsAt<T>, "points"_a,
           "Values and gradients together, in the time of the gradients.")
      .def("range", rangeOf<T>, "low"_a, "high"_a,
           "Bounds (lowest, highest) that contain every value in the box; for vectors and matrices one pair "
           "for each "
           "component. They may be wide, never wrong.")
      .def("__repr__", [name](const Self&) { return std::string("<nephele.") + name + ">"; })
      .def("__reduce__", [](const Self&) -> py::object {
        throw py::type_error(
            "a field cannot be pickled: it is an expression of C++; send what it is made from, or a "
            "grid of it (field.bake)");
      });
}

}  // namespace

std::string nameFrom(const py::handle& key, const std::string& what) {
  if (!py::isinstance<py::str>(key))
    throw py::type_error("the name of " + what + " is a text, got " + py::repr(key).cast<std::string>());
  return key.cast<std::string>();
}

std::string shapeText(const py::array& array) {
  return "an array of shape " + std::string(py::str(array.attr("shape")));
}

py::array numbersFrom(const py::handle& object, const std::string& what, Numbers which) {
  const std::string needed =
      what + (which == Numbers::real ? ": real" : ": whole") + " numbers are needed, got ";
  const py::array array = py::array::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(needed + std::string(py::str(py::type::of(object))));
  }
  const std::string_view kinds = which == Numbers::real ? "fiub" : "iu";
  if (array.size() > 0 && kinds.find(array.dtype().kind()) == std::string_view::npos)
    throw py::type_error(needed + "an array of " + std::string(py::str(array.dtype())));
  return array;
}

py::array_t<float> floatsFrom(const py::handle& object, const std::string& what) {
  const py::array array = numbersFrom(object, what);
  if (py::isinstance<py::array_t<float>>(array)) return py::reinterpret_borrow<py::array_t<float>>(array);
  return py::array_t<float, py::array::forcecast>::ensure(array);
}

void addFields(py::module_& module) {
  addField<float>(
      module, "ScalarField",
      "A number everywhere in space: an expression that never changes, positive inside where it is a shape.")
      .def("bake", baked, "voxel_size"_a, "low"_a, "high"_a, py::kw_only(), "band"_a = py::none(),
           "background"_a = py::none(), "name"_a = "density", "level_set"_a = false,
           "progress"_a = py::none(),
           "The values in a box on voxels, as a Grid. Values beyond `band` voxel sizes from 0 become "
           "constants; of a "
           "level set (positive inside) those beyond 3 unless said otherwise. Work and memory follow what "
           "varies.");
  addField<Vec3f>(module, "VectorField", "A vector everywhere in space: an expression that never changes.");
  addField<Mat3f>(module, "MatrixField",
                  "A 3 x 3 matrix everywhere in space: an expression that never changes.");
  module.def(
      "field",
      [](const py::function& function, const std::string& kind, double step,
         const std::optional<std::pair<float, float>>& range) {
        if (kind == "scalar") return functionField<float>(function, step, range);
        if (kind == "vector") return functionField<Vec3f>(function, step, range);
        if (kind == "matrix") return functionField<Mat3f>(function, step, range);
        throw py::value_error("field: kind must be scalar, vector or matrix, got '" + kind + "'");
      },
      "function"_a, "kind"_a = "scalar", py::kw_only(), "step"_a = kDefaultStep, "range"_a = py::none(),
      "A function of Python as a field. It is called with arrays (n, 3) of up to 256 points, from one thread "
      "at a "
      "time, and returns n values: (n,), (n, 3) or (n, 3, 3). Gradients are differences over `step`. `range` "
      "are "
      "bounds of all values, if they are known. What it raises ends the work and comes out of the call.");
}

}  // namespace nephele::python
