// Where the inside of a level set is, from ranges alone. Outward: a cube about the origin, then shells of
// cubes, each twice as wide as the one before, until there is no room left. Inward: the box of what may be
// inside is split until its faces are known to a few percent.
#include <cmath>

#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/field_extent.h"
#include "nephele/modeling/base/octant.h"
#include "nephele/modeling/field/field.h"

namespace nephele::felt {

namespace {

constexpr float kFarthest = 1 << 20;

/// A box around those parts of `box` in which `level` may be above 0, after so many splits.
Box maybeInside(const ScalarField& level, const Box& box, int splits, const Progress& progress) {
  const Interval range = level.range(box);
  if (range.max <= 0) return {};
  if (splits == 0 || range.min > 0) return box;
  progress.check();
  const ScalarField local = level.restrictedTo(box);
  Box found;
  for (int part = 0; part < 8; ++part)
    found = found.including(maybeInside(local, octant(box, part), splits - 1, progress));
  return found;
}

/// The same of the shell between the cubes with half edges `inner` and 2 `inner`.
Box maybeInsideShell(const ScalarField& level, float inner, const Progress& progress) {
  constexpr int kAcross = 4, kSplits = 2;
  Box found;
  for (int z = 0; z < kAcross; ++z)
    for (int y = 0; y < kAcross; ++y)
      for (int x = 0; x < kAcross; ++x) {
        const auto isInner = [](int i) { return i == 1 || i == 2; };
        if (isInner(x) && isInner(y) && isInner(z)) continue;
        const Vec3f low = Vec3f{float(x - 2), float(y - 2), float(z - 2)} * inner;
        const Box cube{low, low + Vec3f{inner, inner, inner}};
        found = found.including(maybeInside(level, cube, kSplits, progress));
      }
  return found;
}

}  // namespace

Box extentOf(const ScalarField& level, const Progress& progress) {
  constexpr int kFirstSplits = 3, kSplits = 5, kPasses = 3;
  Box box = maybeInside(level, {{-1, -1, -1}, {1, 1, 1}}, kFirstSplits, progress);
  for (float inner = 1; inner < kFarthest; inner *= 2) {
    const Box beyond = maybeInsideShell(level, inner, progress);
    if (!beyond.isEmpty() && 2 * inner >= kFarthest)
      throw CallError(Code::failed,
                      "what is inside has no end, or its ranges show none within 500 000 of the origin",
                      "multiply it by a mask, or say within which domain to look");
    box = box.including(beyond);
  }
  for (int pass = 0; pass < kPasses && !box.isEmpty(); ++pass)
    box = maybeInside(level, box, kSplits, progress);
  if (box.isEmpty())
    throw CallError(Code::failed, "the field is nowhere above 0, so that there is no shape",
                    "shapes are where a field is above 0");
  return box;
}

}  // namespace nephele::felt
