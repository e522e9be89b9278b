// What a marcher needs to know about a density before the first ray.
//
// Empty space: for every brick the Chebyshev distance to the nearest occupied one, and for constant ones to
// the nearest other. A ray then leaves whole boxes of empty bricks in one step, so that its cost follows what
// is there and not how finely the box around it is divided.
//
// Bounds: a brick whose six neighbours are full lies inside the hull of the rest, so only the others are
// looked into.
#include "nephele/render/volume/render_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/volume/detail/brick_distances.h"
#include "nephele/render/volume/detail/holdable_density.h"
#include "nephele/render/volume/field_glow.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele {

namespace {
// Bricks that a ray may leave behind at once; more would cost the passes more than it saves the rays.
constexpr std::uint8_t kFarthest = 32;
// Of the typical density: what glows in less lights others as if there were that much, so that what it gives
// per optical depth stays finite and does not spread from there into what is dense.
constexpr float kThinnestGlow = 0.01f;

}  // namespace

RenderVolume::RenderVolume(std::shared_ptr<const BrickGrid> density, VolumeColour colour)
    : density_(std::move(density)), colour_(std::move(colour)) {
  measure(nullptr);
}

RenderVolume::RenderVolume(std::shared_ptr<const BrickGrid> density, CodedDensity coded)
    : density_(std::move(density)) {
  measure(&coded);
  std::call_once(made_->measuring, [&] { made_->typicalDensity = typicalDensityOf(&coded); });
  std::call_once(made_->coding, [&] {
    made_->coded = coded.codes(*density_);
    made_->isGivenUp = true;
  });
}

// From what is known of samples that were coded, or from the samples.
void RenderVolume::measure(const CodedDensity* coded) {
  require(density_ != nullptr, "render volume: no density given");
  const BrickGrid& grid = *density_;
  require(grid.background() == 0.0f,
          fmt::format("density: expected 0 outside of the volume, but its background is {}{}",
                      grid.background(), grid.background() > 0 ? "; is it a level set?" : ""));
  require(grid.values().size() <= std::size_t(std::numeric_limits<std::int32_t>::max()),
          fmt::format(
              "density: {} distinct bricks are more than the {} that can be marched; use a larger voxel size",
              grid.poolSize(), std::numeric_limits<std::int32_t>::max() / BrickGrid::kVolume));
  Interval all = Interval::of(0);
  bool isFinite = true;
  for (const Interval& range : grid.ranges()) {
    isFinite = isFinite && std::isfinite(range.min) && std::isfinite(range.max);
    all = all.hull(range);
  }
  require(isFinite, "density: contains values that are not finite");
  detail::requireHoldableDensity(all);
  checkColour(colour_.scattering, "colour");
  checkColour(colour_.emission, "emission");
  findOccupied();
  measureColour();
  if (isEmpty()) return;
  parallelFor(3, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part != end; ++part) {
      if (part == 0) measureBounds(coded);
      if (part == 1) measureEmptiness();
      if (part == 2) measureUniformity();
    }
  });
  const Vec3f reach =
      max(max(worldBounds().max, -worldBounds().max), max(worldBounds().min, -worldBounds().min));
  const float farthest = std::max({reach.x, reach.y, reach.z});
  require(
      farthest < 2e6f * grid.voxelSize(),
      fmt::format("density: stands {:g} from the origin, where voxels of {:g} can no longer be told apart; "
                  "move it nearer",
                  farthest, grid.voxelSize()));
}

RenderVolume RenderVolume::ofField(RenderVolume grids, std::shared_ptr<const FieldDensity> field,
                                   std::optional<VectorField> colour, std::shared_ptr<const FieldGlow> glow) {
  require(field != nullptr, "render volume: no field given");
  require(grids.hasColour() == colour.has_value() && grids.hasEmission() == (glow != nullptr),
          "render volume: a colour and a glow are needed both as fields and as grids");
  require(!grids.isEmpty() || (field->isEmpty() && (!glow || glow->bounds.isEmpty())),
          fmt::format("render volume: nothing of the field is found with voxels of {}; use smaller ones",
                      grids.density().voxelSize()));
  grids.field_ = std::move(field);
  grids.fieldColour_ = std::move(colour);
  grids.fieldGlow_ = std::move(glow);
  return grids;
}

void RenderVolume::checkColour(const VolumeColour::Grids& grids, const char* name) const {
  const auto laidOutAs = [](const BrickGrid& a, const BrickGrid& b) {
    return a.firstBrick() == b.firstBrick() && a.brickCount() == b.brickCount() &&
           a.worldToIndex().translation == b.worldToIndex().translation &&
           a.worldToIndex().linear == b.worldToIndex().linear;
  };
  for (const auto& grid : grids) {
    require((grid == nullptr) == (grids[0] == nullptr), fmt::format("{}: three grids or none needed", name));
    if (!grid) continue;
    require(grid->table() == grids[0]->table() && laidOutAs(*grid, *density_) &&
                grid->values().size() <= std::size_t(std::numeric_limits<std::int32_t>::max()),
            fmt::format("{}: its bricks must be laid out as the density's", name));
    require(std::ranges::all_of(
                grid->ranges(),
                [](const Interval& range) { return std::isfinite(range.min) && std::isfinite(range.max); }),
            fmt::format("{}: contains values that are not finite", name));
  }
}

