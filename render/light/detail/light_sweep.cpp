// Sweeps: for each of a few directions light is carried slice by slice through the lattice, read between the
// nodes of the slice before. A cell of optical depth t and own light S per optical depth lets through I
// exp(-t) + S (1 - exp(-t)), and holds S + (I - S) (1 - exp(-t)) / t on average: what it takes and gives away
// is what these differ by, so that no light is lost. S comes from the moments of all light in the cell, and
// every direction adds to these. Rows of a slice are shared out among threads; each is added to in a fixed
// order.
#include "nephele/render/light/detail/light_sweep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele::detail {

namespace {

constexpr int kRow = ScatteringLattice::kRow;

// Lattices with fewer cells are swept by a thread per axis: waiting for each other after every slice would
// take longer than the work.
constexpr std::size_t kSmall = 1 << 16;

// Calls each(plain, turned) with the index of every cell of `count` lattices, where x is the first axis and
// where y is. Cells that lie near each other either way follow each other.
template <class Each>
void forEachTurned(const Vec3i& n, std::size_t count, Each&& each) {
  const std::size_t nx = std::size_t(n.x), ny = std::size_t(n.y), nz = std::size_t(n.z);
  parallelFor(nz * count, std::max<std::size_t>(4, kSmall / (nx * ny)),
              [&](std::size_t begin, std::size_t end) {
                for (std::size_t slice = begin; slice != end; ++slice) {
                  const std::size_t z = slice % nz, first = slice / nz * nx * ny * nz;
                  for (std::size_t y0 = 0; y0 != ny; y0 += kRow)
                    for (std::size_t x0 = 0; x0 != nx; x0 += kRow)
                      for (std::size_t y = y0; y != y0 + kRow; ++y)
                        for (std::size_t x = x0; x != x0 + kRow; ++x)
                          each(first + (z * ny + y) * nx + x, first + (x * nz + z) * ny + y);
                }
              });
}

// Copies lattices whose first axis is x to ones whose first axis is y.
void turn(const float* from, float* to, const Vec3i& n, std::size_t count = 1) {
  forEachTurned(n, count, [=](std::size_t plain, std::size_t turned) { to[turned] = from[plain]; });
}

// Adds what was turned, and what lies as it did, to `to`.
void addTurned(const float* turned, const float* plain, float* to, const Vec3i& n, std::size_t count) {
  forEachTurned(n, count, [=](std::size_t i, std::size_t t) { to[i] = to[i] + plain[i] + turned[t]; });
}

}  // namespace

LightSweep::LightSweep(const ScatteringLattice& lattice, float extinction, const std::vector<float>& phase,
                       const std::vector<Ordinate>& ordinates, const std::vector<float>& inflow,
                       const std::vector<std::uint8_t>& needed)
    : lattice_(lattice),
      extinction_(extinction),
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
    std::size_t length = 0;
    while (length != lengths_.size() && lengths_[length] != 1 / size[axis]) ++length;
    if (length == lengths_.size()) lengths_.push_back(1 / size[axis]);
    for (const bool rises : {false, true}) {
      Group group{axis, rises, length, {}};
      std::size_t count = 0;
      for (std::size_t i = first; i != first + 8; ++i)
        if ((ordinates[i].way[axis] > 0) == rises) group.ordinates[count++] = i;
      groups_.push_back(group);
    }
  }
  addLayout(lattice.density, needed, lattice.size, plain_);
  const Vec3i n = lattice.size;
  std::vector<float> density(lattice.density.size()), floats(needed.begin(), needed.end()),
      turnedNeeded(needed.size());
  turn(lattice.density.data(), density.data(), n);
  turn(floats.data(), turnedNeeded.data(), n);
  addLayout(density, {turnedNeeded.begin(), turnedNeeded.end()}, {n.y, n.z, n.x}, turned_);
  turnedMoments_.resize(momentCount_ * density.size());
  turnedSums_.resize(momentCount_ * density.size());
  sidewaysSums_.resize(momentCount_ * density.size());
}

