// What becomes of the columns of a light volume after its sweep: the shadow of opaque things is added, or a
// deep shadow map takes their place.
#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/scene/sub_samples.h"

namespace nephele {

void detail::ColumnShade::addTo(float* values, int slice, float perDepth) const {
  // By how many of the four points are hidden.
  const float added[5] = {0, 0.28768207f * perDepth, 0.69314718f * perDepth, 1.38629436f * perDepth,
                          kDark * perDepth};
  const float sign = falls ? -1.0f : 1.0f;
  for (int k = 0; k != LightVolume::kWidth; ++k)
    for (const std::array<float, 4>& from : begins) {
      int hidden = 0;
      for (std::size_t p = 0; p != 4; ++p)
        hidden += sign * (float(slice + k) + kQuarterCorners[p].z) > from[p];
      *values++ += added[hidden];
    }
}

void LightVolume::addShade(const std::function<double(const Ray&)>& distanceToShade, const Box& box,
                           const Vec3f& towards, float perDepth) {
  if (table_.empty() || box.isEmpty()) return;
  const Affine toWorld = inverse(worldToLattice_);
  const Vec3f slice = toWorld.linear * Vec3f{0, 0, 1};
  Box reach;
  for (int corner = 0; corner != 8; ++corner)
    reach = reach.including(
        worldToLattice_({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                         corner & 4 ? box.max.z : box.min.z}));
  const bool falls = dot(slice, towards) > 0;
  const float start = falls ? reach.max.z + 1 : reach.min.z - 1, sign = falls ? -1.0f : 1.0f;
  const Vec3d way = Vec3d(slice) * double(sign);
  const double perSlice = length(way);
  const std::size_t across = std::size_t(brickCount_.x) * std::size_t(brickCount_.y);
  parallelFor(across, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column != end; ++column) {
      const Vec3i node = (firstBrick_ + Vec3i{int(column % std::size_t(brickCount_.x)),
                                              int(column / std::size_t(brickCount_.x)), 0}) *
                         kBrick;
      constexpr float margin = 1;
      if (float(node.x) - margin > reach.max.x || float(node.x + kBrick) + margin < reach.min.x ||
          float(node.y) - margin > reach.max.y || float(node.y + kBrick) + margin < reach.min.y)
        continue;
      detail::ColumnShade shade;
      shade.falls = falls;
      for (std::size_t m = 0; m != shade.begins.size(); ++m)
        for (std::size_t p = 0; p != 4; ++p) {
          const Vec3f at{float(node.x + int(m) % kWidth) + kQuarterCorners[p].x,
                         float(node.y + int(m) / kWidth) + kQuarterCorners[p].y, start};
          const double distance = distanceToShade({Vec3d(toWorld(at)), way * (1 / perSlice)});
          shade.begins[m][p] = sign * start + float(distance / perSlice);
        }
      for (std::size_t n = 0; n != std::size_t(brickCount_.z); ++n)
        if (const std::int32_t pool = table_[n * across + column]; isStored(pool)) {
          const std::span nodes(values_.data() + std::size_t(pool) * kVolume, kVolume);
          std::array<float, kVolume> columns;
          std::transform(nodes.begin(), nodes.end(), columns.begin(),
                         [&](float bent) { return detail::unbentColumn(bent, bend_); });
          const std::array<float, kVolume> before = columns;
          shade.addTo(columns.data(), node.z + int(n) * kBrick, perDepth);
          // What is not shaded keeps its bits.
          for (std::size_t i = 0; i != columns.size(); ++i)
            if (columns[i] != before[i]) nodes[i] = detail::bentColumn(columns[i], bend_);
        }
    }
  });
}

void detail::replaceBrick(const std::function<float(const Vec3i&)>& column, float* out) {
  constexpr int n = LightVolume::kWidth, wide = n + 2, plane = wide * wide;
  std::array<float, wide * plane> values;
  for (int k = 0; k != wide; ++k)
    for (int j = 0; j != wide; ++j)
      for (int i = 0; i != wide; ++i)
        values[std::size_t(k * plane + j * wide + i)] = column({i - 1, j - 1, k - 1});
  for (int k = 0; k != n; ++k)
    for (int j = 0; j != n; ++j)
      for (int i = 0; i != n; ++i) {
        const float* at = values.data() + (k + 1) * plane + (j + 1) * wide + i + 1;
        const float across = at[-1] + at[1] + at[-wide] + at[wide] - 4 * *at,
                    along = at[-plane] + at[plane] - 2 * *at;
        *out++ = *at - (2 * across + along) / 12;
      }
}

void LightVolume::replace(const std::function<float(const Vec3f&)>& column) {
  const Affine latticeToWorld = inverse(worldToLattice_);
  parallelFor(table_.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t entry = begin; entry != end; ++entry) {
      if (!isStored(table_[entry])) continue;
      const auto nx = std::size_t(brickCount_.x), ny = std::size_t(brickCount_.y);
      const Vec3i node =
          (firstBrick_ + Vec3i{int(entry % nx), int(entry / nx % ny), int(entry / (nx * ny))}) * kBrick;
      const std::span nodes(values_.data() + std::size_t(table_[entry]) * kVolume, kVolume);
      detail::replaceBrick([&](const Vec3i& at) { return column(latticeToWorld(Vec3f(node + at))); },
                           nodes.data());
      for (float& value : nodes) value = detail::bentColumn(std::max(value, 0.0f), bend_);
    }
  });
}

}  // namespace nephele
