#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/march/detail/path_random.h"
#include "nephele/render/march/detail/path_ways.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/volume/field_glow.h"
#include "nephele/render/volume/lattice_map.h"
#include "nephele/render/volume/march_scene.h"
#include "nephele/render/volume/render_volume.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele::detail {

/// A volume as paths see it, be it a grid or a field: free paths by delta tracking, transmittances by
/// residual ratio tracking. Both step by what bounds of the density allow.
class PathVolume {
 public:
  /// Keeps a reference to `volume`.
  PathVolume(const RenderVolume& volume, const Medium& medium);

  /// Working memory of one thread.
  class Scratch {
    friend class PathVolume;

    struct Track;
    struct Tentative;
    std::vector<Track> tracks;
    std::vector<Tentative> tentative;
    FieldDensity::Batch batch;
    // Places that may glow, and the light there.
    std::array<std::vector<float>, 6> glow;
  };

  /// What becomes of one way does not depend on the others.
  void fly(std::span<Flight> flights, Scratch& scratch) const;
  void look(std::span<ShadowWay> ways, Scratch& scratch) const;

  /// Of the medium, times the colour of the volume there.
  Vec3f albedoAt(const Vec3d& place) const;
  /// Extinction of every colour relative to the largest.
  const Vec3f& colour() const { return colour_; }
  /// Of density 1, in the most opaque colour.
  float extinction() const { return extinction_; }
  bool glows() const { return scene_.emission.table; }
  /// Whether many ways at a time are quicker than one after the other.
  bool isField() const { return field_; }
  /// Shorter distances are of no account.
  float least() const { return least_; }

 private:
  struct Part;

  template <class RateOf, class Meet, class Leave>
  void collide(const Part& part, PathRandom& random, RateOf&& rateOf, Meet&& meet, Leave&& leave) const;
  bool enter(const Ray& ray, double length, Part& out) const;
  void fly(Flight& flight) const;
  void flyInColours(const Part& part, Flight& flight) const;
  void look(ShadowWay& way) const;
  float densityAt(const Vec3f& p) const { return std::clamp(density_(p), 0.0f, mostDensity_); }
  Interval boundsOf(const Interval& range) const {
    return {std::clamp(range.min, 0.0f, mostDensity_), std::clamp(range.max, 0.0f, mostDensity_)};
  }

  // A tentative collision is real by a chance between those of the colours, `real`, and their weights make up
  // for it (spectral tracking, Kutz, Habel, Li and Novak 2017).
  bool isReal(Flight& flight, const Vec3f& real, double distance) const;
  // Adds what glows at a tentative collision, over the bound that it was drawn for.
  void addGlow(Flight& flight, const Vec3f& emission, float bound, double distance) const;
  // How much of the largest density above the least one a density is.
  static float residualOf(float density, const Interval& range) {
    return std::clamp((density - range.min) / (range.max - range.min), 0.0f, 1.0f);
  }
  // Below this, transmittances play Russian roulette.
  static constexpr float kLeastTransmittance = 0.1f;
  static bool isWorthwhile(ShadowWay& way) {
    return std::max({way.left.x, way.left.y, way.left.z}) >= kLeastTransmittance || survives(way);
  }
  static bool survives(ShadowWay& way);
  static void dim(ShadowWay& way, float depth);

  void follow(std::uint32_t way, const Ray& ray, double length, const PathRandom& random,
              const FieldGlow* glow, Scratch& scratch) const;
  bool advance(Scratch::Track& track, float extinction, bool isResidual) const;
  void askGlow(Scratch& scratch) const;
  template <class Lay, class Answer>
  void followAll(Scratch& scratch, Lay&& lay, Answer&& answer) const;
  void flyThroughField(std::span<Flight> flights, Scratch& scratch) const;
  void lookThroughField(std::span<ShadowWay> ways, Scratch& scratch) const;

  const FieldDensity* field_ = nullptr;
  const VectorField* fieldColour_ = nullptr;
  const FieldGlow* fieldGlow_ = nullptr;
  GridSampler density_;
  MarchScene scene_;
  LatticeMap toLattice_;
  Box bounds_;
  Vec3f albedo_;
  float extinction_ = 1.0f;
  Vec3f colour_{1, 1, 1};
  // Of what glows; and of the bound of the extinction where something does, which may have none.
  float perEmission_ = 0.0f, leastBound_ = 0.0f;
  bool isColoured_ = false;
  // Larger densities count as this, so that walks end whatever the extinction is.
  float mostDensity_ = 0.0f, opaqueDensity_ = 0.0f, least_ = 0.0f;
};

/// A way through a field.
struct PathVolume::Scratch::Track {
  // Which of the ways that are asked for, and where on it the line begins.
  std::uint32_t way;
  double start;
  FieldDensity::Line line;
  GlowingWalk walk;
  PathRandom random;
  // The part of the line being crossed, the bound there, where on it, and the depth to the next collision.
  GlowingWalk::Span span{};
  float bound = 0.0f;
  bool hasSpan = false;
  float s = 0.0f, depth = 0.0f;
  // Optical depth that was passed without doubt since the last tentative collision.
  float passed = 0.0f;
  // Whether the end of the line has been reached, or nothing more needs to be known.
  bool isAtEnd = false, isDone = false;
  std::size_t first = 0, end = 0;
};

/// A tentative collision whose density is asked for together with others.
struct PathVolume::Scratch::Tentative {
  float s, passed;
  // Of the density there.
  Interval range;
  // In [0, 1).
  float chance;
  bool isAsked;
  // Extinction that it was drawn for; whether something may glow there, and what does.
  float bound = 0.0f;
  bool glows = false;
  Vec3f glow{};
};

}  // namespace nephele::detail
