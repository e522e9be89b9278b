// Level sets parted by knives, in tetrahedra of their own lattice.
//
// A cell is six tetrahedra about its diagonal (Kuhn), the same across all faces of cells. What the level set
// and the knives make of a tetrahedron (tetrahedron_facets.cpp) depends, on each of its faces, on the samples
// of that face alone, so that the facets of all tetrahedra together are closed. A vertex is known by the
// functions that are 0 at it and the edge, face or tetrahedron in which it lies; it belongs to the brick of
// the first sample of these, which numbers and places it.
//
// Bricks that neither the surface nor a knife enters are told by ranges; first for blocks of 4^3 of them.
//
// A sample of exactly 0 would have a vertex on each edge that leaves it inwards. They become one, at the
// sample, if the surface about it is a disc and stays one: positive samples around it hang together, the
// others do, and no edge or triangle of samples of 0 has more surface at it than two faces.
//
// Vertices of blades are then moved along their edges onto the blade itself, where nothing else is near.
//
// Limit: blades are as coarse as the lattice; waves below two voxels are lost.
#include "nephele/levelset/cut/detail/lattice_carve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "nephele/levelset/cut/detail/solid_split.h"
#include "nephele/levelset/cut/detail/tetrahedron_facets.h"
#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;
/// Samples of a brick's cells, and those with one more around them.
constexpr int kSide = kBrick + 1, kRing = kBrick + 3;
constexpr std::size_t kSamples = kSide * kSide * kSide, kRingSamples = kRing * kRing * kRing;
/// Bricks along a block.
constexpr int kBlock = 4;
/// Values nearer to 0 than this share of a voxel are 0.
constexpr double kMargin = 1.0 / 4096;
constexpr std::size_t kMostFunctions = (1 << 14) - 2;

/// Offset of a cell's corner: one bit per axis.
constexpr Vec3i cornerOffset(unsigned corner) {
  return {int(corner & 1), int(corner >> 1 & 1), int(corner >> 2)};
}
constexpr int ringIndex(int x, int y, int z) {
  return ((z + 1) * kRing + y + 1) * kRing + x + 1;
}
constexpr int sampleIndex(int x, int y, int z) {
  return (z * kSide + y) * kSide + x;
}
constexpr int ringStep(unsigned corner) {
  const Vec3i o = cornerOffset(corner);
  return (o.z * kRing + o.y) * kRing + o.x;
}

/// The neighbours of a sample along edges of tetrahedra: 0 to 6 forward by the corner i + 1, 7 to 13 back.
constexpr std::array<int, 14> kNeighbours = [] {
  std::array<int, 14> steps{};
  for (unsigned i = 0; i < 7; ++i) {
    steps[i] = ringStep(i + 1);
    steps[i + 7] = -ringStep(i + 1);
  }
  return steps;
}();

/// Which neighbours of a sample are neighbours of each other, a bit each.
const std::array<std::uint16_t, 14>& neighboursOfNeighbours() {
  static const auto table = [] {
    std::array<std::uint16_t, 14> result{};
    for (std::size_t a = 0; a < 14; ++a)
      for (std::size_t b = 0; b < 14; ++b)
        if (std::find(kNeighbours.begin(), kNeighbours.end(), kNeighbours[b] - kNeighbours[a]) !=
            kNeighbours.end())
          result[a] = std::uint16_t(result[a] | 1u << b);
    return result;
  }();
  return table;
}

/// Whether neighbours hang together; none do not.
bool isConnected(unsigned neighbours) {
  if (neighbours == 0) return false;
  unsigned reached = neighbours & (~neighbours + 1), open = reached;
  while (open != 0) {
    const auto at = std::size_t(std::countr_zero(open));
    open &= open - 1;
    const unsigned found = neighboursOfNeighbours()[at] & neighbours & ~reached;
    reached |= found;
    open |= found;
  }
  return reached == neighbours;
}

/// Whether the surface about a sample of 0 is a disc that stays one where all such samples become vertices.
bool isDisc(unsigned positive, unsigned zero) {
  constexpr unsigned kAll = (1u << 14) - 1;
  if (!isConnected(positive) || !isConnected(kAll & ~positive)) return false;
  const auto& around = neighboursOfNeighbours();
  for (std::size_t n = 0; n < 14; ++n) {
    if ((zero >> n & 1) == 0) continue;
    // Around the edge to another sample of 0: one arc of positive samples, and something else.
    const unsigned arc = around[n] & positive;
    if (arc != 0 && (arc == around[n] || !isConnected(arc))) return false;
    for (std::size_t m = 0; m < n; ++m) {
      if ((zero >> m & 1) == 0 || (around[n] >> m & 1) == 0) continue;
      // A triangle of samples of 0 has the inside on one side at most.
      const unsigned apexes = around[n] & around[m];
      if (apexes != 0 && (apexes & positive) == apexes) return false;
    }
  }
  return true;
}

