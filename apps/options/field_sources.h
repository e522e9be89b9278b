#pragma once

#include <map>
#include <string>

#include "apps/app.h"
#include "apps/options/field_value.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/field/field.h"

namespace nephele::apps {

/// What the parameters of one cloud are made from. A mask, an attribute or a direction that several
/// parameters use is read once.
class FieldSources {
 public:
  struct Options {
    /// Of the cloud, world units.
    double voxelSize = 0;
    /// How far the cloud may reach beyond the shape, world units: there look-ups are made fast.
    double reach = 0;
    /// Of noises.
    int seed = 0;
  };

  /// Keeps references to both. `shape` must be triangulated.
  FieldSources(const Mesh& shape, const Options& options, const Run& run);

  /// Of the shape; in a sequence of the largest, and the box around all.
  double longestSide() const { return longestSide_; }
  double voxelSize() const { return options_.voxelSize; }
  const Box& box() const { return box_; }

  /// `value` in world units everywhere: its range is that of its stops at most. Noise goes from one stop to
  /// the other between -1.5 and 1.5 times its rms; values with noise of one frequency vary together. Masks
  /// and attributes below 0 or above 1 count as 0 and 1; of a level set the inside is 1 and the outside 0,
  /// smooth over two voxels. Notes where a mask covers the shape in part or not at all.
  /// @throws Error naming the option: a file or grid that cannot be read, an attribute that is not there.
  ScalarField field(const FieldValue& value);

 private:
  ScalarField rampOf(const FieldValue& value);
  ScalarField placesOf(const FieldValue& value);
  ScalarField noise(const FieldValue& value) const;
  ScalarField along(const Vec3f& direction) const;
  ScalarField facing(const Vec3f& direction);
  ScalarField mask(const FieldValue& value);
  ScalarField attribute(const FieldValue& value);

  const Mesh& shape_;
  Options options_;
  const Run& run_;
  Box box_;
  double longestSide_ = 0;
  std::map<std::string, ScalarField> made_;
};

}  // namespace nephele::apps
