// The minimum, not the product of the notes, which bends the outer surface. Where a piece comes near a brick
// its samples are made there and kept only if its surface is near; the volumes of shells that may be slivers
// come from the same samples, of which only those beside crossed edges are made.
#include "nephele/levelset/cut/detail/level_sets/piece_samples.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "nephele/levelset/grid/memory_chunks.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;
constexpr std::size_t kBricksPerTask = 32;

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

}  // namespace

void PieceSamples::look(View& view, std::int32_t at, std::uint32_t owner, const BrickMask& own) const {
  view.kind = View::Kind::outside;
  if (at < 0) return;
  view.brick = &shells_.brick(std::size_t(at));
  if (view.brick->isUniform) {
    if (!own.isEmpty()) view.kind = View::Kind::inside;
    return;
  }
  const std::uint32_t number = shells_.codeOf(owner);
  const CutCode& code = shells_.cut().codes[number];
  const CutKnowledge& known = *view.brick->known;
  for (std::size_t w = 0; w < known.decided.size(); ++w)
    if (((known.sides[w] ^ code.sides[w]) & known.decided[w]) != 0) return;
  const bool hasCell = code.cell != CutCode::kNoCell;
  if (hasCell && std::find(known.cells.begin(), known.cells.end(), code.cell) == known.cells.end()) return;
  view.kind = View::Kind::mixed;
  view.knives.clear();
  for (std::size_t u = 0; u < known.undecided.size(); ++u)
    view.knives.push_back({view.brick->samplesOf(u), bitOf(code.sides, known.undecided[u]) ? 1.0f : -1.0f});
  view.planes.clear();
  if (known.cells.size() > 1)
    for (const std::uint32_t other : known.cells)
      if (other != code.cell) view.planes.emplace_back(plan_.cells[code.cell], plan_.cells[other]);
  view.others = {};
  for (const ShellPart& part : shells_.parts().of(std::size_t(at)))
    if (part.code == number && part.owner != owner) view.others = view.others | part.samples;
}

