// Cutting level sets by knives in one pass.
//
// cut_bricks.cpp finds, for every brick, the samples inside the shape by the sides of all knives. Here the
// combinations of sides are numbered as they occur; the 2^N others never appear. Shells hang together within
// a brick by growing bit sets, and between bricks by union-find. Each takes min(shape, +-knives) in the
// bricks that its surface comes near, from the samples that are there already. Shells of one combination are
// one piece if a straight line joins them inside the shape and between the blades: thin wedges fall apart on
// a grid, but not in fact.
//
// The minimum, not the product of the notes, which bends the outer surface. Everything is ordered by place,
// never by knife or thread. Limits: rims are bevelled by the grid; a neck that is thinner than a voxel and
// bent is not found.
#include "levelset/pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "levelset/cut_bricks.h"
#include "levelset/marching_cubes.h"
#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele {

namespace {

using detail::BrickMask;
using detail::CutBrick;
using detail::CutCode;

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;

/// Samples of one code that hang together within a brick.
struct Part {
  std::uint32_t code;
  BrickMask samples;
};

class Cutter {
 public:
  Cutter(const ScalarField& shape, const CutOptions& options, const Progress& progress)
      : shape_(shape),
        options_(options),
        progress_(progress),
        h_(options.voxelSize),
        band_(options.bandVoxels * options.voxelSize),
        halfKerf_(options.kerf / 2) {}

  Pieces run() {
    progress_.begin("find pieces");
    leaves_ = detail::cutBricks(shape_, options_, progress_);
    numberCodes();
    joinParts();
    progress_.begin("write pieces");
    return writePieces();
  }

