#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/volume/coded_bricks.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

namespace detail {
/// What nodes of a LightVolume hold of a column c >= 0: sqrt(c^2 + 2 a c). Where density begins in a straight
/// rise over a voxel, c grows with the square of the way and this with the way itself; behind it, it is c +
/// a, if `bend`, a, is half of what a voxel adds.
inline float bentColumn(float column, float bend) {
  return std::sqrt(column * (column + 2 * bend));
}
inline float unbentColumn(float bent, float bend) {
  return std::sqrt(bent * bent + bend * bend) - bend;
}
}  // namespace detail

/// How much density lies between every point of a volume and a distant light, on a lattice whose third axis
/// runs along the light.
///
/// Holds  c(x) = integral of density from x towards the light,  so that light reaches x times exp(-extinction
/// c(x)). It is smooth where the light is not, and what is interpolated is nearly straight where density
/// begins, see detail::bentColumn, so that the light is right however opaque a voxel is. Known wherever the
/// volume holds density, and not outside. Nodes are as far apart as the density's voxels.
class LightVolume {
 public:
  static constexpr int kBrick = 8;
  static constexpr int kWidth = kBrick + 1;
  static constexpr int kVolume = kWidth * kWidth * kWidth;

  struct Options {
    /// Columns beyond this need not be told apart: no light is left there. Bricks that lie wholly beyond it
    /// hold this everywhere, and most are not worked out.
    float dark = std::numeric_limits<float>::infinity();
    /// Density above this counts as this: columns of a thinned volume, see ScatteredLight.
    float most = std::numeric_limits<float>::infinity();
    /// Codes bricks as they are worked out, in half the memory. Neither `replace` nor `addShade` may follow.
    bool coded = false;
  };

  /// @param towards world-space direction towards the light, not zero.
  /// Cost: one sample of density per node of the bricks that hold density and light, one sweep, no march.
  /// @throws Error if `towards` is zero or not finite, or `dark` is not above 0.
  LightVolume(const RenderVolume& volume, const Vec3f& towards, const Options& options,
              const Progress& progress = silent());
  LightVolume(const RenderVolume& volume, const Vec3f& towards, const Progress& progress = silent())
      : LightVolume(volume, towards, Options{}, progress) {}

  /// Sets c at every node to `column` of its place in the world, in place of the sweep's; it is taken to be
  /// interpolated itself, between rays that are as far apart as nodes. Uses all cores.
  void replace(const std::function<float(const Vec3f&)>& column);

  /// From world space to this lattice, whose nodes are integers.
  const Affine& worldToLattice() const { return worldToLattice_; }
  Vec3i firstBrick() const { return firstBrick_; }
  Vec3i brickCount() const { return brickCount_; }
  /// Pool brick of every brick of the lattice, first axis fastest; 0 is a brick of zeros, and 1, where
  /// Options::dark is finite, a dark one.
  const std::vector<std::int32_t>& table() const { return table_; }
  /// kVolume values per pool brick, first axis fastest: bentColumn(c, bend()) at the nodes 0 to 8 of its
  /// cells. Empty once coded.
  const detail::UnsetVector<float>& values() const { return values_; }
  float bend() const { return bend_; }

  /// Codes the values for the march, if they are not: the last thing to do, since neither `replace` nor
  /// `addShade` may follow. Uses all cores.
  /// @throws Error if there are more than 5.8 million bricks.
  void code();
  /// Empty until `code`, unless Options::coded.
  const CodedBricks& coded() const { return coded_; }

  /// Adds the shadow of opaque things within `box` to c: where a ray from the light, which starts outside of
  /// the box and travels against `towards`, has met one after distanceToShade(ray), infinite if it meets
  /// none. Edges are a voxel wide: four rays per column of nodes, a quarter of a node apart. Full shadow adds
  /// detail::kDark times `perDepth`, the column of an optical depth of 1. Uses all cores.
  void addShade(const std::function<double(const Ray&)>& distanceToShade, const Box& box,
                const Vec3f& towards, float perDepth);

  /// c at a world-space point.
  float columnDensity(const Vec3f& world) const;
  /// The same at as many points as there are `columns`.
  void columnDensities(std::span<const Vec3f> world, std::span<float> columns) const;
  /// A lower bound of it between points: Options::dark where all around them is dark, else 0.
  float leastColumnDensity(std::span<const Vec3f> world) const;
  std::size_t memoryBytes() const {
    return values_.size() * sizeof(float) + table_.size() * sizeof(std::int32_t) + coded_.memoryBytes();
  }

  /// Upper bound of the bytes that a light volume of `volume` takes, whatever the direction.
  static double estimateBytes(const RenderVolume& volume, const Options& options);

 private:
  struct Sweep;
  struct Patch;

  std::int32_t findBricks(const RenderVolume& volume, const Sweep& sweep);
  void findDark(const Sweep& sweep);
  void fillColumn(const Sweep& sweep, std::size_t column, std::atomic<std::int32_t>& coded);
  void makeRoom(std::int32_t bricks, bool coded);
  bool isStored(std::int32_t pool) const { return pool > (dark_ < INFINITY ? 1 : 0); }

  Affine worldToLattice_;
  Vec3i firstBrick_, brickCount_;
  std::vector<std::int32_t> table_;
  detail::UnsetVector<float> values_;
  float dark_ = INFINITY, bend_ = 0;
  CodedBricks coded_;
};

namespace detail {
/// Optical depth of a full shadow.
inline constexpr float kDark = 40.0f;

/// Where shadow begins along the node columns of a column of bricks, for the four points around every node.
struct ColumnShade {
  static constexpr int kColumns = LightVolume::kWidth * LightVolume::kWidth;
  /// In slices, infinite if there is none; on the way from the light, against which slices count where
  /// `falls`.
  std::array<std::array<float, 4>, kColumns> begins;
  bool falls = false;

  ColumnShade() { begins.fill({INFINITY, INFINITY, INFINITY, INFINITY}); }
  /// Adds it to the nodes of a brick whose first slice is `slice`.
  void addTo(float* values, int slice, float perDepth) const;
};

/// The nodes of a brick from `column` of each, also of those a node outside of it, less the mean error of
/// linear interpolation: once along the light, twice across, see LightVolume::replace.
void replaceBrick(const std::function<float(const Vec3i&)>& column, float* out);
}  // namespace detail

}  // namespace nephele