void LightSweep::addLayout(const std::vector<float>& density, const std::vector<std::uint8_t>& needed,
                           const Vec3i& size, Layout& layout) const {
  layout.size = size;
  for (const float length : lengths_) {
    std::vector<float>&taken = layout.taken.emplace_back(density.size()),
    &mean = layout.mean.emplace_back(density.size()),
    &takenSlope = layout.takenSlope.emplace_back(density.size()),
    &meanSlope = layout.meanSlope.emplace_back(density.size());
    const float perDensity = extinction_ * length;
    parallelFor(density.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) {
        const float depth = std::min(perDensity * density[i], 80.0f);
        // (1 - exp(-depth)) / depth, by its series where the difference would lose its digits.
        const float thin = 1 - depth * (0.5f - depth * (1.0f / 6));
        mean[i] = depth < 0.03f ? thin : (1 - expOfMinus(depth)) / depth;
        taken[i] = depth * mean[i];
        takenSlope[i] =
            depth < 0.1f ? depth * depth * (1.0f / 12 - depth * (1.0f / 24)) : 1 - mean[i] - 0.5f * taken[i];
        meanSlope[i] = depth < 0.1f ? depth * (1.0f / 12 - depth * (1.0f / 24)) : takenSlope[i] / depth;
      }
    });
  }
  const std::size_t rows = density.size() / std::size_t(size.x);
  layout.active.resize(rows);
  for (std::size_t row = 0; row != rows; ++row) {
    int begin = size.x, end = 0;
    for (int x = 0; x != size.x; ++x)
      if (const std::size_t i = row * std::size_t(size.x) + std::size_t(x); needed[i] || density[i] > 0)
        begin = std::min(begin, x), end = x + 1;
    if (begin >= end) begin = end = 0;
    layout.active[row] = {std::uint16_t(begin / kRow * kRow), std::uint16_t((end + kRow - 1) / kRow * kRow)};
  }
}

void LightSweep::sweep(const std::vector<float>& moments, std::vector<float>& result, bool hasInflow) {
  turn(moments.data(), turnedMoments_.data(), lattice_.size, momentCount_);
  findSlopes(moments);
  std::vector<float>* const sums[3] = {&turnedSums_, &sidewaysSums_, &result};
  const auto carryAlong = [&](std::size_t begin, std::size_t end) {
    for (std::size_t axis = begin; axis != end; ++axis) {
      std::fill(sums[axis]->begin(), sums[axis]->end(), 0.0f);
      for (const Group& group : groups_)
        if (group.axis == int(axis))
          carry(group, axis == 0 ? turnedMoments_ : moments, *sums[axis], hasInflow);
    }
  };
  if (lattice_.density.size() < kSmall)
    parallelFor(3, 1, carryAlong);
  else
    carryAlong(0, 3);
  addTurned(turnedSums_.data(), sidewaysSums_.data(), result.data(), lattice_.size, momentCount_);
}

// Central differences of the first moment; one-sided where a neighbour holds nothing.
void LightSweep::findSlopes(const std::vector<float>& moments) {
  const Vec3i n = lattice_.size;
  const std::size_t strides[3] = {1, std::size_t(n.x), std::size_t(n.x) * std::size_t(n.y)};
  for (int axis = 0; axis != 3; ++axis) {
    std::vector<float>& slopes = plain_.slopes[axis];
    slopes.resize(lattice_.density.size());
    parallelFor(std::size_t(n.z), std::max<std::size_t>(4, kSmall / strides[2]),
                [&](std::size_t begin, std::size_t end) {
                  for (int z = int(begin); z != int(end); ++z)
                    for (int y = 0; y != n.y; ++y)
                      for (int x = 0; x != n.x; ++x) {
                        const std::size_t i = lattice_.index(x, y, z);
                        slopes[i] = 0;
                        if (!(lattice_.density[i] > 0)) continue;
                        const int at = axis == 0 ? x : axis == 1 ? y : z;
                        float sum = 0, count = 0;
                        if (at > 0 && lattice_.density[i - strides[axis]] > 0)
                          sum += moments[i] - moments[i - strides[axis]], count += 1;
                        if (at + 1 < n[axis] && lattice_.density[i + strides[axis]] > 0)
                          sum += moments[i + strides[axis]] - moments[i], count += 1;
                        if (count > 0) slopes[i] = sum / count;
                      }
                });
    turned_.slopes[axis].resize(slopes.size());
    turn(slopes.data(), turned_.slopes[axis].data(), n);
  }
}

