// Sweeps: for each of a few directions light is carried slice by slice through the lattice, read between the
// nodes of the slice before, by cubics, since linear interpolation would spread it by half a cell per slice:
// first along rows, when they are written, then across. A cell of optical depth t and own light S per optical
// depth lets through I exp(-t) + S (1 - exp(-t)), and holds S + (I - S) (1 - exp(-t)) / t on average: what it
// takes and gives away is what these differ by, so that no light is lost. S comes from the moments of all
// light in the cell, and every direction adds to these. Rows of a slice are shared out among threads; each is
// added to in a fixed order.
#include "nephele/render/light/detail/light_sweep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr int kVector = CellRows::kVector;

// Lattices with fewer cells are swept by a thread per axis: waiting for each other after every slice would
// take longer than the work.
constexpr std::size_t kSmall = 1 << 16;

// Calls each(rows, turned rows) for all squares of cells, as often as they have values: where the values of
// its rows are in `from`, and those of its turned rows in `to`, null where none are kept.
template <class From, class To, class Each>
void forEachSquare(const CellRows& plain, From* from, const CellRows& turned, To* to, std::size_t moments,
                   Each&& each) {
  const Vec3i n = plain.size();
  parallelFor(std::size_t(n.z), 4, [&](std::size_t begin, std::size_t end) {
    for (int z = int(begin); z != int(end); ++z)
      for (int y = 0; y != n.y; y += kVector)
        for (int x = 0; x != n.x; x += kVector) {
          From* rows[kVector];
          To* turnedRows[kVector];
          bool some = false;
          for (int i = 0; i != kVector; ++i) {
            const CellRows::Row &row = plain.row(y + i, z), &other = turned.row(z, x + i);
            rows[i] =
                row.holds(x) ? from + CellRows::momentsAt(std::size_t(row.first + x), moments) : nullptr;
            turnedRows[i] =
                other.holds(y) ? to + CellRows::momentsAt(std::size_t(other.first + y), moments) : nullptr;
            some = some || rows[i];
          }
          for (std::size_t m = 0; some && m != moments; ++m) {
            each(rows, turnedRows);
            for (int i = 0; i != kVector; ++i) {
              if (rows[i]) rows[i] += kVector;
              if (turnedRows[i]) turnedRows[i] += kVector;
            }
          }
        }
  });
}

// What four values in a row count for at the place f between the middle two: Lagrange's interpolation.
std::array<float, 4> cubic(float f) {
  const float g = 1 - f;
  return {-f * g * (1 + g) / 6, g * (1 + f) * (1 + g) / 2, f * (1 + f) * (1 + g) / 2, -f * g * (1 + f) / 6};
}

// Copies the values of cells to those that are turned.
void turn(const CellRows& plain, const float* from, const CellRows& turned, float* to, std::size_t moments) {
  forEachSquare(plain, from, turned, to, moments,
                [](const float* const(&rows)[kVector], float* const(&others)[kVector]) {
                  turnSquare(rows, others, false);
                });
}

}  // namespace

LightSweep::LightSweep(const CellRows& rows, const std::vector<float>& density, float extinction,
                       const std::vector<float>& phase, const std::vector<Ordinate>& ordinates,
                       const std::vector<float>& inflow)
    : extinction_(extinction),
      ordinates_(ordinates),
      inflow_(inflow),
      momentCount_(phase.size() * phase.size()),
      scattered_(phase[0]) {
  const int degree = int(phase.size()) - 1;
  for (const Ordinate& ordinate : ordinates) {
    std::array<float, kMostMoments> source{}, sum{};
    harmonics(ordinate.way, degree, sum.data());
    for (std::size_t m = 0; m != momentCount_; ++m) {
      source[m] = phase[std::size_t(degreeOf(int(m)))] * sum[m];
      sum[m] *= ordinate.weight;
    }
    sources_.push_back(source);
    sums_.push_back(sum);
  }
  // The eight mirror images of a direction follow each other.
  for (std::size_t first = 0; first != ordinates.size(); first += 8) {
    const Vec3f way = ordinates[first].way;
    const float size[3] = {std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)};
    int axis = 2;
    for (int a = 0; a != 3; ++a)
      // Where two are the longest, so that each axis has as many.
      if (size[a] > size[axis] ||
          (size[a] == size[axis] && size[(a + 1) % 3] == size[axis] && size[(a + 2) % 3] < size[axis]))
        axis = a;
    for (const bool rises : {false, true}) {
      Group group{axis, rises, 1 / size[axis], {}};
      std::size_t count = 0;
      for (std::size_t i = first; i != first + 8; ++i)
        if ((ordinates[i].way[axis] > 0) == rises) group.ordinates[count++] = i;
      groups_.push_back(group);
    }
  }
  const Vec3i n = rows.size();
  std::vector<std::uint8_t> matters(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z));
  rows.forEachRow([&](int y, int z, const CellRows::Row& row) {
    for (int x = row.begin; x != row.end; ++x)
      matters[std::size_t((x * n.z + z)) * std::size_t(n.y) + std::size_t(y)] = 1;
  });
  turnedRows_ = CellRows({n.y, n.z, n.x}, matters);
  turnedDensity_.resize(turnedRows_.count());
  turn(rows, density.data(), turnedRows_, turnedDensity_.data(), 1);
  plain_ = {&rows, &density, {}};
  turned_ = {&turnedRows_, &turnedDensity_, {}};
  // Squares of which nothing is kept are not turned.
  resizeLarge(turnedMoments_, momentCount_ * turnedRows_.count());
  std::fill(turnedMoments_.begin(), turnedMoments_.end(), 0.0f);
  resizeLarge(turnedSums_, turnedMoments_.size());
  if (rows.count() < kSmall) sidewaysSums_.resize(momentCount_ * rows.count());
}

