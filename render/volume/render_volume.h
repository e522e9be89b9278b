#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/box.h"
#include "nephele/modeling/field/field.h"
#include "nephele/render/volume/coded_density.h"

namespace nephele {

class FieldDensity;
struct FieldGlow;

/// What a density may hold beside itself, on bricks laid out as its own: three grids of the same table, or
/// nulls. Values below zero count as zero.
struct VolumeColour {
  using Grids = std::array<std::shared_ptr<const BrickGrid>, 3>;

  /// Density times its colour, which multiplies the albedo and is at most 1: so that colours mix by their
  /// share where volumes overlap, and no edge is darker because the colour ends there too.
  Grids scattering{};
  /// Light of its own, in Rec.709: a Medium glows with extinction * emission per world unit, whatever the
  /// density there. So much density 1 shows where it is opaque.
  Grids emission{};
};

/// A density that is ready to be marched: bricks, which of them hold anything, and how far it is to the next
/// that does.
///
/// Densities are per world unit and multiply the extinction of a Medium. Values below zero count as zero.
class RenderVolume {
 public:
  /// Keeps references to the grids. Cost: one pass over the brick tables, with a colour one over its samples.
  /// @throws Error if a background is not 0, a value is not finite, the bricks are too many to index (1.6
  /// million distinct ones, 8.5 GB), or colours are laid out in another way.
  explicit RenderVolume(std::shared_ptr<const BrickGrid> density, VolumeColour colour = {});

  /// Of a grid all of whose samples were given to `coded`: as after giveUpSamples and `coded`. @throws Error
  /// as above.
  RenderVolume(std::shared_ptr<const BrickGrid> density, CodedDensity coded);

  /// A density that rays ask a field for, and its colour and its glow, if it has them; `grids` stand for all
  /// of them wherever light is worked out beforehand. @throws Error if they are empty and the field is not,
  /// since then nothing would be lit, or only one of them has a colour or an emission.
  static RenderVolume ofField(RenderVolume grids, std::shared_ptr<const FieldDensity> field,
                              std::optional<VectorField> colour = std::nullopt,
                              std::shared_ptr<const FieldGlow> glow = nullptr);

  const BrickGrid& density() const { return *density_; }
  /// The density as the march reads it. Made at the first call, by one thread of those that ask. Cost: one
  /// pass over the samples.
  const CodedBricks& coded() const;
  /// From now on the samples of `density` are given back when `coded` is made, since what follows is only
  /// marched: they read as 0 then. Layers of normals, the path tracer and light made anew need them. The grid
  /// must be this volume's alone, which else keeps it.
  void giveUpSamples();
  /// False once they are given back: then only `coded` holds the density.
  bool hasSamples() const { return !made_->isGivenUp; }
  /// Null where the grid is all there is.
  const FieldDensity* field() const { return field_.get(); }
  /// Of the field, clamped to [0, 1] per colour where it is read; null where it has none.
  const VectorField* fieldColour() const { return fieldColour_ ? &*fieldColour_ : nullptr; }
  /// Null where the field does not glow.
  const FieldGlow* fieldGlow() const { return fieldGlow_.get(); }
  const VolumeColour& colour() const { return colour_; }
  bool hasColour() const { return colour_.scattering[0] != nullptr; }
  bool hasEmission() const { return colour_.emission[0] != nullptr; }
  /// What the albedo is multiplied by, mean over the density; 1 without a colour.
  const Vec3f& meanColour() const { return meanColour_; }
  /// Emission over density at a world-space point; 0 where there is no density, and over a hundredth of the
  /// typical one where there is less. Slow beside a march.
  float emissionPerDensity(const Vec3f& world, int colour) const;
  /// True where nothing in the volume is above zero.
  bool isEmpty() const { return occupied_.empty(); }
  float maxDensity() const { return maxDensity_; }
  /// Mean density weighted by itself: what light meets where it meets anything. 0 for an empty volume.
  /// Cost: one pass over the samples, at the first call.
  float typicalDensity() const;

  /// Brick coordinates of the bricks that hold density or emission, in the table's order.
  const std::vector<Vec3i>& occupiedBricks() const { return occupied_; }
  /// Distance in bricks (largest of the three axes) from every entry of the brick table to the nearest brick
  /// that holds density: 0 in one, saturating at 32. A ray may leave the box of radius distance - 1 around an
  /// entry unseen.
  std::span<const std::uint8_t> emptiness() const { return emptiness_; }
  /// The same distance to the nearest brick that is not the same constant, for bricks of the constant that
  /// fills most bricks; 0 in all others. A ray may cross the box of radius distance - 1 around an entry
  /// without looking at it.
  std::span<const std::uint8_t> uniformity() const { return uniformity_; }

  /// Box of the bricks that hold density, in voxels.
  const Box& indexBounds() const { return indexBounds_; }
  /// World box of the voxels above zero, grown by one voxel. Empty for an empty volume.
  const Box& worldBounds() const { return worldBounds_; }
  /// World-space corners of the voxels above zero, brick by brick; their hull contains all density.
  const std::vector<Vec3f>& outline() const { return outline_; }
  /// With `coded`, be it made or not.
  std::size_t memoryBytes() const;

 private:
  /// What is made where it is asked for.
  struct Made {
    std::once_flag coding, measuring;
    CodedBricks coded;
    float typicalDensity = 0;
    bool isToGiveUp = false, isGivenUp = false;
  };

  void checkColour(const VolumeColour::Grids& grids, const char* name) const;
  void measureColour();
  float typicalDensityOf(const CodedDensity* coded) const;
  bool isOccupied(std::size_t entry) const;
  void findOccupied();
  void measureEmptiness();
  void measureUniformity();
  void measureBounds(const CodedDensity* coded);
  Box boxAbove0(const Vec3i& brick) const;
  void measure(const CodedDensity* coded);

  std::shared_ptr<const BrickGrid> density_;
  VolumeColour colour_;
  std::shared_ptr<Made> made_ = std::make_shared<Made>();
  std::shared_ptr<const FieldDensity> field_;
  std::optional<VectorField> fieldColour_;
  std::shared_ptr<const FieldGlow> fieldGlow_;
  Vec3f meanColour_{1, 1, 1};
  std::vector<Vec3i> occupied_;
  std::vector<std::uint8_t> emptiness_, uniformity_;
  std::vector<Vec3f> outline_;
  Box indexBounds_, worldBounds_;
  float maxDensity_ = 0.0f;
};

}  // namespace nephele
