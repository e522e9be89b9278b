// Shells of one combination are one piece if a straight line joins them inside the shape and between the
// blades: thin wedges fall apart on a grid, but not in fact.
//
// Along such a line all corners of all cells are nearly inside: no farther out than the diagonal of a cell.
// Where a combination has many shells, those samples are found first, as shells are; only shells in one and
// the same part of them are compared in pairs.
//
// Limit: a neck that is thinner than a voxel and bent is not found.
#include "nephele/levelset/cut/detail/level_sets/shell_necks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kSamples = int(CutBrick::kSamples);

/// The square of how far apart two boxes of whole numbers are.
int squaredGap(const Vec3i& lowA, const Vec3i& highA, const Vec3i& lowB, const Vec3i& highB) {
  const Vec3i gap = max(max(lowB - highA, lowA - highB), Vec3i{});
  return dot(gap, gap);
}

constexpr Vec3i placeIn(int sample) {
  return {sample & 7, sample >> 3 & 7, sample >> 6};
}

class Necks {
 public:
  Necks(const ScalarField& shape, const CutPlan& plan, const CutShells& shells, const Progress& progress)
      : shape_(shape),
        plan_(plan),
        shells_(shells),
        members_(shells.members()),
        progress_(progress),
        h_(plan.lattice.voxelSize) {}

  std::vector<std::vector<std::uint32_t>> groups(std::span<const std::uint32_t> kept) {
    // All pairs of a few are looked at sooner than what lies between them.
    constexpr std::size_t kFew = 8;
    std::vector<std::vector<std::uint32_t>> ofCode(shells_.cut().codes.size());
    for (const std::uint32_t shell : kept) ofCode[shells_.codeOf(shell)].push_back(shell);
    std::vector<std::uint32_t> crowded;
    for (std::uint32_t code = 0; code < ofCode.size(); ++code)
      if (ofCode[code].size() > kFew) crowded.push_back(code);
    findReach(crowded);
    DisjointSets joined(shells_.ownerCount());
    for (std::uint32_t code = 0; code < ofCode.size(); ++code) {
      if (ofCode[code].size() <= kFew) {
        joinPairs(ofCode[code], joined);
        continue;
      }
      std::map<std::uint32_t, std::vector<std::uint32_t>> inReach;
      for (const std::uint32_t shell : ofCode[code]) inReach[reachOf(shell)].push_back(shell);
      for (const auto& [reach, some] : inReach) joinPairs(some, joined);
    }
    std::map<std::uint32_t, std::vector<std::uint32_t>> groups;
    for (const std::uint32_t shell : kept) groups[joined.root(shell)].push_back(shell);
    std::vector<std::vector<std::uint32_t>> result;
    for (auto& [first, group] : groups) result.push_back(std::move(group));
    return result;
  }

 private:
  void joinPairs(const std::vector<std::uint32_t>& shells, DisjointSets& joined) const {
    for (std::size_t b = 1; b < shells.size(); ++b)
      for (std::size_t a = 0; a < b; ++a) {
        progress_.check();
        if (joined.root(shells[a]) != joined.root(shells[b]) && haveNeck(shells[a], shells[b]))
          joined.join(shells[a], shells[b]);
      }
  }

  /// The samples that are nearly inside, as parts, for each of some codes.
  void findReach(const std::vector<std::uint32_t>& codes) {
    if (codes.empty()) return;
    nearly_ = makeLists<ShellPart>(
        shells_.cut().count(),
        [&](std::size_t i, std::vector<ShellPart>& list) {
          for (const std::uint32_t code : codes)
            appendParts(code, nearlyInside(shells_.brick(i), code), list);
        },
        progress_);
    DisjointSets sets = shells_.joined(nearly_, progress_);
    for (std::uint32_t i = 0; i < nearly_.items.size(); ++i) nearly_.items[i].owner = sets.root(i);
  }

