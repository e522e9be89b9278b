#include "nephele/modeling/felt/value.h"

#include <array>
#include <charconv>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::felt {

namespace {

/// Numbers of samples beside the last cell are ints, too.
constexpr double kMostCells = 2.1e9;

bool isFinite(const Vec3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The shortest text that is read as the same number, with a point, so that it is no integer.
std::string numberLiteral(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string result(text, end);
  if (result.find_first_of(".en") == std::string::npos) result += ".0";
  return result;
}

std::string textLiteral(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (c == '\n')
      result += "\\n";
    else if (c == '\t')
      result += "\\t";
    else
      result += c;
  }
  return result + "\"";
}

std::string inBrackets(const std::array<std::string, 3>& parts) {
  std::string text(1, '(');
  text += parts[0] + ", " + parts[1] + ", " + parts[2];
  text += ')';
  return text;
}

template <class Number>
std::string threeText(const Vec3d& v, const Number& number) {
  return inBrackets({number(v.x), number(v.y), number(v.z)});
}

template <class Number>
std::string matrixText(const Mat3f& m, const Number& number) {
  const auto row = [&](int i) { return threeText({m(i, 0), m(i, 1), m(i, 2)}, number); };
  return inBrackets({row(0), row(1), row(2)});
}

template <class Element>
std::string arrayText(const Array& array, const Element& element, std::size_t most) {
  std::string text = "[";
  for (std::size_t i = 0; i < array->size(); ++i) {
    if (i != 0) text += ", ";
    if (i == most) return text + "... " + std::to_string(array->size()) + " in all]";
    text += element((*array)[i]);
  }
  return text + "]";
}

std::string domainText(const Domain& domain) {
  const auto cells = domain.cells();
  return "a domain of " + std::to_string(cells.x) + " x " + std::to_string(cells.y) + " x " +
         std::to_string(cells.z) + " cells from " + threeText(domain.origin, numberText) + ", " +
         threeText(domain.lengths, numberText) + " long";
}

}  // namespace

Vec3<std::int64_t> Domain::cells() const {
  // A length that is a whole number of cells but for rounding has no cell more.
  const auto count = [](double length, double edge) {
    return static_cast<std::int64_t>(std::max(1.0, std::ceil(length / edge - 1e-6)));
  };
  return {count(lengths.x, cell.x), count(lengths.y, cell.y), count(lengths.z, cell.z)};
}

Affine Domain::toWorld() const {
  Affine map;
  const double angle = length(rotation);
  if (angle > 0) map.linear = Mat3f::rotation(toFloat(rotation), static_cast<float>(angle));
  map.translation = toFloat(origin);
  return map;
}

Box Domain::bounds() const {
  Box box;
  const Affine map = toWorld();
  for (int corner = 0; corner < 8; ++corner)
    box = box.including(
        map(toFloat({corner & 1 ? lengths.x : 0, corner & 2 ? lengths.y : 0, corner & 4 ? lengths.z : 0})));
  return box;
}

void requireValid(const Domain& domain) {
  require(isFinite(domain.origin) && isFinite(domain.rotation), "a domain's place must be finite");
  const auto positive = [](const Vec3d& v) { return isFinite(v) && v.x > 0 && v.y > 0 && v.z > 0; };
  require(positive(domain.lengths),
          "the lengths of a domain must be finite and above 0, not " + threeText(domain.lengths, numberText));
  require(positive(domain.cell), "the cells of a domain must be finite and longer than 0, not " +
                                     threeText(domain.cell, numberText));
  double cells = 1;
  for (int axis = 0; axis < 3; ++axis) cells *= std::ceil(domain.lengths[axis] / domain.cell[axis]);
  require(cells <= kMostCells, "a domain may have 2.1e+09 cells at most, not " + numberText(cells));
}

Value converted(const Value& value, const Type& to) {
  if (to.isArray || !value.isSet()) return value;
  switch (to.kind) {
    case Kind::number:
      if (value.is<std::int64_t>()) return static_cast<double>(value.as<std::int64_t>());
      break;
    case Kind::scalarField:
      if (value.is<std::int64_t>()) return ScalarField(static_cast<float>(value.as<std::int64_t>()));
      if (value.is<double>()) return ScalarField(static_cast<float>(value.as<double>()));
      break;
    case Kind::vectorField:
      if (value.is<Vec3d>()) return VectorField(toFloat(value.as<Vec3d>()));
      break;
    case Kind::matrixField:
      if (value.is<Mat3f>()) return MatrixField(value.as<Mat3f>());
      break;
    default:
      break;
  }
  return value;
}

std::string shown(const Value& value, const Type& type) {
  if (!value.isSet()) return "nothing";
  if (type.isArray) {
    constexpr std::size_t kMostShown = 12;
    return arrayText(
        value.as<Array>(), [&](const Value& element) { return shown(element, type.element()); }, kMostShown);
  }
  switch (type.kind) {
    case Kind::integer:
      return std::to_string(value.as<std::int64_t>());
    case Kind::number:
      return numberText(value.as<double>());
    case Kind::boolean:
      return value.as<bool>() ? "true" : "false";
    case Kind::text:
      return value.as<std::string>();
    case Kind::vector:
      return threeText(value.as<Vec3d>(), numberText);
    case Kind::matrix:
      return matrixText(value.as<Mat3f>(), numberText);
    case Kind::domain:
      return domainText(value.as<Domain>());
    case Kind::shape: {
      const Shape& shape = *value.as<std::shared_ptr<const Shape>>();
      return "a shape of " + std::to_string(shape.mesh.positions.size()) + " vertices and " +
             std::to_string(shape.mesh.faceCount()) + " faces";
    }
    case Kind::nothing:
    case Kind::anything:
      return "nothing";
    default:
      return articledName(type);
  }
}

std::string literalText(const Value& value, const Type& type) {
  if (type.isArray)
    return arrayText(
        value.as<Array>(), [&](const Value& element) { return literalText(element, type.element()); },
        std::size_t(-1));
  switch (type.kind) {
    case Kind::integer:
      return std::to_string(value.as<std::int64_t>());
    case Kind::number:
      return numberLiteral(value.as<double>());
    case Kind::boolean:
      return value.as<bool>() ? "true" : "false";
    case Kind::text:
      return textLiteral(value.as<std::string>());
    case Kind::vector:
      return threeText(value.as<Vec3d>(), numberLiteral);
    case Kind::matrix:
      return matrixText(value.as<Mat3f>(), numberLiteral);
    default:
      throw Error(articledName(type) + " cannot be written down");
  }
}

}  // namespace nephele::felt
