#pragma once

#include <string>

#include "apps/app.h"
#include "nephele/levelset/mesh/similarity.h"
#include "nephele/modeling/base/box.h"

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
  Vec3f degrees{}, move{};
  Place place = Place::asIs;

  bool isPlaced() const { return place != Place::asIs; }
  /// Units, up axis, scale and turn.
  Similarity turned() const;
  /// All of it; `box` is that of what was `turned`.
  Similarity placed(const Similarity& turn, const Box& box) const;
};

/// Declares the options on `app`.
void addTransformOptions(CLI::App& app, TransformOptions& options);

}  // namespace nephele::apps