/// A vertex: the brick that it belongs to, and within that the first sample of its edge, face or tetrahedron,
/// the other corners relative to it, and the functions that are 0 there.
class Key {
 public:
  Key() = default;
  /// `base` is relative to the brick that asks, -1 to 8.
  Key(const Vec3i& base, unsigned first, unsigned second, std::span<const std::uint32_t> functions) {
    const Vec3i owner = brickOf(base);
    const int place = (owner.x + 1) + 3 * (owner.y + 1) + 9 * (owner.z + 1);
    // 0 is the brick itself: its keys come first.
    bits_ = std::uint64_t((place + 14) % 27);
    bits_ =
        bits_ << 9 | std::uint64_t((insideBrick(base.z) * 8 + insideBrick(base.y)) * 8 + insideBrick(base.x));
    bits_ = (bits_ << 3 | first) << 3 | second;
    for (std::size_t i = 0; i < 3; ++i) bits_ = bits_ << 14 | (i < functions.size() ? functions[i] + 1 : 0);
  }

  bool isOwn() const { return bits_ >> 57 == 0; }
  Vec3i owner() const {
    const int place = (int(bits_ >> 57) + 13) % 27;
    return {place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1};
  }
  Key inOwner() const {
    Key key;
    key.bits_ = bits_ & ((std::uint64_t(1) << 57) - 1);
    return key;
  }
  /// Relative to the owner.
  Vec3i base() const {
    const int s = int(bits_ >> 48 & 511);
    return {s & 7, s >> 3 & 7, s >> 6};
  }
  unsigned first() const { return unsigned(bits_ >> 45 & 7); }
  unsigned second() const { return unsigned(bits_ >> 42 & 7); }
  std::uint32_t function(std::size_t i) const { return std::uint32_t(bits_ >> (28 - 14 * i) & 0x3FFF) - 1; }
  std::size_t functionCount() const {
    return (bits_ & 0x3FFF) != 0 ? 3 : (bits_ >> 14 & 0x3FFF) != 0 ? 2 : 1;
  }
  auto operator<=>(const Key&) const = default;

 private:
  std::uint64_t bits_ = 0;
};

struct KeyedTriangle {
  std::array<Key, 3> corners;
  std::uint32_t parent, code;
};

struct CarvedBrick {
  Vec3i at;
  /// Knives that may be 0 within a voxel of the brick; and the side of the others, per knife.
  std::vector<std::uint32_t> undecided;
  std::vector<char> isPositive;

  /// Own ones first, and as many positions.
  std::vector<Key> keys;
  std::vector<Vec3d> positions;
  std::vector<KeyedTriangle> triangles;
  /// The sides of all knives, numbered by `KeyedTriangle::code`.
  std::vector<std::vector<bool>> codes;
  std::size_t firstVertex = 0;
};

/// What all bricks share.
struct Carving {
  const BrickGrid& level;
  std::span<const LatticeKnife> knives;
  double halfKerf;
  /// The largest value of the level set that counts.
  double largest = 0.0;
  /// Values nearer to 0 than this are 0.
  double margin = 0.0;
  /// The longest edge of a tetrahedron.
  double longestEdge = 0.0;
  std::vector<std::uint32_t> firstFrame{};

  std::uint32_t functionsPerKnife() const { return halfKerf > 0 ? 2 : 1; }
  /// The level set is function 0. With a kerf, a knife has one for its positive side, then one for its
  /// negative side.
  std::uint32_t functionOf(std::uint32_t knife) const { return 1 + knife * functionsPerKnife(); }
  /// The largest value of a knife in a tetrahedron in which it is 0, generously.
  double reach(std::uint32_t knife) const {
    const bool isDistance = halfKerf > 0 && knives[knife].knife.steepest > 1;
    return 2.5 * longestEdge * (isDistance ? 1.0 : double(knives[knife].knife.steepest));
  }
  Vec3d world(const Vec3d& index) const {
    const auto& m = level.indexToWorld.linear.m;
    return Vec3d{double(m[0]) * index.x + double(m[1]) * index.y + double(m[2]) * index.z,
                 double(m[3]) * index.x + double(m[4]) * index.y + double(m[5]) * index.z,
                 double(m[6]) * index.x + double(m[7]) * index.y + double(m[8]) * index.z} +
           Vec3d(level.indexToWorld.translation);
  }
};

/// The samples of the level set about a brick, read from the bricks to which they belong: bricks of one value
/// are shared and have no border of their own.
void gather(const BrickGrid& level, const Vec3i& brick, std::array<float, kRingSamples>& samples) {
  std::array<std::int32_t, 27> pools;
  for (int i = 0; i < 27; ++i)
    pools[std::size_t(i)] = level.poolIndex(brick + Vec3i{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1});
  for (int z = -1; z <= kSide; ++z)
    for (int y = -1; y <= kSide; ++y)
      for (int x = -1; x <= kSide; ++x) {
        const Vec3i b{brickOf(x) + 1, brickOf(y) + 1, brickOf(z) + 1};
        const float v = level.brick(pools[std::size_t((b.z * 3 + b.y) * 3 + b.x)])[sampleOffset(
            insideBrick(x), insideBrick(y), insideBrick(z))];
        samples[std::size_t(ringIndex(x, y, z))] = v;
      }
}

/// The work on one brick after another, by one thread.
class BrickCarver {
 public:
  explicit BrickCarver(const Carving& carving) : carving_(carving) {}

  void carve(CarvedBrick& brick) {
    brick_ = &brick;
    codes_.clear();
    evaluate();
    for (int z = 0; z < kBrick; ++z)
      for (int y = 0; y < kBrick; ++y)
        for (int x = 0; x < kBrick; ++x) carveCell({x, y, z});
    finish();
  }

