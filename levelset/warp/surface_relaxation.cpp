// Relaxation of a map on a surface: triangles get their shape back, and folds open.
//
// The energy is that of Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, Foldover-free maps in 50
// lines of code (2021): angles and areas over a barrier chi(det), which is finite for folded triangles and is
// lowered round by round. They minimise it in the plane; here each triangle is seen in the tangent plane of
// the reference at its images, and images go back to the reference's nearest points after each step. Steps
// are Newton's, with each triangle's Hessian freed of its negative directions, solved by CHOLMOD.
//
// Where topology differs, no map is free of folds, and the energy of the triangles that must stay folded
// would rule all others. So a triangle's energy grows with its logarithm only beyond a limit: such triangles
// give up, and a fold shrinks to few of them. A low limit gives up too early where a map without folds
// exists.
//
// Triangles that give up may also tear: a handle that has nowhere to go becomes a row of triangles that span
// the reference, which smears whatever is on it. So sides that span a fifth of the reference resist like
// springs, without a limit, and the jump spreads over as many triangles as it needs. Not from the start:
// images that tear first find the places where they cover the reference, which springs keep them from. What
// is still torn afterwards is mended: springs that are stronger and begin earlier, on patches whose rims
// stay. Folds that the limit has given up are opened in patches too, with a higher one.
//
// A few smoothing rounds first (Dirichlet energy, implicit Euler) open most folds where the shapes agree;
// many of them shrink to a point what does not wrap around the reference.
//
// Known limits: the minimum is local, and not free of folds for every pair; features that neither shape nor
// size tells apart slide along the surface.
#include "nephele/levelset/warp/surface_relaxation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nephele/levelset/warp/detail/relaxation.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

using detail::Relaxation;
using detail::SmoothNormals;
using detail::tornLength;

/// Which triangles are torn.
std::vector<std::uint8_t> tornTriangles(const ExactDistance& reference, const Mesh& object,
                                        std::span<const Vec3d> images) {
  const double area = surfaceArea(object), scale = area > 0 ? std::sqrt(reference.area() / area) : 0;
  std::vector<std::uint8_t> isTorn(object.faceCount());
  for (std::size_t t = 0; t < isTorn.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = object.corners[3 * t + i], b = object.corners[3 * t + (i + 1) % 3];
      const double rest = scale * length(object.positions[b] - object.positions[a]);
      isTorn[t] |= length(images[b] - images[a]) > tornLength(reference, rest);
    }
  return isTorn;
}

/// The positions within so many triangles of those that are torn, and the part that each is in; coincident
/// ones are one.
struct Patches {
  std::vector<std::uint8_t> moves;
  std::vector<std::uint32_t> part;
};

Patches patchesAround(const Mesh& object, const std::vector<std::uint8_t>& isTorn, int rings) {
  const std::vector<std::uint32_t> first = firstEqualPosition(object.positions);
  Patches result{std::vector<std::uint8_t>(first.size()), std::vector<std::uint32_t>(first.size())};
  std::vector<std::uint8_t>& moves = result.moves;
  for (std::size_t c = 0; c < object.corners.size(); ++c)
    if (isTorn[c / 3]) moves[first[object.corners[c]]] = 1;
  const auto cornersOf = [&](std::size_t t) {
    const std::uint32_t* c = object.corners.data() + 3 * t;
    return std::array<std::uint32_t, 3>{first[c[0]], first[c[1]], first[c[2]]};
  };
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<std::uint8_t> before = moves;
    for (std::size_t t = 0; t < object.faceCount(); ++t) {
      const auto c = cornersOf(t);
      if (before[c[0]] | before[c[1]] | before[c[2]]) moves[c[0]] = moves[c[1]] = moves[c[2]] = 1;
    }
  }
  // What shares a triangle is one part.
  std::vector<std::uint32_t>& part = result.part;
  std::iota(part.begin(), part.end(), 0u);
  const auto rootOf = [&](std::uint32_t v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (std::size_t t = 0; t < object.faceCount(); ++t) {
    const auto c = cornersOf(t);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = c[i], b = c[(i + 1) % 3];
      if (!moves[a] || !moves[b]) continue;
      const std::uint32_t low = std::min(rootOf(a), rootOf(b));
      part[rootOf(a)] = part[rootOf(b)] = low;
    }
  }
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    moves[v] = moves[first[v]];
    part[v] = rootOf(first[v]);
  }
  return result;
}

void requireImages(const char* what, const Mesh& object, std::span<const Vec3d> images) {
  requireValid(object);
  require(images.size() == object.positions.size(),
          fmt::format("{}: {} images for {} positions", what, images.size(), object.positions.size()));
  require(object.isTriangles(), fmt::format("{}: the object must be triangulated", what));
}

}  // namespace

std::size_t countTears(const ExactDistance& reference, const Mesh& object, std::span<const Vec3d> images) {
  requireImages("tears", object, images);
  const std::vector<std::uint8_t> isTorn = tornTriangles(reference, object, images);
  return std::size_t(std::count(isTorn.begin(), isTorn.end(), 1));
}

