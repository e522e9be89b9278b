// Wisps as in the notes, with these changes. Random places are normal instead of evenly spread over a cube:
// directions do not crowd in its corners, and a walk keeps their distribution at any correlation. Noise has
// rms 1, three independent noises take the place of one that is read at shifted places, and displacements are
// in sizes of the guide, so that a wisp scales with its guide.
//
// Every walk draws from a stream of its own, which follows from the seed, the guide and the walk; a thread
// takes whole walks. Noise is evaluated for thousands of dots at once, whatever guides they belong to.
//
// Source: Tessendorf, Production Volume Rendering (2008), "Steps to grow point wisps", "Wisp algorithm 0" to
// "6". Limits: noise far from its origin is coarse, so places drawn for guides lie within kOffset cells.
#include "nephele/modeling/cloud/wisps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/random_stream.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

/// Dots that noise is evaluated for at once.
constexpr std::size_t kPiece = 4096;
/// Noise is read up to so many cells from its origin.
constexpr float kOffset = 512;
/// Values of noise of rms 1 are seldom larger.
constexpr float kLargeNoise = 2.2f;

std::string shown(const Vec3f& v) {
  return numberText(v.x) + "," + numberText(v.y) + "," + numberText(v.z);
}

void requireGuides(std::span<const WispGuide> guides, std::uint64_t first) {
  const auto refuse = [&](std::size_t i, const std::string& what) {
    throw Error("wisps: guide " + std::to_string(first + i) + ": " + what);
  };
  for (std::size_t i = 0; i < guides.size(); ++i) {
    const WispGuide& g = guides[i];
    if (!isFinite(g.position)) refuse(i, "position must be finite, got " + shown(g.position));
    if (!(g.size > 0 && std::isfinite(g.size)))
      refuse(i, "size must be > 0 and finite, got " + numberText(g.size));
    if (!(g.density >= 0 && std::isfinite(g.density)))
      refuse(i, "density must be >= 0 and finite, got " + numberText(g.density));
    if (!isFinite(g.color)) refuse(i, "color must be finite, got " + shown(g.color));
    if (!isFinite(g.velocity)) refuse(i, "velocity must be finite, got " + shown(g.velocity));
  }
}

void requireOptions(const WispOptions& o) {
  const auto check = [](bool fits, const char* name, const char* allowed, float value) {
    if (!fits)
      throw Error(std::string("wisps: ") + name + " must be " + allowed + ", got " + numberText(value));
  };
  const auto share = [&](float value, const char* name) {
    check(value >= 0 && value <= 1, name, "from 0 to 1", value);
  };
  const auto notNegative = [&](float value, const char* name) {
    check(value >= 0 && std::isfinite(value), name, ">= 0 and finite", value);
  };
  check(o.dots > 0, "dots", "> 0", 0);
  check(o.walkLength > 0, "walkLength", "> 0", 0);
  share(o.correlation, "correlation");
  share(o.thickness, "thickness");
  notNegative(o.amplitude, "amplitude");
  notNegative(o.clump, "clump");
  notNegative(o.displacement, "displacement");
}

/// The noises of all wisps of a seed.
struct WispNoises {
  explicit WispNoises(const WispOptions& o) {
    const auto sum = [&](FractalSumOptions octaves, std::uint64_t number) {
      octaves.seed = std::uint32_t(detail::RandomStream({o.seed, octaves.seed, number}).bits());
      return fractalSum(octaves);
    };
    radial = sum(o.radial, 1);
    vector = vectorField(sum(o.vector, 2), sum(o.vector, 3), sum(o.vector, 4));
  }
  ScalarField radial{0.0f};
  VectorField vector{Vec3f{}};
};

/// Where a guide reads the noises.
struct NoisePlaces {
  Vec3f radial, vector;