 private:
  /// One function on the brick's samples.
  struct Function {
    std::uint32_t id;
    std::array<std::int32_t, kSamples> values;
    /// Where the surface passes through a sample.
    std::array<char, kSamples> isVertex;
  };

  void evaluate() {
    gather(carving_.level, brick_->at, samples_);
    functions_.resize(1 + brick_->undecided.size() * carving_.functionsPerKnife());
    rings_.resize(functions_.size());
    functions_[0].id = 0;
    margins_.assign(1, round(samples_, 0.0, carving_.largest, rings_[0]));
    if (!brick_->undecided.empty()) placeSamples();
    std::size_t next = 1;
    for (const std::uint32_t k : brick_->undecided) {
      evaluateKnife(k, samples_);
      for (std::uint32_t side = 0; side < carving_.functionsPerKnife(); ++side, ++next) {
        functions_[next].id = carving_.functionOf(k) + side;
        const double offset = side == 0 ? carving_.halfKerf : -carving_.halfKerf;
        margins_.push_back(round(samples_, offset, carving_.reach(k), rings_[next]));
      }
    }
    for (std::size_t f = 0; f < functions_.size(); ++f) keepFromZero(f, margins_[f]);
  }

  void placeSamples() {
    for (auto& lane : points_) lane.resize(kRingSamples);
    std::size_t i = 0;
    for (int z = -1; z <= kSide; ++z)
      for (int y = -1; y <= kSide; ++y)
        for (int x = -1; x <= kSide; ++x, ++i) {
          const Vec3f p(carving_.world(Vec3d(brick_->at * kBrick + Vec3i{x, y, z})));
          points_[0][i] = p.x, points_[1][i] = p.y, points_[2][i] = p.z;
        }
  }

