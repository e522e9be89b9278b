#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/felt/type.h"
#include "nephele/modeling/field/field.h"

/// What a script computes with.
namespace nephele::felt {

/// A box with cells, where fields are sampled: the points origin + R (a x, b y, c z) with a, b, c from 0 to
/// the lengths.
struct Domain {
  /// Corner, world units.
  Vec3d origin{};
  /// Of the edges, world units, > 0.
  Vec3d lengths{1, 1, 1};
  /// R turns about this axis, right-handed, by its length in radians.
  Vec3d rotation{};
  /// Edges of a cell along the edges of the box, > 0.
  Vec3d cell{0.1, 0.1, 0.1};

  /// Cells of the box along an edge: lengths / cell, rounded up.
  Vec3<std::int64_t> cells() const;
  /// From coordinates along the edges, world units, to the world.
  Affine toWorld() const;
  /// The axis-aligned box around it.
  Box bounds() const;
};

/// Throws unless origin and rotation are finite, lengths and cells finite and positive, and there are at most
/// 2.1e9 cells. @throws Error
void requireValid(const Domain& domain);

/// Room for the samples of a field on a domain. Whoever holds it sees what was written last.
template <class T>
struct Cache {
  Domain domain;
  /// The samples as a field, as soon as something has been written.
  std::optional<Field<T>> values{};
};

/// A mesh and what it is called.
struct Shape {
  Mesh mesh;
  std::string name;
};

class Value;
/// Shared until one of the holders writes.
using Array = std::shared_ptr<const std::vector<Value>>;

/// A value of any type, or none yet.
class Value {
 public:
  using Held = std::variant<std::monostate, std::int64_t, double, bool, std::string, Vec3d, Mat3f,
                            ScalarField, VectorField, MatrixField, Domain, std::shared_ptr<Cache<float>>,
                            std::shared_ptr<Cache<Vec3f>>, std::shared_ptr<Cache<Mat3f>>,
                            std::shared_ptr<const Shape>, Array>;

  Value() = default;
  template <class T>
  requires std::is_constructible_v<Held, T&&> Value(T&& held) : held_(std::forward<T>(held)) {}

  bool isSet() const { return held_.index() != 0; }
  /// The value itself. @throws std::bad_variant_access if it is of another type: a fault of the caller.
  template <class T>
  const T& as() const {
    return std::get<T>(held_);
  }
  template <class T>
  T& as() {
    return std::get<T>(held_);
  }
  template <class T>
  bool is() const {
    return std::holds_alternative<T>(held_);
  }
  const Held& held() const { return held_; }

  /// Operations that lie between a field and the points that it is asked at, along the longest way.
  int depth = 0;
  /// Whether it is evaluated once per block however often it occurs: see memo.
  bool isRemembered = false;

 private:
  Held held_;
};

/// `value` as one of type `to`: see conversionCost.
Value converted(const Value& value, const Type& to);

/// As `print` shows it: numbers with up to 6 digits, vectors and arrays in brackets, fields by their type.
std::string shown(const Value& value, const Type& type);
/// As a script may have it; only of plain types and arrays of them. Read again it is the same value.
std::string literalText(const Value& value, const Type& type);

inline Vec3f toFloat(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
inline Vec3d toDouble(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

}  // namespace nephele::felt
