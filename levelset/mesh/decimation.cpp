// Half-edge collapses on OpenMesh, in the order of the distance that they bring between the two surfaces.
//
// A vertex goes into one of its neighbours: into the one whose quadrics (sums of squared distances from the
// planes of the faces around) like it best. What that costs is the largest distance of the old vertices that
// the faces around stood for, from the faces that come: every face keeps a list of the old vertices that went
// to it. OpenMesh's modules have quadrics for the order and distances as a bound alone, and evaluate every
// neighbour of a collapse at once; here a vertex whose surroundings changed is evaluated when its turn comes,
// which saves most of the work, and the order by distance brings the largest distance to less than half.
// Distances of the new surface from the old one, which see what was closed over, are measured only for
// vertices about to go.
//
// Corners with equal attributes at a vertex, in one group, are a wedge, known by the first of them. Where two
// faces have different wedges at an end of their edge, the edge is a seam.
#include "nephele/levelset/mesh/decimation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "nephele/levelset/mesh/detail/half_edge_mesh.h"
#include "nephele/levelset/mesh/detail/point_distance.h"
#include "nephele/levelset/mesh/detail/wedges.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

using detail::HalfEdgeMesh;
using Vertex = HalfEdgeMesh::VertexHandle;
using HalfEdge = HalfEdgeMesh::HalfedgeHandle;
using Face = HalfEdgeMesh::FaceHandle;
using Point = OpenMesh::Vec3d;
using detail::squaredDistance;
using Quadric = OpenMesh::Geometry::Quadricd;

constexpr std::uint32_t kNone = 0xFFFFFFFFu;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Cosine of the largest turn of a face in one collapse.
constexpr double kTurn = 0.3;
// Twice the area of a triangle over its longest side squared: below this it must not lose area.
constexpr double kThin = 0.03;
// Share of its length that an edge costs on top of the distance, so that flat places lose short edges first.
constexpr double kLengthCost = 1e-3;
// Turns between two looks at whether all is cancelled; late ones measure thousands of points each.
constexpr std::size_t kTurnsUnheard = 64, kFacesUnheard = 1 << 14;
// What measured distances may be of the bound, which leaves room for what lies between the points measured.
constexpr double kAllowance = 0.75;

class Decimation {
 public:
  Decimation(const Mesh& welded, double bound, const Progress& progress)
      : source_(welded),
        origin_(welded.positions[welded.corners[0]]),
        mesh_(detail::halfEdgesOf(welded, {origin_, "decimation"}, progress)),
        wedges_(welded),
        bound_(bound),
        nearest_(centred(), progress),
        quadrics_(welded.positions.size()),
        nextPoint_(welded.positions.size(), kNone),
        firstPoint_(welded.faceCount(), kNone),
        turns_(welded.positions.size()),
        faceCount_(welded.faceCount()) {
    for (const Vertex v : mesh_.vertices()) old_.push_back(mesh_.point(v));
    setQuadrics(progress);
  }

  void run(std::size_t target, const Progress& progress) {
    for (const Vertex v : mesh_.vertices()) {
      if (std::size_t(v.idx()) % kTurnsUnheard == 0) progress.check();
      if (!mesh_.is_isolated(v)) queue(v, evaluate(v));
    }
    const auto before = double(faceCount_);
    for (std::size_t step = 0; faceCount_ > target && !queue_.empty(); ++step) {
      if (step % kTurnsUnheard == 0) {
        progress.check();
        progress.advance((before - double(faceCount_)) / std::max(before - double(target), 1.0));
      }
      const Entry next = queue_.top();
      queue_.pop();
      takeTurn(next);
    }
  }

  DecimatedMesh result() const;

 private:
  struct Entry {
    double cost;
    std::uint32_t vertex;

