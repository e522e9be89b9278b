#pragma once

#include <functional>
#include <map>
#include <string>

#include "apps/app.h"
#include "apps/options/expression_names.h"
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
  FieldSources(const FieldSources&) = delete;
  FieldSources& operator=(const FieldSources&) = delete;

  /// Of the shape; in a sequence of the largest, and the box around all.
  double longestSide() const { return longestSide_; }
  double voxelSize() const { return options_.voxelSize; }
  const Box& box() const { return box_; }

  /// `value` in world units everywhere: its range is that of its stops at most. Noise goes from one stop to
  /// the other between -1.5 and 1.5 times its rms; values with noise of one frequency vary together. Masks
  /// below 0 or above 1 count as 0 and 1, and so do attributes in short forms; of a level set the inside is 1
  /// and the outside 0, smooth over two voxels. Notes where a mask covers the shape in part or not at all.
  /// @throws Error naming the option: a file or grid that cannot be read, an attribute that is not there, an
  /// expression that may leave what is allowed.
  ScalarField field(const FieldValue& value);

  /// What `value` is at most in and around the shape `mesh`, world units, without looking anything up. A
  /// bound, not the least one. @throws Error naming the option where there is none.
  static double bound(const FieldValue& value, const Mesh& mesh, int seed, const Run& run);

 private:
  ScalarField along(const Vec3f& direction) const;
  ScalarField facing(const Vec3f& direction);
  ScalarField mask(const std::string& path, const std::string& grid);
  ScalarField attribute(const std::string& name, bool hasSpheres);
  /// What is kept under `key`, made by `make` where it is not there.
  ScalarField once(const std::string& key, const std::function<ScalarField()>& make);

  const Mesh& shape_;
  Options options_;
  const Run& run_;
  Box box_;
  double longestSide_ = 0;
  std::map<std::string, ScalarField> made_;
  /// The option whose value is being made, for messages.
  std::string option_;
  ExpressionNames names_;
};

}  // namespace nephele::apps
