// Shells hang together within a brick by growing bit sets, and between bricks by union-find. Every brick
// lists the shells that come near it, so that what follows goes over bricks, each read once for all its
// shells.
#include "nephele/levelset/cut/detail/level_sets/cut_shells.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/lattice.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;

/// The 26 bricks around one and itself, in the order of their place.
constexpr int kNeighbours = 27;
constexpr Vec3i neighbour(int i) {
  return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

}  // namespace

void appendParts(std::uint32_t code, const BrickMask& samples, std::vector<ShellPart>& list) {
  for (BrickMask rest = samples; !rest.isEmpty();) {
    const BrickMask part = connectedPart(rest);
    list.push_back({code, kNobody, part});
    rest = without(rest, part);
  }
}

CutShells::CutShells(const CutBricks& cut, float bandVoxels, const Progress& progress) : cut_(cut) {
  placeBricks();
  findParts(progress);
  findShells(progress);
  findNear(bandVoxels, progress);
}

void CutShells::placeBricks() {
  Vec3i first, last;
  for (std::size_t i = 0; i < cut_.count(); ++i) {
    first = i == 0 ? brick(i).brick : min(first, brick(i).brick);
    last = i == 0 ? brick(i).brick : max(last, brick(i).brick);
  }
  if (cut_.count() != 0) places_ = {first, last - first + Vec3i{1, 1, 1}};
  brickAt_.assign(places_.size(), -1);
  for (std::size_t i = 0; i < cut_.count(); ++i) brickAt_[places_.numberOf(brick(i).brick)] = std::int32_t(i);
}

void CutShells::findParts(const Progress& progress) {
  parts_ = makeLists<ShellPart>(
      cut_.count(),
      [&](std::size_t i, std::vector<ShellPart>& list) {
        const std::size_t begin = list.size();
        for (const CutMember& member : cut_.membersOf(i)) {
          if (brick(i).isUniform)
            list.push_back({member.code, kNobody, member.samples});
          else
            appendParts(member.code, member.samples, list);
        }
        std::sort(
            list.begin() + std::ptrdiff_t(begin), list.end(),
            [](const ShellPart& a, const ShellPart& b) { return a.samples.first() < b.samples.first(); });
      },
      progress);
}

DisjointSets CutShells::joined(const BrickLists<ShellPart>& parts, const Progress& progress) const {
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  const auto touching = makeLists<Pair>(
      cut_.count(),
      [&](std::size_t i, std::vector<Pair>& list) {
        for (int axis = 0; axis < 3; ++axis) {
          Vec3i direction{};
          direction[axis] = 1;
          const std::int32_t other = brickAt(brick(i).brick + direction);
          if (other < 0) continue;
          const auto here = parts.of(i), there = parts.of(std::size_t(other));
          for (std::size_t a = 0; a < here.size(); ++a) {
            const std::uint64_t face = faceOf(here[a].samples, axis, true);
            if (face == 0) continue;
            for (std::size_t b = 0; b < there.size(); ++b)
              if (here[a].code == there[b].code && (face & faceOf(there[b].samples, axis, false)) != 0)
                list.emplace_back(parts.first[i] + a, parts.first[std::size_t(other)] + b);
          }
        }
      },
      progress);
  DisjointSets sets(parts.items.size());
  for (const auto& [a, b] : touching.items) sets.join(a, b);
  return sets;
}

void CutShells::findShells(const Progress& progress) {
  DisjointSets shells = joined(parts_, progress);
  for (std::uint32_t i = 0; i < parts_.items.size(); ++i) {
    const std::uint32_t root = shells.root(i);
    if (root == i) {
      parts_.items[i].owner = ownerCount();
      codes_.push_back(parts_.items[i].code);
    } else {
      parts_.items[i].owner = parts_.items[root].owner;
    }
  }
}

CutShells::Reach CutShells::reachOf(const ShellPart& part, float bandVoxels) const {
  Reach reach{part.owner, 0, 0};
  const MaskBounds bounds = boundsOf(part.samples);
  // The surface is less than a voxel beyond the last sample inside.
  const int band = int(std::ceil(bandVoxels)) + 1;
  const auto reaches = [&](int axis, int direction) {
    return direction == 0 ||
           (direction < 0 ? bounds.low[axis] - band < 0 : bounds.high[axis] + band >= kBrick);
  };
  for (int i = 0; i < kNeighbours; ++i) {
    const Vec3i direction = neighbour(i);
    if (reaches(0, direction.x) && reaches(1, direction.y) && reaches(2, direction.z)) reach.near |= 1u << i;
  }
  for (int i = 0; i < 8; ++i)
    if (((i & 1) == 0 || bounds.low.x == 0) && ((i >> 1 & 1) == 0 || bounds.low.y == 0) &&
        (i >> 2 == 0 || bounds.low.z == 0))
      reach.touches = std::uint8_t(reach.touches | 1 << i);
  return reach;
}