    // The least cost is on top; equal ones by vertex, so that the order is always the same.
    bool operator<(const Entry& o) const { return cost != o.cost ? cost > o.cost : vertex > o.vertex; }
  };
  // A vertex in the queue, and what its turn will be.
  struct Turn {
    HalfEdge target{};
    /// Squared distance of the new faces from the old surface; below 0: not measured.
    double backward = -1;
    bool isQueued = false, isStale = false;
  };
  // A face that changes: its corners that stay.
  struct Rim {
    Face face;
    Point a, b;
    /// What the corner that changes becomes.
    std::uint32_t wedge;
  };

  Mesh centred() const {
    Mesh result;
    result.corners = source_.corners;
    result.faceStart = source_.faceStart;
    for (const Vec3d& p : source_.positions) result.positions.push_back(p - origin_);
    return result;
  }

  bool isSeam(HalfEdge h) const {
    const Face left = mesh_.face_handle(h), right = mesh_.face_handle(mesh_.opposite_halfedge_handle(h));
    if (!left.is_valid() || !right.is_valid()) return true;
    return wedges_.differ(left.idx(), right.idx(), mesh_.from_vertex_handle(h).idx(),
                          mesh_.to_vertex_handle(h).idx());
  }

  void setQuadrics(const Progress& progress);
  bool isLegal(HalfEdge h);
  bool findRim(HalfEdge h);
  double distanceFromOld(double limit);
  double distanceToOld(double expected);
  double evaluate(Vertex v);
  void takeTurn(const Entry& next);
  void collapse(HalfEdge h);

  void queue(Vertex v, double cost) {
    Turn& turn = turns_[v.idx()];
    turn.isQueued = cost < kInfinity;
    if (turn.isQueued) queue_.push({cost, std::uint32_t(v.idx())});
  }

  const Mesh& source_;
  Vec3d origin_;
  HalfEdgeMesh mesh_;
  detail::Wedges wedges_;
  // Squared, as all distances here.
  double bound_;
  double error_ = 0;
  NearestOnMesh nearest_;
  double oldEdge_ = 0;
  std::vector<Point> old_;
  std::vector<Quadric> quadrics_;
  // Old vertices that went to a face, as a list: the first, and after each the next.
  std::vector<std::uint32_t> nextPoint_, firstPoint_;
  std::vector<Turn> turns_;
  std::priority_queue<Entry> queue_;
  std::size_t faceCount_;

  // About the collapse that is looked at: what changes, and the old vertices there.
  Point kept_;
  double seamDistance_ = 0;
  std::vector<Rim> rim_;
  std::vector<std::uint32_t> points_;
  std::vector<std::pair<double, HalfEdge>> candidates_;
};

void Decimation::setQuadrics(const Progress& progress) {
  for (Quadric& q : quadrics_) q.clear();
  const auto add = [&](Vertex v, const Point& normal, double weight) {
    Quadric q(normal[0], normal[1], normal[2], -(mesh_.point(v) | normal));
    q *= weight;
    return q;
  };
  double lengths = 0;
  for (const Face f : mesh_.faces()) {
    if (std::size_t(f.idx()) % kFacesUnheard == 0) progress.check();
    const Point normal = mesh_.calc_normal(f);
    for (const HalfEdge h : mesh_.fh_range(f)) {
      const Vertex from = mesh_.from_vertex_handle(h), to = mesh_.to_vertex_handle(h);
      const Point side = mesh_.point(to) - mesh_.point(from);
      const double length = side.norm();
      lengths += length;
      quadrics_[to.idx()] += add(to, normal, mesh_.calc_face_area(f));
      if (!isSeam(h) || !(length > 0)) continue;
      // Upright on the seam.
      const Quadric wall = add(from, (normal % side) / length, length * length);
      quadrics_[from.idx()] += wall;
      quadrics_[to.idx()] += wall;
    }
  }
  oldEdge_ = lengths / double(3 * mesh_.n_faces());
}