 private:
  void numberCodes() {
    std::map<CutCode, std::uint32_t> numbers;
    firstNode_.resize(leaves_.size() + 1);
    Vec3i last;
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      firstBrick_ = i == 0 ? leaves_[i].brick : min(firstBrick_, leaves_[i].brick);
      last = i == 0 ? leaves_[i].brick : max(last, leaves_[i].brick);
    }
    brickCount_ = leaves_.empty() ? Vec3i{} : last - firstBrick_ + Vec3i{1, 1, 1};
    leafAt_.assign(std::size_t(brickCount_.x) * std::size_t(brickCount_.y) * std::size_t(brickCount_.z), -1);
    std::vector<std::vector<std::uint32_t>> codeOf(leaves_.size());
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      leafAt_[tableIndex(leaves_[i].brick)] = std::int32_t(i);
      for (const auto& [code, samples] : leaves_[i].members)
        codeOf[i].push_back(numbers.try_emplace(code, std::uint32_t(numbers.size())).first->second);
    }
    codes_.resize(numbers.size());
    parts_.resize(leaves_.size());
    for (const auto& [code, number] : numbers) codes_[number] = code;
    parallelFor(leaves_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        for (std::size_t m = 0; m < leaves_[i].members.size(); ++m)
          for (BrickMask rest = leaves_[i].members[m].second; !rest.isEmpty();) {
            const BrickMask part = leaves_[i].isUniform ? rest : detail::connectedPart(rest);
            parts_[i].push_back({codeOf[i][m], part});
            rest = detail::without(rest, part);
          }
        std::sort(parts_[i].begin(), parts_[i].end(),
                  [](const Part& a, const Part& b) { return a.samples.first() < b.samples.first(); });
        leaves_[i].members.clear();
      }
    });
    for (std::size_t i = 0; i < leaves_.size(); ++i)
      firstNode_[i + 1] = firstNode_[i] + std::uint32_t(parts_[i].size());
  }

  std::size_t tableIndex(const Vec3i& brick) const {
    const Vec3i b = brick - firstBrick_;
    return (std::size_t(b.z) * std::size_t(brickCount_.y) + std::size_t(b.y)) * std::size_t(brickCount_.x) +
           std::size_t(b.x);
  }

  /// The leaf at a brick, or -1.
  std::int32_t leafAt(const Vec3i& brick) const {
    const Vec3i b = brick - firstBrick_;
    if (b.x < 0 || b.y < 0 || b.z < 0 || b.x >= brickCount_.x || b.y >= brickCount_.y || b.z >= brickCount_.z)
      return -1;
    return leafAt_[tableIndex(brick)];
  }

  void joinParts() {
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> touching(leaves_.size());
    parallelFor(leaves_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        for (int axis = 0; axis < 3; ++axis) {
          Vec3i direction{};
          direction[axis] = 1;
          const std::int32_t other = leafAt(leaves_[i].brick + direction);
          if (other < 0) continue;
          const auto& parts = parts_[i];
          const auto& others = parts_[std::size_t(other)];
          for (std::size_t a = 0; a < parts.size(); ++a) {
            const BrickMask across = detail::moved(parts[a].samples, direction * (1 - kBrick));
            for (std::size_t b = 0; b < others.size(); ++b)
              if (parts[a].code == others[b].code && !(across & others[b].samples).isEmpty())
                touching[i].emplace_back(firstNode_[i] + a, firstNode_[std::size_t(other)] + b);
          }
        }
    });
    parent_.resize(firstNode_.back());
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (const auto& pairs : touching)
      for (const auto& [a, b] : pairs) {
        const std::uint32_t x = rootOf(a), y = rootOf(b);
        parent_[std::max(x, y)] = std::min(x, y);
      }
  }

  std::uint32_t rootOf(std::uint32_t node) {
    while (parent_[node] != node) node = parent_[node] = parent_[parent_[node]];
    return node;
  }

  /// A part of a piece: a leaf, and which of its parts.
  struct Member {
    std::uint32_t leaf, part;
  };

  Pieces writePieces() {
    std::vector<std::uint32_t> shellOf(parent_.size());
    std::vector<std::vector<Member>> shells;
    for (std::uint32_t i = 0; i < leaves_.size(); ++i)
      for (std::uint32_t p = 0; p < parts_[i].size(); ++p) {
        const std::uint32_t node = firstNode_[i] + p, root = rootOf(node);
        if (root == node) {
          shellOf[node] = std::uint32_t(shells.size());
          shells.emplace_back();
        }
        shells[shellOf[root]].push_back({i, p});
      }
    std::vector<Piece> pieces(shells.size());
    parallelFor(
        shells.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) pieces[i] = write(shells[i]);
        },
        progress_);
    Pieces result;
    result.codes = codes_.size();
    const double least = options_.minVolume * double(h_) * double(h_) * double(h_);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < pieces.size(); ++i) {
      if (pieces[i].volume >= least) {
        kept.push_back(i);
      } else {
        ++result.slivers;
        result.sliverVolume += pieces[i].volume;
      }
    }
    for (const std::vector<std::uint32_t>& group : joinedByNecks(shells, kept)) {
      if (group.size() > 1) {
        std::vector<Member> members;
        for (const std::uint32_t i : group) members.insert(members.end(), shells[i].begin(), shells[i].end());
        pieces[group.front()] = write(members);
      }
      result.pieces.push_back(std::move(pieces[group.front()]));
    }
    return result;
  }

  std::uint32_t codeOf(const std::vector<Member>& shell) const {
    return parts_[shell[0].leaf][shell[0].part].code;
  }

  /// Shells of one code that are connected where the piece is thinner than the grid can show, as the tips of
  /// wedges are: groups of `kept`, in the order of their first.
  std::vector<std::vector<std::uint32_t>> joinedByNecks(const std::vector<std::vector<Member>>& shells,
                                                        const std::vector<std::uint32_t>& kept) const {
    std::vector<std::vector<std::uint32_t>> ofCode(codes_.size());
    for (const std::uint32_t i : kept) ofCode[codeOf(shells[i])].push_back(i);
    std::vector<std::vector<std::uint32_t>> groups;
    for (const auto& candidates : ofCode) {
      std::vector<std::vector<std::uint32_t>> joined;
      for (const std::uint32_t shell : candidates) {
        std::vector<std::uint32_t> group{shell};
        std::erase_if(joined, [&](const std::vector<std::uint32_t>& other) {
          const bool meets = std::any_of(other.begin(), other.end(),
                                         [&](std::uint32_t i) { return haveNeck(shells[i], shells[shell]); });
          if (meets) group.insert(group.end(), other.begin(), other.end());
          return meets;
        });
        std::sort(group.begin(), group.end());
        joined.push_back(std::move(group));
      }
      groups.insert(groups.end(), joined.begin(), joined.end());
    }
    std::sort(groups.begin(), groups.end());
    return groups;
  }

  /// Whether a straight line between samples of the two, near each other, stays inside the piece.
  bool haveNeck(const std::vector<Member>& a, const std::vector<Member>& b) const {
    // The nearest bricks of the two, and in these the nearest samples.
    const Member *fromA = nullptr, *fromB = nullptr;
    int least = std::numeric_limits<int>::max();
    for (const Member& m : a)
      for (const Member& n : b) {
        const Vec3i d = leaves_[m.leaf].brick - leaves_[n.leaf].brick;
        if (const int squared = dot(d, d); squared < least) least = squared, fromA = &m, fromB = &n;
      }
    const CutBrick &leafA = leaves_[fromA->leaf], &leafB = leaves_[fromB->leaf];
    const BrickMask &samplesA = parts_[fromA->leaf][fromA->part].samples,
                    &samplesB = parts_[fromB->leaf][fromB->part].samples;
    Vec3f start, end;
    float nearest = std::numeric_limits<float>::infinity();
    for (int s = 0; s < int(kSamples); ++s) {
      if (!samplesA.contains(s)) continue;
      for (int t = 0; t < int(kSamples); ++t) {
        if (!samplesB.contains(t)) continue;
        const Vec3f p = leafA.position(std::size_t(s), h_), q = leafB.position(std::size_t(t), h_);
        if (const float d = length(p - q); d < nearest) nearest = d, start = p, end = q;
      }
    }
    constexpr int kStepsPerVoxel = 8;
    const int steps = int(std::ceil(nearest / h_)) * kStepsPerVoxel;
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
    const CutCode& code = codes_[parts_[fromA->leaf][fromA->part].code];
    for (std::uint32_t k = 0; k < options_.knives.size(); ++k) {
      detail::evaluateKnife(options_.knives[k], points, values);
      if (!allAbove(halfKerf_, detail::bitOf(code.sides, k) ? 1.0f : -1.0f)) return false;
    }
    // Cells are convex: a line between two of its points stays in one.
    return true;
  }

  Piece write(const std::vector<Member>& members) const {
    const CutCode& code = codes_[codeOf(members)];
    Piece piece;
    piece.code.sides.resize(options_.knives.size());
    for (std::uint32_t k = 0; k < options_.knives.size(); ++k)
      piece.code.sides[k] = detail::bitOf(code.sides, k);
    if (code.cell != CutCode::kNoCell) piece.cell = code.cell;

    const std::vector<std::uint32_t> bricks = leavesNear(members);
    std::vector<BrickMask> own(bricks.size());
    for (const Member& m : members) {
      const auto at = std::lower_bound(bricks.begin(), bricks.end(), m.leaf) - bricks.begin();
      for (std::size_t z = 0; z < 8; ++z)
        own[std::size_t(at)].slices[z] |= parts_[m.leaf][m.part].samples.slices[z];
    }
    auto grid = std::make_shared<BrickGrid>();
    grid->indexToWorld.linear = Mat3f::scaling(h_);
    grid->worldToIndex.linear = Mat3f::scaling(1 / h_);
    grid->voxelSize = h_;
    grid->background = -band_;
    Vec3i last = grid->firstBrick = leaves_[bricks.front()].brick;
    for (const std::uint32_t b : bricks) {
      grid->firstBrick = min(grid->firstBrick, leaves_[b].brick);
      last = max(last, leaves_[b].brick);
    }
    grid->brickCount = last - grid->firstBrick + Vec3i{1, 1, 1};
    grid->table.assign(
        std::size_t(grid->brickCount.x) * std::size_t(grid->brickCount.y) * std::size_t(grid->brickCount.z),
        0);
    grid->values.reserve((2 + bricks.size()) * std::size_t(BrickGrid::kVolume));
    grid->values.resize(2 * std::size_t(BrickGrid::kVolume), -band_);
    std::fill_n(grid->brick(1), BrickGrid::kVolume, band_);
    grid->ranges = {Interval::of(-band_), Interval::of(band_)};
    std::array<float, kSamples> values;
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      const CutBrick& leaf = leaves_[bricks[i]];
      std::int32_t& entry = grid->table[grid->tableIndex(leaf.brick)];
      entry = evaluate(leaf, parts_[bricks[i]], codeOf(members), own[i], values);
      if (entry >= 0) continue;
      entry = std::int32_t(grid->poolSize());
      grid->ranges.push_back({});
      grid->values.resize(grid->poolSize() * std::size_t(BrickGrid::kVolume));
      float* samples = grid->brick(entry);
      for (std::size_t s = 0; s < kSamples; ++s)
        samples[sampleOffset(int(s & 7), int(s >> 3 & 7), int(s >> 6))] = values[s];
    }
    fillBorders(*grid);
    piece.volume = signedVolume(marchingCubes(*grid));
    piece.level = std::move(grid);
    return piece;
  }

  /// The leaves that a piece comes within the band of, in order.
  std::vector<std::uint32_t> leavesNear(const std::vector<Member>& members) const {
    // The surface is less than a voxel beyond the last sample inside.
    const int reach = int(std::ceil(options_.bandVoxels)) + 1;
    std::vector<std::uint32_t> near;
    for (const Member& m : members) {
      near.push_back(m.leaf);
      const detail::MaskBounds bounds = detail::boundsOf(parts_[m.leaf][m.part].samples);
      const auto reaches = [&](int axis, int direction) {
        return direction == 0 ||
               (direction < 0 ? bounds.low[axis] - reach < 0 : bounds.high[axis] + reach >= kBrick);
      };
      for (int side = 0; side < 27; ++side) {
        const Vec3i direction{side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1};
        if (!reaches(0, direction.x) || !reaches(1, direction.y) || !reaches(2, direction.z)) continue;
        const std::int32_t other = leafAt(leaves_[m.leaf].brick + direction);
        if (other >= 0) near.push_back(std::uint32_t(other));
      }
    }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    return near;
  }

  /// Values of a piece with code `number` in a brick, of which it has the samples `own`. Returns 0 or 1 where
  /// all of them are the lower or upper end of the band, else -1.
  std::int32_t evaluate(const CutBrick& leaf, const std::vector<Part>& parts, std::uint32_t number,
                        const BrickMask& own, std::array<float, kSamples>& values) const {
    if (leaf.isUniform) return own.isEmpty() ? 0 : 1;
    const CutCode& code = codes_[number];
    for (std::size_t w = 0; w < leaf.decided.size(); ++w)
      if (((leaf.sides[w] ^ code.sides[w]) & leaf.decided[w]) != 0) return 0;
    if (code.cell != CutCode::kNoCell &&
        std::find(leaf.cells.begin(), leaf.cells.end(), code.cell) == leaf.cells.end())
      return 0;
    std::copy_n(leaf.samples.begin(), kSamples, values.begin());
    for (std::size_t u = 0; u < leaf.undecided.size(); ++u) {
      const float* knife = leaf.samples.data() + (1 + u) * kSamples;
      const float sign = detail::bitOf(code.sides, leaf.undecided[u]) ? 1.0f : -1.0f;
      for (std::size_t s = 0; s < kSamples; ++s) values[s] = std::min(values[s], sign * knife[s] - halfKerf_);
    }
    if (leaf.cells.size() > 1)
      for (const std::uint32_t other : leaf.cells) {
        if (other == code.cell) continue;
        const detail::Bisector side(options_.cells[code.cell], options_.cells[other]);
        for (std::size_t s = 0; s < kSamples; ++s)
          values[s] = std::min(values[s], side.at(leaf.position(s, h_)) - halfKerf_);
      }
    // Inside, but of another piece with this code.
    for (const Part& part : parts) {
      if (part.code != number) continue;
      const BrickMask others = detail::without(part.samples, own);
      if (others.isEmpty()) continue;
      for (std::size_t s = 0; s < kSamples; ++s)
        if (others.contains(int(s))) values[s] = -values[s];
    }
    float least = band_, most = -band_;
    for (float& v : values) {
      // Adding 0 leaves one kind of zero, whatever came first.
      v = std::max(-band_, std::min(v, band_)) + 0.0f;
      least = std::min(least, v);
      most = std::max(most, v);
    }
    return most == -band_ ? 0 : least == band_ ? 1 : -1;
  }

  const ScalarField& shape_;
  const CutOptions& options_;
  const Progress& progress_;
  float h_, band_, halfKerf_;

  std::vector<CutBrick> leaves_;
  /// Per leaf.
  std::vector<std::vector<Part>> parts_;
  std::vector<CutCode> codes_;
  Vec3i firstBrick_{}, brickCount_{};
  std::vector<std::int32_t> leafAt_;
  /// Every part of every leaf is a node: parts of leaf i from firstNode_[i] on.
  std::vector<std::uint32_t> firstNode_, parent_;
};