  /// At `points_`.
  void evaluateKnife(std::uint32_t k, std::span<float> values) {
    const Knife& knife = carving_.knives[k].knife;
    const PointSpans points{points_[0], points_[1], points_[2]};
    if (!(carving_.halfKerf > 0 && knife.steepest > 1)) {
      knife.field.eval(points, values);
      return;
    }
    for (auto& lane : slopes_) lane.resize(values.size());
    knife.field.evalGrad(points, values, {{slopes_[0], slopes_[1], slopes_[2]}});
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float slope = length(Vec3f{slopes_[0][i], slopes_[1][i], slopes_[2][i]});
      if (slope > 0) values[i] /= slope;
    }
  }

  /// Whole numbers for samples less an offset. What is nearer to 0 than the margin becomes 0, and so does
  /// what is no number. @returns the margin.
  std::int32_t round(const std::array<float, kRingSamples>& samples, double offset, double largest,
                     std::array<std::int32_t, kRingSamples>& rounded) const {
    const double scale = double(kLargestValue) / largest;
    const double margin = std::max(std::floor(carving_.margin * scale), 1.0);
    for (std::size_t i = 0; i < kRingSamples; ++i) {
      const double v = (double(samples[i]) - offset) * scale;
      const bool isFar = std::abs(v) >= margin;
      rounded[i] = isFar ? std::int32_t(std::clamp(v, -double(kLargestValue), double(kLargestValue))) : 0;
    }
    return std::int32_t(margin);
  }

  void keepFromZero(std::size_t f, std::int32_t margin) {
    const auto& ring = rings_[f];
    Function& function = functions_[f];
    for (int z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
          const int r = ringIndex(x, y, z);
          const auto s = std::size_t(sampleIndex(x, y, z));
          const std::int32_t v = ring[std::size_t(r)];
          // Where a sample of 0 is as good as a vertex, the value stays; so does the volume if it is none,
          // as other functions are near.
          const bool isSimple = v == 0 && isSimpleAt(f, r);
          function.isVertex[s] = isSimple && isAloneAt(f, r);
          function.values[s] = v != 0 ? v : isSimple ? -1 : -margin;
        }
  }

  bool isAloneAt(std::size_t f, int r) const {
    for (std::size_t g = 0; g < rings_.size(); ++g) {
      if (g == f) continue;
      const bool isPositive = rings_[g][std::size_t(r)] > 0;
      for (const int step : kNeighbours)
        if ((rings_[g][std::size_t(r + step)] > 0) != isPositive) return false;
    }
    return true;
  }

  bool isSimpleAt(std::size_t f, int r) const {
    unsigned positive = 0, zero = 0;
    for (std::size_t n = 0; n < 14; ++n) {
      const std::int32_t v = rings_[f][std::size_t(r + kNeighbours[n])];
      if (v > 0) positive |= 1u << n;
      if (v == 0) zero |= 1u << n;
    }
    return isDisc(positive, zero);
  }

  static int indexOf(const Vec3i& sample) { return sampleIndex(sample.x, sample.y, sample.z); }

  void carveCell(const Vec3i& cell) {
    constexpr std::array<int, 8> kSteps = [] {
      std::array<int, 8> steps{};
      for (unsigned c = 0; c < 8; ++c) {
        const Vec3i o = cornerOffset(c);
        steps[c] = sampleIndex(o.x, o.y, o.z);
      }
      return steps;
    }();
    const int start = indexOf(cell);
    const auto signsOf = [&](std::size_t f) {
      unsigned signs = 0;
      for (unsigned c = 0; c < 8; ++c)
        if (functions_[f].values[std::size_t(start + kSteps[c])] > 0) signs |= 1u << c;
      return signs;
    };
    const unsigned inside = signsOf(0);
    if (inside == 0) return;
    crossing_.clear();
    if (inside != 255) crossing_.push_back(0);
    for (std::size_t f = 1; f < functions_.size(); ++f)
      if (const unsigned signs = signsOf(f); signs != 0 && signs != 255) crossing_.push_back(f);
    if (crossing_.empty()) return;

    // Ways from one end of the diagonal to the other, along an axis at a time; every other one is odd.
    constexpr std::array<std::array<unsigned, 2>, 6> kWays{{{1, 3}, {1, 5}, {2, 6}, {2, 3}, {4, 5}, {4, 6}}};
    for (std::size_t w = 0; w < 6; ++w) {
      const std::array<unsigned, 4> corners{0, kWays[w][0], kWays[w][1], 7};
      values_.clear();
      here_.clear();
      bool isOutside = false;
      for (const std::size_t f : crossing_) {
        CornerValues v;
        for (std::size_t i = 0; i < 4; ++i)
          v[i] = functions_[f].values[std::size_t(start + kSteps[corners[i]])];
        const bool isPositive = v[0] > 0;
        if ((v[1] > 0) == isPositive && (v[2] > 0) == isPositive && (v[3] > 0) == isPositive) {
          isOutside |= f == 0 && !isPositive;
          continue;
        }
        values_.push_back(v);
        here_.push_back(f);
      }
      if (isOutside || here_.empty()) continue;
      for (const Facet& facet : facets_.of(values_)) addFacet(cell, corners, facet, w % 2 == 1);
    }
  }

  void addFacet(const Vec3i& cell, const std::array<unsigned, 4>& corners, const Facet& facet, bool isOdd) {
    const std::size_t function = here_[facet.function];
    if (here_[0] == 0 && function != 0 && !facet.isPositive[0]) return;
    const std::int32_t above = codeBeside(cell, facet, true);
    const std::int32_t below = function == 0 ? -1 : codeBeside(cell, facet, false);
    if (above < 0 && below < 0) return;
    ring_.clear();
    for (const FacetCorner& corner : facet.corners) {
      const Key key = keyOf(cell, corners, corner);
      keys_.push_back(key);
      if (ring_.empty() || ring_.back() != key) ring_.push_back(key);
    }
    if (ring_.size() > 1 && ring_.front() == ring_.back()) ring_.pop_back();
    if (ring_.size() < 3) return;
    const bool isMirrored = isOdd != (determinant(carving_.level.indexToWorld.linear) < 0);
    if (isMirrored) std::reverse(ring_.begin(), ring_.end());
    places_.clear();
    for (const Key& key : ring_) places_.push_back(placeOf(key));
    const std::uint32_t parent = function == 0 ? 0 : kOnPlane | frameOf(function);
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (above >= 0)
        brick_->triangles.push_back({{ring_[a], ring_[b], ring_[c]}, parent, std::uint32_t(above)});
      if (below >= 0)
        brick_->triangles.push_back({{ring_[a], ring_[c], ring_[b]}, parent, std::uint32_t(below)});
    };
    const auto cutOff = [&](std::size_t ear) {
      const std::size_t count = ring_.size();
      add((ear + count - 1) % count, ear, (ear + 1) % count);
      ring_.erase(ring_.begin() + std::ptrdiff_t(ear));
      places_.erase(places_.begin() + std::ptrdiff_t(ear));
    };
    // The same for both sides of a kerf, see moveOntoBlade.
    if (carving_.functionsPerKnife() == 2 && function != 0 && ring_.size() == 4 &&
        facet.corners.size() == 4) {
      constexpr std::uint8_t kDiagonal = 0b1001;
      const auto corner = std::find_if(facet.corners.begin(), facet.corners.end(),
                                       [](const FacetCorner& c) { return c.carrier == kDiagonal; });
      const auto place = std::size_t(corner - facet.corners.begin()) % 4;
      cutOff(isMirrored ? 3 - place : place);
    }
    // Ears with the shortest cuts first.
    while (ring_.size() > 3) {
      const std::size_t count = ring_.size();
      std::size_t ear = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3d cut = places_[(i + 1) % count] - places_[(i + count - 1) % count];
        if (const double squared = dot(cut, cut); squared < least) least = squared, ear = i;
      }
      cutOff(ear);
    }
    add(0, 1, 2);
  }

  /// The number of the code on one side of a facet; -1 within a kerf.
  std::int32_t codeBeside(const Vec3i& cell, const Facet& facet, bool isAbove) {
    signs_.clear();
    std::size_t next = here_[0] == 0 ? 1 : 0;
    for (std::size_t f = 1; f < functions_.size(); ++f) {
      bool isPositive;
      if (next < here_.size() && here_[next] == f) {
        isPositive = facet.function == next ? isAbove : facet.isPositive[next] != 0;
        ++next;
      } else {
        isPositive = functions_[f].values[std::size_t(indexOf(cell))] > 0;
      }
      signs_.push_back(isPositive ? '+' : '-');
    }
    const auto [entry, isNew] = codes_.try_emplace(signs_, -1);
    if (!isNew) return entry->second;
    std::vector<bool> sides(brick_->isPositive.begin(), brick_->isPositive.end());
    for (std::size_t i = 0; i < brick_->undecided.size(); ++i) {
      const std::size_t per = carving_.functionsPerKnife();
      const bool isHigh = signs_[i * per] == '+', isLow = signs_[i * per + per - 1] == '-';
      if (!isHigh && !isLow) return -1;
      sides[brick_->undecided[i]] = isHigh;
    }
    entry->second = std::int32_t(brick_->codes.size());
    brick_->codes.push_back(std::move(sides));
    return entry->second;
  }

  Key keyOf(const Vec3i& cell, const std::array<unsigned, 4>& corners, const FacetCorner& corner) const {
    std::array<unsigned, 4> carrier{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < 4; ++i)
      if (corner.carrier >> i & 1) carrier[count++] = corners[i];
    std::array<std::uint32_t, 3> ids{};
    for (std::size_t i = 0; i < corner.count; ++i) ids[i] = functions_[here_[corner.functions[i]]].id;
    const Vec3i base = cell + cornerOffset(carrier[0]);
    if (corner.count == 1) {
      const std::size_t f = here_[corner.functions[0]];
      const Vec3i other = cell + cornerOffset(carrier[1]);
      const bool isPositive = functions_[f].values[std::size_t(indexOf(base))] > 0;
      const Vec3i& negative = isPositive ? other : base;
      if (functions_[f].isVertex[std::size_t(indexOf(negative))]) return keyOfSample(f, negative);
    }
    return {base, carrier[1] ^ carrier[0], count == 2 ? 0 : carrier[2] ^ carrier[0],
            std::span(ids).first(corner.count)};
  }

  /// That of the first edge to a positive neighbour.
  Key keyOfSample(std::size_t f, const Vec3i& sample) const {
    const int r = ringIndex(sample.x, sample.y, sample.z);
    std::size_t n = 0;
    while (rings_[f][std::size_t(r + kNeighbours[n])] <= 0) ++n;
    const auto corner = unsigned(n % 7 + 1);
    return {n < 7 ? sample : sample - cornerOffset(corner), corner, 0, std::span(&functions_[f].id, 1)};
  }

  /// In the index space of the grid, relative to the brick.
  Vec3d placeOf(const Key& key) const {
    const std::size_t count = key.functionCount();
    const Vec3i base = key.base() + key.owner() * kBrick;
    const std::array<unsigned, 4> offsets{0, key.first(), key.second(), 7};
    std::array<CornerValues, 3> rows{};
    FacetCorner corner{std::uint8_t((2u << count) - 1), std::uint8_t(count), {0, 1, 2}};
    if (count == 1)
      for (const std::size_t c : {0, 1})
        if (isVertexAt(functionBy(key.function(0)), base + cornerOffset(offsets[c])))
          return Vec3d(base + cornerOffset(offsets[c]));
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t c = 0; c <= count; ++c)
        rows[i][c] =
            functionBy(key.function(i)).values[std::size_t(indexOf(base + cornerOffset(offsets[c])))];
    const auto weights = weightsOf(corner, rows);
    Vec3d place(base);
    for (std::size_t c = 1; c <= count; ++c) place += Vec3d(cornerOffset(offsets[c])) * weights[c];
    return place;
  }

  /// Edges to a vertex at a sample may begin before the brick.
  static bool isVertexAt(const Function& function, const Vec3i& sample) {
    const bool isHere = std::min({sample.x, sample.y, sample.z}) >= 0;
    return isHere && function.isVertex[std::size_t(indexOf(sample))];
  }

  const Function& functionBy(std::uint32_t id) const {
    return *std::lower_bound(functions_.begin(), functions_.end(), id,
                             [](const Function& f, std::uint32_t i) { return f.id < i; });
  }

  std::uint32_t frameOf(std::size_t f) const {
    const std::uint32_t knife = (functions_[f].id - 1) / carving_.functionsPerKnife();
    const std::uint32_t first = carving_.firstFrame[knife];
    if (carving_.knives[knife].frame) return first;
    Vec3d normal{};
    const Vec3d origin = carving_.world(places_[0]);
    for (std::size_t i = 1; i + 1 < places_.size(); ++i)
      normal += cross(carving_.world(places_[i]) - origin, carving_.world(places_[i + 1]) - origin);
    const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
    return first + (x >= y && x >= z ? 0 : y >= z ? 1 : 2);
  }

  void finish() {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    brick_->keys = std::move(keys_);
    keys_.clear();
    for (const Key& key : brick_->keys) {
      if (!key.isOwn()) break;
      brick_->positions.push_back(carving_.world(placeOf(key) + Vec3d(brick_->at * kBrick)));
    }
    for (std::size_t u = 0; u < brick_->undecided.size(); ++u) moveOntoBlade(u);
    brick_->undecided = {};
    brick_->isPositive = {};
  }

  /// Where a blade crosses an edge, from 0 at its start to 1 at its end, and what is known of the way there.
  struct Crossing {
    std::size_t vertex;
    Vec3d start, along;
    double offset;
    double low, atLow, high, atHigh, place, linear;
    /// Which end the last step moved: -1, 1, or 0 before the first.
    int moved = 0;
    bool isDone = false;
  };

  /// Along an edge a curved blade is not linear. Moves the vertices of one that are far from other surfaces:
  /// in all tetrahedra about their edge there is one sheet of this blade alone, or the two sides of its
  /// kerf. These stay apart, since they keep their order on all edges and have the same diagonals.
  void moveOntoBlade(std::size_t undecided) {
    crossings_.clear();
    const std::uint32_t knife = brick_->undecided[undecided], per = carving_.functionsPerKnife();
    const std::size_t first = 1 + undecided * per;
    for (std::size_t v = 0; v < brick_->positions.size(); ++v)
      for (std::size_t f = first; f < first + per; ++f)
        if (const Key& key = brick_->keys[v];
            key.functionCount() == 1 && key.function(0) == functions_[f].id && isFarFromOthers(key, first))
          addCrossing(v, f, f == first ? carving_.halfKerf : -carving_.halfKerf);
    constexpr int kMostSteps = 32;
    for (int step = 0; step < kMostSteps; ++step) {
      for (auto& lane : points_) lane.clear();
      for (const Crossing& c : crossings_) {
        if (c.isDone) continue;
        const Vec3f p(carving_.world(c.start + c.along * c.place));
        for (int axis = 0; axis < 3; ++axis) points_[std::size_t(axis)].push_back(p[axis]);
      }
      if (points_[0].empty()) break;
      residuals_.resize(points_[0].size());
      evaluateKnife(knife, residuals_);
      auto residual = residuals_.begin();
      for (Crossing& c : crossings_)
        if (!c.isDone) closeIn(c, double(*residual++) - c.offset);
    }
    for (std::size_t i = 0, next; i < crossings_.size(); i = next) {
      const Crossing& c = crossings_[i];
      next = i + 1;
      const bool isPair =
          next < crossings_.size() && crossings_[next].start == c.start && crossings_[next].along == c.along;
      if (isPair) {
        const Crossing& other = crossings_[next++];
        if ((c.place < other.place) != (c.linear < other.linear) || c.place == other.place) continue;
      }
      for (std::size_t j = i; j < next; ++j)
        brick_->positions[crossings_[j].vertex] =
            carving_.world(crossings_[j].start + crossings_[j].along * crossings_[j].place);
    }
  }

  /// Whether all other functions have one sign on the tetrahedra about an edge.
  bool isFarFromOthers(const Key& key, std::size_t first) const {
    const Vec3i base = key.base();
    const int r = ringIndex(base.x, base.y, base.z);
    const std::size_t edge = key.first() - 1;
    const unsigned around = neighboursOfNeighbours()[edge] | 1u << edge;
    for (std::size_t g = 0; g < rings_.size(); ++g) {
      if (g >= first && g < first + carving_.functionsPerKnife()) continue;
      const bool isPositive = rings_[g][std::size_t(r)] > 0;
      for (std::size_t n = 0; n < kNeighbours.size(); ++n)
        if ((around >> n & 1) != 0 && (rings_[g][std::size_t(r + kNeighbours[n])] > 0) != isPositive)
          return false;
    }
    return true;
  }

  void addCrossing(std::size_t vertex, std::size_t f, double offset) {
    const Key& key = brick_->keys[vertex];
    const Vec3i base = key.base(), end = base + cornerOffset(key.first());
    const Function& function = functions_[f];
    if (isVertexAt(function, base) || isVertexAt(function, end)) return;
    const double unit =
        carving_.reach((function.id - 1) / carving_.functionsPerKnife()) / double(kLargestValue);
    const double low = unit * function.values[std::size_t(indexOf(base))],
                 high = unit * function.values[std::size_t(indexOf(end))];
    // Vertices at the ends stay there.
    const double place = low / (low - high);
    if (place < kMargin || place > 1 - kMargin) return;
    crossings_.push_back({.vertex = vertex,
                          .start = Vec3d(base + brick_->at * kBrick),
                          .along = Vec3d(cornerOffset(key.first())),
                          .offset = offset,
                          .low = 0,
                          .atLow = low,
                          .high = 1,
                          .atHigh = high,
                          .place = place,
                          .linear = place});
  }

  /// A step of the Illinois method.
  static void closeIn(Crossing& c, double residual) {
    constexpr double kNear = 1.0 / 65536;
    if (std::isnan(residual)) {
      c.place = c.linear;
      c.isDone = true;
      return;
    }
    const int end = (residual > 0) == (c.atLow > 0) ? -1 : 1;
    const bool isSame = std::exchange(c.moved, end) == end;
    if (end < 0) {
      c.low = c.place, c.atLow = residual;
      if (isSame) c.atHigh /= 2;
    } else {
      c.high = c.place, c.atHigh = residual;
      if (isSame) c.atLow /= 2;
    }
    const double next = c.low + (c.high - c.low) * c.atLow / (c.atLow - c.atHigh);
    const double before = std::exchange(c.place, std::clamp(next, kMargin, 1 - kMargin));
    c.isDone = residual == 0 || std::abs(c.place - before) < kNear;
  }

  const Carving& carving_;
  CarvedBrick* brick_ = nullptr;
  std::array<float, kRingSamples> samples_;
  std::array<std::vector<float>, 3> points_, slopes_;
  std::vector<Function> functions_;
  std::vector<std::array<std::int32_t, kRingSamples>> rings_;
  std::vector<std::int32_t> margins_;
  TetrahedronFacets facets_;
  /// Functions that cross the cell, and the tetrahedron, by their places in functions_.
  std::vector<std::size_t> crossing_, here_;
  std::vector<CornerValues> values_;
  std::vector<Key> keys_, ring_;
  std::vector<Vec3d> places_;
  std::vector<Crossing> crossings_;
  std::vector<float> residuals_;
  std::string signs_;
  std::map<std::string, std::int32_t> codes_;
};