  NoisePlaces(const WispOptions& o, std::uint64_t guide) {
    detail::RandomStream stream({o.seed, guide});
    // Frequencies stretch the noise: far away in cells, not in lengths.
    const auto draw = [&](float frequency) {
      Vec3f p;
      for (int a = 0; a < 3; ++a) p[a] = (2 * stream.uniform() - 1) * kOffset / frequency;
      return p;
    };
    radial = draw(o.radial.frequency);
    vector = draw(o.vector.frequency);
  }
};

/// Up to kPiece dots on their way, structure of arrays.
struct Piece {
  std::array<std::vector<float>, 3> u, place, moved;
  std::vector<float> noise;

  explicit Piece(std::size_t size) : noise(size) {
    for (int a = 0; a < 3; ++a) {
      u[std::size_t(a)].resize(size);
      place[std::size_t(a)].resize(size);
      moved[std::size_t(a)].resize(size);
    }
  }
  Vec3f at(const std::array<std::vector<float>, 3>& lanes, std::size_t i) const {
    return {lanes[0][i], lanes[1][i], lanes[2][i]};
  }
  static void set(std::array<std::vector<float>, 3>& lanes, std::size_t i, const Vec3f& v) {
    lanes[0][i] = v.x, lanes[1][i] = v.y, lanes[2][i] = v.z;
  }
  PointSpans places() const { return {place[0], place[1], place[2]}; }
};

/// One random walk; see growWisps.
class Walk {
 public:
  Walk(const WispOptions& o, std::uint64_t guide, std::uint64_t number)
      : stream_({o.seed, guide, number + 1}),
        keep_(o.correlation),
        step_(std::sqrt(std::max(0.0f, 1 - o.correlation * o.correlation))),
        at_(draw()) {}

  /// The next place; the first is drawn at random.
  Vec3f next() {
    const Vec3f result = at_;
    at_ = keep_ * at_ + step_ * draw();
    return result;
  }

 private:
  Vec3f draw() {
    constexpr float kPerAxis = 0.57735027f;  // sqrt(1/3), as of an even spread over [-1, 1]
    float n[4];
    stream_.normalPair(n[0], n[1]);
    stream_.normalPair(n[2], n[3]);
    return Vec3f{n[0], n[1], n[2]} * kPerAxis;
  }

  detail::RandomStream stream_;
  float keep_, step_;
  Vec3f at_;
};

class Grower {
 public:
  Grower(std::span<const WispGuide> guides, const WispOptions& options, Dots& dots)
      : guides_(guides), options_(options), noises_(options), dots_(dots) {
    const std::size_t count = guides.size() * options.dots;
    const auto any = [&](const auto& is) { return std::any_of(guides.begin(), guides.end(), is); };
    dots.positions.resize(count);
    dots.masses.resize(count);
    if (any([](const WispGuide& g) { return g.color != Vec3f{1, 1, 1}; })) dots.colors.resize(count);
    if (any([](const WispGuide& g) { return g.velocity != Vec3f{}; })) dots.velocities.resize(count);
    for (std::size_t g = 0; g < guides.size(); ++g) places_.emplace_back(options, options.firstGuide + g);
  }

  std::size_t walksPerGuide() const {
    return (std::size_t(options_.dots) + options_.walkLength - 1) / options_.walkLength;
  }

  /// Grows the walks [begin, end) of all.
  void grow(std::size_t begin, std::size_t end) const {
    const std::size_t first = firstDot(begin), last = firstDot(end);
    const std::size_t size = std::min(kPiece, last - first);
    Piece piece(size);
    std::size_t walkNumber = begin;
    Walk walk = walkOf(walkNumber);
    for (std::size_t from = first; from < last; from += size) {
      const std::size_t count = std::min(size, last - from);
      for (std::size_t i = 0; i < count; ++i) {
        if (from + i == firstDot(walkNumber + 1)) walk = walkOf(++walkNumber);
        Piece::set(piece.u, i, walk.next());
      }
      finish(piece, from, count);
    }
  }