  /// The part of `nearly_`, all bricks together, that holds a shell.
  std::uint32_t reachOf(std::uint32_t shell) const {
    const ShellMember& member = members_[shell][0];
    const ShellPart& part = shells_.parts().of(member.brick)[member.part];
    const auto candidates = nearly_.of(member.brick);
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](const ShellPart& candidate) {
      return candidate.code == part.code && candidate.samples.contains(part.samples.first());
    });
    return found->owner;
  }

  BrickMask nearlyInside(const CutBrick& brick, std::uint32_t number) const {
    const CutCode& code = shells_.cut().codes[number];
    const CutKnowledge& known = *brick.known;
    for (std::size_t w = 0; w < known.decided.size(); ++w)
      if (((known.sides[w] ^ code.sides[w]) & known.decided[w]) != 0) return {};
    if (brick.isUniform) return BrickMask::all();
    // The diagonal of a cell, and what rounding takes.
    constexpr float kReach = 1.8f;
    BrickMask inside = sidesOf(brick.samples, -kReach * h_).above;
    for (std::size_t u = 0; u < known.undecided.size() && !inside.isEmpty(); ++u) {
      const std::uint32_t k = known.undecided[u];
      const Sides sides =
          sidesOf(brick.samplesOf(u), plan_.halfKerf() - kReach * h_ * plan_.knives[k].steepest);
      inside = inside & (bitOf(code.sides, k) ? sides.above : sides.below);
    }
    return inside;
  }

  /// Whether a straight line between samples of the two, near each other, stays inside the piece.
  bool haveNeck(std::uint32_t a, std::uint32_t b) const {
    const auto [fromA, fromB] = nearestMembers(members_[a], members_[b]);
    const auto [start, end] = nearestSamples(fromA, fromB);
    constexpr int kStepsPerVoxel = 8;
    const int steps = int(std::ceil(length(start - end) / h_)) * kStepsPerVoxel;
    std::array<std::vector<float>, 3> lanes;
    for (int i = 1; i < steps; ++i)
      for (int axis = 0; axis < 3; ++axis)
        lanes[std::size_t(axis)].push_back(start[axis] + (end[axis] - start[axis]) * float(i) / float(steps));
    const PointSpans points{lanes[0], lanes[1], lanes[2]};
    std::vector<float> values(points.size());
    const auto allAbove = [&](float limit, float sign) {
      return std::all_of(values.begin(), values.end(), [&](float v) { return sign * v > limit; });
    };
    shape_.eval(points, values);
    if (!allAbove(0, 1)) return false;
    const CutCode& code = shells_.cut().codes[shells_.codeOf(a)];
    for (std::uint32_t k = 0; k < plan_.knives.size(); ++k) {
      evaluateKnife(plan_.knives[k], points, values);
      if (!allAbove(plan_.halfKerf(), bitOf(code.sides, k) ? 1.0f : -1.0f)) return false;
    }
    // Cells are convex: a line between two of its points stays in one.
    return true;
  }

  const Vec3i& placeOf(const ShellMember& member) const { return shells_.brick(member.brick).brick; }

  /// Those in the nearest bricks, the first if there are several.
  std::pair<ShellMember, ShellMember> nearestMembers(const std::vector<ShellMember>& a,
                                                     const std::vector<ShellMember>& b) const {
    Vec3i low = placeOf(b[0]), high = low;
    for (const ShellMember& n : b) {
      low = min(low, placeOf(n));
      high = max(high, placeOf(n));
    }
    std::pair nearest(a[0], b[0]);
    int least = std::numeric_limits<int>::max();
    for (const ShellMember& m : a) {
      if (squaredGap(placeOf(m), placeOf(m), low, high) >= least) continue;
      progress_.check();
      for (const ShellMember& n : b) {
        const Vec3i d = placeOf(m) - placeOf(n);
        if (const int squared = dot(d, d); squared < least) least = squared, nearest = {m, n};
      }
    }
    return nearest;
  }

  /// The nearest samples of two members, the first if there are several.
  std::pair<Vec3f, Vec3f> nearestSamples(const ShellMember& a, const ShellMember& b) const {
    const BrickMask& samplesA = shells_.parts().of(a.brick)[a.part].samples;
    const BrickMask& samplesB = shells_.parts().of(b.brick)[b.part].samples;
    const MaskBounds boundsA = boundsOf(samplesA), boundsB = boundsOf(samplesB);
    const Vec3i offset = (placeOf(b) - placeOf(a)) * kBrick;
    std::pair<Vec3f, Vec3f> found;
    float nearest = std::numeric_limits<float>::infinity();
    // Positions are rounded: what is a voxel farther is no candidate, all the rest is looked at.
    const auto isFar = [&](int squared) { return std::sqrt(float(squared)) > nearest / h_ + 1; };
    for (int s = 0; s < kSamples; ++s) {
      if (!samplesA.contains(s)) continue;
      const Vec3i p = placeIn(s) - offset;
      if (isFar(squaredGap(p, p, boundsB.low, boundsB.high))) continue;
      for (int t = 0; t < kSamples; ++t) {
        if (!samplesB.contains(t)) continue;
        const Vec3i q = placeIn(t) + offset;
        if (isFar(squaredGap(q, q, boundsA.low, boundsA.high))) continue;
        const std::pair ends(shells_.brick(a.brick).position(std::size_t(s), h_),
                             shells_.brick(b.brick).position(std::size_t(t), h_));
        if (const float d = length(ends.first - ends.second); d < nearest) nearest = d, found = ends;
      }
    }
    return found;
  }

  const ScalarField& shape_;
  const CutPlan& plan_;
  const CutShells& shells_;
  std::vector<std::vector<ShellMember>> members_;
  const Progress& progress_;
  float h_;
  BrickLists<ShellPart> nearly_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> joinedByNecks(const ScalarField& shape, const CutPlan& plan,
                                                      const CutShells& shells,
                                                      std::span<const std::uint32_t> kept,
                                                      const Progress& progress) {
  return Necks(shape, plan, shells, progress).groups(kept);
}

}  // namespace nephele::detail
