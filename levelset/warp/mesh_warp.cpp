// A map from one mesh to another: aligned, warped by nacelle, and relaxed where it folds over.
//
// Both meshes are moved to the origin first, so that floats resolve the shapes and not their places. The
// object's positions lie on its surface, so their level set value is 0 and the warp field takes them to the
// zero surface of the reference; what floats and grids leave of the way goes to the reference's nearest
// point.
//
// Scaling changes distances: the level sets are made to agree by measuring the object in the reference's
// units, scale * object(x) = reference(X(x)).
//
// `best` relaxes the warp field first, if the topology is the same. If folds are left, it lets the object's
// level set turn into the reference's in 20 steps, and relaxes what that gives in five runs: two in which
// triangles may tear, which find the places where they cover the reference, one in which tears close, and two
// that lower what is left. Smaller meshes start from the warp field and from a smoother beginning too. At the
// end the map that has the fewest faults is mended around torn and folded triangles. A sphere and two linked
// tori with a cone have 25 % flipped triangles by the warp field, 0.1 % then; spot and bob 30 and 0.1 %.
//
// Known limits: nacelle between distances is closest-point projection, so that limbs which the reference does
// not have fold over; relaxation moves the folds apart, but where the topology differs some must stay.
#include "nephele/levelset/warp/mesh_warp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/warp/surface_relaxation.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele {

namespace {

constexpr std::size_t kGrain = 256;

/// A mesh at the origin, and where it was.
struct Placed {
  Mesh mesh;
  Vec3d origin;
};

Placed atOrigin(const Mesh& mesh, const char* name) {
  requireValid(mesh);
  require(mesh.faceCount() > 0, fmt::format("warp: the {} has no faces", name));
  require(mesh.isTriangles(), fmt::format("warp: the {} must be triangulated", name));
  Vec3d low = mesh.positions.at(0), high = low;
  for (const Vec3d& p : mesh.positions) {
    require(isFinite(p), fmt::format("warp: the {} has positions that are not finite", name));
    low = min(low, p);
    high = max(high, p);
  }
  Placed result;
  result.origin = (low + high) * 0.5;
  result.mesh.corners = mesh.corners;
  result.mesh.faceStart = mesh.faceStart;
  for (const Vec3d& p : mesh.positions) result.mesh.positions.push_back(p - result.origin);
  return result;
}

/// Where alignment puts a point.
struct Placement {
  Similarity similarity;
  std::optional<BendLattice> lattice;

  Vec3d operator()(const Vec3d& p) const {
    const Vec3d q = similarity(p);
    return lattice ? (*lattice)(q) : q;
  }
};

class PlacementNode final : public FieldNode<Vec3f> {
 public:
  explicit PlacementNode(const Placement& placement) : placement_(placement) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch&) const override {
    for (int i = 0; i < points.count; ++i) {
      const Vec3d q = placement_({points.x[i], points.y[i], points.z[i]});
      for (int c = 0; c < 3; ++c) values[std::size_t(c)][i] = float(q[c]);
    }
  }
  float differenceStep() const override { return kNoLength; }

 private:
  Placement placement_;
};

using Images = std::vector<Vec3d>;

/// Coordinates of points as spans of floats.
struct PointLanes {
  std::vector<float> x, y, z;

  explicit PointLanes(std::size_t count) : x(count), y(count), z(count) {}
  explicit PointLanes(const Images& points) : PointLanes(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      x[i] = float(points[i].x);
      y[i] = float(points[i].y);
      z[i] = float(points[i].z);
    }
  }
  PointSpans points() const { return {x, y, z}; }
  Spans<3> values() { return {{x, y, z}}; }
  Vec3d operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// What both qualities and all attempts share.
struct Pair {
  Placed reference, object;
  std::shared_ptr<const ExactDistance> target, source;
  /// The object, laid on the reference.
  Mesh laid;
  double voxel = 0;
};

