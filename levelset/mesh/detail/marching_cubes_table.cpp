// The surface meets each face of a cell in segments between crossed edges. Each crossed edge ends one segment
// on both of its faces, so the segments of a cell link into closed loops, and a loop is filled with
// triangles. Neighbouring cells decide a face alike and so share its segments.
//
// A loop is filled by the shortest diagonals that do not lie in a face of the cell. A diagonal inside a face
// could be met by a diagonal of the neighbouring cell, and four triangles would share one edge; and three
// corners in one face make a triangle without area when samples differ little. Where no such filling exists
// the loop gets a centre point. Every loop becomes a disk. The trilinear interpolant can also hold a tunnel
// between two loops of one cell; such tunnels, always thinner than a voxel, are closed here.
#include "nephele/levelset/mesh/detail/marching_cubes_table.h"

#include <bit>
#include <limits>
#include <utility>

namespace nephele::detail {
namespace {

using Loop = std::vector<int>;

constexpr double kForbidden = std::numeric_limits<double>::infinity();

constexpr std::array<std::array<std::uint8_t, 4>, 6> makeFaceCorners() {
  std::array<std::array<std::uint8_t, 4>, 6> faces{};
  for (int axis = 0; axis < 3; ++axis) {
    const int u = 1 << (axis + 1) % 3;
    const int v = 1 << (axis + 2) % 3;
    const int side = 1 << axis;
    faces[2 * axis] = {0, std::uint8_t(v), std::uint8_t(u + v), std::uint8_t(u)};
    faces[2 * axis + 1] = {std::uint8_t(side), std::uint8_t(side + u), std::uint8_t(side + u + v),
                           std::uint8_t(side + v)};
  }
  return faces;
}

int edgeBetween(int cornerA, int cornerB) {
  const int axis = std::countr_zero(unsigned(cornerA ^ cornerB));
  const int start = cornerA & cornerB;
  return 4 * axis + (start >> (axis + 1) % 3 & 1) + 2 * (start >> (axis + 2) % 3 & 1);
}

bool isInside(unsigned signs, int corner) {
  return signs >> corner & 1;
}

unsigned findAmbiguousFaces(unsigned signs) {
  unsigned faces = 0;
  for (int f = 0; f < 6; ++f) {
    const auto& q = CellTable::faceCorners(f);
    const bool first = isInside(signs, q[0]);
    if (first == isInside(signs, q[2]) && first != isInside(signs, q[1]) && first != isInside(signs, q[3]))
      faces |= 1u << f;
  }
  return faces;
}

// On each face, walking counter-clockwise as seen from outside the cell, a segment leads from an edge where
// the walk comes inside to one where it goes outside. An edge is walked in opposite directions on its two
// faces, so that each segment's end is the start of exactly one other, and loops run counter-clockwise about
// the outward normal.
std::vector<Loop> traceLoops(unsigned signs, unsigned joinedFaces) {
  std::array<int, 12> next{};
  next.fill(-1);
  for (int f = 0; f < 6; ++f) {
    const auto& q = CellTable::faceCorners(f);
    const auto crosses = [&](int i) { return isInside(signs, q[i & 3]) != isInside(signs, q[(i + 1) & 3]); };
    const auto edge = [&](int i) { return edgeBetween(q[i & 3], q[(i + 1) & 3]); };
    const int step = joinedFaces >> f & 1 ? 3 : 1;
    for (int i = 0; i < 4; ++i) {
      if (!crosses(i) || isInside(signs, q[i])) continue;
      int exit = i + step;
      while (!crosses(exit)) exit += step;
      next[edge(i)] = edge(exit);
    }
  }
  std::vector<Loop> loops;
  for (int start = 0; start < 12; ++start) {
    Loop loop;
    for (int e = start; next[e] >= 0;) {
      loop.push_back(e);
      e = std::exchange(next[e], -1);
    }
    if (!loop.empty()) loops.push_back(loop);
  }
  return loops;
}

bool onFace(int edge, int face) {
  const int axis = face >> 1;
  return CellTable::edgeAxis(edge) != axis && (CellTable::edgeStart(edge) >> axis & 1) == (face & 1);
}

double diagonalCost(int edgeA, int edgeB) {
  for (int f = 0; f < 6; ++f) {
    if (onFace(edgeA, f) && onFace(edgeB, f)) return kForbidden;
  }
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto middle = [&](int e) {
      return CellTable::edgeAxis(e) == axis ? 0.5 : (CellTable::edgeStart(e) >> axis & 1);
    };
    squared += (middle(edgeA) - middle(edgeB)) * (middle(edgeA) - middle(edgeB));
  }
  return squared;
}

// Minimum-weight triangulation of the loop's corners first .. last by trying every third corner.
double fill(const Loop& loop, int first, int last, std::vector<std::uint8_t>* triangles) {
  if (last - first < 2) return 0;
  const auto side = [&](int i, int j) {
    const bool onLoop = j - i == 1 || (i == 0 && j == int(loop.size()) - 1);
    return onLoop ? 0 : diagonalCost(loop[i], loop[j]);
  };
  double best = kForbidden;
  int third = -1;
  for (int k = first + 1; k < last; ++k) {
    const double here = side(first, k) + side(k, last);
    if (here == kForbidden) continue;
    const double cost = here + fill(loop, first, k, nullptr) + fill(loop, k, last, nullptr);
    if (cost < best) {
      best = cost;
      third = k;
    }
  }
  if (triangles && third >= 0) {
    for (const int i : {first, third, last}) triangles->push_back(std::uint8_t(loop[i]));
    fill(loop, first, third, triangles);
    fill(loop, third, last, triangles);
  }
  return best;
}

}  // namespace