// Whether the collapse keeps the surface a manifold of the same kind, and seams.
bool Decimation::isLegal(HalfEdge h) {
  if (!mesh_.is_collapse_ok(h)) return false;
  const HalfEdge o = mesh_.opposite_halfedge_handle(h);
  const Vertex v = mesh_.from_vertex_handle(h);
  const bool hasLeft = !mesh_.is_boundary(h), hasRight = !mesh_.is_boundary(o);
  if (hasLeft && hasRight) {
    if (mesh_.is_boundary(v)) return false;
    // Two triangles back to back would be left.
    const Vertex left = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h));
    const Vertex right = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(o));
    if (mesh_.find_halfedge(left, right).is_valid() && mesh_.valence(left) == 3 && mesh_.valence(right) == 3)
      return false;
  }
  if (mesh_.valence(v) < 3) return false;
  if (!wedges_.hasSeams() && !mesh_.is_boundary(v)) return true;
  unsigned seams = 0;
  for (const HalfEdge out : mesh_.voh_range(v)) seams += isSeam(out);
  return seams == 0 || (seams == 2 && isSeam(h));
}

// Finds what changes; false if a face would turn over or get too thin.
bool Decimation::findRim(HalfEdge h) {
  const Vertex v = mesh_.from_vertex_handle(h), into = mesh_.to_vertex_handle(h);
  const Point gone = mesh_.point(v);
  kept_ = mesh_.point(into);
  seamDistance_ = 0;
  rim_.clear();
  points_.assign(1, std::uint32_t(v.idx()));
  const auto shape = [](double area, const Point& a, const Point& b, const Point& c) {
    const double longest = std::max({(a - b).sqrnorm(), (b - c).sqrnorm(), (c - a).sqrnorm()});
    return longest > 0 ? area / longest : 0.0;
  };
  std::uint32_t wedge = mesh_.is_boundary(h) ? kNone : wedges_.at(mesh_.face_handle(h).idx(), into.idx());
  HalfEdge out = h;
  do {
    if (out != h && (wedges_.hasSeams() || mesh_.is_boundary(v)) && isSeam(out)) {
      // The other half of the seam: beyond it lies the face right of h.
      const Face right = mesh_.face_handle(mesh_.opposite_halfedge_handle(h));
      if (right.is_valid()) wedge = wedges_.at(right.idx(), into.idx());
      seamDistance_ = squaredDistance(gone, kept_, mesh_.point(mesh_.to_vertex_handle(out)));
    }
    if (const Face face = mesh_.face_handle(out); face.is_valid()) {
      for (auto i = firstPoint_[face.idx()]; i != kNone; i = nextPoint_[i]) points_.push_back(i);
      const Vertex from = mesh_.to_vertex_handle(out),
                   to = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(out));
      if (from != into && to != into) {
        const Point &a = mesh_.point(from), &b = mesh_.point(to);
        const Point before = (a - gone) % (b - gone), after = (a - kept_) % (b - kept_);
        const double areaBefore = before.norm(), areaAfter = after.norm();
        if ((before | after) < kTurn * areaBefore * areaAfter) return false;
        if (areaAfter < 0.99 * areaBefore && shape(areaAfter, a, b, kept_) < kThin) return false;
        if (wedges_.turns(face.idx(), v.idx(), wedge)) return false;
        rim_.push_back({face, a, b, wedge});
      }
    }
    out = mesh_.ccw_rotated_halfedge_handle(out);
  } while (out != h);
  return true;
}

// The largest distance of the old vertices from the faces to come, squared; infinity beyond the limit.
double Decimation::distanceFromOld(double limit) {
  double largest = seamDistance_;
  for (const std::uint32_t i : points_) {
    double least = kInfinity;
    for (const Rim& rim : rim_) {
      least = std::min(least, squaredDistance(old_[i], kept_, rim.a, rim.b));
      if (least <= largest) break;
    }
    largest = std::max(largest, least);
    if (largest > limit) return kInfinity;
  }
  return largest;
}

