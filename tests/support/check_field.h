#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/field.h"

namespace nephele::test {

/// Points in random order, structure of arrays.
struct Points {
  std::vector<float> x, y, z;

  explicit Points(std::size_t count = 0) : x(count), y(count), z(count) {}
  std::size_t size() const { return x.size(); }
  PointSpans spans() const { return {x, y, z}; }
  Vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  void set(std::size_t i, const Vec3f& p) { x[i] = p.x, y[i] = p.y, z[i] = p.z; }
};

/// N lanes of results.
template <int N>
struct Lanes {
  std::array<std::vector<float>, N> data;

  explicit Lanes(std::size_t count) {
    for (auto& lane : data) lane.assign(count, 0.0f);
  }
  Spans<N> spans() {
    if constexpr (N == 1) {
      return Spans<1>(data[0]);
    } else {
      Spans<N> result;
      for (int i = 0; i < N; ++i) result.lanes[i] = data[i];
      return result;
    }
  }
};

template <class T>
using Values = Lanes<kComponents<T>>;
template <class T>
using Gradients = Lanes<3 * kComponents<T>>;

inline Points randomPoints(const Box& box, std::size_t count, std::mt19937& random) {
  Points points(count);
  const auto between = [&](float lo, float hi) {
    const float t = float(random() >> 8) * 0x1p-24f;
    return std::clamp(lo + t * (hi - lo), lo, hi);
  };
  for (std::size_t i = 0; i < count; ++i) {
    points.x[i] = between(box.min.x, box.max.x);
    points.y[i] = between(box.min.y, box.max.y);
    points.z[i] = between(box.min.z, box.max.z);
  }
  // Corners are where ranges are tight.
  for (std::size_t i = 0; i < 8 && i < count; ++i)
    points.set(i,
               {i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z});
  return points;
}

/// A box inside `box`: every third one tiny, to reach the cases that simplify.
inline Box randomSubBox(const Box& box, std::mt19937& random, int number) {
  const Points ends = randomPoints(box, 10, random);
  Box result{min(ends[8], ends[9]), max(ends[8], ends[9])};
  const float share = number % 3 == 0 ? 0.01f : number % 3 == 1 ? 0.1f : 1.0f;
  result.max = min(result.max, result.min + box.size() * share);
  return result;
}

template <class T>
Values<T> evaluate(const Field<T>& field, const Points& points) {
  Values<T> values(points.size());
  field.eval(points.spans(), values.spans());
  return values;
}

inline bool sameBits(float a, float b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}
inline bool sameValue(float a, float b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

struct CheckOptions {
  /// Compare the gradient with differences. Step in world units, and tolerance relative to 1 + |gradient|.
  bool gradient = true;
  float step = 2e-3f;
  float tolerance = 5e-3f;
  /// Share of the points that must be free of kinks, where differences say nothing.
  double smoothShare = 0.7;
  unsigned seed = 1;
};

template <class T>
void checkBatches(const Field<T>& field, const Points& points) {
  constexpr int kLanes = kComponents<T>;
  const Values<T> all = evaluate(field, points);
  Values<T> same(points.size());
  Gradients<T> grads(points.size());
  field.evalGrad(points.spans(), same.spans(), grads.spans());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Points one(1);
    one.set(0, points[i]);
    Values<T> alone(1), aloneToo(1);
    Gradients<T> aloneGrads(1);
    field.eval(one.spans(), alone.spans());
    field.evalGrad(one.spans(), aloneToo.spans(), aloneGrads.spans());
    for (int c = 0; c < kLanes; ++c) {
      ASSERT_TRUE(sameBits(all.data[c][i], alone.data[c][0]))
          << "point " << i << " lane " << c << ": " << all.data[c][i] << " and " << alone.data[c][0];
      ASSERT_TRUE(sameBits(all.data[c][i], same.data[c][i])) << "eval and evalGrad differ at point " << i;
      ASSERT_TRUE(sameBits(all.data[c][i], aloneToo.data[c][0])) << "point " << i;
    }
    for (int c = 0; c < 3 * kLanes; ++c)
      ASSERT_TRUE(sameBits(grads.data[c][i], aloneGrads.data[c][0]))
          << "gradient of point " << i << " lane " << c;
  }
}

template <class T>
void checkRange(const Field<T>& field, const Box& box, const Points& points) {
  const RangeOf<T> range = field.range(box);
  const Values<T> values = evaluate(field, points);
  for (int c = 0; c < kComponents<T>; ++c) {
    const Interval r = detail::rangeComponent(range, c);
    ASSERT_LE(r.min, r.max);
    if (r == Interval::everything()) continue;
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_TRUE(r.contains(values.data[c][i]))
          << "lane " << c << " is " << values.data[c][i] << " outside [" << r.min << ", " << r.max << "] at "
          << points.x[i] << " " << points.y[i] << " " << points.z[i] << " in the box " << box.min.x << " "
          << box.min.y << " " << box.min.z << " to " << box.max.x << " " << box.max.y << " " << box.max.z;
  }
}

template <class T>
void checkRestriction(const Field<T>& field, const Box& box, const Points& points) {
  const Field<T> local = field.restrictedTo(box);
  const Values<T> full = evaluate(field, points), restricted = evaluate(local, points);
  for (int c = 0; c < kComponents<T>; ++c)
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_TRUE(sameValue(full.data[c][i], restricted.data[c][i]))
          << "lane " << c << ": " << full.data[c][i] << " in full, " << restricted.data[c][i]
          << " restricted";
  checkRange(local, box, points);
}

template <class T>
void checkGradient(const Field<T>& field, const Points& points, const CheckOptions& options) {
  const std::size_t n = points.size();
  Values<T> values(n);
  Gradients<T> grads(n);
  field.evalGrad(points.spans(), values.spans(), grads.spans());
  std::size_t smooth = 0, total = 0;
  for (int axis = 0; axis < 3; ++axis) {
    Points above = points, below = points;
    std::vector<float> Points::*const lane = axis == 0 ? &Points::x : axis == 1 ? &Points::y : &Points::z;
    for (std::size_t i = 0; i < n; ++i) {
      (above.*lane)[i] += options.step;
      (below.*lane)[i] -= options.step;
    }
    const Values<T> high = evaluate(field, above), low = evaluate(field, below);
    for (int c = 0; c < kComponents<T>; ++c)
      for (std::size_t i = 0; i < n; ++i) {
        const double up =
            (double(high.data[c][i]) - values.data[c][i]) / ((above.*lane)[i] - (points.*lane)[i]);
        const double down =
            (double(values.data[c][i]) - low.data[c][i]) / ((points.*lane)[i] - (below.*lane)[i]);
        const double g = grads.data[3 * c + axis][i], size = 1 + std::abs(g);
        ++total;
        // A kink within reach, or too curved for the step: then the gradient may be either slope.
        if (!(std::abs(up - down) < 1.5 * options.tolerance * size)) continue;
        ++smooth;
        ASSERT_NEAR(g, 0.5 * (up + down), options.tolerance * size)
            << "lane " << c << " axis " << axis << " at " << points.x[i] << " " << points.y[i] << " "
            << points.z[i];
      }
  }
  EXPECT_GE(double(smooth), options.smoothShare * double(total)) << "too few points without kinks";
}

/// What every field promises: values do not depend on how many are asked for at once, ranges contain samples
/// (10^4 on the box, and more on boxes inside), restricted fields equal the full one on their box, gradients
/// equal differences.
template <class T>
void checkField(const Field<T>& field, const Box& box, const CheckOptions& options = {}) {
  std::mt19937 random(options.seed);
  {
    SCOPED_TRACE("batches");
    checkBatches(field, randomPoints(box, 2 * kBlockSize + 77, random));
  }
  {
    SCOPED_TRACE("range");
    checkRange(field, box, randomPoints(box, 10000, random));
  }
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE("sub-box " + std::to_string(i));
    const Box part = randomSubBox(box, random, i);
    const Points points = randomPoints(part, 200, random);
    checkRange(field, part, points);
    checkRestriction(field, part, points);
    if (testing::Test::HasFatalFailure()) return;
  }
  if (options.gradient) {
    SCOPED_TRACE("gradient");
    checkGradient(field, randomPoints(box, 500, random), options);
  }
}

}  // namespace nephele::test
