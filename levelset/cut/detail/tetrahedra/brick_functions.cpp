// A sample of exactly 0 would have a vertex on each edge that leaves it inwards. They become one, at the
// sample, if the surface about it is a disc and stays one.
#include "nephele/levelset/cut/detail/tetrahedra/brick_functions.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/cut/detail/tetrahedra/tetrahedron_facets.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;

}  // namespace

void BrickFunctions::evaluate(const CarvedBrick& brick) {
  gather(carving_.level, brick.at, samples_);
  functions_.resize(1 + brick.undecided.size() * carving_.functionsPerKnife());
  rings_.resize(functions_.size());
  functions_[0].id = 0;
  margins_.assign(1, round(0.0, carving_.largest, rings_[0]));
  if (!brick.undecided.empty()) placeSamples(brick);
  std::size_t next = 1;
  for (const std::uint32_t k : brick.undecided) {
    evaluateKnife(k, points_, samples_);
    for (std::uint32_t side = 0; side < carving_.functionsPerKnife(); ++side, ++next) {
      functions_[next].id = carving_.functionOf(k) + side;
      const double offset = side == 0 ? carving_.halfKerf : -carving_.halfKerf;
      margins_.push_back(round(offset, carving_.reach(k), rings_[next]));
    }
  }
  for (std::size_t f = 0; f < functions_.size(); ++f) keepFromZero(f, margins_[f]);
}

void BrickFunctions::placeSamples(const CarvedBrick& brick) {
  for (auto& lane : points_) lane.resize(kRingSamples);
  std::size_t i = 0;
  for (int z = -1; z <= kCellSide; ++z)
    for (int y = -1; y <= kCellSide; ++y)
      for (int x = -1; x <= kCellSide; ++x, ++i) {
        const Vec3f p(carving_.world(Vec3d(brick.at * kBrick + Vec3i{x, y, z})));
        points_[0][i] = p.x, points_[1][i] = p.y, points_[2][i] = p.z;
      }
}

void BrickFunctions::evaluateKnife(std::uint32_t k, const PointLanes& lanes, std::span<float> values) {
  const Knife& knife = carving_.knives[k].knife;
  const PointSpans points{lanes[0], lanes[1], lanes[2]};
  if (!(carving_.halfKerf > 0 && knife.steepest > 1)) {
    knife.field.eval(points, values);
    return;
  }
  for (auto& lane : slopes_) lane.resize(values.size());
  knife.field.evalGrad(points, values, {{slopes_[0], slopes_[1], slopes_[2]}});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float slope = length(Vec3f{slopes_[0][i], slopes_[1][i], slopes_[2][i]});
    if (slope > 0) values[i] /= slope;
  }
}

/// Whole numbers for samples less an offset. What is nearer to 0 than the margin becomes 0, and so does
/// what is no number. @returns the margin.
std::int32_t BrickFunctions::round(double offset, double largest, Ring& rounded) const {
  const double scale = double(kLargestValue) / largest;
  const double margin = std::max(std::floor(carving_.margin * scale), 1.0);
  for (std::size_t i = 0; i < kRingSamples; ++i) {
    const double v = (double(samples_[i]) - offset) * scale;
    const bool isFar = std::abs(v) >= margin;
    rounded[i] = isFar ? std::int32_t(std::clamp(v, -double(kLargestValue), double(kLargestValue))) : 0;
  }
  return std::int32_t(margin);
}

void BrickFunctions::keepFromZero(std::size_t f, std::int32_t margin) {
  const auto& ring = rings_[f];
  Function& function = functions_[f];
  for (int z = 0; z < kCellSide; ++z)
    for (int y = 0; y < kCellSide; ++y)
      for (int x = 0; x < kCellSide; ++x) {
        const int r = ringIndex(x, y, z);
        const auto s = std::size_t(sampleIndex({x, y, z}));
        const std::int32_t v = ring[std::size_t(r)];
        // Where a sample of 0 is as good as a vertex, the value stays; so does the volume if it is none,
        // as other functions are near.
        const bool isSimple = v == 0 && isSimpleAt(f, r);
        function.isVertex[s] = isSimple && isAloneAt(f, r);
        function.values[s] = v != 0 ? v : isSimple ? -1 : -margin;
      }
}

bool BrickFunctions::isAloneAt(std::size_t f, int r) const {
  for (std::size_t g = 0; g < rings_.size(); ++g) {
    if (g == f) continue;
    const bool isPositive = rings_[g][std::size_t(r)] > 0;
    for (const int step : kEdgeSteps)
      if ((rings_[g][std::size_t(r + step)] > 0) != isPositive) return false;
  }
  return true;
}

bool BrickFunctions::isSimpleAt(std::size_t f, int r) const {
  unsigned positive = 0, zero = 0;
  for (std::size_t n = 0; n < 14; ++n) {
    const std::int32_t v = rings_[f][std::size_t(r + kEdgeSteps[n])];
    if (v > 0) positive |= 1u << n;
    if (v == 0) zero |= 1u << n;
  }
  return isDisc(positive, zero);
}

const BrickFunctions::Function& BrickFunctions::byId(std::uint32_t id) const {
  return *std::lower_bound(functions_.begin(), functions_.end(), id,
                           [](const Function& f, std::uint32_t i) { return f.id < i; });
}

bool BrickFunctions::isVertexAt(const Function& function, const Vec3i& sample) {
  const bool isHere = std::min({sample.x, sample.y, sample.z}) >= 0;
  return isHere && function.isVertex[std::size_t(sampleIndex(sample))];
}

bool BrickFunctions::isFarFromOthers(const VertexKey& key, std::size_t first) const {
  const Vec3i base = key.base();
  const int r = ringIndex(base.x, base.y, base.z);
  const std::size_t edge = key.first() - 1;
  const unsigned around = neighboursOfNeighbours()[edge] | 1u << edge;
  for (std::size_t g = 0; g < rings_.size(); ++g) {
    if (g >= first && g < first + carving_.functionsPerKnife()) continue;
    const bool isPositive = rings_[g][std::size_t(r)] > 0;
    for (std::size_t n = 0; n < kEdgeSteps.size(); ++n)
      if ((around >> n & 1) != 0 && (rings_[g][std::size_t(r + kEdgeSteps[n])] > 0) != isPositive)
        return false;
  }
  return true;
}

}  // namespace nephele::detail