/// The nearest points of the reference.
Images snapped(const Pair& pair, const PointLanes& points, const Progress& progress) {
  Images images(points.x.size());
  parallelFor(
      images.size(), kGrain,
      [&](std::size_t begin, std::size_t end) {
        ExactDistance::Cursor cursor;
        for (std::size_t i = begin; i < end; ++i) images[i] = pair.target->at(points[i], cursor).point;
      },
      progress);
  return images;
}

/// Both solids' distances for points of the object on their way to the reference; if asked on grids, which
/// are faster for many points, unless the solids are far from each other.
std::pair<ScalarField, ScalarField> distances(const Pair& pair, bool onGrids, const Progress& progress) {
  double farthest = 0;
  ExactDistance::Cursor cursor;
  if (onGrids)
    for (const Vec3d& p : pair.laid.positions)
      farthest = std::max(farthest, std::abs(pair.target->at(p, cursor).distance));
  const double size = pair.target->size(), reach = farthest + size / 4;
  if (!onGrids || reach > size) return {memo(exactDistance(pair.laid)), memo(exactDistance(pair.target))};
  const MeshDistanceOptions options{2 * pair.voxel, reach, reach};
  return {meshDistance(pair.laid, options, progress), meshDistance(pair.reference.mesh, options, progress)};
}

/// The object's positions carried along while its level set turns into the reference's, in small steps.
Images morphed(const Pair& pair, bool onGrids, const Progress& progress) {
  constexpr int kSteps = 20;
  const auto [from, to] = distances(pair, onGrids, progress);
  PointLanes at(pair.laid.positions);
  for (int step = 1; step <= kSteps; ++step) {
    progress.advance(double(step - 1) / kSteps);
    progress.check();
    const float share = float(step) / kSteps;
    PointLanes next(at.x.size());
    const ScalarField between = step == kSteps ? to : (1 - share) * from + share * to;
    nacelleAt(0.0f, between, at.points(), next.values(), {.steps = 5, .voxel = float(pair.voxel)});
    at = std::move(next);
  }
  return snapped(pair, at, SubProgress(progress, 1, 1));
}

struct Candidate {
  Images images;
  TransferQuality quality;
  std::size_t tears = 0;
  bool isRelaxed = false;
};

Candidate judged(const Pair& pair, Images images, bool isRelaxed, const Progress& progress) {
  const TransferQuality quality = transferQuality(pair.reference.mesh, pair.object.mesh, images, progress);
  const std::size_t tears = countTears(*pair.target, pair.laid, images);
  return {std::move(images), quality, tears, isRelaxed};
}

bool isNoWorse(const TransferQuality& a, const TransferQuality& b) {
  return a.flippedFraction <= b.flippedFraction && a.degenerateFraction <= b.degenerateFraction &&
         a.stretchP95 <= b.stretchP95 && a.coverage >= b.coverage;
}

/// Less is better: bad triangles count most, then coverage, then stretch.
double faultsOf(const Candidate& candidate) {
  constexpr double kPerTear = 0.5, kPerCoverage = 0.1, kPerStretch = 0.01;
  const TransferQuality& q = candidate.quality;
  return kPerTear * double(candidate.tears) / double(std::max<std::size_t>(q.triangleCount, 1)) +
         q.flippedFraction + q.degenerateFraction + kPerCoverage * (1 - q.coverage) +
         kPerStretch * std::log(q.stretchP95);
}

/// The progress of attempts of which nobody knows how many there will be: each takes a share of what is left.
class Attempts {
 public:
  explicit Attempts(const Progress& whole) : whole_(whole) {}
  SubProgress next() {
    constexpr double kShare = 0.15;
    const double from = at_;
    at_ += kShare * (1 - at_);
    return {whole_, from, at_};
  }

 private:
  const Progress& whole_;
  double at_ = 0;
};

