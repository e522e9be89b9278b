#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/python/strings.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/felt/value.h"
#include "nephele/render/image/exr_io.h"

/// What objects of the module hold, and how numpy's arrays become and are made of it.
namespace nephele::python {

namespace py = pybind11;

/// A field of any kind, with what Felt knows of it.
template <class T>
struct PythonField {
  felt::Value value;

  const Field<T>& field() const { return value.as<Field<T>>(); }
};
using PythonScalarField = PythonField<float>;
using PythonVectorField = PythonField<Vec3f>;
using PythonMatrixField = PythonField<Mat3f>;

/// A mesh that is never changed once made.
using PythonMesh = std::shared_ptr<const felt::Shape>;

/// Voxels from `first` on.
struct VoxelBox {
  Vec3i first{}, size{};
};

/// A grid of numbers or vectors, never changed once made: in OpenVDB's form, in bricks, or both, as it was
/// asked for.
class PythonGrid {
 public:
  explicit PythonGrid(VdbGrid grid);
  PythonGrid(std::vector<std::shared_ptr<const BrickGrid>> bricks, VdbGridLabel label);

  const VdbGridLabel& label() const { return label_; }
  bool isVector() const { return isVector_; }
  /// Whether it was, and OpenVDB's form is made of them.
  bool isMadeOfBricks() const { return isMadeOfBricks_; }
  /// In OpenVDB's form. @throws Error as toVdb.
  const VdbGrid& vdb();
  /// One, or three of a grid of vectors. @throws Error as toBricks.
  const std::vector<std::shared_ptr<const BrickGrid>>& bricks();
  /// Of the array that it was made from, else around active voxels.
  VoxelBox box();
  void setBox(const VoxelBox& box) { box_ = box; }

 private:
  VdbGridLabel label_;
  bool isVector_ = false, isMadeOfBricks_ = false;
  std::mutex mutex_;
  std::optional<VdbGrid> vdb_;
  std::vector<std::shared_ptr<const BrickGrid>> bricks_;
  std::optional<VoxelBox> box_;
};

enum class Numbers { real, whole };
/// The array that `object` is or can be read as. @throws py::type_error naming `what` unless it holds such
/// numbers; an empty one holds any.
py::array numbersFrom(const py::handle& object, const std::string& what, Numbers which = Numbers::real);
/// The numbers of `object` as floats: the array itself where it holds such, whatever its strides, else a
/// copy. @throws py::type_error as numbersFrom.
py::array_t<float> floatsFrom(const py::handle& object, const std::string& what);
/// An array that lies in one piece, in C's order.
template <class T>
using Packed = py::array_t<T, py::array::c_style | py::array::forcecast>;
/// The same, a copy only where it must be. @throws py::type_error as numbersFrom.
template <class T>
Packed<T> packedFrom(const py::handle& object, const std::string& what, Numbers which = Numbers::real) {
  return Packed<T>::ensure(numbersFrom(object, what, which));
}
/// "an array of shape (4, 3)"
std::string shapeText(const py::array& array);
/// The name that a key of a dict is. @throws py::type_error naming `what` unless it is a text.
std::string nameFrom(const py::handle& key, const std::string& what);

/// An array of these values that Python sees without a copy and cannot write; `owner` lives as long as it.
template <class T>
py::array viewOf(const T* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                 std::shared_ptr<const void> owner) {
  auto* held = new std::shared_ptr<const void>(std::move(owner));
  const py::capsule base(held, [](void* kept) { delete static_cast<std::shared_ptr<const void>*>(kept); });
  py::array view(py::dtype::of<T>(), std::move(shape), std::move(strides), data, base);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

/// Three numbers as a vector. @throws py::type_error naming what it is of.
Vec3d vectorFrom(const py::handle& object, const std::string& what);

/// What Python shows a value of Felt as; None for none.
py::object toPython(const felt::Value& value);

// The parts of the module.
void addFields(py::module_& module);
void addGrids(py::module_& module);
void addMeshes(py::module_& module);
void addPictures(py::module_& module);
void addPickles(py::module_& module);
void addWords(py::module_& module);
void addVerbs(py::module_& module);

}  // namespace nephele::python