void CutShells::findNear(float bandVoxels, const Progress& progress) {
  constexpr std::size_t kPartsPerTask = 512;
  reach_.resize(parts_.items.size());
  parallelFor(
      reach_.size(), kPartsPerTask,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) reach_[i] = reachOf(parts_.items[i], bandVoxels);
      },
      progress);
  std::vector<std::uint32_t> reachOfBrick(cut_.count(), 0);
  for (std::size_t i = 0; i < cut_.count(); ++i)
    for (std::size_t p = parts_.first[i]; p < parts_.first[i + 1]; ++p) reachOfBrick[i] |= reach_[p].near;
  near_ = makeLists<NearOwner>(
      cut_.count(), [&](std::size_t i, std::vector<NearOwner>& list) { listNear(i, reachOfBrick, list); },
      progress);
}

void CutShells::listNear(std::size_t i, const std::vector<std::uint32_t>& reachOfBrick,
                         std::vector<NearOwner>& list) const {
  const auto begin = std::ptrdiff_t(list.size());
  for (int n = 0; n < kNeighbours; ++n) {
    const Vec3i direction = neighbour(n);
    const std::int32_t other = brickAt(brick(i).brick + direction);
    // As the other brick sees this one.
    const std::uint32_t bit = 1u << (kNeighbours - 1 - n);
    if (other < 0 || (reachOfBrick[std::size_t(other)] & bit) == 0) continue;
    const bool isAfter = std::min({direction.x, direction.y, direction.z}) >= 0;
    const int before = direction.x + 2 * direction.y + 4 * direction.z;
    for (std::size_t p = parts_.first[std::size_t(other)]; p < parts_.first[std::size_t(other) + 1]; ++p) {
      const Reach& reach = reach_[p];
      if ((reach.near & bit) == 0) continue;
      const auto known = std::find_if(list.begin() + begin, list.end(),
                                      [&](const NearOwner& near) { return near.owner == reach.owner; });
      const bool isSurface = isAfter && (reach.touches >> before & 1) != 0;
      if (known == list.end())
        list.push_back({reach.owner, isSurface});
      else
        known->isSurface |= isSurface;
    }
  }
}

std::vector<std::vector<ShellMember>> CutShells::members() const {
  std::vector<std::vector<ShellMember>> result(ownerCount());
  for (std::uint32_t i = 0; i < cut_.count(); ++i)
    for (std::uint32_t p = 0; p < parts_.of(i).size(); ++p)
      if (const std::uint32_t owner = parts_.of(i)[p].owner; owner != kNobody)
        result[owner].push_back({i, p});
  return result;
}

BrickMask CutShells::ownedBy(std::uint32_t owner, std::int32_t at) const {
  BrickMask own;
  if (at >= 0)
    for (const ShellPart& part : parts_.of(std::size_t(at)))
      if (part.owner == owner) own = own | part.samples;
  return own;
}

std::vector<std::pair<Vec3i, std::uint32_t>> CutShells::surfacesBeyond() const {
  std::vector<std::pair<Vec3i, std::uint32_t>> beyond;
  for (std::size_t i = 0; i < cut_.count(); ++i)
    for (std::size_t p = parts_.first[i]; p < parts_.first[i + 1]; ++p)
      for (std::size_t d = 1; d < 8 && reach_[p].touches > 1; ++d) {
        const Vec3i at = brick(i).brick - stepOf(d);
        const std::uint32_t owner = parts_.items[p].owner;
        if ((reach_[p].touches >> d & 1) != 0 && owner != kNobody && brickAt(at) < 0)
          beyond.emplace_back(at, owner);
      }
  const auto comesFirst = [](const auto& a, const auto& b) {
    return a.first != b.first ? comesBefore(a.first, b.first) : a.second < b.second;
  };
  std::sort(beyond.begin(), beyond.end(), comesFirst);
  beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
  return beyond;
}

void CutShells::giveTo(const std::vector<std::uint32_t>& pieceOf, std::size_t pieces) {
  std::vector<std::uint32_t> codes(pieces);
  for (std::uint32_t shell = 0; shell < ownerCount(); ++shell)
    if (pieceOf[shell] != kNobody) codes[pieceOf[shell]] = codes_[shell];
  codes_ = std::move(codes);
  for (ShellPart& part : parts_.items) part.owner = pieceOf[part.owner];
  std::size_t count = 0, begin = 0;
  for (std::size_t i = 0; i < cut_.count(); ++i) {
    const std::size_t end = near_.first[i + 1], first = count;
    near_.first[i] = first;
    for (std::size_t n = begin; n < end; ++n) {
      const NearOwner near{pieceOf[near_.items[n].owner], near_.items[n].isSurface};
      if (near.owner == kNobody) continue;
      const auto known = std::find_if(near_.items.begin() + std::ptrdiff_t(first),
                                      near_.items.begin() + std::ptrdiff_t(count),
                                      [&](const NearOwner& other) { return other.owner == near.owner; });
      if (known != near_.items.begin() + std::ptrdiff_t(count))
        known->isSurface |= near.isSurface;
      else
        near_.items[count++] = near;
    }
    begin = end;
  }
  near_.items.resize(count);
  near_.first.back() = count;
}

}  // namespace nephele::detail