// Sums in a fixed order, since the mean must not depend on the threads.
void RenderVolume::measureColour() {
  if (!hasColour()) return;
  double density = 0, colours[3] = {};
  const auto sumOf = [](const BrickGrid& grid, const Vec3i& brick) {
    const float* values = grid.brick(grid.poolIndex(brick));
    double sum = 0;
    for (int z = 0; z != BrickGrid::kBrick; ++z)
      for (int y = 0; y != BrickGrid::kBrick; ++y)
        for (int x = 0; x != BrickGrid::kBrick; ++x)
          sum += double(std::max(values[sampleOffset(x, y, z)], 0.0f));
    return sum;
  };
  for (const Vec3i& brick : occupied_) {
    density += sumOf(*density_, brick);
    for (std::size_t c = 0; c != 3; ++c) colours[c] += sumOf(*colour_.scattering[c], brick);
  }
  for (int c = 0; c != 3; ++c)
    meanColour_[c] = density > 0 ? float(std::min(colours[c] / density, 1.0)) : 1.0f;
}

bool RenderVolume::isOccupied(std::size_t entry) const {
  if (density_->ranges()[std::size_t(density_->table()[entry])].max > 0) return true;
  for (const auto& grid : colour_.emission)
    if (grid && grid->ranges()[std::size_t(grid->table()[entry])].max > 0) return true;
  return false;
}

void RenderVolume::findOccupied() {
  const BrickGrid& grid = *density_;
  std::size_t entry = 0;
  for (int z = 0; z < grid.brickCount().z; ++z)
    for (int y = 0; y < grid.brickCount().y; ++y)
      for (int x = 0; x < grid.brickCount().x; ++x, ++entry) {
        const float most = grid.ranges()[std::size_t(grid.table()[entry])].max;
        if (!isOccupied(entry)) continue;
        occupied_.push_back(grid.firstBrick() + Vec3i{x, y, z});
        maxDensity_ = std::max(maxDensity_, most);
      }
}

void RenderVolume::measureEmptiness() {
  emptiness_.assign(density_->table().size(), kFarthest);
  for (const Vec3i& brick : occupied_) emptiness_[density_->tableIndex(brick)] = 0;
  detail::spreadDistances(emptiness_, density_->brickCount());
}

void RenderVolume::measureUniformity() {
  const BrickGrid& grid = *density_;
  std::vector<std::size_t> places(grid.poolSize());
  for (const std::int32_t pool : grid.table()) ++places[std::size_t(pool)];
  std::size_t constant = 0;
  for (std::size_t pool = 0; pool != places.size(); ++pool)
    if (grid.ranges()[pool].isPoint() && grid.ranges()[pool].max > 0 &&
        (constant == 0 || places[pool] > places[constant]))
      constant = pool;
  uniformity_.assign(grid.table().size(), 0);
  if (constant == 0) return;
  for (std::size_t entry = 0; entry != grid.table().size(); ++entry)
    if (std::size_t(grid.table()[entry]) == constant) uniformity_[entry] = kFarthest;
  detail::spreadDistances(uniformity_, grid.brickCount());
}

void RenderVolume::measureBounds(const CodedDensity* coded) {
  const BrickGrid& grid = *density_;
  constexpr int brickSize = BrickGrid::kBrick;
  Vec3i low = occupied_.front(), high = occupied_.front();
  for (const Vec3i& brick : occupied_) low = min(low, brick), high = max(high, brick);
  indexBounds_ = {Vec3f(low * brickSize), Vec3f((high + Vec3i{1, 1, 1}) * brickSize)};

  const auto isFull = [&](const Vec3i& brick) {
    return grid.ranges()[std::size_t(grid.poolIndex(brick))].min > 0;
  };
  std::vector<Vec3i> border;
  for (const Vec3i& brick : occupied_) {
    bool inside = true;
    for (int axis = 0; axis != 3 && inside; ++axis)
      for (const int side : {-1, 1}) {
        Vec3i next = brick;
        next[axis] += side;
        inside = inside && isFull(next);
      }
    if (!inside) border.push_back(brick);
  }

  std::vector<Box> boxes(border.size());
  parallelFor(border.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      Box box;
      if (coded) {
        const BrickMeasures& known = coded->measures()[std::size_t(grid.poolIndex(border[i]))];
        for (const auto& node : {known.first, known.last})
          if (known.last[0] >= 0)
            box = box.including(Vec3f(border[i] * brickSize + Vec3i{node[0], node[1], node[2]}));
      } else {
        box = boxAbove0(border[i]);
      }
      // Interpolation carries density to the voxel beyond.
      if (!box.isEmpty()) boxes[i] = box.expanded(1.0f);
    }
  });
  outline_.reserve(8 * boxes.size());
  for (const Box& box : boxes) {
    if (box.isEmpty()) continue;
    for (int corner = 0; corner != 8; ++corner) {
      const Vec3f p{corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                    corner & 4 ? box.max.z : box.min.z};
      outline_.push_back(grid.indexToWorld()(p));
      worldBounds_ = worldBounds_.including(outline_.back());
    }
  }
}