 private:
  std::size_t firstDot(std::size_t walk) const {
    const std::size_t perGuide = walksPerGuide();
    return walk / perGuide * options_.dots + walk % perGuide * options_.walkLength;
  }
  Walk walkOf(std::size_t walk) const {
    return {options_, options_.firstGuide + walk / walksPerGuide(), walk % walksPerGuide()};
  }

  /// From random places to dots first .. first + count - 1.
  void finish(Piece& p, std::size_t first, std::size_t count) const {
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f u = p.at(p.u, i), direction = normalize(u);
      const float read = std::pow(length(u), options_.thickness);
      Piece::set(p.u, i, direction);
      Piece::set(p.place, i, read * direction + places_[guideOf(first + i)].radial);
    }
    noises_.radial.eval(p.places(), std::span<float>(p.noise));
    for (std::size_t i = 0; i < count; ++i) {
      const float r = std::pow(options_.amplitude * std::abs(p.noise[i]), options_.clump);
      const Vec3f s = r * p.at(p.u, i);
      Piece::set(p.u, i, s);
      Piece::set(p.place, i, s + places_[guideOf(first + i)].vector);
    }
    noises_.vector.eval(p.places(), {{p.moved[0], p.moved[1], p.moved[2]}});
    for (std::size_t i = 0; i < count; ++i) {
      const WispGuide& g = guides_[guideOf(first + i)];
      dots_.positions[first + i] =
          g.position + g.size * (p.at(p.u, i) + options_.displacement * p.at(p.moved, i));
      dots_.masses[first + i] =
          g.density * (4.0f / 3 * kPi) * g.size * g.size * g.size / float(options_.dots);
      if (!dots_.colors.empty()) dots_.colors[first + i] = g.color;
      if (!dots_.velocities.empty()) dots_.velocities[first + i] = g.velocity;
    }
  }
  std::size_t guideOf(std::size_t dot) const { return dot / options_.dots; }

  std::span<const WispGuide> guides_;
  const WispOptions& options_;
  WispNoises noises_;
  std::vector<NoisePlaces> places_;
  Dots& dots_;
};

}  // namespace

Dots growWisps(std::span<const WispGuide> guides, const WispOptions& options, const Progress& progress) {
  requireGuides(guides, options.firstGuide);
  requireOptions(options);
  Dots dots;
  const Grower grower(guides, options, dots);
  const std::size_t walks = guides.size() * grower.walksPerGuide();
  const std::size_t grain = std::max<std::size_t>(1, kPiece / std::min(options.dots, options.walkLength));
  parallelFor(
      walks, grain, [&](std::size_t begin, std::size_t end) { grower.grow(begin, end); }, progress);
  return dots;
}

Box wispBox(std::span<const WispGuide> guides, const WispOptions& options) {
  requireGuides(guides, options.firstGuide);
  requireOptions(options);
  const float reach =
      std::pow(kLargeNoise * options.amplitude, options.clump) + kLargeNoise * options.displacement;
  Box box;
  for (const WispGuide& g : guides) box = box.including(Box{g.position, g.position}.expanded(reach * g.size));
  return box;
}

void addVelocity(Dots& dots, const VectorField& velocity) {
  dots.velocities.resize(dots.size());
  parallelFor(dots.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    std::array<std::vector<float>, 3> at, v;
    for (std::size_t a = 0; a < 3; ++a) {
      at[a].resize(end - begin);
      v[a].resize(end - begin);
      for (std::size_t i = begin; i < end; ++i) at[a][i - begin] = dots.positions[i][int(a)];
    }
    velocity.eval({at[0], at[1], at[2]}, {{v[0], v[1], v[2]}});
    for (std::size_t i = begin; i < end; ++i)
      dots.velocities[i] += Vec3f{v[0][i - begin], v[1][i - begin], v[2][i - begin]};
  });
}

}  // namespace nephele
