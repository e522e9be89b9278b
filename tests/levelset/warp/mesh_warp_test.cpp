#include "nephele/levelset/warp/mesh_warp.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/warp/surface_relaxation.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "tests/support/check_field.h"
#include "tests/support/linked_tori.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

Mesh figureObject(float voxel) {
  return marchingCubes(
      *bakeGrid(test::linkedToriAndCone(), {.voxelSize = voxel,
                                            .box = Box{{-1.6f, -1.2f, -1.2f}, {1.6f, 1.6f, 1.2f}},
                                            .band = Interval{-3 * voxel, 3 * voxel}}));
}

Mesh loaded(const std::string& path) {
  return triangulated(readMesh(path));
}

Mesh moved(Mesh mesh, const Vec3f& axis, float degrees, double scale, const Vec3d& shift) {
  const Mat3f turn = Mat3f::rotation(axis, radians(degrees));
  for (Vec3d& p : mesh.positions) {
    Vec3d q;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) q[r] += double(turn(r, c)) * p[c];
    p = q * scale + shift;
  }
  return mesh;
}

/// Every triangle in four, the new corners in the middles of sides.
Mesh subdivided(const Mesh& mesh) {
  Mesh result;
  result.positions = mesh.positions;
  for (std::size_t t = 0; t < mesh.faceCount(); ++t) {
    const auto f = mesh.face(t);
    const auto middle = std::uint32_t(result.positions.size());
    for (std::size_t i = 0; i < 3; ++i)
      result.positions.push_back((mesh.positions[f[i]] + mesh.positions[f[(i + 1) % 3]]) * 0.5);
    for (std::uint32_t i = 0; i < 3; ++i)
      result.addFace(std::array<std::uint32_t, 3>{f[i], middle + i, middle + (i + 2) % 3});
    result.addFace(std::array<std::uint32_t, 3>{middle, middle + 1, middle + 2});
  }
  return result;
}

struct Errors {
  double median, p99;
};

/// Distances between points, in units of `size`.
Errors errorsOf(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b, double size) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < a.size(); ++i) errors.push_back(length(a[i] - b[i]) / size);
  std::sort(errors.begin(), errors.end());
  return {errors[errors.size() / 2], errors[errors.size() * 99 / 100]};
}

bool allFinite(const std::vector<Vec3d>& points) {
  return std::all_of(points.begin(), points.end(), [](const Vec3d& p) { return isFinite(p); });
}

double farthestFrom(const Mesh& reference, const std::vector<Vec3d>& images) {
  const ExactDistance distance(reference);
  double farthest = 0;
  for (const Vec3d& p : images) farthest = std::max(farthest, std::abs(distance.at(p).distance));
  return farthest / distance.size();
}

