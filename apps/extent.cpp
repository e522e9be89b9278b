#include "apps/extent.h"

#include <fmt/format.h>

#include <algorithm>

#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::apps {
namespace {

Box boxOfFile(const std::string& path) {
  if (!isVolumeFile(path)) return boundingBox(readPoints(path));
  return contentBox(readScalarGrid(path));
}

}  // namespace

void Extent::include(const Extent& other) {
  box = box.including(other.box);
  longestSide = std::max(longestSide, other.longestSide);
  outline.insert(outline.end(), other.outline.begin(), other.outline.end());
  typicalDensity = std::max(typicalDensity, other.typicalDensity);
}

std::string Extent::text() const {
  std::string text = fmt::format("{} {}", longestSide, typicalDensity);
  const auto add = [&](const Vec3f& p) { text += fmt::format(" {},{},{}", p.x, p.y, p.z); };
  add(box.min);
  add(box.max);
  for (const Vec3f& point : outline) add(point);
  return text;
}

Extent extentOfFile(const std::string& path) {
  const Box box = boxOfFile(path);
  return {box, box.isEmpty() ? 0.0 : double(box.longestSide())};
}

}  // namespace nephele::apps
