#include "nephele/render/light/detail/sky_parts.h"

#include <algorithm>
#include <array>

namespace nephele::detail {

namespace {

constexpr double kTolerance = 0.025;

// Of their second moments, the eigenvector of the largest eigenvalue, by squaring: what is left of a matrix
// then lies along it.
Vec3d mainAxis(std::span<const Vec3d> values) {
  constexpr int kSquarings = 24;
  std::array<Vec3d, 3> rows{};
  for (const Vec3d& v : values)
    for (int row = 0; row != 3; ++row) rows[std::size_t(row)] += v * v[row];
  for (int i = 0; i != kSquarings; ++i) {
    const double trace = rows[0].x + rows[1].y + rows[2].z;
    if (!(trace > 0)) return {1, 0, 0};
    for (Vec3d& row : rows) row *= 1 / trace;
    const std::array<Vec3d, 3> once = rows;
    for (Vec3d& row : rows) row = once[0] * row.x + once[1] * row.y + once[2] * row.z;
  }
  return normalize(*std::ranges::max_element(rows, {}, [](const Vec3d& row) { return dot(row, row); }));
}

bool isSmall(std::span<const Vec3d> rest) {
  Vec3d squares;
  for (const Vec3d& v : rest) squares += v * v;
  const double most = kTolerance * kTolerance * double(rest.size());
  return squares.x <= most && squares.y <= most && squares.z <= most;
}

}  // namespace

SkyParts coloursOfSky(std::span<const Vec3f> radiance) {
  SkyParts result;
  for (int c = 0; c != 3; ++c) {
    auto& values = result.values.emplace_back();
    for (const Vec3f& value : radiance) values.push_back(value[c]);
    Vec3f colour;
    colour[c] = 1;
    result.colours.push_back(colour);
  }
  return result;
}

SkyParts partsOfSky(std::span<const Vec3f> radiance) {
  Vec3d mean;
  for (const Vec3f& value : radiance) mean += Vec3d(value) * (1 / double(radiance.size()));
  std::vector<Vec3d> rest;
  for (const Vec3f& value : radiance) {
    Vec3d& own = rest.emplace_back(value);
    for (int c = 0; c != 3; ++c) own[c] = mean[c] > 0 ? own[c] / mean[c] : 0.0;
  }
  SkyParts result;
  std::vector<std::vector<double>> shares;
  std::vector<Vec3d> axes;
  for (int part = 0; part != 2; ++part) {
    // Colours are not negative, and neither is the axis that most of them lie along.
    Vec3d axis = mainAxis(rest);
    if (part == 0 && axis.x + axis.y + axis.z < 0) axis = -axis;
    auto& share = shares.emplace_back();
    for (Vec3d& value : rest) {
      share.push_back(dot(axis, value));
      value -= axis * share.back();
    }
    axes.push_back(axis);
    if (part == 1) {
      // So much of the first part makes the second nowhere negative.
      double most = 0;
      for (std::size_t i = 0; i != share.size(); ++i)
        if (shares[0][i] > 0) most = std::max(most, -share[i] / shares[0][i]);
      for (std::size_t i = 0; i != share.size(); ++i)
        share[i] = std::max(share[i] + most * shares[0][i], 0.0);
      axes[0] -= axis * most;
    }
    if (isSmall(rest)) break;
  }
  if (!isSmall(rest)) return coloursOfSky(radiance);
  // The mean of every colour is as it was.
  Vec3d left{1, 1, 1};
  for (const Vec3d& value : rest) left -= value * (1 / double(rest.size()));
  for (std::size_t part = 0; part != shares.size(); ++part) {
    result.values.emplace_back(shares[part].begin(), shares[part].end());
    Vec3d& colour = axes[part];
    for (int c = 0; c != 3; ++c) colour[c] *= mean[c] / left[c];
    result.colours.push_back(Vec3f(colour));
  }
  return result;
}

}  // namespace nephele::detail