/// Relaxes `images` and keeps what is best: no worse in any number than closest points without alignment
/// are, if there is such a map.
Candidate improved(const Pair& pair, const Images& images, WarpQuality quality, const Progress& progress) {
  // Equal shapes: there is nothing to gain, and exact correspondences to lose.
  constexpr double kFew = 1e-3, kHardlyStretched = 1.2, kGoodEnough = 3e-3;
  Attempts attempts(progress);
  std::vector<Candidate> candidates;
  candidates.push_back(judged(pair, images, false, attempts.next()));
  const TransferQuality& plain = candidates.front().quality;
  if (plain.flippedFraction <= kFew && plain.degenerateFraction <= kFew &&
      plain.stretchP95 <= kHardlyStretched)
    return candidates.front();
  const Vec3d shift = pair.object.origin - pair.reference.origin;
  Images unaligned = pair.object.mesh.positions;
  for (Vec3d& p : unaligned) p += shift;
  Images nearest = snapped(pair, PointLanes(unaligned), attempts.next());
  candidates.push_back(judged(pair, std::move(nearest), false, attempts.next()));
  const TransferQuality closest = candidates.back().quality;

  // First what is no worse in anything, and of that what is whole; else fewer bad triangles of both kinds are
  // worth a few more of one.
  const auto isBetter = [&](const TransferQuality& q) {
    return q.flippedFraction + q.degenerateFraction <= closest.flippedFraction + closest.degenerateFraction &&
           q.coverage >= closest.coverage;
  };
  const auto fewestFaults = [](const Candidate& a, const Candidate& b) { return faultsOf(a) < faultsOf(b); };
  const auto bestOf = [&](bool preferWhole) -> const Candidate& {
    const Candidate* best = nullptr;
    int highest = -1;
    for (const Candidate& c : candidates) {
      const bool noWorse = &c != &candidates[1] && isNoWorse(c.quality, closest);
      const bool whole = preferWhole && c.isRelaxed && c.tears == 0 && !fewestFaults(candidates.front(), c);
      const int rank = 2 * noWorse + whole;
      if (rank < highest || (!noWorse && !isBetter(c.quality))) continue;
      if (!best || rank > highest || fewestFaults(c, *best)) best = &c;
      highest = rank;
    }
    return *best;
  };
  SurfaceRelaxation relaxation(*pair.target, pair.laid, progress);
  // Attempts until one has hardly any fold.
  const auto attempt = [&](const Images& start, const RelaxationOptions& options) {
    Images relaxed = relaxation.relaxed(start, options, attempts.next());
    candidates.push_back(judged(pair, std::move(relaxed), true, attempts.next()));
    const TransferQuality& q = candidates.back().quality;
    return q.flippedFraction <= kGoodEnough && q.degenerateFraction <= kGoodEnough && isNoWorse(q, closest);
  };
  // Only then is there a map without folds to aim at.
  const MeshDiagnosis to = diagnose(pair.reference.mesh), from = diagnose(pair.object.mesh);
  const bool isSameTopology =
      to.components == from.components && to.eulerCharacteristic == from.eulerCharacteristic;
  // So that meshes of 60 000 triangles take about a quarter of a minute.
  constexpr std::size_t kLarge = 15000;
  const bool isLarge = pair.object.mesh.faceCount() > kLarge;
  const int tearing = isLarge ? 14 : 20, closing = isLarge ? 12 : 16;
  // Twice free to tear, which finds places where triangles cover the reference, then closed, then polished.
  const auto tornThenClosed = [&](const Images& start, int smoothingRounds) {
    RelaxationOptions torn{
        .smoothingRounds = smoothingRounds, .rounds = tearing, .limit = 5, .lastLimit = 3, .resistsFrom = 1};
    Images at = relaxation.relaxed(start, torn, attempts.next());
    torn.smoothingRounds = 0;
    at = relaxation.relaxed(at, torn, attempts.next());
    bool isGood = false;
    for (const double lastLimit : {3.0, 5.0, 5.0}) {
      isGood = attempt(
          at,
          {.smoothingRounds = 0, .rounds = closing, .limit = 5, .lastLimit = lastLimit, .resistsFrom = 0});
      at = candidates.back().images;
    }
    const TransferQuality& q = candidates.back().quality;
    return isGood && q.flippedFraction + q.degenerateFraction <= kFew;
  };
  if (quality == WarpQuality::balanced) {
    // Few rounds leave no time for both.
    attempt(images, {.smoothingRounds = 2, .rounds = 8, .resistsFrom = 1});
    if (!isNoWorse(candidates.back().quality, closest))
      attempt(images, {.smoothingRounds = 1, .rounds = 12, .limit = 5, .lastLimit = 3, .resistsFrom = 1});
    if (!bestOf(false).isRelaxed) tornThenClosed(images, 2);
  } else if (!isSameTopology || !attempt(images, {})) {
    const bool canMorph = pair.target->isSolid() && pair.source->isSolid();
    const Images start = canMorph ? morphed(pair, isLarge, attempts.next()) : images;
    // Where there is time, from several starts.
    if (!tornThenClosed(start, 2) && !isLarge) {
      if (canMorph) tornThenClosed(images, 2);
      tornThenClosed(start, 6);
    }
    // A fold that few triangles hold collapses them: spread it where closest points have fewer of these.
    constexpr double kSpreading = 30;
    if (const Candidate& best = bestOf(false); !isNoWorse(best.quality, closest))
      attempt(Images(best.images),
              {.smoothingRounds = 1, .rounds = 20, .limit = kSpreading, .lastLimit = kSpreading});
  }
  if (const Candidate& best = bestOf(false);
      quality == WarpQuality::balanced && best.isRelaxed && best.tears > 0)
    attempt(Images(best.images),
            {.smoothingRounds = 0, .rounds = 16, .limit = 5, .lastLimit = 3, .resistsFrom = 0});
  if (const Candidate& best = bestOf(false); best.isRelaxed) {
    Images mended = relaxation.mended(best.images, attempts.next());
    candidates.push_back(judged(pair, std::move(mended), true, attempts.next()));
  }
  return bestOf(true);
}