const std::array<std::uint8_t, 4>& CellTable::faceCorners(int face) {
  static constexpr auto kFaces = makeFaceCorners();
  return kFaces[face];
}

int CellTable::edgeStart(int edge) {
  const int axis = edge >> 2;
  return (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
}

const CellTable& CellTable::instance() {
  static const CellTable table;
  return table;
}

CellTable::CellTable() {
  for (unsigned signs = 0; signs < 256; ++signs) {
    const unsigned ambiguous = findAmbiguousFaces(signs);
    ambiguous_[signs] = std::uint8_t(ambiguous);
    firstPattern_[signs] = std::uint16_t(patterns_.size());
    for (unsigned choice = 0; choice < 1u << std::popcount(ambiguous); ++choice) {
      unsigned joined = 0;
      for (unsigned f = 0, bit = 0; f < 6; ++f) {
        if (ambiguous >> f & 1) joined |= (choice >> bit++ & 1) << f;
      }
      Pattern pattern;
      pattern.first = std::uint16_t(corners_.size());
      for (const Loop& loop : traceLoops(signs, joined)) {
        const int size = int(loop.size());
        if (fill(loop, 0, size - 1, &corners_) < kForbidden) continue;
        pattern.hasCentre = true;
        for (int i = 0; i < size; ++i) {
          corners_.insert(corners_.end(),
                          {std::uint8_t(loop[i]), std::uint8_t(loop[(i + 1) % size]), kCentre});
        }
      }
      pattern.triangleCount = std::uint8_t((corners_.size() - pattern.first) / 3);
      patterns_.push_back(pattern);
    }
  }
}

const CellTable::Pattern& CellTable::pattern(unsigned signs, unsigned joinedFaces) const {
  unsigned choice = 0;
  unsigned bit = 0;
  for (unsigned rest = ambiguous_[signs]; rest; rest &= rest - 1) {
    choice |= (joinedFaces >> std::countr_zero(rest) & 1) << bit++;
  }
  return patterns_[firstPattern_[signs] + choice];
}

}  // namespace nephele::detail