void LightSweep::sweep(const Moments& moments, Moments& result, bool hasInflow) {
  const CellRows& rows = *plain_.rows;
  turn(rows, moments.data(), turnedRows_, turnedMoments_.data(), momentCount_);
  findSlopes(moments);
  const bool isSmall = rows.count() < kSmall;
  Moments* const sums[3] = {&turnedSums_, isSmall ? &sidewaysSums_ : &result, &result};
  const auto carryAlong = [&](std::size_t begin, std::size_t end) {
    for (std::size_t axis = begin; axis != end; ++axis) {
      // Those along y and z are added up in one place, unless that is done at the same time.
      if (axis != 2 || isSmall) std::fill(sums[axis]->begin(), sums[axis]->end(), 0.0f);
      for (const bool rises : {false, true})
        carry(int(axis), rises, axis == 0 ? turnedMoments_ : moments, *sums[axis], hasInflow);
    }
  };
  if (isSmall)
    parallelFor(3, 1, carryAlong);
  else
    carryAlong(0, 3);
  if (isSmall)
    for (std::size_t i = 0; i != result.size(); ++i) result[i] += sidewaysSums_[i];
  forEachSquare(
      rows, result.data(), turnedRows_, static_cast<const float*>(turnedSums_.data()), momentCount_,
      [](float* const(&to)[kVector], const float* const(&from)[kVector]) { turnSquare(from, to, true); });
}

// Central differences of the first moment; one-sided where a neighbour holds nothing.
void LightSweep::findSlopes(const Moments& moments) {
  const CellRows& rows = *plain_.rows;
  const std::vector<float>& density = *plain_.density;
  for (std::vector<float>& slopes : plain_.slopes) slopes.resize(rows.count());
  const auto first = [&](std::size_t cell) { return moments[CellRows::momentsAt(cell, momentCount_)]; };
  rows.forEachRow([&](int y, int z, const CellRows::Row& row) {
    const auto holds = [&](const CellRows::Row* there, int x) {
      return there && there->holds(x) && density[std::size_t(there->first + x)] > 0;
    };
    const auto rowAt = [&](int j, int k) {
      return j >= 0 && k >= 0 && j != rows.size().y && k != rows.size().z ? &rows.row(j, k) : nullptr;
    };
    const CellRows::Row* const neighbours[3][2] = {
        {&row, &row}, {rowAt(y - 1, z), rowAt(y + 1, z)}, {rowAt(y, z - 1), rowAt(y, z + 1)}};
    for (int x = row.begin; x != row.end; ++x) {
      const std::size_t i = std::size_t(row.first + x);
      const bool isSolid = density[i] > 0;
      for (int axis = 0; axis != 3; ++axis) {
        const int step = axis == 0;
        const auto [before, behind] = neighbours[axis];
        float sum = 0, count = 0;
        if (isSolid && holds(before, x - step))
          sum += first(i) - first(std::size_t(before->first + x - step)), count += 1;
        if (isSolid && holds(behind, x + step))
          sum += first(std::size_t(behind->first + x + step)) - first(i), count += 1;
        plain_.slopes[axis][i] = count > 0 ? sum / count : 0.0f;
      }
    }
  });
  for (int axis = 0; axis != 3; ++axis) {
    turned_.slopes[axis].resize(turnedRows_.count());
    turn(rows, plain_.slopes[axis].data(), turnedRows_, turned_.slopes[axis].data(), 1);
  }
}

// Of four directions: what they do with a slice, and what goes through the slice before and this one.
struct LightSweep::Wave {
  SliceWork work;
  std::array<std::vector<float>, 4> before, here;
  std::size_t offsets[4];
  float inflow[4];
};

