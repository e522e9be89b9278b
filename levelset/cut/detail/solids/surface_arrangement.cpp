// Bringing surfaces together.
//
// Pairs of triangles whose boxes meet are found by walking two trees at once. For each pair exact predicates
// on the given points tell which edge of one passes through the other, what only touches and what lies in one
// plane. The points of all pairs are numbered by their places. They split edges, and join to segments across
// faces; segments of a face that cross are split by a point of three planes. Each face that has any is then
// triangulated with its segments as constraints, from rounded points if that does not make them cross, else
// from exact ones.
//
// Two facets in one plane have the same vertices at last: both faces hold each other's outline as segments,
// and are triangulated from exact points after the same shear, so that no four points of a rectangle are on
// one circle.
#include "nephele/levelset/cut/detail/solids/surface_arrangement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "nephele/levelset/cut/detail/solids/meeting_points.h"
#include "nephele/levelset/cut/detail/solids/split_triangles.h"
#include "nephele/levelset/cut/detail/solids/triangle_pairs.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Edge = PointPair;

struct Segment {
  std::uint32_t from, to;
  std::uint32_t other;
  Edge edge;
};

class Arranger {
 public:
  Arranger(const Surfaces& surfaces, const Progress& progress)
      : given_(surfaces),
        progress_(progress),
        triangles_(surfaces),
        points_(surfaces.positions, surfaces.triangles) {}

  Arrangement run() {
    const auto pairs = findPairs();
    meet(pairs);
    crossSegments();
    return split();
  }

 private:
  // --- what is given ---

  std::uint32_t surfaceOf(std::uint32_t triangle) const {
    const auto after = std::upper_bound(given_.start.begin(), given_.start.end(), triangle);
    return std::uint32_t(after - given_.start.begin()) - 1;
  }

