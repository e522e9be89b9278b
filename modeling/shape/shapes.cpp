// Solid shapes as fields. Their formulas for one point are in detail/shape_kinds.h, from which the loops over
// lanes are compiled.
//
// Ranges: a distance changes by at most the way travelled, so the value in the middle of a box plus or minus
// half its diagonal bounds it. Sphere, box and plane have tighter closed forms. All are widened by the
// rounding of coordinates.
#include "nephele/modeling/shape/shapes.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/shape/detail/shape_kernels.h"

namespace nephele {
namespace detail {
namespace {

/// Rounding error of a distance computed from coordinates up to `reach`, with room to spare.
float rounding(float reach) {
  return 2e-6f * reach;
}

float reachOf(const Box& box) {
  return std::max({std::abs(box.min.x), std::abs(box.min.y), std::abs(box.min.z), std::abs(box.max.x),
                   std::abs(box.max.y), std::abs(box.max.z)});
}

template <class Shape>
float valueAt(const Shape& shape, const Vec3f& p) {
  float unused[3];
  return shape.template at<false>(p.x, p.y, p.z, unused[0], unused[1], unused[2]);
}

/// Range of a distance field over a bounded box from its value in the middle.
template <class Shape>
Interval distanceRange(const Shape& shape, const Box& box, float largest) {
  const Vec3f c = box.center();
  const float v = valueAt(shape, c), radius = 0.5f * length(box.size());
  return {v - radius, std::min(v + radius, largest)};
}

/// Least and largest |x - center| per axis.
std::array<Interval, 3> awayFrom(const Vec3f& center, const Box& box) {
  const auto x = rangeOf(box);
  return {abs(x[0] - Interval::of(center.x)), abs(x[1] - Interval::of(center.y)),
          abs(x[2] - Interval::of(center.z))};
}

Interval norm(const std::array<Interval, 3>& v) {
  return sqrt(square(v[0]) + square(v[1]) + square(v[2]));
}

Interval rangeIn(const SphereShape& s, const Box& box) {
  return Interval::of(s.radius) - norm(awayFrom(s.center, box));
}
Interval rangeIn(const BoxShape& s, const Box& box) {
  auto q = awayFrom(s.center, box);
  for (int k = 0; k < 3; ++k) q[k] = q[k] - Interval::of(s.half[k]);
  const Interval zero = Interval::of(0.0f);
  const Interval outside = norm({max(q[0], zero), max(q[1], zero), max(q[2], zero)});
  return -(outside + min(max(max(q[0], q[1]), q[2]), zero));
}
Interval rangeIn(const PlaneShape& s, const Box& box) {
  const auto x = rangeOf(box);
  Interval sum = Interval::of(-s.offset);
  for (int k = 0; k < 3; ++k)
    if (s.normal[k] != 0) sum = sum + Interval::of(s.normal[k]) * x[k];
  return sum;
}
Interval rangeIn(const TorusShape& s, const Box& box) {
  return distanceRange(s, box, s.minor);
}
Interval rangeIn(const CapsuleShape& s, const Box& box) {
  return distanceRange(s, box, s.radius);
}
Interval rangeIn(const ConeShape& s, const Box& box) {
  return distanceRange(s, box, std::min(s.radius, s.height));
}
Interval rangeIn(const EllipsoidShape& s, const Box& box) {
  auto u = awayFrom(s.center, box);
  for (int k = 0; k < 3; ++k) u[k] = u[k] * Interval::of(s.inverseRadii[k]);
  return (Interval::of(1.0f) - norm(u)) * Interval{s.smallest, s.largest};
}

/// Largest value, and a size that bounds the coordinates of the shape.
struct Extent {
  float largest, reach;
};

float reachOf(const Vec3f& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

Extent extentOf(const SphereShape& s) {
  return {s.radius, reachOf(s.center) + s.radius};
}
Extent extentOf(const BoxShape& s) {
  return {std::min({s.half.x, s.half.y, s.half.z}), reachOf(s.center) + reachOf(s.half)};
}
Extent extentOf(const PlaneShape& s) {
  return {std::numeric_limits<float>::infinity(), std::abs(s.offset)};
}
Extent extentOf(const TorusShape& s) {
  return {s.minor, reachOf(s.center) + s.major + s.minor};
}
Extent extentOf(const CapsuleShape& s) {
  return {s.radius, reachOf(s.a) + length(s.way) + s.radius};
}
Extent extentOf(const ConeShape& s) {
  return {std::min(s.radius, s.height), reachOf(s.base) + s.radius + s.height};
}
Extent extentOf(const EllipsoidShape& s) {
  // Rounding of points is multiplied by largest / smallest on its way through k and k / m.
  return {s.largest, (reachOf(s.center) + s.largest) * (s.largest / s.smallest)};
}

class ShapeNode final : public FieldNode<float> {
 public:
  ShapeNode(ShapeKind kind, float size) : kind_(std::move(kind)), size_(size) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    shapeLanes(kind_, points, values[0]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    shapeGradLanes(kind_, points, values[0], grads);
  }
  Interval range(const Box& box, RangeMemo&) const override {
    return std::visit(
        [&](const auto& shape) -> Interval {
          const Extent extent = extentOf(shape);
          const float reach = reachOf(box);
          // Squares of what lies further away overflow.
          if (!(reach < 1e18f) || box.isEmpty())
            return {-std::numeric_limits<float>::infinity(), extent.largest};
          const bool isEllipsoid = std::is_same_v<std::decay_t<decltype(shape)>, EllipsoidShape>;
          const float stretch = isEllipsoid ? extent.reach / size_ : 1.0f;
          const float slack = rounding(extent.reach + reach * std::max(stretch, 1.0f));
          const Interval r = rangeIn(shape, box);
          return {r.min - slack, r.max + slack};
        },
        kind_);
  }
  float differenceStep() const override { return size_ > 0 ? kDefaultStep * size_ : kNoLength; }

 private:
  ShapeKind kind_;
  /// A length that is typical of the shape; 0 for a plane, which has none.
  float size_;
};

ScalarField shapeField(ShapeKind kind, float size) {
  return ScalarField(std::make_shared<ShapeNode>(std::move(kind), size));
}

void requireSize(float value, const char* shape, const char* name) {
  require(value > 0 && value < 1e18f,
          std::string(shape) + ": " + name + " must be > 0 and finite, got " + numberText(value));
}

void requirePoint(const Vec3f& p, const char* shape, const char* name) {
  require(isFinite(p) && reachOf(p) < 1e18f, std::string(shape) + ": " + name + " must be finite");
}

/// `v` with length 1, computed in double. @throws Error naming the argument if it has no direction.
Vec3f direction(const Vec3f& v, const char* shape, const char* name) {
  const Vec3d d(v);
  const double l = length(d);
  require(std::isfinite(l) && l > 0, std::string(shape) + ": " + name + " must be finite and not zero");
  return Vec3f(d / l);
}

}  // namespace
}  // namespace detail

using detail::direction;
using detail::requirePoint;
using detail::requireSize;
using detail::shapeField;

ScalarField sphere(const Vec3f& center, float radius) {
  requirePoint(center, "sphere", "center");
  requireSize(radius, "sphere", "radius");
  return shapeField(detail::SphereShape{center, radius}, radius);
}

ScalarField box(const Box& box) {
  requirePoint(box.min, "box", "min");
  requirePoint(box.max, "box", "max");
  require(box.min.x < box.max.x && box.min.y < box.max.y && box.min.z < box.max.z,
          "box: the lengths must be > 0 along every axis");
  const Vec3f half = box.size() * 0.5f;
  return shapeField(detail::BoxShape{box.center(), half}, std::min({half.x, half.y, half.z}));
}

ScalarField plane(const Vec3f& point, const Vec3f& normal) {
  requirePoint(point, "plane", "point");
  const Vec3f n = direction(normal, "plane", "normal");
  return shapeField(detail::PlaneShape{n, float(dot(Vec3d(n), Vec3d(point)))}, 0);
}

ScalarField torus(const TorusOptions& options) {
  requirePoint(options.center, "torus", "center");
  requireSize(options.majorRadius, "torus", "radius");
  requireSize(options.minorRadius, "torus", "radius of the tube");
  const Vec3f axis = direction(options.axis, "torus", "axis");
  return shapeField(detail::TorusShape{options.center, axis, options.majorRadius, options.minorRadius},
                    options.minorRadius);
}

ScalarField cone(const ConeOptions& options) {
  requirePoint(options.apex, "cone", "apex");
  requirePoint(options.baseCenter, "cone", "baseCenter");
  requireSize(options.baseRadius, "cone", "baseRadius");
  const Vec3f way = options.apex - options.baseCenter;
  const Vec3f axis = direction(way, "cone", "apex - baseCenter");
  const float height = length(way), r = options.baseRadius, slant = std::hypot(r, height);
  return shapeField(detail::ConeShape{options.baseCenter, axis, r, height, 1 / (slant * slant),
                                      -height / slant, -r / slant},
                    std::min(r, height));
}

ScalarField capsule(const Vec3f& a, const Vec3f& b, float radius) {
  requirePoint(a, "capsule", "a");
  requirePoint(b, "capsule", "b");
  requireSize(radius, "capsule", "radius");
  const Vec3f way = b - a;
  const float square = dot(way, way);
  return shapeField(detail::CapsuleShape{a, way, square > 0 ? 1 / square : 0.0f, radius}, radius);
}

ScalarField ellipsoid(const Vec3f& center, const Vec3f& radii) {
  requirePoint(center, "ellipsoid", "center");
  for (int k = 0; k < 3; ++k) requireSize(radii[k], "ellipsoid", "radii");
  const float smallest = std::min({radii.x, radii.y, radii.z}),
              largest = std::max({radii.x, radii.y, radii.z});
  return shapeField(
      detail::EllipsoidShape{center, {1 / radii.x, 1 / radii.y, 1 / radii.z}, smallest, largest}, smallest);
}

}  // namespace nephele
