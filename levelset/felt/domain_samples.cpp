// A domain is baked in its own coordinates, where its samples are whole numbers: voxel (2, 2, 2) is its first
// one, and two layers before and behind are there for differences. What is inside is interpolated there; what
// is outside is first moved to the nearest point of the box.
#include "nephele/levelset/felt/domain_samples.h"

#include <fmt/format.h>

#include <cmath>

#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/base/system.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele::felt {

namespace {

using Grid = std::shared_ptr<const BrickGrid>;

Vec3i cellsOf(const Domain& domain) {
  const auto cells = domain.cells();
  return {int(cells.x), int(cells.y), int(cells.z)};
}

/// Layers of samples beyond those of a domain.
constexpr int kLayers = 2;

/// From voxels, which begin these layers before the samples, to the world.
Affine voxelToWorld(const Domain& domain) {
  Affine map = sampleToWorld(domain);
  map.translation = map(Vec3f{-kLayers, -kLayers, -kLayers});
  return map;
}

template <class T>
class DomainNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;
  /// The first sample along an edge, voxels.
  static constexpr float kFirst = kLayers;
  /// What lies on a face of the domain is as near to it as this, in voxels, where it is outside by rounding.
  static constexpr float kOnFace = 1e-3f;

  DomainNode(const Domain& domain, const std::array<Grid, kLanes>& grids)
      : toVoxel_(inverse(voxelToWorld(domain))),
        last_(toFloat({double(cellsOf(domain).x), double(cellsOf(domain).y), double(cellsOf(domain).z)}) +
              Vec3f{kLayers, kLayers, kLayers}),
        step_(float(std::min({domain.cell.x, domain.cell.y, domain.cell.z}))) {
    for (int c = 0; c < kLanes; ++c) lanes_[c] = gridField(grids[c]).node();
  }

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    const BlockLanes<3> q = frame.template lanes<3>();
    moveInside<false>(points, q, {});
    const PointBlock inside = scratch.pointBlock(q, points.count);
    for (int c = 0; c < kLanes; ++c) lanes_[c]->eval(inside, {values[c]}, scratch);
  }

  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    const BlockLanes<3> q = frame.template lanes<3>(), stays = frame.template lanes<3>();
    moveInside<true>(points, q, stays);
    const PointBlock inside = scratch.pointBlock(q, points.count);
    for (int c = 0; c < kLanes; ++c) {
      const BlockLanes<3> g{grads[3 * c], grads[3 * c + 1], grads[3 * c + 2]};
      lanes_[c]->evalGrad(inside, {values[c]}, g, scratch);
      sharpen(c, q, points.count, g, scratch);
      const Mat3f& m = toVoxel_.linear;
      for (int i = 0; i < points.paddedCount(); ++i) {
        const float x = g[0][i] * stays[0][i], y = g[1][i] * stays[1][i], z = g[2][i] * stays[2][i];
        for (int a = 0; a < 3; ++a) g[a][i] = m(0, a) * x + m(1, a) * y + m(2, a) * z;
      }
    }
  }

  RangeOf<T> range(const Box& box, RangeMemo& memo) const override {
    RangeOf<T> result;
    const Box inside = box.isEmpty() ? box : voxels(box);
    for (int c = 0; c < kLanes; ++c) nephele::detail::rangeComponent(result, c) = memo.of(lanes_[c], inside);
    return result;
  }

  NodePtr<T> restricted(Restriction& restriction) const override {
    return nephele::detail::constantFrom<T>(range(restriction.box, restriction.memo.ranges));
  }

  float differenceStep() const override { return step_; }

 private:
  /// Makes differences over two cells of lane `c` at `q` differences of fourth order, by those over four.
  void sharpen(int c, const BlockLanes<3>& q, int count, const BlockLanes<3>& g, Scratch& scratch) const {
    Scratch::Frame frame(scratch);
    float *const above = frame.lane(), *const below = frame.lane(), *const high = frame.lane(),
                 *const low = frame.lane();
    const int padded = (count + 15) & ~15;
    for (int a = 0; a < 3; ++a) {
      for (int i = 0; i < padded; ++i) high[i] = q[a][i] + 2.0f, low[i] = q[a][i] - 2.0f;
      BlockLanes<3> at = q;
      at[a] = high;
      lanes_[c]->eval(scratch.pointBlock(at, count), {above}, scratch);
      at[a] = low;
      lanes_[c]->eval(scratch.pointBlock(at, count), {below}, scratch);
      for (int i = 0; i < padded; ++i) g[a][i] = (4.0f * g[a][i] - 0.25f * (above[i] - below[i])) / 3.0f;
    }
  }

  /// The nearest points of the box, voxels; `stays` is 1 along edges of the box that were not left, else 0.
  template <bool kMarks>
  void moveInside(const PointBlock& points, const BlockLanes<3>& q, const BlockLanes<3>& stays) const {
    const Mat3f& m = toVoxel_.linear;
    for (int a = 0; a < 3; ++a) {
      const float t = toVoxel_.translation[a], last = last_[a];
      for (int i = 0; i < points.paddedCount(); ++i) {
        const float at = m(a, 0) * points.x[i] + m(a, 1) * points.y[i] + m(a, 2) * points.z[i] + t;
        const float notBelow = at < kFirst ? kFirst : at;
        q[a][i] = notBelow > last ? last : notBelow;
        if constexpr (kMarks) stays[a][i] = std::abs(q[a][i] - at) <= kOnFace ? 1.0f : 0.0f;
      }
    }
  }

  /// Around the nearest points of a box, and a little more for rounding.
  Box voxels(const Box& box) const {
    constexpr double kRounding = 1e-6;
    Box result;
    for (int a = 0; a < 3; ++a) {
      double low = toVoxel_.translation[a], high = low, size = std::abs(low);
      for (int c = 0; c < 3; ++c) {
        if (toVoxel_.linear(a, c) == 0) continue;
        const double x = double(toVoxel_.linear(a, c)) * box.min[c],
                     y = double(toVoxel_.linear(a, c)) * box.max[c];
        low += std::min(x, y);
        high += std::max(x, y);
        size += std::max(std::abs(x), std::abs(y));
      }
      const double more = std::isfinite(size) ? kRounding * size : 0;
      // What is no number may be anywhere.
      result.min[a] = low - more > kFirst ? std::min(float(low - more), last_[a]) : kFirst;
      result.max[a] = high + more < last_[a] ? std::max(float(high + more), kFirst) : last_[a];
    }
    return result;
  }

  Affine toVoxel_;
  Vec3f last_;
  float step_;
  std::array<NodePtr<float>, kLanes> lanes_;
};

