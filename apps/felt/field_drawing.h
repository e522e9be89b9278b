#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/field/field.h"
#include "nephele/render/image/image.h"

namespace nephele::apps {

/// Lines of text that draw the values of `field` from `a` to `b` as a curve in Braille dots, with the lowest
/// and the highest value beside it. Values that are not finite are left out.
std::vector<std::string> plotted(const ScalarField& field, const Vec3f& a, const Vec3f& b);

/// A plane of a box that is square to an axis.
struct Slice {
  Box box;
  /// 0, 1, 2: x, y, z.
  int axis = 2;
  float place = 0;

  /// The axes that go to the right and up.
  int right() const { return axis == 0 ? 2 : 0; }
  int up() const { return axis == 1 ? 2 : 1; }
};

/// Lines of text with a mark for each value, darkest where it is least.
std::vector<std::string> drawn(const ScalarField& field, const Slice& slice);

/// A picture whose longer side has so many pixels: grey from black at 0 or above to white at the largest
/// value; values below 0 are blue. Where there are both, the line of 0 is seen.
Image pictureOf(const ScalarField& field, const Slice& slice, int pixels);

}  // namespace nephele::apps