// Around the nodes of a brick where anything is.
Box RenderVolume::boxAbove0(const Vec3i& brick) const {
  const float* values = density_->brick(density_->poolIndex(brick));
  const float* glows[3] = {};
  for (std::size_t c = 0; c != 3 && hasEmission(); ++c)
    glows[c] = colour_.emission[c]->brick(colour_.emission[c]->poolIndex(brick));
  const float* const* glow = hasEmission() ? glows : nullptr;
  Box box;
  for (int z = 0; z <= BrickGrid::kBrick; ++z)
    for (int y = 0; y <= BrickGrid::kBrick; ++y)
      for (int x = 0; x <= BrickGrid::kBrick; ++x) {
        const int at = sampleOffset(x, y, z);
        if (values[at] > 0 || (glow && (glow[0][at] > 0 || glow[1][at] > 0 || glow[2][at] > 0)))
          box = box.including(Vec3f(brick * BrickGrid::kBrick + Vec3i{x, y, z}));
      }
  return box;
}

float RenderVolume::emissionPerDensity(const Vec3f& world, int colour) const {
  const Vec3d place(density_->worldToIndex()(world));
  const auto valueOf = [&](const BrickGrid& grid) { return std::max(sampleGrid(grid, place), 0.0f); };
  const float density = valueOf(*density_);
  if (!(density > 0 && hasEmission())) return 0.0f;
  return valueOf(*colour_.emission[std::size_t(colour)]) /
         std::max(density, kThinnestGlow * typicalDensity());
}

float RenderVolume::typicalDensity() const {
  std::call_once(made_->measuring, [this] { made_->typicalDensity = typicalDensityOf(nullptr); });
  return made_->typicalDensity;
}

float RenderVolume::typicalDensityOf(const CodedDensity* coded) const {
  std::vector<BrickMeasures> measures(density_->poolSize());
  if (!coded)
    parallelFor(measures.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pool = begin; pool != end; ++pool)
        if (density_->ranges()[pool].max > 0)
          measures[pool] = BrickMeasures::of(density_->brick(std::int32_t(pool)));
    });
  // Added in a fixed order, so that the sum does not depend on the threads.
  double density = 0, squares = 0;
  for (const Vec3i& brick : occupied_) {
    const auto pool = std::size_t(density_->poolIndex(brick));
    const BrickMeasures& own = coded ? coded->measures()[pool] : measures[pool];
    density += own.density;
    squares += own.squares;
  }
  return density > 0 ? float(squares / density) : 0.0f;
}

const CodedBricks& RenderVolume::coded() const {
  std::call_once(made_->coding, [this] {
    made_->isGivenUp = made_->isToGiveUp && density_.use_count() == 1;
    if (made_->isGivenUp) {
      // It can only be told from the samples.
      typicalDensity();
      // Grids are made to be written; only what is shared is not.
      made_->coded = CodedBricks::inPlaceOf(const_cast<BrickGrid&>(*density_));
    } else {
      made_->coded = CodedBricks(*density_);
    }
  });
  return made_->coded;
}

void RenderVolume::giveUpSamples() {
  made_->isToGiveUp = true;
}

std::size_t RenderVolume::memoryBytes() const {
  std::size_t others = 0;
  for (const VolumeColour::Grids* grids : {&colour_.scattering, &colour_.emission})
    for (const auto& grid : *grids) others += grid ? grid->memoryBytes() : 0;
  if (field_) others += field_->memoryBytes();
  if (fieldGlow_) others += fieldGlow_->bounds.memoryBytes();
  const auto codedBytes =
      std::size_t(CodedBricks::estimateBytes(double(density_->poolSize()), double(density_->table().size())));
  const std::size_t given = hasSamples() ? 0 : density_->values().capacity() * sizeof(float);
  return density_->memoryBytes() - given + codedBytes + others + emptiness_.size() + uniformity_.size() +
         occupied_.size() * sizeof(Vec3i) + outline_.size() * sizeof(Vec3f);
}

}  // namespace nephele
