#pragma once

#include <optional>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"
#include "nephele/render/volume/field_density.h"

namespace nephele {

/// Light of its own that rays ask a field for, in units of VolumeColour::emission, and the bounds that tell
/// them where they need not. Values below zero and NaN count as zero; outside of the box there is nothing.
struct FieldGlow {
  /// Cost and errors: as FieldDensity.
  FieldGlow(const VectorField& emission, const Box& box, float cell, const Progress& progress = silent());

  /// As a ray counts it.
  static Vec3f counted(const Vec3f& value);

  VectorField emission;
  /// Of the brightest colour.
  FieldDensity bounds;
};

/// Goes along a line through what a density and a glow, which may be null, leave room for.
class GlowingWalk {
 public:
  /// Where there can only be glow, the range of the density is 0.
  struct Span : FieldDensity::Span {
    bool glows = false;
  };

  GlowingWalk(const FieldDensity& density, const FieldGlow* glow, const FieldDensity::Line& line);
  /// The next part of the line where there may be either, near to far; false at its end.
  bool next(Span& span);

 private:
  FieldDensity::Walk density_;
  std::optional<FieldDensity::Walk> glow_;
  FieldDensity::Span dense_{}, glowing_{};
  bool hasDense_, hasGlowing_;
  float at_ = 0.0f;
};

}  // namespace nephele