/// The samples of one component after faults in single ones were mended.
class Mender {
 public:
  Mender(Grid grid, const Domain& domain)
      : grid_(std::move(grid)), domain_(domain), cells_(cellsOf(domain)) {}

  Grid mended() {
    find();
    if (places_.empty()) return grid_;
    auto result = std::make_shared<BrickGrid>(*grid_);
    for (const Vec3i& voxel : places_)
      if (isSample(voxel)) set(*result, voxel, meanAround(voxel));
    const Vec3i first{kLayers, kLayers, kLayers}, last = cells_ + first;
    for (const Vec3i& voxel : places_)
      if (!isSample(voxel)) set(*result, voxel, result->at(min(max(voxel, first), last)));
    fillBorders(*result);
    return result;
  }

 private:
  bool isSample(const Vec3i& v) const { return isWithin(v, 0); }
  bool isStored(const Vec3i& v) const { return isWithin(v, kLayers); }
  bool isWithin(const Vec3i& voxel, int layers) const {
    for (int a = 0; a < 3; ++a)
      if (voxel[a] < kLayers - layers || voxel[a] > cells_[a] + kLayers + layers) return false;
    return true;
  }
  static void set(BrickGrid& grid, const Vec3i& voxel, float value) {
    grid.brick(grid.poolIndex(brickOf(voxel)))[sampleOffset(insideBrick(voxel))] = value;
  }

  void find() {
    const BrickBox& bricks = grid_->places();
    for (std::size_t number = 0; number < bricks.size(); ++number) {
      const std::int32_t pool = grid_->table()[number];
      const Interval& range = grid_->ranges()[std::size_t(pool)];
      if (std::isfinite(range.min) && std::isfinite(range.max)) continue;
      const Vec3i first = bricks.at(number) * kBrickSide;
      for (int s = 0; s < kBrickSamples; ++s) {
        const Vec3i at{s % kBrickSide, s / kBrickSide % kBrickSide, s / (kBrickSide * kBrickSide)};
        if (!isStored(first + at) || std::isfinite(grid_->brick(pool)[sampleOffset(at)])) continue;
        if (isSample(first + at)) requireMendable(first + at);
        places_.push_back(first + at);
      }
    }
  }

