// Cutting level sets by knives in one pass.
//
// cut_bricks.cpp finds, for every brick, the samples inside the shape by the sides of all knives, numbered as
// they occur; the 2^N others never appear. Here, shells hang together within a brick by growing bit sets, and
// between bricks by union-find. Every brick lists the shells that come near it, so that what follows goes
// over bricks, each read once for all its shells: first the volumes of those that may be slivers, then
// min(shape, +-knives) of those that stay, written where their surfaces are. Shells of one combination are
// one piece if a straight line joins them inside the shape and between the blades: thin wedges fall apart on
// a grid, but not in fact.
//
// The minimum, not the product of the notes, which bends the outer surface. Everything is ordered by place,
// never by knife or thread. Limits: rims are bevelled by the grid; a neck that is thinner than a voxel and
// bent is not found.
#include "nephele/levelset/cut/cut_into_level_sets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/levelset/cut/detail/cut_bricks.h"
#include "nephele/levelset/cut/detail/cut_kernels.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/levelset/grid/memory_chunks.h"
#include "nephele/levelset/mesh/brick_volume.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using detail::BrickCells;
using detail::BrickMask;
using detail::CutBrick;
using detail::CutCode;

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;
constexpr std::size_t kBricksPerTask = 32;
constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// The 26 bricks around one and itself, in the order of their place.
constexpr int kNeighbours = 27;
constexpr Vec3i neighbour(int i) {
  return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

/// Samples of one code that hang together within a brick.
struct Part {
  std::uint32_t code;
  /// What it belongs to: the shell, later the piece, or none.
  std::uint32_t owner;
  BrickMask samples;
};

/// How far a part goes.
struct Reach {
  /// Its shell.
  std::uint32_t owner;
  /// Bit i: the brick neighbour(i) is within the band of it.
  std::uint32_t near;
  /// Bit i: it has samples on all faces that lead to the brick before it by i & 1, i >> 1 & 1, i >> 2.
  std::uint8_t touches;
};

/// That an owner comes near a brick.
struct Near {
  std::uint32_t owner;
  /// Its surface may cross cells of the brick, not only its band.
  bool isSurface;
};

/// Runs of items, one for each brick.
template <class T>
struct Lists {
  std::vector<T> items;
  std::vector<std::size_t> first;

  std::span<const T> of(std::size_t i) const { return {items.data() + first[i], first[i + 1] - first[i]}; }
};

/// Lists made in parallel: make(i, list) appends those of i.
template <class T, class Make>
Lists<T> makeLists(std::size_t count, const Make& make) {
  struct Block {
    std::vector<T> items;
    std::vector<std::size_t> ends;
  };
  std::vector<Block> blocks((count + kBricksPerTask - 1) / kBricksPerTask);
  parallelFor(count, kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    Block& block = blocks[begin / kBricksPerTask];
    for (std::size_t i = begin; i < end; ++i) {
      make(i, block.items);
      block.ends.push_back(block.items.size());
    }
  });
  Lists<T> lists;
  lists.first.reserve(count + 1);
  lists.first.push_back(0);
  std::size_t total = 0;
  for (const Block& block : blocks) total += block.items.size();
  lists.items.reserve(total);
  for (const Block& block : blocks) {
    for (const std::size_t end : block.ends) lists.first.push_back(lists.items.size() + end);
    lists.items.insert(lists.items.end(), block.items.begin(), block.items.end());
  }
  return lists;
}

/// What one owner's level set is in one brick.
struct BrickView {
  enum class Kind { outside, inside, mixed };

  Kind kind = Kind::outside;
  const CutBrick* brick = nullptr;
  /// Samples inside others with the same code.
  BrickMask others;
  std::vector<detail::KnifeSide> knives;
  std::vector<detail::Bisector> planes;
};

/// Which samples of the bricks after one, by i & 1, i >> 1 & 1, i >> 2, are corners of its cells.
const std::array<std::vector<std::uint16_t>, 8>& sharedCorners() {
  static const std::array<std::vector<std::uint16_t>, 8> all = [] {
    std::array<std::vector<std::uint16_t>, 8> made;
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t s = 0; s < kSamples; ++s)
        if (((i & 1) == 0 || (s & 7) == 0) && ((i >> 1 & 1) == 0 || (s >> 3 & 7) == 0) &&
            (i >> 2 == 0 || s >> 6 == 0))
          made[i].push_back(std::uint16_t(s));
    return made;
  }();
  return all;
}

