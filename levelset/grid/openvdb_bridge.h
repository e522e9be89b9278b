#pragma once

// Brings OpenVDB's headers: for .cpp files alone.
#include <openvdb/openvdb.h>
#include <openvdb/util/NullInterrupter.h>

#include <memory>
#include <string>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/progress.h"

/// Our grids as OpenVDB's trees and back: for files, and for those of OpenVDB's tools that the library uses.
namespace nephele::detail {

/// OpenVDB's type registry must be filled before any grid is made or read.
void initializeOpenVdb();

/// What a grid is called in messages.
std::string displayName(const std::string& name);
std::string displayName(const openvdb::GridBase& grid);

/// A linear transform from voxels to the world, for row vectors. OpenVDB's own makes none of voxels below
/// 1e-5.
openvdb::Mat4d matrixOf(const openvdb::math::Transform& transform);

/// Voxels of an edge that may be so small that OpenVDB's constructors refuse it.
openvdb::math::Transform::Ptr uniformTransform(double voxelSize,
                                               const openvdb::Vec3d& translation = {0, 0, 0});

/// Where the voxels of a grid stand. @throws Error naming the grid if its transform is not linear or is
/// singular.
Lattice latticeOf(const openvdb::GridBase& grid);

/// A transform in double precision for voxels of `voxelSize` where the lattice is uniform, and else that of
/// the lattice.
openvdb::math::Transform::Ptr transformOf(const Lattice& lattice, double voxelSize);

/// The bricks of a grid, its values times `sign`: -1 for a level set, which is negative inside in OpenVDB.
/// @throws Error naming the grid if it is too large, not finite, or so far from the origin that single
/// precision would move a voxel by more than an eighth of its size.
std::shared_ptr<BrickGrid> bricksOf(const openvdb::FloatGrid& grid, float sign, const BrickSink& made = {});
/// The leaves and tiles of a tree, likewise, its first brick being that at `origin` and its voxels of
/// `voxelSize`.
VoxelGrid<float> voxelsOf(const openvdb::FloatGrid& grid, double voxelSize, const Vec3i& origin, float sign);
/// The leaves of a grid of vectors, tiles of active voxels among them; what is not active is background.
/// @throws Error naming the grid if a value is not finite or its tiles are too large to be held voxel by
/// voxel.
VoxelGrid<Vec3f> voxelsOf(const openvdb::Vec3SGrid& grid);

/// How values of ours become values of a tree, and which of those are active.
struct TreeValues {
  enum class Active { insideBand, positive, notBackground };

  float sign = 1.0f;
  float low = 0.0f;
  float high = 0.0f;
  float background = 0.0f;
  Active active = Active::notBackground;

  /// A level set: negative inside; its background is the half-width. Values are clamped to the narrower side
  /// of the band. @throws Error naming the grid if it is not negative outside.
  static TreeValues levelSet(const BrickGrid& bricks, const std::string& name);
  static TreeValues levelSet(const VoxelGrid<float>& voxels, const std::string& name);
  static TreeValues fog();
  static TreeValues asTheyAre(float background);
  /// Times -1, without bounds.
  static TreeValues negated(float background);

  float operator()(float sample) const { return std::clamp(sign * sample, low, high); }
  bool isActive(float value) const {
    switch (active) {
      case Active::insideBand:
        return value > low && value < high;
      case Active::positive:
        return value > 0.0f;
      default:
        return value != background;
    }
  }
};

/// Trees of bricks and of voxels; constants become tiles. The transform is set, name and class are not.
/// Of voxels handed over, samples are given back while leaves are made of them.
/// `name` as messages show it. @throws Error naming the grid if a value is not finite.
openvdb::FloatGrid::Ptr toOpenVdb(const BrickGrid& bricks, const TreeValues& values, const std::string& name);
openvdb::FloatGrid::Ptr toOpenVdb(VoxelGrid<float>&& voxels, const TreeValues& values,
                                  const std::string& name);
/// Voxels of bricks that hold samples are active.
openvdb::Vec3SGrid::Ptr toOpenVdb(VoxelGrid<Vec3f>&& voxels, const std::string& name);

/// Lets OpenVDB's tools see that a Progress was cancelled, and reports how far they are.
class Interrupter final : public openvdb::util::NullInterrupter {
 public:
  explicit Interrupter(const Progress& progress) : progress_(progress) {}
  bool wasInterrupted(int percent = -1) override {
    if (percent >= 0) progress_.advance(percent / 100.0);
    return progress_.cancelled();
  }

 private:
  const Progress& progress_;
};

}  // namespace nephele::detail