// The largest distance of points on the faces to come from the old surface, squared; infinity beyond the
// bound. Most points are within `expected` of it, which makes them quick to find.
double Decimation::distanceToOld(double expected) {
  constexpr int kMostOnSide = 16, kMostInside = 8;
  const auto near = float(1.001 * std::sqrt(expected)), far = float(1.001 * std::sqrt(bound_));
  double largest = 0;
  const auto isWithin = [&](const Point& p) {
    const Vec3f place(detail::toVec3d(p));
    auto hit = nearest_.nearest(place, near);
    if (!hit) hit = nearest_.nearest(place, far);
    largest = std::max(largest, hit ? double(hit->distance) * double(hit->distance) : kInfinity);
    return largest <= bound_;
  };
  const auto stepsFor = [&](double size, int least, int most) {
    return std::clamp(int(std::ceil(size / oldEdge_)), least, most);
  };
  for (const Rim& rim : rim_) {
    // Surfaces are farthest apart where their edges cross. The rim was there before, and the next face has
    // the other side.
    const double side = (rim.a - kept_).norm();
    const int onSide = stepsFor(3 * side, 3, kMostOnSide);
    for (int i = 1; i < onSide; ++i)
      if (!isWithin(kept_ + (rim.a - kept_) * (double(i) / onSide))) return kInfinity;
    const int inside =
        stepsFor(std::max({side, (rim.b - kept_).norm(), (rim.a - rim.b).norm()}), 3, kMostInside);
    for (int i = 1; i < inside; ++i)
      for (int j = 1; i + j < inside; ++j)
        if (!isWithin((rim.a * i + rim.b * j + kept_ * (inside - i - j)) / double(inside))) return kInfinity;
  }
  return largest;
}

// Where the vertex would go, and what that costs; infinity if it cannot go.
double Decimation::evaluate(Vertex v) {
  Turn& turn = turns_[v.idx()];
  turn.isStale = false;
  turn.backward = -1;
  candidates_.clear();
  const auto lengthCost = [&](HalfEdge h) {
    return kLengthCost * kLengthCost * (mesh_.point(mesh_.to_vertex_handle(h)) - mesh_.point(v)).sqrnorm();
  };
  for (const HalfEdge h : mesh_.voh_range(v)) {
    const Vertex into = mesh_.to_vertex_handle(h);
    Quadric q = quadrics_[v.idx()];
    q += quadrics_[into.idx()];
    const double length = lengthCost(h);
    candidates_.emplace_back(q(mesh_.point(into)) + length * length, h);
  }
  std::sort(candidates_.begin(), candidates_.end());
  for (const auto& [score, h] : candidates_) {
    if (!isLegal(h) || !findRim(h)) continue;
    const double distance = distanceFromOld(bound_);
    if (distance == kInfinity) continue;
    turn.target = h;
    return distance + lengthCost(h);
  }
  return kInfinity;
}

void Decimation::takeTurn(const Entry& next) {
  const Vertex v(static_cast<int>(next.vertex));
  Turn& turn = turns_[next.vertex];
  turn.isQueued = false;
  if (turn.isStale || !isLegal(turn.target)) return queue(v, evaluate(v));
  if (!findRim(turn.target)) return;
  if (turn.backward < 0) {
    turn.backward = distanceToOld(next.cost);
    if (turn.backward == kInfinity) return;
    if (turn.backward > next.cost) return queue(v, turn.backward);
  }
  error_ = std::max({error_, distanceFromOld(kInfinity), turn.backward});
  const HalfEdge h = turn.target;
  std::vector<Vertex> around;
  for (const Vertex w : mesh_.vv_range(v)) around.push_back(w);
  collapse(h);
  for (const Vertex w : around) {
    turns_[w.idx()].isStale = true;
    if (!turns_[w.idx()].isQueued) queue(w, next.cost);
  }
}

void Decimation::collapse(HalfEdge h) {
  const Vertex v = mesh_.from_vertex_handle(h), into = mesh_.to_vertex_handle(h);
  for (const Rim& rim : rim_) {
    firstPoint_[rim.face.idx()] = kNone;
    wedges_.replace(rim.face.idx(), v.idx(), into.idx(), rim.wedge);
  }
  for (const std::uint32_t i : points_) {
    const auto distance = [&](const Rim& rim) { return squaredDistance(old_[i], kept_, rim.a, rim.b); };
    const Rim* nearest = &rim_.front();
    double least = distance(*nearest);
    for (const Rim& rim : rim_)
      if (const double d = distance(rim); d < least) {
        least = d;
        nearest = &rim;
      }
    nextPoint_[i] = firstPoint_[nearest->face.idx()];
    firstPoint_[nearest->face.idx()] = i;
  }
  faceCount_ -= mesh_.is_boundary(h) || mesh_.is_boundary(mesh_.opposite_halfedge_handle(h)) ? 1 : 2;
  mesh_.collapse(h);
  quadrics_[into.idx()] += quadrics_[v.idx()];
}