constexpr Vec3i stepOf(std::size_t i) {
  return {int(i & 1), int(i >> 1 & 1), int(i >> 2)};
}

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
    cut_ = detail::cutBricks(shape_, options_, progress_);
    placeBricks();
    findParts();
    joinParts();
    reach_.resize(parts_.items.size());
    parallelFor(reach_.size(), 16 * kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) reach_[i] = reachOf(parts_.items[i]);
    });
    reachOfBrick_.assign(cut_.count(), 0);
    for (std::size_t i = 0; i < cut_.count(); ++i)
      for (std::size_t p = parts_.first[i]; p < parts_.first[i + 1]; ++p) reachOfBrick_[i] |= reach_[p].near;
    near_ = makeLists<Near>(cut_.count(), [&](std::size_t i, std::vector<Near>& list) { listNear(i, list); });
    progress_.begin("write pieces");
    return writePieces();
  }

 private:
  /// A part of a piece: a brick, and which of its parts.
  struct Member {
    std::uint32_t brick, part;
  };

  const CutBrick& brick(std::size_t i) const { return cut_.bricks[i]; }

  void placeBricks() {
    Vec3i first, last;
    for (std::size_t i = 0; i < cut_.count(); ++i) {
      first = i == 0 ? brick(i).brick : min(first, brick(i).brick);
      last = i == 0 ? brick(i).brick : max(last, brick(i).brick);
    }
    if (cut_.count() != 0) places_ = {first, last - first + Vec3i{1, 1, 1}};
    brickAt_.assign(places_.size(), -1);
    for (std::size_t i = 0; i < cut_.count(); ++i)
      brickAt_[places_.numberOf(brick(i).brick)] = std::int32_t(i);
  }

  /// The number of the brick at a place, or -1.
  std::int32_t brickAt(const Vec3i& at) const {
    return places_.covers(at) ? brickAt_[places_.numberOf(at)] : -1;
  }

  void findParts() {
    parts_ = makeLists<Part>(cut_.count(), [&](std::size_t i, std::vector<Part>& list) {
      const std::size_t begin = list.size();
      for (const detail::CutMember& member : cut_.membersOf(i))
        for (BrickMask rest = member.samples; !rest.isEmpty();) {
          const BrickMask part = brick(i).isUniform ? rest : detail::connectedPart(rest);
          list.push_back({member.code, kNone, part});
          rest = detail::without(rest, part);
        }
      std::sort(list.begin() + std::ptrdiff_t(begin), list.end(),
                [](const Part& a, const Part& b) { return a.samples.first() < b.samples.first(); });
    });
  }

  Reach reachOf(const Part& part) const {
    Reach reach{part.owner, 0, 0};
    const detail::MaskBounds bounds = detail::boundsOf(part.samples);
    // The surface is less than a voxel beyond the last sample inside.
    const int band = int(std::ceil(options_.bandVoxels)) + 1;
    const auto reaches = [&](int axis, int direction) {
      return direction == 0 ||
             (direction < 0 ? bounds.low[axis] - band < 0 : bounds.high[axis] + band >= kBrick);
    };
    for (int i = 0; i < kNeighbours; ++i) {
      const Vec3i direction = neighbour(i);
      if (reaches(0, direction.x) && reaches(1, direction.y) && reaches(2, direction.z))
        reach.near |= 1u << i;
    }
    for (int i = 0; i < 8; ++i)
      if (((i & 1) == 0 || bounds.low.x == 0) && ((i >> 1 & 1) == 0 || bounds.low.y == 0) &&
          (i >> 2 == 0 || bounds.low.z == 0))
        reach.touches = std::uint8_t(reach.touches | 1 << i);
    return reach;
  }

  /// Gives every part its shell.
  void joinParts() {
    using Pair = std::pair<std::uint32_t, std::uint32_t>;
    const auto touching = makeLists<Pair>(cut_.count(), [&](std::size_t i, std::vector<Pair>& list) {
      for (int axis = 0; axis < 3; ++axis) {
        Vec3i direction{};
        direction[axis] = 1;
        const std::int32_t other = brickAt(brick(i).brick + direction);
        if (other < 0) continue;
        const auto parts = parts_.of(i), others = parts_.of(std::size_t(other));
        for (std::size_t a = 0; a < parts.size(); ++a) {
          const std::uint64_t face = detail::faceOf(parts[a].samples, axis, true);
          if (face == 0) continue;
          for (std::size_t b = 0; b < others.size(); ++b)
            if (parts[a].code == others[b].code &&
                (face & detail::faceOf(others[b].samples, axis, false)) != 0)
              list.emplace_back(parts_.first[i] + a, parts_.first[std::size_t(other)] + b);
        }
      }
    });
    std::vector<std::uint32_t> parent(parts_.items.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto rootOf = [&](std::uint32_t node) {
      while (parent[node] != node) node = parent[node] = parent[parent[node]];
      return node;
    };
    for (const auto& [a, b] : touching.items) {
      const std::uint32_t x = rootOf(a), y = rootOf(b);
      parent[std::max(x, y)] = std::min(x, y);
    }
    for (std::uint32_t i = 0; i < parts_.items.size(); ++i) {
      const std::uint32_t root = rootOf(i);
      parts_.items[i].owner = root == i ? shellCount_++ : parts_.items[root].owner;
    }
  }

  /// The shells that come within the band of a brick.
  void listNear(std::size_t i, std::vector<Near>& list) const {
    const auto begin = std::ptrdiff_t(list.size());
    for (int n = 0; n < kNeighbours; ++n) {
      const Vec3i direction = neighbour(n);
      const std::int32_t other = brickAt(brick(i).brick + direction);
      // As the other brick sees this one.
      const std::uint32_t bit = 1u << (kNeighbours - 1 - n);
      if (other < 0 || (reachOfBrick_[std::size_t(other)] & bit) == 0) continue;
      const bool isAfter = std::min({direction.x, direction.y, direction.z}) >= 0;
      const int before = direction.x + 2 * direction.y + 4 * direction.z;
      for (std::size_t p = parts_.first[std::size_t(other)]; p < parts_.first[std::size_t(other) + 1]; ++p) {
        const Reach& reach = reach_[p];
        if ((reach.near & bit) == 0) continue;
        const auto known = std::find_if(list.begin() + begin, list.end(),
                                        [&](const Near& near) { return near.owner == reach.owner; });
        const bool isSurface = isAfter && (reach.touches >> before & 1) != 0;
        if (known == list.end())
          list.push_back({reach.owner, isSurface});
        else
          known->isSurface |= isSurface;
      }
    }
  }

  Pieces writePieces() {
    std::vector<std::vector<Member>> shells(shellCount_);
    // Cells that are wholly inside count a voxel each: shells with enough of them are no slivers.
    std::vector<double> leastVolume(shellCount_, 0.0);
    for (std::uint32_t i = 0; i < cut_.count(); ++i)
      for (std::uint32_t p = 0; p < parts_.of(i).size(); ++p) {
        const Part& part = parts_.of(i)[p];
        shells[part.owner].push_back({i, p});
        if (leastVolume[part.owner] < options_.minVolume)
          leastVolume[part.owner] += double(detail::wholeCells(part.samples));
      }
    codeOfOwner_.resize(shellCount_);
    for (std::uint32_t s = 0; s < shellCount_; ++s) codeOfOwner_[s] = codeOf(shells[s]);
    const auto isSmall = [&](std::uint32_t s) { return leastVolume[s] < options_.minVolume; };
    const std::vector<double> small = smallVolumes(isSmall);

    Pieces result;
    result.codes = cut_.codes.size();
    const double voxel = double(h_) * double(h_) * double(h_);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t s = 0; s < shellCount_; ++s) {
      if (!isSmall(s) || small[s] * voxel >= options_.minVolume * voxel) {
        kept.push_back(s);
      } else {
        ++result.slivers;
        result.sliverVolume += small[s] * voxel;
      }
    }
    const auto groups = joinedByNecks(shells, kept);
    std::vector<std::uint32_t> pieceOf(shellCount_, kNone), codes;
    for (std::uint32_t g = 0; g < groups.size(); ++g) {
      for (const std::uint32_t shell : groups[g]) pieceOf[shell] = g;
      codes.push_back(codeOf(shells[groups[g].front()]));
    }
    giveTo(pieceOf);
    codeOfOwner_ = std::move(codes);
    std::vector<PieceLevelSet> levels = writeLevels(groups.size());
    for (std::uint32_t g = 0; g < groups.size(); ++g) {
      Piece& piece = result.pieces.emplace_back();
      const CutCode& code = cut_.codes[codeOfOwner_[g]];
      piece.code.sides.resize(options_.knives.size());
      for (std::uint32_t k = 0; k < options_.knives.size(); ++k)
        piece.code.sides[k] = detail::bitOf(code.sides, k);
      if (code.cell != CutCode::kNoCell) piece.cell = code.cell;
      piece.level = std::move(levels[g]);
    }
    return result;
  }

  std::uint32_t codeOf(const std::vector<Member>& shell) const {
    return parts_.of(shell[0].brick)[shell[0].part].code;
  }

  /// Owners were shells and become pieces.
  void giveTo(const std::vector<std::uint32_t>& pieceOf) {
    const auto pass = [&](std::uint32_t& owner) { owner = pieceOf[owner]; };
    for (Part& part : parts_.items) pass(part.owner);
    std::size_t count = 0, begin = 0;
    for (std::size_t i = 0; i < cut_.count(); ++i) {
      const std::size_t end = near_.first[i + 1], first = count;
      near_.first[i] = first;
      for (std::size_t n = begin; n < end; ++n) {
        Near near = near_.items[n];
        pass(near.owner);
        if (near.owner == kNone) continue;
        const auto known = std::find_if(near_.items.begin() + std::ptrdiff_t(first),
                                        near_.items.begin() + std::ptrdiff_t(count),
                                        [&](const Near& other) { return other.owner == near.owner; });
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

  /// Shells of one code that are connected where the piece is thinner than the grid can show, as the tips of
  /// wedges are: groups of `kept`, in the order of their first.
  std::vector<std::vector<std::uint32_t>> joinedByNecks(const std::vector<std::vector<Member>>& shells,
                                                        const std::vector<std::uint32_t>& kept) const {
    std::vector<std::vector<std::uint32_t>> ofCode(cut_.codes.size());
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
        const Vec3i d = brick(m.brick).brick - brick(n.brick).brick;
        if (const int squared = dot(d, d); squared < least) least = squared, fromA = &m, fromB = &n;
      }
    const CutBrick &brickA = brick(fromA->brick), &brickB = brick(fromB->brick);
    const Part &partA = parts_.of(fromA->brick)[fromA->part], &partB = parts_.of(fromB->brick)[fromB->part];
    Vec3f start, end;
    float nearest = std::numeric_limits<float>::infinity();
    for (int s = 0; s < int(kSamples); ++s) {
      if (!partA.samples.contains(s)) continue;
      for (int t = 0; t < int(kSamples); ++t) {
        if (!partB.samples.contains(t)) continue;
        const Vec3f p = brickA.position(std::size_t(s), h_), q = brickB.position(std::size_t(t), h_);
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
    const CutCode& code = cut_.codes[partA.code];
    for (std::uint32_t k = 0; k < options_.knives.size(); ++k) {
      detail::evaluateKnife(options_.knives[k], points, values);
      if (!allAbove(halfKerf_, detail::bitOf(code.sides, k) ? 1.0f : -1.0f)) return false;
    }
    // Cells are convex: a line between two of its points stays in one.
    return true;
  }

  /// Samples of a brick that belong to an owner.
  BrickMask ownedBy(std::uint32_t owner, std::int32_t at) const {
    BrickMask own;
    if (at >= 0)
      for (const Part& part : parts_.of(std::size_t(at)))
        if (part.owner == owner) own = own | part.samples;
    return own;
  }

  void look(BrickView& view, std::int32_t at, std::uint32_t owner, const BrickMask& own) const {
    view.kind = BrickView::Kind::outside;
    if (at < 0) return;
    view.brick = &brick(std::size_t(at));
    if (view.brick->isUniform) {
      if (!own.isEmpty()) view.kind = BrickView::Kind::inside;
      return;
    }
    const std::uint32_t number = codeOfOwner_[owner];
    const CutCode& code = cut_.codes[number];
    const detail::CutKnowledge& known = *view.brick->known;
    for (std::size_t w = 0; w < known.decided.size(); ++w)
      if (((known.sides[w] ^ code.sides[w]) & known.decided[w]) != 0) return;
    const bool hasCell = code.cell != CutCode::kNoCell;
    if (hasCell && std::find(known.cells.begin(), known.cells.end(), code.cell) == known.cells.end()) return;
    view.kind = BrickView::Kind::mixed;
    view.knives.clear();
    for (std::size_t u = 0; u < known.undecided.size(); ++u)
      view.knives.push_back(
          {view.brick->samplesOf(u), detail::bitOf(code.sides, known.undecided[u]) ? 1.0f : -1.0f});
    view.planes.clear();
    if (known.cells.size() > 1)
      for (const std::uint32_t other : known.cells)
        if (other != code.cell) view.planes.emplace_back(options_.cells[code.cell], options_.cells[other]);
    view.others = {};
    for (const Part& part : parts_.of(std::size_t(at)))
      if (part.code == number && part.owner != owner) view.others = view.others | part.samples;
  }

  /// All samples of a mixed brick, and their range.
  Interval evaluate(BrickView& view, std::vector<float>& planes, float* values) const {
    planes.resize(view.planes.size() * kSamples);
    const std::size_t knives = view.knives.size();
    for (std::size_t i = 0; i < view.planes.size(); ++i) {
      float* side = planes.data() + i * kSamples;
      for (std::size_t s = 0; s < kSamples; ++s) side[s] = view.planes[i].at(view.brick->position(s, h_));
      view.knives.push_back({side, 1.0f});
    }
    Interval range = detail::pieceSamples(view.brick->samples, view.knives, halfKerf_, band_, values);
    view.knives.resize(knives);
    if (view.others.isEmpty()) return range;
    // Inside, but of another piece with this code.
    range = {band_, -band_};
    for (std::size_t s = 0; s < kSamples; ++s) {
      if (view.others.contains(int(s))) values[s] = -values[s];
      range = {std::min(range.min, values[s]), std::max(range.max, values[s])};
    }
    return range;
  }

  /// Working memory of a thread.
  struct Work {
    BrickCells cells;
    BrickView view;
    std::vector<float> planes;
    std::array<std::array<float, kSamples>, 8> samples;
  };

  /// What a shell has of its volume in the cells of a brick, voxels cubed.
  double volumeIn(const Vec3i& at, std::uint32_t owner, Work& work) const {
    std::array<std::int32_t, 8> bricks;
    std::array<BrickMask, 8> own;
    for (std::size_t i = 0; i < 8; ++i) {
      bricks[i] = brickAt(at + stepOf(i));
      own[i] = ownedBy(owner, bricks[i]);
    }
    work.cells.setInside(own);
    const BrickMask mixed = work.cells.mixed();
    if (mixed.isEmpty()) return 0;
    for (std::size_t i = 0; i < 8; ++i) {
      look(work.view, bricks[i], owner, own[i]);
      if (i == 0 && work.view.kind == BrickView::Kind::mixed)
        evaluate(work.view, work.planes, work.samples[i].data());
      else
        evaluateSome(work.view, sharedCorners()[i], work.samples[i].data());
      work.cells.samples[i] = work.samples[i].data();
    }
    return detail::volumeShare(work.cells, mixed, at * kBrick);
  }

  /// Some of its samples, each at its place.
  void evaluateSome(const BrickView& view, std::span<const std::uint16_t> samples, float* values) const {
    if (view.kind != BrickView::Kind::mixed) {
      std::fill_n(values, kSamples, view.kind == BrickView::Kind::inside ? band_ : -band_);
      return;
    }
    for (const std::uint16_t s : samples) {
      float v = view.brick->samples[s];
      for (const detail::KnifeSide& knife : view.knives)
        v = std::min(v, knife.sign * knife.samples[s] - halfKerf_);
      for (const detail::Bisector& plane : view.planes)
        v = std::min(v, plane.at(view.brick->position(s, h_)) - halfKerf_);
      v = std::max(-band_, std::min(v, band_)) + 0.0f;
      values[s] = view.others.contains(s) ? -v : v;
    }
  }

  /// Volumes of the shells that are small, voxels cubed.
  template <class IsSmall>
  std::vector<double> smallVolumes(const IsSmall& isSmall) const {
    std::vector<double> shares(near_.items.size());
    parallelFor(cut_.count(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      std::unique_ptr<Work> work;
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t n = near_.first[i]; n < near_.first[i + 1]; ++n) {
          if (!near_.items[n].isSurface || !isSmall(near_.items[n].owner)) continue;
          if (!work) work = std::make_unique<Work>();
          shares[n] = volumeIn(brick(i).brick, near_.items[n].owner, *work);
        }
    });
    std::vector<double> volumes(shellCount_, 0.0);
    for (std::size_t n = 0; n < shares.size(); ++n) volumes[near_.items[n].owner] += shares[n];
    const auto work = std::make_unique<Work>();
    for (const auto& [at, owner] : surfacesBeyond())
      if (isSmall(owner)) volumes[owner] += volumeIn(at, owner, *work);
    return volumes;
  }

  /// Places without a brick, and owners whose surface crosses cells there: where the box cuts the shape off.
  std::vector<std::pair<Vec3i, std::uint32_t>> surfacesBeyond() const {
    std::vector<std::pair<Vec3i, std::uint32_t>> beyond;
    for (std::size_t i = 0; i < cut_.count(); ++i)
      for (std::size_t p = parts_.first[i]; p < parts_.first[i + 1]; ++p)
        for (std::size_t d = 1; d < 8 && reach_[p].touches > 1; ++d) {
          const Vec3i at = brick(i).brick - stepOf(d);
          const std::uint32_t owner = parts_.items[p].owner;
          if ((reach_[p].touches >> d & 1) != 0 && owner != kNone && brickAt(at) < 0)
            beyond.emplace_back(at, owner);
        }
    const auto comesFirst = [](const auto& a, const auto& b) {
      return a.first != b.first ? comesBefore(a.first, b.first) : a.second < b.second;
    };
    std::sort(beyond.begin(), beyond.end(), comesFirst);
    beyond.erase(std::unique(beyond.begin(), beyond.end()), beyond.end());
    return beyond;
  }

  /// The level sets of the first owners.
  std::vector<PieceLevelSet> writeLevels(std::size_t count) const {
    // Boxes first, then places for samples, as they are needed.
    std::vector<PieceLevelSet::Table> tables(count);
    std::vector<Vec3i> last(count);
    for (std::size_t i = 0; i < cut_.count(); ++i)
      for (const Near& near : near_.of(i)) {
        PieceLevelSet::Table& table = tables[near.owner];
        const Vec3i& at = brick(i).brick;
        const bool isFirst = table.bricks.count.x == 0;
        table.bricks.first = isFirst ? at : min(table.bricks.first, at);
        last[near.owner] = isFirst ? at : max(last[near.owner], at);
        table.bricks.count.x = 1;
      }
    for (std::size_t p = 0; p < count; ++p) {
      PieceLevelSet::Table& table = tables[p];
      table.bricks.count = last[p] - table.bricks.first + Vec3i{1, 1, 1};
      table.entries.assign(table.bricks.size(), PieceLevelSet::kOutside);
    }
    const auto samples = std::make_shared<detail::LargeArray>(near_.items.size() * kSamples);
    std::atomic<std::int32_t> used{0};
    parallelFor(
        cut_.count(), kBricksPerTask,
        [&](std::size_t begin, std::size_t end) {
          BrickView view;
          std::vector<float> planes;
          std::int32_t place = -1;
          for (std::size_t i = begin; i < end; ++i)
            for (const Near& near : near_.of(i)) {
              look(view, std::int32_t(i), near.owner, ownedBy(near.owner, std::int32_t(i)));
              std::int32_t& entry =
                  tables[near.owner].entries[tables[near.owner].bricks.numberOf(brick(i).brick)];
              if (view.kind != BrickView::Kind::mixed) {
                entry =
                    view.kind == BrickView::Kind::inside ? PieceLevelSet::kInside : PieceLevelSet::kOutside;
                continue;
              }
              if (place < 0) place = used.fetch_add(1);
              const Interval range = evaluate(view, planes, samples->data() + std::size_t(place) * kSamples);
              entry = range.max == -band_  ? PieceLevelSet::kOutside
                      : range.min == band_ ? PieceLevelSet::kInside
                                           : place + 2;
              if (entry == place + 2) place = -1;
            }
        },
        progress_);
    std::vector<PieceLevelSet> levels;
    for (PieceLevelSet::Table& table : tables) levels.emplace_back(h_, band_, std::move(table), samples);
    return levels;
  }

  const ScalarField& shape_;
  const CutOptions& options_;
  const Progress& progress_;
  float h_, band_, halfKerf_;

  detail::CutBricks cut_;
  BrickBox places_;
  std::vector<std::int32_t> brickAt_;
  /// Of every brick.
  Lists<Part> parts_;
  /// Of every part.
  std::vector<Reach> reach_;
  /// Of every brick: `Reach::near` of its parts together.
  std::vector<std::uint32_t> reachOfBrick_;
  Lists<Near> near_;
  std::uint32_t shellCount_ = 0;
  std::vector<std::uint32_t> codeOfOwner_;
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