  float meanAround(const Vec3i& voxel) const {
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        Vec3i beside = voxel;
        beside[axis] += side;
        sum += grid_->at(beside);
      }
    return sum / 6;
  }

  void requireMendable(const Vec3i& voxel) const {
    if (std::isfinite(meanAround(voxel))) return;
    const Vec3f at = voxelToWorld(domain_)(Vec3f{float(voxel.x), float(voxel.y), float(voxel.z)});
    throw CallError(Code::failed,
                    fmt::format("the field is {} at ({:.4g}, {:.4g}, {:.4g}) and around it, and samples must "
                                "be finite",
                                grid_->at(voxel), at.x, at.y, at.z),
                    "is something divided by 0 there, or the root of a negative number taken? clamp(f, low, "
                    "high) keeps values finite");
  }

  Grid grid_;
  const Domain& domain_;
  Vec3i cells_;
  std::vector<Vec3i> places_;
};

std::array<Grid, 1> baked(const ScalarField& field, const BakeOptions& options, const Progress& progress) {
  return {bakeGrid(field, options, progress)};
}
VectorGrids baked(const VectorField& field, const BakeOptions& options, const Progress& progress) {
  return gridsOf(bake(field, options, progress));
}
std::array<Grid, 9> baked(const MatrixField& field, const BakeOptions& options, const Progress& progress) {
  std::array<Grid, 9> grids;
  for (int i = 0; i < 3; ++i) {
    const VectorGrids ofRow = baked(row(field, i), options, SubProgress(progress, i / 3.0, (i + 1) / 3.0));
    std::copy(ofRow.begin(), ofRow.end(), grids.begin() + 3 * i);
  }
  return grids;
}

}  // namespace

Affine sampleToWorld(const Domain& domain) {
  Affine map = domain.toWorld();
  map.linear = map.linear *
               Mat3f{{float(domain.cell.x), 0, 0, 0, float(domain.cell.y), 0, 0, 0, float(domain.cell.z)}};
  return map;
}

double sampledBytes(const Domain& domain, int components) {
  // While grids are made, parts of them are there twice.
  constexpr double kMaking = 1.5;
  const Vec3i cells = cellsOf(domain);
  double bricks = 1;
  for (int axis = 0; axis < 3; ++axis) bricks *= brickOf(cells[axis] + 2 * kLayers) + 1;
  return kMaking * bricks * components * BrickGrid::kVolume * sizeof(float);
}

double allowedBytes(const Context& context) {
  constexpr double kShare = 0.8;
  return context.limits.memoryBytes.value_or(kShare * allowedMemory());
}

void requireBytes(double needed, const std::string& what, const std::string& hint, const Context& context) {
  constexpr double kGigabyte = 1e9;
  const double allowed = allowedBytes(context);
  if (needed > allowed)
    throw CallError(Code::limit,
                    fmt::format("{} may take {:.3g} GB, and {:.3g} GB are allowed", what, needed / kGigabyte,
                                allowed / kGigabyte),
                    hint);
}

void requireRoom(const Domain& domain, int components, const Context& context) {
  requireValid(domain);
  const auto cells = domain.cells();
  requireBytes(sampledBytes(domain, components),
               fmt::format("the samples of {} x {} x {} cells", cells.x, cells.y, cells.z),
               "give the domain larger cells or a smaller box", context);
}

template <class T>
Field<T> sampled(const Field<T>& field, const Domain& domain, const Context& context) {
  requireRoom(domain, kComponents<T>, context);
  if (nephele::detail::constantOf(field.node())) return field;
  const Vec3i cells = cellsOf(domain);
  const float behind = 2 * kLayers - 0.5f;
  const Box box{{0.5f, 0.5f, 0.5f},
                Vec3f{float(cells.x), float(cells.y), float(cells.z)} + Vec3f{behind, behind, behind}};
  auto grids = baked(transformed(field, inverse(voxelToWorld(domain))), {.voxelSize = 1, .box = box},
                     *context.progress);
  for (auto& grid : grids) grid = Mender(grid, domain).mended();
  return Field<T>(std::make_shared<DomainNode<T>>(domain, grids));
}

template Field<float> sampled(const Field<float>&, const Domain&, const Context&);
template Field<Vec3f> sampled(const Field<Vec3f>&, const Domain&, const Context&);
template Field<Mat3f> sampled(const Field<Mat3f>&, const Domain&, const Context&);

}  // namespace nephele::felt