/// A distance that the solid holds inside, found on a lattice: its inradius or a little less.
double inradius(const ExactDistance& solid) {
  constexpr int kCount = 16;
  std::vector<double> most(kCount);
  parallelFor(kCount, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      ExactDistance::Cursor cursor;
      for (int y = 0; y < kCount; ++y)
        for (int x = 0; x < kCount; ++x) {
          const Vec3d p =
              (Vec3d(x, y, double(z)) + Vec3d(0.5, 0.5, 0.5)) / double(kCount) - Vec3d(0.5, 0.5, 0.5);
          most[z] = std::max(most[z], solid.at(solid.centre() + p * solid.size(), cursor).distance);
        }
    }
  });
  return *std::max_element(most.begin(), most.end());
}

/// The level sets to connect, both about the origin, and where they hold.
struct LevelSets {
  ScalarField object, reference;
  Interval band;
};

LevelSets levelSets(const Pair& pair, double scale, const MeshWarpOptions& options,
                    const Progress& progress) {
  // Outside, every level of the object has one of the reference; inside, none beyond its inradius.
  Interval band = Interval::everything();
  band.max = pair.target->isSolid() ? float(inradius(*pair.target)) : 0.0f;
  const bool gridded = options.gridded && pair.target->isSolid() && pair.source->isSolid();
  if (options.gridded && !gridded)
    progress.note("warp: open meshes have no level set on a grid: exact distances");
  if (!gridded) return {float(scale) * exactDistance(pair.source), exactDistance(pair.target), band};
  double farthest = 0;
  ExactDistance::Cursor cursor;
  for (const Vec3d& p : pair.laid.positions)
    farthest = std::max(farthest, std::abs(pair.target->at(p, cursor).distance));
  // Around the object the map is wanted a quarter of its size far; the reference must hold what that reaches.
  constexpr double kAround = 0.25;
  const double around = kAround * pair.source->size() * scale, reach = farthest + 2 * around;
  band.min = -float(around);
  return {float(scale) * meshDistance(pair.object.mesh,
                                      {pair.voxel / scale, around / scale, pair.source->size()}, progress),
          meshDistance(pair.reference.mesh, {pair.voxel, reach, pair.target->size()}, progress), band};
}

}  // namespace