class LatticeCarver {
 public:
  LatticeCarver(const BrickGrid& level, std::span<const LatticeKnife> knives, float kerf,
                const Progress& progress)
      : carving_{.level = level, .knives = knives, .halfKerf = double(kerf) / 2}, progress_(progress) {
    require(knives.size() * carving_.functionsPerKnife() < kMostFunctions,
            fmt::format("cut: too many knives for a level set: {}", knives.size()));
    require(level.background <= 0, "cut: the level set does not end: its background is inside");
    for (unsigned corner = 1; corner < 8; ++corner)
      carving_.longestEdge = std::max(
          carving_.longestEdge, length(carving_.world(Vec3d(cornerOffset(corner))) - carving_.world({})));
    for (const LatticeKnife& knife : knives) {
      carving_.firstFrame.push_back(std::uint32_t(result_.frames.size()));
      if (knife.frame) {
        result_.frames.push_back(*knife.frame);
      } else {
        for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
          result_.frames.push_back(PlaneFrame::of(axis));
      }
    }
    // One layer of bricks before the table: its last cells lie between the background and the table.
    places_ = {level.firstBrick - Vec3i{1, 1, 1}, level.brickCount + Vec3i{1, 1, 1}};
  }

  Carved run() {
    findBricks();
    parallelFor(
        bricks_.size(), 8,
        [&](std::size_t begin, std::size_t end) {
          const auto carver = std::make_unique<BrickCarver>(carving_);
          for (std::size_t i = begin; i < end; ++i) carver->carve(bricks_[i]);
        },
        progress_);
    number();
    collect();
    return std::move(result_);
  }