/// All samples of a mixed brick, and their range.
Interval PieceSamples::evaluate(View& view, std::vector<float>& planes, float* values) const {
  planes.resize(view.planes.size() * kSamples);
  const std::size_t knives = view.knives.size();
  for (std::size_t i = 0; i < view.planes.size(); ++i) {
    float* side = planes.data() + i * kSamples;
    for (std::size_t s = 0; s < kSamples; ++s) side[s] = view.planes[i].at(view.brick->position(s, h_));
    view.knives.push_back({side, 1.0f});
  }
  Interval range = pieceSamples(view.brick->samples, view.knives, halfKerf_, band_, values);
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

/// What a shell has of its volume in the cells of a brick, voxels cubed.
double PieceSamples::volumeIn(const Vec3i& at, std::uint32_t owner, Work& work) const {
  std::array<std::int32_t, 8> bricks;
  std::array<BrickMask, 8> own;
  for (std::size_t i = 0; i < 8; ++i) {
    bricks[i] = shells_.brickAt(at + stepOf(i));
    own[i] = shells_.ownedBy(owner, bricks[i]);
  }
  work.cells.setInside(own);
  const BrickMask mixed = work.cells.mixed();
  if (mixed.isEmpty()) return 0;
  for (std::size_t i = 0; i < 8; ++i) {
    look(work.view, bricks[i], owner, own[i]);
    if (i == 0 && work.view.kind == View::Kind::mixed)
      evaluate(work.view, work.planes, work.samples[i].data());
    else
      evaluateSome(work.view, sharedCorners()[i], work.samples[i].data());
    work.cells.samples[i] = work.samples[i].data();
  }
  return volumeShare(work.cells, mixed, at * kBrick);
}

/// Some of its samples, each at its place.
void PieceSamples::evaluateSome(const View& view, std::span<const std::uint16_t> samples,
                                float* values) const {
  if (view.kind != View::Kind::mixed) {
    std::fill_n(values, kSamples, view.kind == View::Kind::inside ? band_ : -band_);
    return;
  }
  for (const std::uint16_t s : samples) {
    float v = view.brick->samples[s];
    for (const KnifeSide& knife : view.knives) v = std::min(v, knife.sign * knife.samples[s] - halfKerf_);
    for (const Bisector& plane : view.planes)
      v = std::min(v, plane.at(view.brick->position(s, h_)) - halfKerf_);
    v = std::max(-band_, std::min(v, band_)) + 0.0f;
    values[s] = view.others.contains(s) ? -v : v;
  }
}

std::vector<double> PieceSamples::smallVolumes(const std::vector<bool>& isSmall,
                                               const Progress& progress) const {
  const BrickLists<NearOwner>& near = shells_.near();
  std::vector<double> shares(near.items.size());
  parallelFor(
      shells_.cut().count(), kBricksPerTask,
      [&](std::size_t begin, std::size_t end) {
        std::unique_ptr<Work> work;
        for (std::size_t i = begin; i < end; ++i)
          for (std::size_t n = near.first[i]; n < near.first[i + 1]; ++n) {
            if (!near.items[n].isSurface || !isSmall[near.items[n].owner]) continue;
            if (!work) work = std::make_unique<Work>();
            shares[n] = volumeIn(shells_.brick(i).brick, near.items[n].owner, *work);
          }
      },
      progress);
  std::vector<double> volumes(shells_.ownerCount(), 0.0);
  for (std::size_t n = 0; n < shares.size(); ++n) volumes[near.items[n].owner] += shares[n];
  const auto work = std::make_unique<Work>();
  for (const auto& [at, owner] : shells_.surfacesBeyond())
    if (isSmall[owner]) volumes[owner] += volumeIn(at, owner, *work);
  return volumes;
}

/// Each as large as it must be, with no samples yet.
std::vector<FlatBrickTable> PieceSamples::emptyTables() const {
  const std::size_t count = shells_.ownerCount();
  std::vector<FlatBrickTable> tables(count);
  std::vector<Vec3i> last(count);
  for (std::size_t i = 0; i < shells_.cut().count(); ++i)
    for (const NearOwner& near : shells_.near().of(i)) {
      FlatBrickTable& table = tables[near.owner];
      const Vec3i& at = shells_.brick(i).brick;
      const bool isFirst = table.box.count.x == 0;
      table.box.first = isFirst ? at : min(table.box.first, at);
      last[near.owner] = isFirst ? at : max(last[near.owner], at);
      table.box.count.x = 1;
    }
  for (std::size_t p = 0; p < count; ++p) {
    FlatBrickTable& table = tables[p];
    table = FlatBrickTable({table.box.first, last[p] - table.box.first + Vec3i{1, 1, 1}});
  }
  return tables;
}

std::vector<PieceLevelSet> PieceSamples::levelSets(const Progress& progress) const {
  // Boxes first, then places for samples, as they are needed.
  std::vector<FlatBrickTable> tables = emptyTables();
  const auto samples = std::make_shared<LargeArray>(shells_.near().items.size() * kSamples);
  std::atomic<std::int32_t> used{0};
  parallelFor(
      shells_.cut().count(), kBricksPerTask,
      [&](std::size_t begin, std::size_t end) {
        View view;
        std::vector<float> planes;
        std::int32_t place = -1;
        for (std::size_t i = begin; i < end; ++i)
          for (const NearOwner& near : shells_.near().of(i)) {
            look(view, std::int32_t(i), near.owner, shells_.ownedBy(near.owner, std::int32_t(i)));
            std::int32_t& entry = tables[near.owner][shells_.brick(i).brick];
            if (view.kind != View::Kind::mixed) {
              entry = view.kind == View::Kind::inside ? PieceLevelSet::kInside : PieceLevelSet::kOutside;
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
      progress);
  std::vector<PieceLevelSet> levels;
  for (FlatBrickTable& table : tables) levels.emplace_back(h_, band_, std::move(table), samples);
  return levels;
}

}  // namespace nephele::detail
