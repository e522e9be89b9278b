#pragma once

#include <span>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// Dots in arrays of one length, held elsewhere. Arrays other than `positions` may be empty.
struct DotSpans {
  std::span<const Vec3f> positions{};
  /// Density times volume, >= 0: what the density of a dot sums up to. Empty: 1 each.
  std::span<const float> masses{};
  /// World units, >= 0. Empty: what the reader of the dots says.
  std::span<const float> radii{};
  /// Linear Rec.709. Empty: white.
  std::span<const Vec3f> colors{};
  /// World units per unit of time. Empty: at rest.
  std::span<const Vec3f> velocities{};

  std::size_t size() const { return positions.size(); }

  /// The dots [first, first + count).
  DotSpans part(std::size_t first, std::size_t count) const {
    const auto cut = [&](auto all) { return all.empty() ? all : all.subspan(first, count); };
    return {cut(positions), cut(masses), cut(radii), cut(colors), cut(velocities)};
  }

  /// @throws Error, in the name of `caller`, if an array has another length than `positions`.
  void requireFit(const std::string& caller) const {
    const auto check = [&](std::size_t length, const char* name) {
      require(length == 0 || length == size(), caller + ": " + name + " must be empty or as many as the " +
                                                   std::to_string(size()) + " positions, got " +
                                                   std::to_string(length));
    };
    check(masses.size(), "masses");
    check(radii.size(), "radii");
    check(colors.size(), "colors");
    check(velocities.size(), "velocities");
  }
};

/// Dots that own their arrays; see DotSpans.
struct Dots {
  std::vector<Vec3f> positions{};
  std::vector<float> masses{}, radii{};
  std::vector<Vec3f> colors{}, velocities{};

  std::size_t size() const { return positions.size(); }
  operator DotSpans() const { return {positions, masses, radii, colors, velocities}; }
};

}  // namespace nephele