 private:
  struct Block {
    std::vector<CarvedBrick> bricks;
    double largest = 0.0;
  };

  void findBricks() {
    const BrickBox blocks{{}, (places_.count + Vec3i{kBlock - 1, kBlock - 1, kBlock - 1}) / kBlock};
    std::vector<Block> found(blocks.size());
    parallelFor(
        found.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) found[i] = blockAt(blocks.at(i) * kBlock + places_.first);
        },
        progress_);
    carving_.largest = double(std::numeric_limits<float>::min());
    for (Block& block : found) {
      carving_.largest = std::max(carving_.largest, block.largest);
      std::move(block.bricks.begin(), block.bricks.end(), std::back_inserter(bricks_));
    }
    carving_.margin = kMargin * std::min(double(carving_.level.voxelSize), carving_.largest);
    table_.assign(places_.size(), -1);
    for (std::size_t i = 0; i < bricks_.size(); ++i)
      table_[places_.numberOf(bricks_[i].at)] = std::int32_t(i);
  }

  /// Samples -1 to 9 of the bricks, in the world.
  Box boxOf(const Vec3i& firstBrick, int bricks) const {
    const Vec3d low(firstBrick * kBrick - Vec3i{1, 1, 1}), size = Vec3d{1, 1, 1} * (kBrick * bricks + 2.0);
    Box box;
    for (unsigned corner = 0; corner < 8; ++corner)
      box = box.including(Vec3f(carving_.world(low + Vec3d(cornerOffset(corner)) * size)));
    const float far = std::max(length(box.min), length(box.max));
    return box.expanded(4e-7f * far);
  }

  Block blockAt(const Vec3i& firstBrick) const {
    Block block;
    CarvedBrick all;
    all.undecided.resize(carving_.knives.size());
    all.isPositive.assign(carving_.knives.size(), 0);
    for (std::uint32_t k = 0; k < all.undecided.size(); ++k) all.undecided[k] = k;
    bool isDecided = false;
    std::array<float, kRingSamples> samples;
    const Vec3i end = min(firstBrick + Vec3i{kBlock, kBlock, kBlock}, places_.first + places_.count);
    for (int z = firstBrick.z; z < end.z; ++z)
      for (int y = firstBrick.y; y < end.y; ++y)
        for (int x = firstBrick.x; x < end.x; ++x) {
          const Vec3i at{x, y, z};
          const Interval range = rangeOfCells(at);
          const bool hasSurface = !(double(range.min) > kMargin * double(carving_.level.voxelSize));
          if (!(range.max > 0) && !std::isnan(range.max)) continue;
          if (!isDecided) decide(all, boxOf(firstBrick, kBlock));
          isDecided = true;
          CarvedBrick brick = all;
          brick.at = at;
          if (!all.undecided.empty()) decide(brick, boxOf(at, 1));
          if (!hasSurface && brick.undecided.empty()) continue;
          if (hasSurface) {
            gather(carving_.level, at, samples);
            block.largest = std::max(block.largest, largestAtSurface(samples));
          }
          block.bricks.push_back(std::move(brick));
        }
    return block;
  }

  /// Of all samples of the brick's cells.
  Interval rangeOfCells(const Vec3i& at) const {
    Interval range = carving_.level.ranges[std::size_t(carving_.level.poolIndex(at))];
    for (unsigned corner = 1; corner < 8; ++corner) {
      const Interval other =
          carving_.level.ranges[std::size_t(carving_.level.poolIndex(at + cornerOffset(corner)))];
      range = {std::min(range.min, other.min), std::max(range.max, other.max)};
    }
    return range;
  }

  /// The largest value in cells that the surface meets; 0 if it meets none.
  static double largestAtSurface(const std::array<float, kRingSamples>& samples) {
    double largest = 0;
    for (int z = 0; z < kBrick; ++z)
      for (int y = 0; y < kBrick; ++y)
        for (int x = 0; x < kBrick; ++x) {
          float low = std::numeric_limits<float>::infinity(), high = -low;
          for (unsigned c = 0; c < 8; ++c) {
            const float v = samples[std::size_t(ringIndex(x, y, z) + ringStep(c))];
            require(!std::isnan(v), "cut: the level set holds samples that are not numbers (NaN)");
            low = std::min(low, v);
            high = std::max(high, v);
          }
          if (!(low <= 0 && high > 0)) continue;
          constexpr double kMost = std::numeric_limits<float>::max();
          largest = std::max(largest, std::min(double(std::max(high, -low)), kMost));
        }
    return largest;
  }

  void decide(CarvedBrick& brick, const Box& box) const {
    std::erase_if(brick.undecided, [&](std::uint32_t k) {
      const Knife& knife = carving_.knives[k].knife;
      const bool isDivided = carving_.halfKerf > 0 && knife.steepest > 1;
      const double reach = (isDivided ? double(knife.steepest) : 1.0) * carving_.halfKerf +
                           2 * double(knife.steepest) * carving_.longestEdge * kMargin;
      const Interval range = knife.field.range(box);
      if (!(double(range.min) > reach) && !(double(range.max) < -reach)) return false;
      brick.isPositive[k] = double(range.min) > reach;
      return true;
    });
  }

  void number() {
    std::size_t vertices = 0, triangles = 0;
    for (CarvedBrick& brick : bricks_) {
      brick.firstVertex = vertices;
      vertices += brick.positions.size();
      triangles += brick.triangles.size();
    }
    require(triangles < kSourceEdge && vertices < kSourceEdge,
            fmt::format("cut: more than {} triangles", kSourceEdge - 1));
    result_.positions.resize(vertices);
    result_.triangles.resize(triangles);
    result_.parents.resize(triangles);
  }

  std::uint32_t vertexOf(const CarvedBrick& brick, const Key& key) const {
    const CarvedBrick& owner =
        key.isOwn() ? brick : bricks_[std::size_t(table_[places_.numberOf(brick.at + key.owner())])];
    const auto at = std::lower_bound(owner.keys.begin(), owner.keys.end(), key.inOwner());
    return std::uint32_t(owner.firstVertex + std::size_t(at - owner.keys.begin()));
  }

  void collect() {
    std::map<std::vector<bool>, std::uint32_t> parts;
    for (const CarvedBrick& brick : bricks_)
      for (const auto& code : brick.codes) parts.emplace(code, 0);
    for (auto& [sides, number] : parts) {
      number = std::uint32_t(result_.parts.size());
      result_.parts.push_back({.sides = sides, .triangles = {}});
    }
    std::uint32_t next = 0;
    std::vector<std::uint32_t> firstTriangle;
    for (const CarvedBrick& brick : bricks_) {
      firstTriangle.push_back(next);
      std::vector<std::uint32_t> partOf;
      for (const auto& code : brick.codes) partOf.push_back(parts.at(code));
      for (const KeyedTriangle& t : brick.triangles)
        result_.parts[partOf[t.code]].triangles.push_back(next++);
    }
    parallelFor(bricks_.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const CarvedBrick& brick = bricks_[i];
        std::copy(brick.positions.begin(), brick.positions.end(),
                  result_.positions.begin() + std::ptrdiff_t(brick.firstVertex));
        std::size_t t = firstTriangle[i];
        for (const KeyedTriangle& triangle : brick.triangles) {
          for (std::size_t k = 0; k < 3; ++k) result_.triangles[t][k] = vertexOf(brick, triangle.corners[k]);
          result_.parents[t++] = triangle.parent;
        }
      }
    });
    std::erase_if(result_.parts, [](const Carved::Part& part) { return part.triangles.empty(); });
    bricks_ = {};
  }

  Carving carving_;
  const Progress& progress_;
  BrickBox places_;
  std::vector<CarvedBrick> bricks_;
  /// The number of the brick at each place of the table, or -1.
  std::vector<std::int32_t> table_;
  Carved result_;
};

}  // namespace

Carved carveLattice(const BrickGrid& level, std::span<const LatticeKnife> knives, float kerf,
                    const Progress& progress) {
  return LatticeCarver(level, knives, kerf, progress).run();
}

}  // namespace nephele::detail