void requireOptions(const CutOptions& options) {
  const auto finite = [](float v) { return std::isfinite(v); };
  require(finite(options.voxelSize) && options.voxelSize > 0,
          fmt::format("cut: voxelSize must be > 0, got {}", options.voxelSize));
  require(!options.box.isEmpty() && isFinite(options.box.min) && isFinite(options.box.max),
          "cut: the box must be bounded and not empty");
  require(finite(options.kerf) && options.kerf >= 0,
          fmt::format("cut: kerf must be >= 0, got {}", options.kerf));
  require(std::isfinite(options.minVolume) && options.minVolume >= 0,
          fmt::format("cut: minVolume must be >= 0, got {}", options.minVolume));
  require(options.bandVoxels >= 2 && options.bandVoxels < kBrick,
          fmt::format("cut: bandVoxels must be from 2 to 7, got {}", options.bandVoxels));
  for (const Knife& knife : options.knives)
    require(finite(knife.steepest) && knife.steepest >= 1,
            fmt::format("cut: a knife's steepest gradient must be >= 1, got {}", knife.steepest));
  std::vector<Vec3f> cells = options.cells;
  for (const Vec3f& p : cells) require(isFinite(p), "cut: a point of the cells is not finite");
  std::sort(cells.begin(), cells.end());
  const auto same = std::adjacent_find(cells.begin(), cells.end());
  if (same != cells.end())
    throw Error(fmt::format("cut: two cells have the point {}, {}, {}", same->x, same->y, same->z));
}

}  // namespace

Pieces cutIntoPieces(const ScalarField& shape, const CutOptions& options, const Progress& progress) {
  requireOptions(options);
  return Cutter(shape, options, progress).run();
}

}  // namespace nephele
