#include "nephele/levelset/cut/detail/tetrahedra/blade_vertices.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/levelset/cut/detail/tetrahedra/tetrahedron_facets.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;

}  // namespace

void BladeVertices::move(BrickFunctions& functions, CarvedBrick& brick) {
  for (std::size_t u = 0; u < brick.undecided.size(); ++u) moveOnto(u, functions, brick);
}

void BladeVertices::moveOnto(std::size_t undecided, BrickFunctions& functions, CarvedBrick& brick) {
  crossings_.clear();
  const std::uint32_t knife = brick.undecided[undecided], per = carving_.functionsPerKnife();
  const std::size_t first = 1 + undecided * per;
  for (std::size_t v = 0; v < brick.positions.size(); ++v)
    for (std::size_t f = first; f < first + per; ++f)
      if (const VertexKey& key = brick.keys[v]; key.functionCount() == 1 &&
                                                key.function(0) == functions[f].id &&
                                                functions.isFarFromOthers(key, first))
        addCrossing(v, functions[f], f == first ? carving_.halfKerf : -carving_.halfKerf, brick);
  constexpr int kMostSteps = 32;
  for (int step = 0; step < kMostSteps; ++step) {
    for (auto& lane : points_) lane.clear();
    for (const Crossing& c : crossings_) {
      if (c.isDone) continue;
      const Vec3f p(carving_.world(c.start + c.along * c.place));
      for (int axis = 0; axis < 3; ++axis) points_[std::size_t(axis)].push_back(p[axis]);
    }
    if (points_[0].empty()) break;
    residuals_.resize(points_[0].size());
    functions.evaluateKnife(knife, points_, residuals_);
    auto residual = residuals_.begin();
    for (Crossing& c : crossings_)
      if (!c.isDone) closeIn(c, double(*residual++) - c.offset);
  }
  for (std::size_t i = 0, next; i < crossings_.size(); i = next) {
    const Crossing& c = crossings_[i];
    next = i + 1;
    const bool isPair =
        next < crossings_.size() && crossings_[next].start == c.start && crossings_[next].along == c.along;
    if (isPair) {
      const Crossing& other = crossings_[next++];
      if ((c.place < other.place) != (c.linear < other.linear) || c.place == other.place) continue;
    }
    for (std::size_t j = i; j < next; ++j)
      brick.positions[crossings_[j].vertex] =
          carving_.world(crossings_[j].start + crossings_[j].along * crossings_[j].place);
  }
}

void BladeVertices::addCrossing(std::size_t vertex, const BrickFunctions::Function& function, double offset,
                                const CarvedBrick& brick) {
  const VertexKey& key = brick.keys[vertex];
  const Vec3i base = key.base(), end = base + cornerOffset(key.first());
  if (BrickFunctions::isVertexAt(function, base) || BrickFunctions::isVertexAt(function, end)) return;
  const double unit =
      carving_.reach((function.id - 1) / carving_.functionsPerKnife()) / double(kLargestValue);
  const double low = unit * function.values[std::size_t(sampleIndex(base))],
               high = unit * function.values[std::size_t(sampleIndex(end))];
  // Vertices at the ends stay there.
  const double place = low / (low - high);
  if (place < kZeroMargin || place > 1 - kZeroMargin) return;
  crossings_.push_back({.vertex = vertex,
                        .start = Vec3d(base + brick.at * kBrick),
                        .along = Vec3d(cornerOffset(key.first())),
                        .offset = offset,
                        .low = 0,
                        .atLow = low,
                        .high = 1,
                        .atHigh = high,
                        .place = place,
                        .linear = place});
}

/// A step of the Illinois method.
void BladeVertices::closeIn(Crossing& c, double residual) {
  constexpr double kNear = 1.0 / 65536;
  if (std::isnan(residual)) {
    c.place = c.linear;
    c.isDone = true;
    return;
  }
  const int end = (residual > 0) == (c.atLow > 0) ? -1 : 1;
  const bool isSame = std::exchange(c.moved, end) == end;
  if (end < 0) {
    c.low = c.place, c.atLow = residual;
    if (isSame) c.atHigh /= 2;
  } else {
    c.high = c.place, c.atHigh = residual;
    if (isSame) c.atLow /= 2;
  }
  const double next = c.low + (c.high - c.low) * c.atLow / (c.atLow - c.atHigh);
  const double before = std::exchange(c.place, std::clamp(next, kZeroMargin, 1 - kZeroMargin));
  c.isDone = residual == 0 || std::abs(c.place - before) < kNear;
}

}  // namespace nephele::detail