// Vertices and faces in their old order, so that groups stay runs of faces.
DecimatedMesh Decimation::result() const {
  Mesh mesh;
  std::vector<std::uint32_t> vertexAt(source_.positions.size(), kNone), vertices, corners;
  std::vector<std::uint32_t> facesBefore{0};
  for (const Face f : mesh_.all_faces()) {
    facesBefore.push_back(facesBefore.back() + (mesh_.status(f).deleted() ? 0 : 1));
    if (mesh_.status(f).deleted()) continue;
    for (const std::uint32_t v : wedges_.vertices(f.idx())) vertexAt[v] = 0;
  }
  for (std::uint32_t v = 0; v < vertexAt.size(); ++v) {
    if (vertexAt[v] == kNone) continue;
    vertexAt[v] = std::uint32_t(vertices.size());
    vertices.push_back(v);
    mesh.positions.push_back(source_.positions[v]);
  }
  for (const Face f : mesh_.all_faces()) {
    if (mesh_.status(f).deleted()) continue;
    for (const std::uint32_t v : wedges_.vertices(f.idx())) mesh.corners.push_back(vertexAt[v]);
    for (const std::uint32_t wedge : wedges_.of(f.idx())) corners.push_back(wedge);
    mesh.faceStart.push_back(std::uint32_t(mesh.corners.size()));
  }
  for (const MeshAttribute& a : source_.attributes) {
    MeshAttribute kept{a.name, a.domain, a.width, {}};
    const auto width = std::ptrdiff_t(a.width);
    for (const std::uint32_t i : a.domain == MeshAttribute::Domain::vertex ? vertices : corners) {
      const auto first = a.values.begin() + std::ptrdiff_t(i) * width;
      kept.values.insert(kept.values.end(), first, first + width);
    }
    mesh.attributes.push_back(std::move(kept));
  }
  mesh.materialFiles = source_.materialFiles;
  for (MeshGroup group : source_.groups) {
    const std::uint32_t end = facesBefore[group.firstFace + group.faceCount];
    group.firstFace = facesBefore[group.firstFace];
    group.faceCount = end - group.firstFace;
    if (group.faceCount > 0) mesh.groups.push_back(std::move(group));
  }
  return {std::move(mesh), std::sqrt(error_)};
}

}  // namespace

DecimatedMesh decimate(const Mesh& mesh, const DecimationOptions& options, const Progress& progress) {
  requireValid(mesh);
  require(options.faces || options.maxError,
          "decimation: a number of faces or a largest error must be given");
  require(options.faces.value_or(1) > 0, "decimation: the number of faces must be at least 1, got 0");
  const double bound = options.maxError.value_or(kInfinity);
  require(!options.maxError || (std::isfinite(bound) && bound > 0),
          fmt::format("decimation: the largest error must be > 0, got {}", bound));
  require(mesh.faceCount() > 0, "decimation: the mesh has no faces");
  for (const std::uint32_t v : mesh.corners)
    require(isFinite(mesh.positions[v]), "decimation: the mesh has positions that are not finite");
  const std::size_t target = options.faces.value_or(0);
  if (!options.maxError && triangulated(mesh).faceCount() <= target) return {mesh, 0.0};
  progress.begin("decimate");
  const Mesh welded = detail::weldedTriangles(mesh, progress);
  require(welded.faceCount() > 0, "decimation: all faces repeat a corner");
  Decimation decimation(welded, kAllowance * kAllowance * bound * bound, progress);
  decimation.run(target, progress);
  return decimation.result();
}

}  // namespace nephele