LightSweep::Wave LightSweep::wave(const Group& group, const Moments& moments, Moments& sums,
                                  bool hasInflow) const {
  const Layout& layout = group.axis == 0 ? turned_ : plain_;
  // Axes along a row, from row to row and from slice to slice.
  const int u = group.axis == 0 ? 1 : 0, v = group.axis == 2 ? 1 : 2, w = group.axis;
  const Vec3i n = plain_.rows->size();
  const std::size_t planeStride = std::size_t(n[u]);
  Wave wave;
  SliceWork& work = wave.work;
  work.width = n[u];
  work.rowStride = group.axis == 1 ? std::size_t(layout.rows->size().y) : 1;
  work.density = layout.density->data();
  work.depthPerDensity = extinction_ * group.length;
  work.slopes[0] = layout.slopes[u].data();
  work.slopes[1] = layout.slopes[v].data();
  work.slopes[2] = layout.slopes[w].data();
  work.moments = moments.data();
  work.sums = sums.data();
  work.momentCount = momentCount_;
  work.planeStride = planeStride;
  for (std::size_t k = 0; k != 4; ++k) {
    const std::size_t ordinate = group.ordinates[k];
    const Vec3f way = ordinates_[ordinate].way;
    wave.inflow[k] = hasInflow ? inflow_[ordinate] : 0.0f;
    wave.before[k].assign(planeStride * std::size_t(n[v] + 2 * SliceWork::kRim), wave.inflow[k]);
    wave.here[k] = wave.before[k];
    const float du = -way[u] / std::fabs(way[w]), dv = -way[v] / std::fabs(way[w]);
    const int iu = std::min(int(std::floor(du)), 0), iv = std::min(int(std::floor(dv)), 0);
    work.ways[k].first = iu - 1;
    work.ways[k].along = cubic(du - float(iu));
    work.ways[k].across = cubic(dv - float(iv));
    const float perCell = scattered_ / std::fabs(way[w]);
    work.ways[k].slopes[0] = perCell * way[u];
    work.ways[k].slopes[1] = perCell * way[v];
    work.ways[k].slopes[2] = perCell * way[w];
    wave.offsets[k] = std::size_t(iv - 1 + SliceWork::kRim) * planeStride;
  }
  const std::size_t first = group.ordinates[0];
  int count = 0;
  for (int kind = 0; kind != 4; ++kind) {
    for (std::size_t m = 0; m != momentCount_; ++m)
      if (isOdd(int(m), u) == (kind % 2 == 1) && isOdd(int(m), v) == (kind / 2 == 1))
        work.parts[std::size_t(count++)] = {m * kVector, sources_[first][m], sums_[first][m]};
    work.ends[std::size_t(kind)] = count;
  }
  return wave;
}

// All directions that rise along an axis, or fall, go through a slice while it is in the cache.
void LightSweep::carry(int axis, bool rises, const Moments& moments, Moments& sums, bool hasInflow) const {
  std::vector<Wave> waves;
  for (const Group& group : groups_)
    if (group.axis == axis && group.rises == rises) waves.push_back(wave(group, moments, sums, hasInflow));
  const CellRows& rows = axis == 0 ? turnedRows_ : *plain_.rows;
  const Vec3i n = plain_.rows->size();
  const int height = n[axis == 2 ? 1 : 2], slices = n[axis];
  const std::size_t sliceStride = axis == 1 ? 1 : std::size_t(rows.size().y);
  const std::size_t grain = rows.count() < kSmall
                                ? std::size_t(height)
                                : std::max<std::size_t>(1, 4096 / std::size_t(waves[0].work.width));
  for (int slice = 0; slice != slices; ++slice) {
    for (Wave& wave : waves) {
      wave.work.rows = rows.rows().data() + std::size_t(rises ? slice : slices - 1 - slice) * sliceStride;
      for (std::size_t k = 0; k != 4; ++k) {
        wave.work.ways[k].before = wave.before[k].data() + wave.offsets[k];
        wave.work.ways[k].here = wave.here[k].data() + SliceWork::kRim * wave.work.planeStride;
      }
    }
    parallelFor(std::size_t(height), grain, [&](std::size_t begin, std::size_t end) {
      const std::size_t length = std::size_t(waves[0].work.width + 2 * SliceWork::kRim);
      std::vector<float> carried(4 * length);
      for (Wave& wave : waves) {
        SliceWork work = wave.work;
        for (std::size_t k = 0; k != 4; ++k) {
          work.ways[k].row = carried.data() + k * length;
          std::fill_n(work.ways[k].row, length, wave.inflow[k]);
        }
        work.rowBegin = int(begin);
        work.rowEnd = int(end);
        carrySlice(work);
      }
    });
    for (Wave& wave : waves) std::swap(wave.before, wave.here);
  }
}

}  // namespace nephele::detail