void LightSweep::carry(const Group& group, const std::vector<float>& moments, std::vector<float>& sums,
                       bool hasInflow) const {
  const Layout& layout = group.axis == 0 ? turned_ : plain_;
  // Axes along a row, from row to row and from slice to slice.
  const int u = group.axis == 0 ? 1 : 0, v = group.axis == 2 ? 1 : 2, w = group.axis;
  const Vec3i n = lattice_.size;
  const int width = n[u], height = n[v], slices = n[w];
  const std::size_t line = std::size_t(layout.size.x), plane = line * std::size_t(layout.size.y);
  const std::size_t rowStride = group.axis == 1 ? plane : line, sliceStride = group.axis == 1 ? line : plane;
  // Slices have a rim of cells through which light comes in.
  constexpr int rim = 1;
  const std::size_t planeStride = std::size_t(width + 2 * rim + kRow);
  SliceWork work;
  work.width = width;
  work.rowStride = rowStride;
  work.momentStride = lattice_.density.size();
  work.momentCount = int(momentCount_);
  work.planeStride = planeStride;
  work.activeStride = rowStride / line;
  std::array<std::vector<float>, 4> before, here;
  std::size_t offsets[4];
  for (std::size_t k = 0; k != 4; ++k) {
    const std::size_t ordinate = group.ordinates[k];
    const Vec3f way = ordinates_[ordinate].way;
    before[k].assign(planeStride * std::size_t(height + 2 * rim), hasInflow ? inflow_[ordinate] : 0.0f);
    here[k] = before[k];
    const float du = -way[u] / std::fabs(way[w]), dv = -way[v] / std::fabs(way[w]);
    const int iu = std::min(int(std::floor(du)), 0), iv = std::min(int(std::floor(dv)), 0);
    const float fu = du - float(iu), fv = dv - float(iv);
    const float shares[4] = {(1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv};
    std::copy_n(shares, 4, work.ways[k].shares);
    const float perCell = scattered_ / std::fabs(way[w]);
    work.ways[k].slopes[0] = perCell * way[u];
    work.ways[k].slopes[1] = perCell * way[v];
    work.ways[k].slopes[2] = perCell * way[w];
    offsets[k] = std::size_t(iv + rim) * planeStride + std::size_t(iu + rim);
    for (std::size_t m = 0; m != momentCount_; ++m) {
      work.source[m][k] = sources_[ordinate][m];
      work.sum[m][k] = sums_[ordinate][m];
    }
  }
  const std::size_t grain = lattice_.density.size() < kSmall
                                ? std::size_t(height)
                                : std::max<std::size_t>(1, 4096 / std::size_t(width));
  for (int slice = 0; slice != slices; ++slice) {
    const std::size_t first = std::size_t(group.rises ? slice : slices - 1 - slice) * sliceStride;
    work.taken = layout.taken[group.length].data() + first;
    work.mean = layout.mean[group.length].data() + first;
    work.takenSlope = layout.takenSlope[group.length].data() + first;
    work.meanSlope = layout.meanSlope[group.length].data() + first;
    work.slopes[0] = layout.slopes[u].data() + first;
    work.slopes[1] = layout.slopes[v].data() + first;
    work.slopes[2] = layout.slopes[w].data() + first;
    work.moments = moments.data() + first;
    work.sums = sums.data() + first;
    work.active = layout.active.data() + first / line;
    for (std::size_t k = 0; k != 4; ++k) {
      work.ways[k].before = before[k].data() + offsets[k];
      work.ways[k].here = here[k].data() + rim * planeStride + rim;
    }
    parallelFor(std::size_t(height), grain, [&](std::size_t begin, std::size_t end) {
      SliceWork rows = work;
      rows.rowBegin = int(begin);
      rows.rowEnd = int(end);
      carrySlice(rows);
    });
    std::swap(before, here);
  }
}

}  // namespace nephele::detail