  std::vector<std::pair<std::uint32_t, std::uint32_t>> findPairs() const {
    const std::size_t count = given_.start.size() - 1;
    std::vector<std::unique_ptr<TriangleTree>> trees(count);
    parallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t s = begin; s < end; ++s)
        trees[s] = std::make_unique<TriangleTree>(given_.positions, given_.triangles, given_.start[s],
                                                  given_.start[s + 1]);
    });
    std::vector<std::pair<std::size_t, std::size_t>> work;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < count; ++j) work.emplace_back(i, j);
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> found(work.size());
    parallelFor(
        work.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t k = begin; k < end; ++k)
            trees[work[k].first]->findPairs(*trees[work[k].second], found[k]);
        },
        progress_);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (auto& list : found) {
      pairs.insert(pairs.end(), list.begin(), list.end());
      list = {};
    }
    return pairs;
  }

  // --- all pairs ---

  void meet(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
    constexpr std::size_t kGroup = 512;
    std::vector<TriangleMeetings> groups((pairs.size() + kGroup - 1) / kGroup);
    parallelFor(
        groups.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t g = begin; g < end; ++g)
            for (std::size_t i = g * kGroup; i < std::min(pairs.size(), (g + 1) * kGroup); ++i)
              triangles_.meet(groups[g], pairs[i].first, pairs[i].second);
        },
        progress_);
    std::vector<Meeting> meetings;
    std::vector<TriangleContact> contacts;
    for (TriangleMeetings& group : groups) {
      const auto offset = std::uint32_t(meetings.size());
      meetings.insert(meetings.end(), group.meetings.begin(), group.meetings.end());
      for (EdgePoint& p : group.edgePoints) {
        p.point += offset;
        edgePoints_.push_back(p);
      }
      for (TriangleContact& c : group.contacts) {
        c.first += offset;
        contacts.push_back(c);
      }
      group = {};
    }
    const std::vector<std::uint32_t> numbers = points_.add(meetings);

    for (EdgePoint& p : edgePoints_) p.point = numbers[p.point];
    std::erase_if(edgePoints_,
                  [](const EdgePoint& p) { return p.point == p.edge[0] || p.point == p.edge[1]; });
    sortEdgePoints();

    inPlane_.resize(given_.triangles.size());
    for (const TriangleContact& c : contacts) {
      std::vector<std::uint32_t> ends(numbers.begin() + c.first, numbers.begin() + c.first + c.count);
      std::sort(ends.begin(), ends.end());
      ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
      if (c.edge[0] != kNoPoint) inPlane_[c.triangle] = true;
      if (ends.size() < 2) continue;
      if (ends.size() > 2) keepFarthest(ends);
      segments_.push_back({c.triangle, {ends[0], ends[1], c.other, c.edge}});
    }
    std::erase_if(segments_, [&](const auto& s) { return isAlongSide(s.first, s.second); });
    std::stable_sort(segments_.begin(), segments_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  }

  /// Whether a segment is part of the outline of its triangle, which has its points as it is.
  bool isAlongSide(std::uint32_t triangle, const Segment& segment) const {
    const TriangleIndices& t = given_.triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = ordered(t[k], t[(k + 1) % 3]);
      const auto isOn = [&](std::uint32_t p) {
        const auto points = pointsOf(edge);
        return p == edge[0] || p == edge[1] ||
               std::any_of(points.begin(), points.end(), [&](const EdgePoint& e) { return e.point == p; });
      };
      if (isOn(segment.from) && isOn(segment.to)) return true;
    }
    return false;
  }

  /// Along an edge in the plane of a triangle there may be points between the ends.
  void keepFarthest(std::vector<std::uint32_t>& ends) const {
    std::pair farthest(ends[0], ends[1]);
    double most = -1;
    for (const std::uint32_t i : ends)
      for (const std::uint32_t j : ends) {
        const Vec3d d = points_.position(i) - points_.position(j);
        if (i == j || dot(d, d) <= most) continue;
        most = dot(d, d);
        farthest = {i, j};
      }
    points_.sortAlong(farthest.first, farthest.second, ends);
    ends = {ends.front(), ends.back()};
  }

  /// By edge, from its lower vertex on.
  void sortEdgePoints() {
    std::sort(edgePoints_.begin(), edgePoints_.end());
    edgePoints_.erase(std::unique(edgePoints_.begin(), edgePoints_.end()), edgePoints_.end());
    for (auto i = edgePoints_.begin(); i != edgePoints_.end();) {
      const Edge edge = i->edge;
      const auto end = std::find_if(i, edgePoints_.end(), [&](const EdgePoint& p) { return p.edge != edge; });
      if (end - i > 1) {
        std::vector<std::uint32_t> sorted;
        for (auto k = i; k != end; ++k) sorted.push_back(k->point);
        points_.sortAlong(edge[0], edge[1], sorted);
        for (const std::uint32_t point : sorted) (i++)->point = point;
      }
      i = end;
    }
    isOnSplitEdge_.assign(given_.positions.size(), false);
    for (const EdgePoint& p : edgePoints_) isOnSplitEdge_[p.edge[0]] = isOnSplitEdge_[p.edge[1]] = true;
  }

  std::span<const EdgePoint> pointsOf(const Edge& edge) const {
    if (!isOnSplitEdge_[edge[0]] || !isOnSplitEdge_[edge[1]]) return {};
    const auto begin = std::lower_bound(edgePoints_.begin(), edgePoints_.end(), edge,
                                        [](const EdgePoint& p, const Edge& e) { return p.edge < e; });
    const auto end =
        std::find_if(begin, edgePoints_.end(), [&](const EdgePoint& p) { return p.edge != edge; });
    return {begin, end};
  }

  // --- one face ---

  /// A face to be split.
  struct Task {
    std::uint32_t triangle;
    std::span<const std::pair<std::uint32_t, Segment>> segments;
  };

  /// A point inside a segment: which of the face's segments, and an index of a meeting or a number.
  struct Break {
    std::uint32_t segment, point;
  };

  std::vector<Task> findTasks() const {
    std::vector<Task> tasks;
    auto begin = segments_.begin();
    for (std::uint32_t t = 0; t < given_.triangles.size(); ++t) {
      auto end = begin;
      while (end != segments_.end() && end->first == t) ++end;
      bool isSplit = end != begin;
      const TriangleIndices& v = given_.triangles[t];
      for (std::size_t k = 0; k < 3 && !isSplit; ++k)
        isSplit = !pointsOf(ordered(v[k], v[(k + 1) % 3])).empty();
      if (isSplit) tasks.push_back({t, {begin, end}});
      begin = end;
    }
    return tasks;
  }

  void crossSegments() {
    tasks_ = findTasks();
    std::vector<std::vector<Meeting>> meetings(tasks_.size());
    breaks_.resize(tasks_.size());
    parallelFor(
        tasks_.size(), 64,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) crossSegments(tasks_[i], meetings[i], breaks_[i]);
        },
        progress_);
    std::vector<Meeting> all;
    std::vector<std::uint32_t> offsets;
    for (const auto& list : meetings) {
      offsets.push_back(std::uint32_t(all.size()));
      all.insert(all.end(), list.begin(), list.end());
    }
    const std::vector<std::uint32_t> numbers = points_.add(all);
    for (std::size_t i = 0; i < breaks_.size(); ++i)
      for (Break& b : breaks_[i])
        b.point = b.point & kKnown ? b.point & ~kKnown : numbers[offsets[i] + b.point];
  }

  /// Marks a number in a break before all are numbers.
  static constexpr std::uint32_t kKnown = 0x80000000u;

  void crossSegments(const Task& task, std::vector<Meeting>& meetings, std::vector<Break>& breaks) const {
    const auto& list = task.segments;
    if (list.size() < 2) return;
    const FlatAxis axis = triangles_.axis(task.triangle);
    const int u = firstCoordinate(axis), v = secondCoordinate(axis);
    struct Extent {
      std::uint32_t segment;
      double lowU, highU, lowV, highV;
    };
    std::vector<Extent> extents;
    for (std::uint32_t i = 0; i < list.size(); ++i) {
      const Vec3d &p = points_.position(list[i].second.from), &q = points_.position(list[i].second.to);
      const double margin = 1e-13 * (std::abs(p[u]) + std::abs(p[v]) + std::abs(q[u]) + std::abs(q[v]));
      extents.push_back({i, std::min(p[u], q[u]) - margin, std::max(p[u], q[u]) + margin,
                         std::min(p[v], q[v]) - margin, std::max(p[v], q[v]) + margin});
    }
    std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) {
      return a.lowU != b.lowU ? a.lowU < b.lowU : a.segment < b.segment;
    });
    for (std::size_t i = 0; i < extents.size(); ++i)
      for (std::size_t j = i + 1; j < extents.size() && extents[j].lowU <= extents[i].highU; ++j)
        if (extents[j].lowV <= extents[i].highV && extents[i].lowV <= extents[j].highV)
          crossPair(task, axis, extents[i].segment, extents[j].segment, meetings, breaks);
  }

  void crossPair(const Task& task, FlatAxis axis, std::uint32_t i, std::uint32_t j,
                 std::vector<Meeting>& meetings, std::vector<Break>& breaks) const {
    const Segment &a = task.segments[i].second, &b = task.segments[j].second;
    const int from = points_.side(axis, a.from, a.to, b.from), to = points_.side(axis, a.from, a.to, b.to);
    if (from * to > 0) return;
    const int back = points_.side(axis, b.from, b.to, a.from), ahead = points_.side(axis, b.from, b.to, a.to);
    if (back * ahead > 0) return;
    if (from * to < 0 && back * ahead < 0) {
      if (surfaceOf(a.other) == surfaceOf(b.other)) refuseCrossing(a);
      const bool aInPlane = a.edge[0] != kNoPoint, bInPlane = b.edge[0] != kNoPoint;
      meetings.push_back(aInPlane && bInPlane ? Meeting::edges(a.edge[0], a.edge[1], b.edge[0], b.edge[1])
                         : aInPlane           ? Meeting::edgeAndFace(a.edge[0], a.edge[1], b.other)
                         : bInPlane           ? Meeting::edgeAndFace(b.edge[0], b.edge[1], a.other)
                                              : Meeting::faces(task.triangle, a.other, b.other));
      breaks.push_back({i, std::uint32_t(meetings.size() - 1)});
      breaks.push_back({j, std::uint32_t(meetings.size() - 1)});
      return;
    }
    // An end of one lies on the line of the other, perhaps between its ends.
    const auto breakAt = [&](std::uint32_t index, const Segment& segment, std::uint32_t point, int side) {
      if (side == 0 && points_.isBetween(segment.from, segment.to, point))
        breaks.push_back({index, kKnown | point});
    };
    breakAt(i, a, b.from, from);
    breakAt(i, a, b.to, to);
    breakAt(j, b, a.from, back);
    breakAt(j, b, a.to, ahead);
  }

  [[noreturn]] void refuseCrossing(const Segment& segment) const {
    const Vec3d p = (points_.position(segment.from) + points_.position(segment.to)) * 0.5;
    throw Error(fmt::format("cut: {} crosses itself near ({:.6g}, {:.6g}, {:.6g}), where another one passes",
                            given_.names[surfaceOf(segment.other)], p.x, p.y, p.z));
  }

  // --- facets ---

  Arrangement split() {
    std::vector<std::vector<TriangleIndices>> pieces(tasks_.size());
    parallelFor(
        tasks_.size(), 64,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) pieces[i] = splitFace(tasks_[i], breaks_[i]);
        },
        progress_);
    Arrangement result;
    result.positions.resize(points_.count());
    for (std::uint32_t i = 0; i < points_.count(); ++i) result.positions[i] = points_.position(i);
    result.facets.reserve(given_.triangles.size());
    std::size_t task = 0;
    for (std::uint32_t t = 0; t < given_.triangles.size(); ++t) {
      if (task == tasks_.size() || tasks_[task].triangle != t) {
        result.facets.push_back({t, given_.triangles[t]});
        continue;
      }
      for (const TriangleIndices& v : pieces[task]) result.facets.push_back({t, v});
      pieces[task++] = {};
    }
    result.isInPlane = std::move(inPlane_);
    return result;
  }

  std::vector<TriangleIndices> splitFace(const Task& task, std::vector<Break>& breaks) const {
    const TriangleIndices& t = given_.triangles[task.triangle];
    std::vector<std::uint32_t> outline;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      outline.push_back(a);
      const auto start = outline.size();
      for (const EdgePoint& p : pointsOf(ordered(a, b))) outline.push_back(p.point);
      if (a > b) std::reverse(outline.begin() + std::ptrdiff_t(start), outline.end());
    }
    const FlatAxis axis = triangles_.axis(task.triangle);
    if (axis == kNoArea) return trianglesWithoutArea(outline);

    std::vector<Edge> inner;
    std::stable_sort(breaks.begin(), breaks.end(),
                     [](const Break& a, const Break& b) { return a.segment < b.segment; });
    auto next = breaks.begin();
    for (std::uint32_t i = 0; i < task.segments.size(); ++i) {
      const Segment& segment = task.segments[i].second;
      std::vector<std::uint32_t> chain{segment.from, segment.to};
      for (; next != breaks.end() && next->segment == i; ++next) chain.push_back(next->point);
      std::sort(chain.begin(), chain.end());
      chain.erase(std::unique(chain.begin(), chain.end()), chain.end());
      if (chain.size() > 2) points_.sortAlong(segment.from, segment.to, chain);
      for (std::size_t k = 0; k + 1 < chain.size(); ++k) inner.push_back(ordered(chain[k], chain[k + 1]));
    }
    std::sort(inner.begin(), inner.end());
    inner.erase(std::unique(inner.begin(), inner.end()), inner.end());
    if (inner.empty() && outline.size() == 3) return {t};
    const bool isFlipped = triangles_.turn(axis, t[0], t[1], t[2]) < 0;
    // Faces in one plane must get the same triangles, and so must not be rounded differently.
    return splitTriangles(points_, axis, isFlipped, inPlane_[task.triangle], outline, inner);
  }

  const Surfaces& given_;
  const Progress& progress_;
  TrianglePairs triangles_;
  MeetingPoints points_;
  std::vector<EdgePoint> edgePoints_;
  std::vector<bool> isOnSplitEdge_;
  /// Triangles that have one of another surface in their plane.
  std::vector<bool> inPlane_;
  /// By triangle.
  std::vector<std::pair<std::uint32_t, Segment>> segments_;
  std::vector<Task> tasks_;
  std::vector<std::vector<Break>> breaks_;
};

}  // namespace

Arrangement arrange(const Surfaces& surfaces, const Progress& progress) {
  return Arranger(surfaces, progress).run();
}

}  // namespace nephele::detail
