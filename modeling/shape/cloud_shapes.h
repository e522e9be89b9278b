#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "nephele/modeling/field/field.h"

/// Shapes of cumulus clouds from a seed: the base that `cumulo` grows its layers on, where there is no mesh.
namespace nephele {

/// How far a cumulus has grown, as the cloud atlas names it. In brackets the height over the width.
enum class CloudSpecies {
  /// Low and wide, of small heaps side by side. [0.2 to 0.5]
  humilis,
  /// A few blunt towers. [0.5 to 1.1]
  mediocris,
  /// One or two tall towers with crowns of turrets, above lower ones. [0.95 to 1.9]
  congestus,
};

/// Every species.
std::span<const CloudSpecies> cloudSpecies();
/// The name in options and files: "humilis", "mediocris", "congestus".
std::string_view speciesName(CloudSpecies species);

/// A rounded part of a cloud: the ellipsoid |(x - center) / radii| = 1.
struct CloudLobe {
  Vec3f center, radii;
};

struct CloudShapeOptions {
  CloudSpecies species = CloudSpecies::mediocris;
  /// Another seed is another cloud of the same species.
  std::uint32_t seed = 0;
  /// Longest side of the box around the lobes, world units, > 0.
  float size = 1.0f;
};

struct CloudShape {
  /// Positive inside; see `cloudShape`.
  ScalarField level{0.0f};
  /// Contains all points where `level` is positive. Its lower face is the base, y = 0.
  Box box;
  /// What the shape was made of, before it was cut at the base.
  std::vector<CloudLobe> lobes;
};

/// A cloud that stands on y = 0 with its middle above the origin: lobes joined by fillets, cut flat below.
///
/// Warm air rises in columns. Each becomes a stack of lobes, widest below the middle and leaning with the
/// wind, and crowned by turrets; smaller lobes bud from the upper side of each. The tallest columns stand in
/// the middle, lower ones lean against them, and all end at the same height below, where vapour condenses:
/// the base is flat with a round rim. The shape is one piece.
///
/// |gradient| <= 1, so that |level| is at most the distance to the surface, and > 0.9 on four fifths of the
/// space around it: it falls where fillets join facing parts. Of humilis, whose lobes are flattened, it is up
/// to 1.15 outside and steeper in the middle of lobes. To grow layers take the distance to the surface, as
/// `makeCloud` does with the mesh of it. Cost: some hundred lobes per value in the open, a few where
/// restricted to a box. The same seed gives the same shape.
/// @throws Error unless size > 0 and finite.
CloudShape cloudShape(const CloudShapeOptions& options = {});

}  // namespace nephele
