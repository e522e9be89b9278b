// Where surfaces meet, as points that are known exactly.
//
// A point is kept as what it comes from: an edge and a face, two edges, three faces, all of them given in
// doubles. Its place is computed once, in long double, or in rational numbers where surfaces meet at so flat
// an angle that this would show. Decisions that rounding could turn are made with rational numbers. Points
// that come about in different ways at one place are found by nearness, then compared exactly.
#include "nephele/levelset/cut/detail/solids/meeting_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Rational = MeetingPoints::Rational;
using ExactPoint = MeetingPoints::ExactPoint;
using Long3 = Vec3<long double>;

ExactPoint minus(const ExactPoint& a, const ExactPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

ExactPoint crossed(const ExactPoint& a, const ExactPoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Rational dotted(const ExactPoint& a, const ExactPoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec3d rounded(const ExactPoint& p) {
  return {CGAL::to_double(p[0]), CGAL::to_double(p[1]), CGAL::to_double(p[2])};
}

int largest(const Long3& v) {
  const long double x = std::abs(v.x), y = std::abs(v.y), z = std::abs(v.z);
  return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

}  // namespace

Meeting Meeting::vertex(std::uint32_t v) {
  return {Kind::vertex, {v, 0, 0, 0}};
}

Meeting Meeting::edgeAndFace(std::uint32_t a, std::uint32_t b, std::uint32_t triangle) {
  return {Kind::edgeAndFace, {std::min(a, b), std::max(a, b), triangle, 0}};
}

Meeting Meeting::edges(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  std::array<std::uint32_t, 2> first{std::min(a, b), std::max(a, b)}, second{std::min(c, d), std::max(c, d)};
  if (second < first) std::swap(first, second);
  return {Kind::edges, {first[0], first[1], second[0], second[1]}};
}

Meeting Meeting::faces(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::array<std::uint32_t, 4> of{a, b, c, 0};
  std::sort(of.begin(), of.begin() + 3);
  return {Kind::faces, of};
}

std::size_t MeetingHash::operator()(const Meeting& meeting) const {
  std::uint64_t h = std::uint64_t(meeting.kind) + 1;
  for (const std::uint32_t i : meeting.of) {
    h = (h ^ h >> 32 ^ i) * 0x9e3779b97f4a7c15u;
  }
  return std::size_t(h ^ h >> 29);
}

MeetingPoints::MeetingPoints(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles)
    : given_(positions), triangles_(triangles) {
  Vec3d far{};
  for (const Vec3d& p : positions) far = max(far, max(p, -p));
  size_ = length(far);
}

ExactPoint MeetingPoints::given(std::uint32_t v) const {
  const Vec3d& p = given_[v];
  return {Rational(p.x), Rational(p.y), Rational(p.z)};
}

ExactPoint MeetingPoints::exactPosition(std::uint32_t point) const {
  return point < given_.size() ? given(point) : evaluate(added_[point - given_.size()]);
}

ExactPoint MeetingPoints::evaluate(const Meeting& meeting) const {
  const auto& of = meeting.of;
  const auto along = [](const ExactPoint& a, const ExactPoint& b, const Rational& t) {
    return ExactPoint{a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
  };
  const auto normalOf = [&](std::uint32_t t) {
    const ExactPoint a = given(triangles_[t][0]);
    return crossed(minus(given(triangles_[t][1]), a), minus(given(triangles_[t][2]), a));
  };
  switch (meeting.kind) {
    case Meeting::Kind::vertex:
      return given(of[0]);
    case Meeting::Kind::edgeAndFace: {
      const ExactPoint a = given(of[0]), b = given(of[1]), n = normalOf(of[2]);
      const Rational height = dotted(n, minus(given(triangles_[of[2]][0]), a));
      return along(a, b, height / dotted(n, minus(b, a)));
    }
    case Meeting::Kind::edges: {
      const ExactPoint a = given(of[0]), d = minus(given(of[1]), a), c = given(of[2]),
                       e = minus(given(of[3]), c), r = minus(c, a);
      const ExactPoint n = crossed(d, e), m = crossed(r, e);
      const auto k = std::size_t(largest(Long3(rounded(n))));
      return along(a, given(of[1]), m[k] / n[k]);
    }
    case Meeting::Kind::faces: {
      const ExactPoint na = normalOf(of[0]), nb = normalOf(of[1]), nc = normalOf(of[2]);
      const Rational da = dotted(na, given(triangles_[of[0]][0])),
                     db = dotted(nb, given(triangles_[of[1]][0])),
                     dc = dotted(nc, given(triangles_[of[2]][0]));
      const ExactPoint bc = crossed(nb, nc), ca = crossed(nc, na), ab = crossed(na, nb);
      const Rational det = dotted(na, bc);
      return {(bc[0] * da + ca[0] * db + ab[0] * dc) / det, (bc[1] * da + ca[1] * db + ab[1] * dc) / det,
              (bc[2] * da + ca[2] * db + ab[2] * dc) / det};
    }
  }
  return {};
}

Vec3d MeetingPoints::approximate(const Meeting& meeting) const {
  const auto& of = meeting.of;
  const auto at = [&](std::uint32_t v) { return Long3(given_[v]); };
  // What rounding moves a point by is the size times this, divided by the sine of the angle of the meeting.
  constexpr long double kRounding = 64 * std::numeric_limits<long double>::epsilon();
  constexpr long double kLeastSine = kRounding / 1e-15L;
  const auto normalOf = [&](std::uint32_t t) {
    const Long3 a = at(triangles_[t][0]);
    return cross(at(triangles_[t][1]) - a, at(triangles_[t][2]) - a);
  };
  switch (meeting.kind) {
    case Meeting::Kind::vertex:
      return given_[of[0]];
    case Meeting::Kind::edgeAndFace: {
      const TriangleIndices& t = triangles_[of[2]];
      const Long3 a = at(of[0]), b = at(of[1]), c = at(t[0]), u = at(t[1]) - c, v = at(t[2]) - c,
                  n = cross(u, v);
      const long double da = dot(n, a - c), db = dot(n, b - c);
      // Long thin triangles have no sure normal, either.
      const long double sine = std::abs(da - db) / (length(u) * length(v) * length(b - a));
      if (!(sine > kLeastSine)) break;
      return Vec3d(a + (b - a) * (da / (da - db)));
    }
    case Meeting::Kind::edges: {
      const Long3 a = at(of[0]), d = at(of[1]) - a, c = at(of[2]), e = at(of[3]) - c;
      const Long3 n = cross(d, e), m = cross(c - a, e);
      const int k = largest(n);
      if (!(std::abs(n[k]) > kLeastSine * length(d) * length(e))) break;
      return Vec3d(a + d * (m[k] / n[k]));
    }
    case Meeting::Kind::faces: {
      const Long3 origin = at(triangles_[of[0]][0]);
      Long3 normals[3];
      long double offsets[3], scale = 1;
      for (int k = 0; k < 3; ++k) {
        const TriangleIndices& t = triangles_[of[std::size_t(k)]];
        normals[k] = normalOf(of[std::size_t(k)]);
        offsets[k] = dot(normals[k], at(t[0]) - origin);
        scale *= length(at(t[1]) - at(t[0])) * length(at(t[2]) - at(t[0]));
      }
      const Long3 bc = cross(normals[1], normals[2]), ca = cross(normals[2], normals[0]),
                  ab = cross(normals[0], normals[1]);
      const long double det = dot(normals[0], bc);
      if (!(std::abs(det) > kLeastSine * scale)) break;
      return Vec3d(origin + (bc * offsets[0] + ca * offsets[1] + ab * offsets[2]) / det);
    }
  }
  return rounded(evaluate(meeting));
}

std::vector<std::uint32_t> MeetingPoints::add(std::span<const Meeting> meetings) {
  // Each once, in an order of their own.
  std::vector<std::uint32_t> numbers(meetings.size());
  const auto before = std::uint32_t(count());
  std::vector<std::uint32_t> touched;
  std::vector<Meeting> fresh;
  for (std::size_t i = 0; i < meetings.size(); ++i) {
    if (meetings[i].kind == Meeting::Kind::vertex) {
      numbers[i] = meetings[i].of[0];
      touched.push_back(numbers[i]);
      continue;
    }
    const auto [entry, added] = numbers_.try_emplace(meetings[i], before + std::uint32_t(fresh.size()));
    if (added) fresh.push_back(meetings[i]);
    numbers[i] = entry->second;
  }
  touched.insert(touched.end(), touched_.begin(), touched_.end());
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  touched_ = std::move(touched);

  const std::size_t old = added_.size();
  added_.insert(added_.end(), fresh.begin(), fresh.end());
  places_.resize(added_.size());
  parallelFor(fresh.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) places_[old + i] = approximate(fresh[i]);
  });

  // A direction, no longer than 1, across which no model has many points.
  constexpr Vec3d kAcross{0.8417, 0.4273, 0.3291};
  const double near = 1e-13 * size_;
  std::vector<std::pair<double, std::uint32_t>> sorted;
  sorted.reserve(touched_.size() + added_.size());
  for (const std::uint32_t v : touched_) sorted.emplace_back(dot(given_[v], kAcross), v);
  for (std::uint32_t i = 0; i < added_.size(); ++i)
    sorted.emplace_back(dot(places_[i], kAcross), std::uint32_t(given_.size()) + i);
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint32_t> first(fresh.size());
  std::iota(first.begin(), first.end(), before);
  const auto root = [&](std::uint32_t point) {
    while (point >= before && first[point - before] != point) point = first[point - before];
    return point;
  };
  for (std::size_t i = 0; i < sorted.size(); ++i)
    for (std::size_t j = i + 1; j < sorted.size() && sorted[j].first - sorted[i].first <= 2 * near; ++j) {
      const std::uint32_t p = root(sorted[i].second), q = root(sorted[j].second);
      if (p == q || std::max(p, q) < before) continue;
      const Vec3d apart = position(sorted[i].second) - position(sorted[j].second);
      if (length(apart) > near || exactPosition(p) != exactPosition(q)) continue;
      first[std::max(p, q) - before] = std::min(p, q);
    }
  for (std::uint32_t i = 0; i < fresh.size(); ++i) {
    const std::uint32_t number = root(before + i);
    if (number != before + i) numbers_[fresh[i]] = number;
  }
  for (std::uint32_t& number : numbers) number = root(number);
  return numbers;
}

int MeetingPoints::side(FlatAxis axis, std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  if (a == b || b == c || c == a) return 0;
  const int u = firstCoordinate(axis), v = secondCoordinate(axis);
  const Vec3d &p = position(a), &q = position(b), &r = position(c);
  const double left = (q[u] - p[u]) * (r[v] - p[v]), right = (q[v] - p[v]) * (r[u] - p[u]);
  const double reach =
      std::max({std::abs(q[u] - p[u]), std::abs(q[v] - p[v]), std::abs(r[u] - p[u]), std::abs(r[v] - p[v])});
  const double doubt = 1e-13 * size_ * reach;
  if (left - right > doubt) return 1;
  if (left - right < -doubt) return -1;
  const ExactPoint x = exactPosition(a), y = exactPosition(b), z = exactPosition(c);
  const auto i = std::size_t(u), j = std::size_t(v);
  const Rational area = (y[i] - x[i]) * (z[j] - x[j]) - (y[j] - x[j]) * (z[i] - x[i]);
  return area > 0 ? 1 : area < 0 ? -1 : 0;
}

std::pair<bool, int> MeetingPoints::axisOf(std::uint32_t from, std::uint32_t to) const {
  const Vec3d along = position(to) - position(from);
  const int axis = largest(Long3(along));
  return {!(std::abs(along[axis]) > 1e-12 * size_), axis};
}

bool MeetingPoints::isLess(bool isShort, int axis, std::uint32_t a, std::uint32_t b) const {
  if (a == b) return false;
  const double ahead = position(b)[axis] - position(a)[axis];
  if (!isShort && std::abs(ahead) > 1e-13 * size_) return ahead > 0;
  const ExactPoint p = exactPosition(a), q = exactPosition(b);
  // Where rounding leaves no direction, x before y before z is an order along every line, too.
  return isShort ? p < q : p[std::size_t(axis)] < q[std::size_t(axis)];
}

void MeetingPoints::sortAlong(std::uint32_t from, std::uint32_t to,
                              std::vector<std::uint32_t>& points) const {
  const auto [isShort, axis] = axisOf(from, to);
  std::sort(points.begin(), points.end(),
            [&, isShort = isShort, axis = axis](std::uint32_t a, std::uint32_t b) {
              return isLess(isShort, axis, a, b);
            });
  if (isLess(isShort, axis, to, from)) std::reverse(points.begin(), points.end());
}

bool MeetingPoints::isBetween(std::uint32_t from, std::uint32_t to, std::uint32_t point) const {
  if (point == from || point == to) return false;
  const auto [isShort, axis] = axisOf(from, to);
  return isLess(isShort, axis, from, to)
             ? isLess(isShort, axis, from, point) && isLess(isShort, axis, point, to)
             : isLess(isShort, axis, to, point) && isLess(isShort, axis, point, from);
}

}  // namespace nephele::detail