TEST(MeshWarp, GivesSubdividedSurfacesTheirOwnPositionsBack) {
  // The project's bars for coordinates, in sizes: median 1e-4, p99 1e-3. New corners lie on the old faces.
  for (const char* name : {"meshes/spot_uv.obj", "meshes/bunny_28k_uv.ply"}) {
    const std::string path = test::sharedData(name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const Mesh reference = loaded(path), object = subdivided(reference);
    for (const Alignment align : {Alignment::none, Alignment::similarity}) {
      const MeshWarp warp = warpMesh(reference, object, {.align = align, .quality = WarpQuality::fast});
      const Errors errors = errorsOf(warp.images, object.positions, boundingBox(reference).longestSide());
      EXPECT_LE(errors.median, 1e-7) << name;
      EXPECT_LE(errors.p99, 1e-6) << name;
    }
  }
}

TEST(MeshWarp, FindsPositionsAgainAfterAnySimilarity) {
  // Bars: flips <= 0.2 %, stretch p95 <= 1.2, correspondence median <= 0.1 voxel (1 / 2560 of the size).
  const std::string path = test::sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh reference = loaded(path);
  const std::pair<float, double> cases[] = {{30.0f, 0.5}, {90.0f, 1.0}, {150.0f, 2.0}};
  for (const auto& [degrees, scale] : cases) {
    const Mesh object = moved(reference, {1, 2, 0.5f}, degrees, scale, {1, -2, 3});
    const MeshWarp warp = warpMesh(reference, object);
    const Errors errors = errorsOf(warp.images, reference.positions, boundingBox(reference).longestSide());
    EXPECT_LE(errors.median, 1e-6) << degrees << " degrees, scale " << scale;
    EXPECT_LE(errors.p99, 1e-5) << degrees << " degrees, scale " << scale;
    const TransferQuality quality = transferQuality(reference, object, warp.images);
    EXPECT_LE(quality.flippedFraction, 0.002);
    EXPECT_LE(quality.stretchP95, 1.2);
    EXPECT_LE(warp.alignmentCost, 0.01);
  }
}

TEST(MeshWarp, BestFoldsFarLessThanClosestPoints) {
  // The notes' figure: a ball to linked tori and a cone. Whatever wraps around nothing must fold somewhere,
  // but far less than the 28 % of closest points.
  const Mesh reference = test::icosphere(1, 3), object = figureObject(1.0f / 8);
  const auto quality = [&](const MeshWarpOptions& options) {
    return transferQuality(reference, object, warpMesh(reference, object, options).images);
  };
  const TransferQuality closest = quality({.method = WarpMethod::closest});
  const TransferQuality best = quality({.quality = WarpQuality::best});
  EXPECT_GT(closest.flippedFraction, 0.2);
  EXPECT_LE(best.flippedFraction, 0.25 * closest.flippedFraction);
  EXPECT_LE(best.flippedFraction + best.degenerateFraction, 0.25 * closest.flippedFraction);
  EXPECT_GE(best.coverage, closest.coverage);
}

TEST(MeshWarp, BestOpensAllFoldsBetweenSpheres) {
  // A mushroom, whose cap hangs over, and a ball: a map without folds exists.
  Mesh object = test::icosphere(1, 4);
  for (Vec3d& p : object.positions) {
    const double s = std::max(p.y - 0.3, 0.0) / 0.7, wide = 1 - 2.5 * s + 8 * s * s;
    p = {p.x * wide, p.y + 1.2 * s, p.z * wide};
  }
  const Mesh reference = test::icosphere(1, 3);
  const MeshWarp closest = warpMesh(reference, object, {.method = WarpMethod::closest});
  const MeshWarp best = warpMesh(reference, object, {.quality = WarpQuality::best});
  EXPECT_GT(transferQuality(reference, object, closest.images).flippedFraction, 0.05);
  EXPECT_TRUE(best.isRelaxed);
  EXPECT_EQ(transferQuality(reference, object, best.images).flippedFraction, 0);
  EXPECT_LE(farthestFrom(reference, best.images), 1e-12);
}

TEST(MeshWarp, MapTakesTheObjectsSurfaceToTheReferences) {
  // The zero surface of reference(map) against the object: p99 <= 0.05 voxels on its positions; and the map
  // agrees with the images before relaxation.
  const Mesh reference = moved(test::icosphere(1, 4), {0, 1, 0}, 0, 1, {5, 0, 0}),
             object = figureObject(0.1f);
  const MeshWarp warp = warpMesh(reference, object, {.quality = WarpQuality::fast});
  const double voxel = 2.0 / 256;
  test::Points points(object.positions.size());
  for (std::size_t i = 0; i < points.size(); ++i) points.set(i, Vec3f(object.positions[i]));
  const auto values = test::evaluate(compose(warp.reference, warp.map), points);
  const auto images = test::evaluate(warp.map, points);
  std::vector<float> residuals;
  for (std::size_t i = 0; i < points.size(); ++i) {
    residuals.push_back(float(values.data[0][i] / voxel));
    const Vec3d image(images.data[0][i], images.data[1][i], images.data[2][i]);
    ASSERT_LE(length(image - warp.images[i]), 0.02);
  }
  EXPECT_LE(residualOf(residuals).p99, 0.05);
  ASSERT_EQ(warp.iterations.size(), 4u);
  EXPECT_LE(warp.iterations[3].p99, 0.01);
  EXPECT_LE(warp.iterations[3].max, 0.1);
}

TEST(MeshWarp, ConnectsTheLevelSetsAllAroundTheObject) {
  // Equation 4.1 in units of the reference; twice the size tells object(x) from scale * object(x).
  const Mesh reference = test::icosphere(2, 4), object = test::torusMesh(1, 0.4, 48, 24);
  for (const bool gridded : {false, true}) {
    const MeshWarp warp = warpMesh(reference, object,
                                   {.quality = WarpQuality::fast, .voxelSize = 1.0 / 16, .gridded = gridded});
    std::mt19937 random(1);
    const test::Points points = test::randomPoints({{-1.6f, -1.6f, -0.6f}, {1.6f, 1.6f, 0.6f}}, 2000, random);
    const auto wanted = test::evaluate(warp.object, points);
    const auto found = test::evaluate(compose(warp.reference, warp.map), points);
    std::vector<float> residuals;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (wanted.data[0][i] > -0.3f) residuals.push_back((wanted.data[0][i] - found.data[0][i]) * 16);
    EXPECT_LE(residualOf(residuals).p99, 0.1) << gridded;
  }
}

TEST(MeshWarp, GriddedImagesLieWhereExactOnesDo) {
  // Within a tenth of a voxel but near the medial axis, which the grid rounds.
  const Mesh reference = test::torusMesh(1, 0.4, 48, 24), object = test::torusMesh(1.05, 0.45, 31, 17);
  const MeshWarpOptions options{.align = Alignment::none, .quality = WarpQuality::fast};
  MeshWarpOptions onGrid = options;
  onGrid.gridded = true;
  const MeshWarp exact = warpMesh(reference, object, options), gridded = warpMesh(reference, object, onGrid);
  const Errors errors = errorsOf(exact.images, gridded.images, 2.8 / 256);
  EXPECT_LE(errors.median, 0.2);
  EXPECT_LE(errors.p99, 1.0);
}

TEST(MeshWarp, StaysOnTheReferenceWhateverTheInput) {
  const Mesh ball = test::icosphere(1, 2);
  Mesh open = ball;
  open.corners.resize(open.corners.size() / 2 / 3 * 3);
  open.faceStart.resize(open.corners.size() / 3 + 1);
  Mesh inverted = ball;
  for (std::size_t t = 0; t < inverted.corners.size(); t += 3)
    std::swap(inverted.corners[t], inverted.corners[t + 1]);
  Mesh many = ball;
  for (int k = 1; k < 5; ++k) {
    const auto first = std::uint32_t(many.positions.size());
    for (const Vec3d& p : ball.positions) many.positions.push_back(p * 0.3 + Vec3d(1.5 * k, 0.4 * k, 0));
    for (std::size_t t = 0; t < ball.faceCount(); ++t)
      many.addFace(std::array<std::uint32_t, 3>{first + ball.corners[3 * t], first + ball.corners[3 * t + 1],
                                                first + ball.corners[3 * t + 2]});
  }
  Mesh doubled = ball;  // coincident positions, and triangles without area
  doubled.positions.push_back(ball.positions[0]);
  doubled.addFace(std::array<std::uint32_t, 3>{0, std::uint32_t(ball.positions.size()), 1});
  Mesh flat;  // a triangle: no inside, no volume
  flat.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  const Mesh large = moved(ball, {0, 1, 0}, 20, 1000, {}),
             away = moved(ball, {0, 1, 0}, 20, 1, {1e6, 1e6, 0});
  const Mesh torus = test::torusMesh(1, 0.3, 24, 12);
  using Meshes = std::vector<const Mesh*>;
  for (const Mesh* reference : Meshes{&torus, &open, &inverted, &many, &flat, &away})
    for (const Mesh* object : Meshes{&ball, &open, &inverted, &many, &doubled, &flat, &large, &away})
      for (const WarpQuality quality : {WarpQuality::fast, WarpQuality::balanced}) {
        if (quality == WarpQuality::balanced && reference != &open) continue;
        const Alignment align = quality == WarpQuality::fast ? Alignment::none : Alignment::similarity;
        const MeshWarp warp = warpMesh(*reference, *object, {.align = align, .quality = quality});
        ASSERT_TRUE(allFinite(warp.images));
        ASSERT_LE(farthestFrom(*reference, warp.images), 1e-6);  // near triangles are told apart in floats
        ASSERT_LE(warp.unconvergedFraction, 1.0);
      }
}

TEST(MeshWarp, ReportsWhatDoesNotConverge) {
  // Exact distances have a gradient everywhere: nothing needs the fallback, however far the object is.
  const Mesh reference = test::icosphere(1, 3);
  const Mesh object = moved(test::icosphere(1, 3), {0, 1, 0}, 0, 1, {300, 0, 0});
  const MeshWarp warp = warpMesh(reference, object, {.align = Alignment::none, .quality = WarpQuality::fast});
  EXPECT_EQ(warp.unconvergedFraction, 0);
  EXPECT_GT(warp.iterations.front().median, 1e4);
  EXPECT_LE(warp.iterations.back().max, 0.1);
}

TEST(MeshWarp, ClosestIsTheNearestPoint) {
  const Mesh reference = test::torusMesh(1, 0.3, 24, 12), object = test::icosphere(1, 3);
  const MeshWarp warp = warpMesh(reference, object, {.method = WarpMethod::closest});
  const ExactDistance distance(reference);
  for (std::size_t i = 0; i < object.positions.size(); ++i) {
    const double wanted = std::abs(distance.at(object.positions[i]).distance);
    ASSERT_NEAR(length(warp.images[i] - object.positions[i]), wanted, 1e-6);
  }
  EXPECT_FALSE(warp.isRelaxed);
}

TEST(MeshWarp, IsTheSameTwice) {
  const Mesh reference = test::torusMesh(1, 0.4, 24, 12), object = test::icosphere(1, 3);
  const MeshWarp a = warpMesh(reference, object), b = warpMesh(reference, object);
  EXPECT_EQ(a.images, b.images);
}

TEST(MeshWarp, RejectsBadInput) {
  const Mesh ball = test::icosphere(1, 1);
  EXPECT_THROW(warpMesh(Mesh{}, ball), Error);
  EXPECT_THROW(warpMesh(ball, Mesh{}), Error);
  EXPECT_THROW(warpMesh(ball, ball, {.order = 3}), Error);
  EXPECT_THROW(warpMesh(ball, ball, {.steps = 0}), Error);
  EXPECT_THROW(warpMesh(ball, ball, {.voxelSize = -1}), Error);
  Mesh bad = ball;
  bad.positions[0].x = std::nan("");
  EXPECT_THROW(warpMesh(ball, bad), Error);
}

TEST(NacelleOnGrids, BakedCurvaturesChangeTheStepsAndNotTheResult) {
  // The notes' faster variant: g.g and g.M.g looked up on grids of two voxels. docs/nacelle.md has the table.
  constexpr float kVoxel = 1.0f / 30;
  const VectorField x = position();
  const ScalarField ball = 0.5f * (1.0f - dot(x, x)), object = 0.5f * test::linkedToriAndCone();
  const auto onGrid = [](const ScalarField& f) {
    return bake(f, {.voxelSize = 2 * kVoxel, .box = {{-2, -2, -2}, {2, 2, 2}}});
  };
  std::mt19937 random(1);
  const test::Points points = test::randomPoints({{-1.6f, -1.2f, -1.2f}, {1.6f, 1.6f, 1.2f}}, 2000, random);
  const auto residuals = [&](const NacelleOptions& options) {
    test::Points images(points.size());
    const Spans<3> lanes{{images.x, images.y, images.z}};
    return nacelleAt(object, ball, points.spans(), lanes, options).iterations;
  };
  const auto plain = residuals({.order = 2, .voxel = kVoxel, .band = {-10, 0.4f}});
  const auto looked = residuals({.order = 2, .voxel = kVoxel, .band = {-10, 0.4f}, .bake = onGrid});
  EXPECT_LT(plain[1].median, 1e-3);
  EXPECT_GT(looked[1].median, 1e-3);
  EXPECT_LE(looked[3].p95, 1e-2);
}

TEST(RelaxImages, LeavesAnIsometryAlone) {
  const Mesh mesh = test::icosphere(1, 3);
  const ExactDistance reference(mesh);
  const std::vector<Vec3d> images = relaxImages(reference, mesh, mesh.positions);
  const Errors errors = errorsOf(images, mesh.positions, 2);
  EXPECT_LE(errors.p99, 2e-3);
}

TEST(RelaxImages, RejectsBadOptions) {
  const Mesh mesh = test::icosphere(1, 1);
  const ExactDistance reference(mesh);
  EXPECT_THROW(relaxImages(reference, mesh, std::vector<Vec3d>(3)), Error);
  EXPECT_THROW(relaxImages(reference, mesh, mesh.positions, {.rounds = -1}), Error);
  EXPECT_THROW(relaxImages(reference, mesh, mesh.positions, {.areaWeight = 0}), Error);
  EXPECT_THROW(relaxImages(reference, mesh, mesh.positions, {.limit = 0}), Error);
  EXPECT_THROW(relaxImages(reference, mesh, mesh.positions, {.resistsFrom = -0.1}), Error);
  EXPECT_THROW(relaxImages(reference, mesh, mesh.positions, {.resistsFrom = 1.1}), Error);
}

TEST(MeshWarp, ProgressOfRelaxationRisesFromAttemptToAttempt) {
  class Recorder final : public Progress {
   public:
    void begin(std::string_view stage) const override { isRelaxing_ = stage == "relax"; }
    void advance(double fraction) const override {
      if (isRelaxing_) fractions.push_back(fraction);
    }
    mutable std::vector<double> fractions;

   private:
    mutable bool isRelaxing_ = false;
  };
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const Recorder progress;
  // A ball on linked tori: no map without folds, so that there are several attempts.
  warpMesh(figureObject(0.1f), test::icosphere(3, 1), {.quality = WarpQuality::best}, progress);
  EXPECT_GE(progress.fractions.size(), 50u);
  EXPECT_TRUE(std::is_sorted(progress.fractions.begin(), progress.fractions.end()));
  EXPECT_GE(progress.fractions.back(), 0.5);
  EXPECT_LE(progress.fractions.back(), 1);
}

TEST(MeshWarp, RelaxationIsCancelledBeforeItsFirstRound) {
  class StopWhenRelaxing final : public Progress {
   public:
    void begin(std::string_view stage) const override { isRelaxing_ = stage == "relax"; }
    void advance(double) const override { advances += isRelaxing_; }
    bool cancelled() const override { return isRelaxing_; }
    mutable int advances = 0;

   private:
    mutable bool isRelaxing_ = false;
  };
  const StopWhenRelaxing progress;
  EXPECT_THROW(warpMesh(figureObject(0.1f), test::icosphere(3, 1), {}, progress), Cancelled);
  EXPECT_EQ(progress.advances, 0);
}

}  // namespace
}  // namespace nephele
