#pragma once

#include <string>

#include "apps/app.h"
#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/similarity.h"

namespace nephele::apps {

/// What is moved, and where to.
struct TransformOptions {
  enum class UpAxis { y, z };
  enum class Unit { millimetre, centimetre, metre, inch, foot };
  enum class Place { asIs, centre, ground };

  std::string input, output;
  UpAxis from = UpAxis::y, to = UpAxis::y;
  Unit unit = Unit::metre, newUnit = Unit::metre;
  double scale = 1;
  Vec3d degrees{}, move{};
  Place place = Place::asIs;

  /// Units, up axis, scale and turn.
  Similarity turn() const;
  /// The way from there to its place; `box` is that of what was turned.
  Similarity shift(const Box& box) const;
};

/// Declares the options on `app`.
void addTransformOptions(CLI::App& app, TransformOptions& options);

}  // namespace nephele::apps