struct SurfaceRelaxation::Parts {
  Parts(const ExactDistance& to, const Mesh& from, const Progress& progress)
      : reference(to), object(from), normals(to), all(to, normals, from, progress) {}
  const ExactDistance& reference;
  const Mesh& object;
  SmoothNormals normals;
  Relaxation all;
};

SurfaceRelaxation::SurfaceRelaxation(const ExactDistance& reference, const Mesh& object,
                                     const Progress& progress) {
  requireValid(object);
  require(object.isTriangles(), "relaxation: the object must be triangulated");
  parts_ = std::make_unique<Parts>(reference, object, progress);
}
SurfaceRelaxation::~SurfaceRelaxation() = default;

std::vector<Vec3d> SurfaceRelaxation::relaxed(std::span<const Vec3d> images, const RelaxationOptions& options,
                                              const Progress& progress) {
  requireImages("relaxation", parts_->object, images);
  require(
      options.rounds >= 0 && options.smoothingRounds >= 0,
      fmt::format("relaxation: rounds must be >= 0, got {} and {}", options.smoothingRounds, options.rounds));
  require(options.limit > 0 && options.lastLimit > 0,
          fmt::format("relaxation: limits must be > 0, got {} and {}", options.limit, options.lastLimit));
  require(options.areaWeight > 0,
          fmt::format("relaxation: areaWeight must be > 0, got {}", options.areaWeight));
  require(options.resistsFrom >= 0 && options.resistsFrom <= 1,
          fmt::format("relaxation: resistsFrom must be 0 to 1, got {}", options.resistsFrom));
  require(options.tearWeight >= 0,
          fmt::format("relaxation: tearWeight must be >= 0, got {}", options.tearWeight));
  std::vector<Vec3d> result(images.begin(), images.end());
  parts_->all.relax(result, options, progress);
  return result;
}

std::vector<Vec3d> SurfaceRelaxation::mended(std::span<const Vec3d> images, const Progress& progress) {
  requireImages("mending", parts_->object, images);
  const ExactDistance& reference = parts_->reference;
  const Mesh& object = parts_->object;
  const SmoothNormals& normals = parts_->normals;
  std::vector<Vec3d> result(images.begin(), images.end());
  // Sides that resist more, then a limit that gives fewer triangles up; the wider, the less is held.
  struct Try {
    int rings;
    double tearWeight, limit;
  };
  constexpr Try kTries[] = {{4, 40, 5},    {4, 400, 5}, {10, 100, 5}, {10, 1000, 5},
                            {20, 1000, 5}, {3, 40, 30}, {6, 40, 30},  {10, 40, 30}};
  double done = 0;
  for (const Try& attempt : kTries) {
    const SubProgress ofTry(progress, done, done + 1.0 / std::size(kTries));
    done += 1.0 / std::size(kTries);
    ofTry.check();
    const std::vector<std::uint8_t> before = tornTriangles(reference, object, result);
    std::vector<std::uint8_t> isBad = before;
    constexpr double kForTears = 5;
    if (attempt.limit > kForTears)
      for (const std::uint32_t t : parts_->all.foldedFaces(result)) isBad[t] = 1;
    if (std::none_of(isBad.begin(), isBad.end(), [](std::uint8_t bad) { return bad != 0; })) continue;
    const Patches patches = patchesAround(object, isBad, attempt.rings);
    std::vector<Vec3d> trial = result;
    constexpr int kRounds = 12;
    Relaxation local(reference, normals, object, patches.moves, ofTry);
    local.relax(trial,
                {.smoothingRounds = 0,
                 .rounds = kRounds,
                 .limit = attempt.limit,
                 .lastLimit = attempt.limit,
                 .resistsFrom = 0,
                 .tearWeight = attempt.tearWeight},
                ofTry);
    // Part by part: torn triangles, and these with those that are turned over.
    std::vector<int> torn(result.size()), bad(result.size());
    const auto partOf = [&](std::size_t t) {
      const std::uint32_t* c = object.corners.data() + 3 * t;
      return patches.part[patches.moves[c[0]] ? c[0] : patches.moves[c[1]] ? c[1] : c[2]];
    };
    const std::vector<std::uint8_t> after = tornTriangles(reference, object, trial);
    for (std::size_t t = 0; t < object.faceCount(); ++t)
      if (before[t] != after[t]) torn[partOf(t)] += int(after[t]) - int(before[t]);
    bad = torn;
    for (const std::uint32_t t : local.foldedFaces(result)) --bad[partOf(t)];
    for (const std::uint32_t t : local.foldedFaces(trial)) ++bad[partOf(t)];
    for (std::size_t v = 0; v < result.size(); ++v) {
      const std::uint32_t part = patches.part[v];
      if (patches.moves[v] && torn[part] <= 0 && bad[part] <= 0 && torn[part] + bad[part] < 0)
        result[v] = trial[v];
    }
  }
  return result;
}

std::vector<Vec3d> relaxImages(const ExactDistance& reference, const Mesh& object,
                               std::span<const Vec3d> images, const RelaxationOptions& options,
                               const Progress& progress) {
  return SurfaceRelaxation(reference, object).relaxed(images, options, progress);
}

}  // namespace nephele