double estimateWarpBytes(const Mesh& object, const MeshWarpOptions& options) {
  // Measured from 30 000 to 500 000 triangles; most of the second is the factorised system.
  constexpr double kMapped = 1000, kRelaxed = 2600;
  const bool isRelaxed = options.method == WarpMethod::nacelle && options.quality != WarpQuality::fast;
  return (isRelaxed ? kRelaxed : kMapped) * (double(object.corners.size()) - 2 * double(object.faceCount()));
}

MeshWarp warpMesh(const Mesh& reference, const Mesh& object, const MeshWarpOptions& options,
                  const Progress& progress) {
  require(options.order >= 0 && options.order <= 2,
          fmt::format("warp: order must be 0, 1 or 2, got {}", options.order));
  require(options.steps >= 1 && options.steps <= 20,
          fmt::format("warp: steps must be 1 to 20, got {}", options.steps));
  require(options.voxelSize >= 0 && std::isfinite(options.voxelSize),
          fmt::format("warp: the voxel size must be >= 0, got {}", options.voxelSize));
  Pair pair{atOrigin(reference, "reference"), atOrigin(object, "object"), nullptr, nullptr, {}, 0};
  pair.target = std::make_shared<ExactDistance>(pair.reference.mesh);
  pair.source = std::make_shared<ExactDistance>(pair.object.mesh);
  pair.voxel = options.voxelSize > 0 ? options.voxelSize : pair.target->size() / 256;
  const Vec3d to = pair.reference.origin, from = pair.object.origin;

  MeshWarp result;
  Placement placement;
  if (options.method == WarpMethod::closest || options.align == Alignment::none) {
    placement.similarity.shift = from - to;
  } else {
    progress.begin("align");
    const AlignmentResult aligned =
        alignSimilarity(*pair.target, *pair.source, {.seed = options.seed}, progress);
    placement.similarity = aligned.similarity;
    result.alignmentCost = aligned.cost / pair.voxel;
    if (options.align == Alignment::lattice)
      placement.lattice =
          alignLattice(*pair.target, *pair.source, aligned.similarity, {.seed = options.seed}, progress);
  }
  pair.laid = pair.object.mesh;
  for (Vec3d& p : pair.laid.positions) p = placement(p);
  const double scale = placement.similarity.scale;

  progress.begin("warp");
  const LevelSets sets = levelSets(pair, scale, options, progress);
  NacelleOptions nacelleOptions{.steps = options.steps,
                                .order = std::max(options.order, 1),
                                .voxel = float(pair.voxel),
                                .closestPoint = closestPoint(pair.target),
                                .band = sets.band};
  const PointLanes points(pair.laid.positions);
  if (options.method == WarpMethod::closest) {
    result.images = snapped(pair, points, progress);
    result.unconvergedFraction = 1;
  } else {
    PointLanes ends(points.x.size());
    const NacelleStatistics statistics =
        nacelleAt(0.0f, sets.reference, points.points(), ends.values(), nacelleOptions);
    result.iterations = statistics.iterations;
    result.unconvergedFraction = statistics.unconvergedFraction;
    result.images = snapped(pair, ends, progress);
    if (options.quality != WarpQuality::fast) {
      progress.begin("relax");
      Candidate best = improved(pair, result.images, options.quality, progress);
      result.images = std::move(best.images);
      result.isRelaxed = best.isRelaxed;
    }
  }
  for (Vec3d& p : result.images) p += to;

  nacelleOptions.start = VectorField(std::make_shared<PlacementNode>(placement));
  result.reference = translate(sets.reference, Vec3f(to));
  result.object = translate(sets.object, Vec3f(from));
  const VectorField map = options.method == WarpMethod::closest
                              ? compose(closestPoint(pair.target), *nacelleOptions.start)
                              : nacelle(sets.object, sets.reference, nacelleOptions);
  result.map = translate(map, Vec3f(from)) + VectorField(Vec3f(to));
  result.alignment = placement.similarity;
  result.alignment.shift += to - result.alignment.turned(from) * scale;
  return result;
}

}  // namespace nephele
