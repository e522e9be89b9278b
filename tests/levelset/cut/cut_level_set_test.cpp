#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/marching_tetrahedra.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/levelset/cut/balls_and_blades.h"
#include "tests/support/brick_grids.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

/// How far a point is from the nearest of some planes.
double toPlanes(const Vec3d& p, const std::vector<BladePlane>& planes) {
  double least = std::numeric_limits<double>::infinity();
  for (const BladePlane& plane : planes)
    least = std::min(least, std::abs(dot(p - Vec3d(plane.point), normalize(Vec3d(plane.normal)))));
  return least;
}

TEST(LevelSetPieces, PlanesThroughTheCentreOfABallMakeNSquaredMinusNPlusTwo) {
  const auto level = ball(32);
  const Mesh whole = marchingTetrahedra(*level);
  for (const int n : {1, 3, 5, 8}) {
    const auto blades = randomBlades({.count = n, .box = kBall, .throughCentre = true});
    const Pieces cut = cutIntoMeshes(*level, {.planes = blades});
    EXPECT_EQ(cut.pieces.size(), std::size_t(n * n - n + 2));
    expectSound(whole, cut);
    EXPECT_NEAR(volumeSum(cut) / signedVolume(whole), 1, 1e-10);
  }
}

TEST(LevelSetPieces, CutFacesLieOnTheirKnivesAndOuterOnesOnTheLevelSet) {
  const auto level = ball(40);
  const double h = double(level->voxelSize());
  const auto blades = randomBlades({.count = 5, .box = kBall, .seed = 1});
  for (const Piece& piece : cutIntoMeshes(*level, {.planes = blades}).pieces) {
    for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f)
      for (const std::uint32_t v : piece.mesh.face(f)) {
        const Vec3d& p = piece.mesh.positions[v];
        if (f >= firstInside(piece.mesh)) {
          EXPECT_LT(toPlanes(p, blades), 1e-3 * h);
        } else {
          EXPECT_NEAR(length(p), 1, 0.01 * h);
        }
      }
  }
}

TEST(LevelSetPieces, APlaneThroughSamplesHalvesABall) {
  const auto level = ball(25);
  const Mesh whole = marchingTetrahedra(*level);
  const Pieces cut = cutIntoMeshes(*level, {.planes = {{{0, 0, 0}, {1, 0, 0}}}});
  expectSound(whole, cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    // The tetrahedra are symmetric about the centre.
    EXPECT_NEAR(piece.mass.volume, signedVolume(whole) / 2, 1e-7);
    EXPECT_NEAR(piece.mass.volume, 2 * M_PI / 3, 0.01);
    EXPECT_NEAR(insideArea(piece.mesh), M_PI, 0.01);
  }
  // The same plane as any other field: made of triangles of the lattice, in the same place.
  const Pieces field = cutIntoMeshes(*level, {.fields = {flatKnife({{0, 0, 0}, {1, 0, 0}})}});
  ASSERT_EQ(field.pieces.size(), 2u);
  expectSound(whole, field);
  for (const Piece& piece : field.pieces) EXPECT_NEAR(piece.mass.volume, signedVolume(whole) / 2, 1e-7);
}

TEST(LevelSetPieces, AKnifeThatMissesLeavesOnePiece) {
  const auto level = ball(16);
  const Pieces cut =
      cutIntoMeshes(*level, {.planes = {{{0, 3, 0}, {0, 1, 0}}}, .fields = {Knife(sphere({5, 0, 0}, 1))}});
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.pieces[0].code.sides, (std::vector<bool>{false, false}));
  EXPECT_NEAR(cut.pieces[0].mass.volume, signedVolume(marchingTetrahedra(*level)), 1e-11);
}

TEST(LevelSetPieces, KnivesThatCoincideCutOnce) {
  const auto level = ball(16);
  const BladePlane plane{{0.1f, 0, 0}, {1, 0.3f, 0}};
  const RoughBlade rough{plane, {.amplitude = 0.05f, .noise = {.frequency = 2}}};
  const Knife tool(sphere({0, 1, 0}, 0.7f));
  for (const Knives& knives :
       {Knives{.planes = {plane, plane}}, Knives{.rough = {rough, rough}}, Knives{.fields = {tool, tool}}}) {
    const Pieces cut = cutIntoMeshes(*level, knives);
    ASSERT_EQ(cut.pieces.size(), 2u);
    EXPECT_EQ(cut.slivers, 0u);
    for (const Piece& piece : cut.pieces) EXPECT_EQ(piece.code.sides[0], piece.code.sides[1]);
    expectSound(marchingTetrahedra(*level), cut);
  }
}

TEST(LevelSetPieces, AKnifeMayCoincideWithTheSurface) {
  // Refused of meshes, where two of them have to be brought together.
  const auto level = ball(16);
  for (const Pieces& cut : {cutIntoMeshes(*level, {.fields = {gridField(level)}}),
                            cutIntoMeshes(*level, {.fields = {Knife(sphere({0, 0, 0}, 1))}})}) {
    ASSERT_EQ(cut.pieces.size(), 1u);
    EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{true});
    EXPECT_NEAR(cut.pieces[0].mass.volume, signedVolume(marchingTetrahedra(*level)), 1e-6);
  }
}

TEST(LevelSetPieces, ABallCutsOutALens) {
  const auto level = ball(40);
  const Pieces cut = cutIntoMeshes(*level, {.fields = {Knife(sphere({1, 0, 0}, 1))}});
  expectSound(marchingTetrahedra(*level), cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  const Piece& lens = cut.pieces[1];
  EXPECT_EQ(lens.code.sides, std::vector<bool>{true});
  EXPECT_NEAR(lens.mass.volume, 5 * M_PI / 12, 0.002 * 5 * M_PI / 12);  // two caps of height 1/2
  EXPECT_NEAR(lens.neighbours[0].area, M_PI, 0.005 * M_PI);             // a cap: 2 pi r h
  // 3 / 8 of a voxel squared over the radius, and the margin beside samples; off the rim nearly nothing
  // (ALGORITHMS 4: 1e-3).
  std::size_t offRim = 0;
  for (std::size_t f = firstInside(lens.mesh); f < lens.mesh.faceCount(); ++f)
    for (const std::uint32_t v : lens.mesh.face(f)) {
      const Vec3d q = lens.mesh.positions[v] / double(level->voxelSize());
      const bool isOffRim = length(q) < 40 - 2;
      offRim += isOffRim;
      EXPECT_NEAR(length(q - Vec3d{40, 0, 0}), 40, isOffRim ? 1e-3 : 0.01);
    }
  EXPECT_GT(offRim, 20000u);
}

/// How far vertices of inner faces, off the outer surface of the ball, lie from a blade with a kerf, voxels.
double farthestFromBlade(const Pieces& cut, const Knife& knife, float kerf, double voxel) {
  double worst = 0;
  for (const Piece& piece : cut.pieces) {
    std::array<std::vector<float>, 3> points, slopes;
    for (std::size_t f = firstInside(piece.mesh); f < piece.mesh.faceCount(); ++f)
      for (const std::uint32_t v : piece.mesh.face(f))
        if (const Vec3d& p = piece.mesh.positions[v]; length(p) < 1 - 3 * voxel)
          for (int axis = 0; axis < 3; ++axis) points[std::size_t(axis)].push_back(float(p[axis]));
    EXPECT_GT(points[0].size(), 3000u);
    std::vector<float> values(points[0].size());
    for (auto& lane : slopes) lane.resize(values.size());
    knife.field.evalGrad({points[0], points[1], points[2]}, values, {{slopes[0], slopes[1], slopes[2]}});
    const double side = piece.code.sides[0] ? 0.5 : -0.5;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double slope = double(length(Vec3f{slopes[0][i], slopes[1][i], slopes[2][i]}));
      worst = std::max(worst, std::abs(double(values[i]) / slope - side * double(kerf)) / voxel);
    }
  }
  return worst;
}

TEST(LevelSetPieces, VerticesOfCurvedBladesLieOnThem) {
  // ALGORITHMS 4: 1e-3 of a voxel.
  const auto level = ball(24);
  const double voxel = double(level->voxelSize());
  const RoughBlade rough{{{0, 0, 0}, {0.2f, 1, 0}}, {.amplitude = 0.05f, .noise = {.frequency = 2}}};
  const Knife hills = roughKnife(rough.plane, rough.roughness), tool(sphere({0, 0, 0}, 0.5f));
  for (const float kerf : {0.0f, 0.05f * level->voxelSize(), 0.5f * level->voxelSize()}) {
    EXPECT_LT(
        farthestFromBlade(cutIntoMeshes(*level, {.rough = {rough}}, {.kerf = kerf}), hills, kerf, voxel),
        1e-3);
    EXPECT_LT(farthestFromBlade(cutIntoMeshes(*level, {.fields = {tool}}, {.kerf = kerf}), tool, kerf, voxel),
              1e-3);
  }
}

TEST(LevelSetPieces, SidesOfANarrowKerfDoNotMeet) {
  // The blade bends by more than the kerf is wide within a voxel.
  const auto level = ball(16);
  const RoughBlade rough{{{0, 0, 0}, {0.2f, 1, 0}},
                         {.amplitude = 0.12f, .noise = {.frequency = 2, .seed = 1}}};
  const Pieces cut = cutIntoMeshes(*level, {.rough = {rough}, .fields = {Knife(sphere({0.1f, 0, 0}, 0.4f))}},
                                   {.kerf = 0.01f * level->voxelSize()});
  ASSERT_GT(cut.pieces.size(), 2u);
  Mesh all;
  for (const Piece& piece : cut.pieces) {
    EXPECT_EQ(countSelfIntersections(piece.mesh), 0u);
    const auto first = std::uint32_t(all.positions.size());
    all.positions.insert(all.positions.end(), piece.mesh.positions.begin(), piece.mesh.positions.end());
    for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f) {
      const auto face = piece.mesh.face(f);
      all.addFace(std::array{face[0] + first, face[1] + first, face[2] + first});
    }
  }
  EXPECT_EQ(countSelfIntersections(all), 0u);
}

TEST(LevelSetPieces, VoronoiCellsAreThose) {
  const auto level = ball(24);
  const auto points = scatteredPoints(sphere({0, 0, 0}, 0.9f), kBall, 12, 1);
  const Pieces cut = cutIntoMeshes(*level, {.cells = points});
  expectSound(marchingTetrahedra(*level), cut);
  EXPECT_EQ(cut.pieces.size(), 12u);
  for (const Piece& piece : cut.pieces)
    for (const Vec3d& p : piece.mesh.positions)
      for (const Vec3f& other : points)
        EXPECT_LE(length(p - Vec3d(points[*piece.cell])), length(p - Vec3d(other)) + 1e-9);
}

TEST(LevelSetPieces, AKerfTakesItsWidthTimesTheArea) {
  const auto level = ball(24);
  const double whole = signedVolume(marchingTetrahedra(*level));
  const float kerf = 0.04f;
  const RoughBlade rough{{{0, 0, 0}, {0.2f, 1, 0}}, {.amplitude = 0.03f, .noise = {.frequency = 1.5f}}};
  const Knife tool(sphere({0, 0, 0}, 0.6f));
  const auto taken = [&](const Knives& knives) {
    double area = 0;
    for (const Piece& piece : cutIntoMeshes(*level, knives).pieces) area += insideArea(piece.mesh) / 2;
    const Pieces cut = cutIntoMeshes(*level, knives, {.kerf = kerf});
    EXPECT_EQ(cut.pieces.size(), 2u);
    for (const Piece& piece : cut.pieces) {
      EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold());
      EXPECT_TRUE(piece.neighbours.empty());
    }
    return (whole - volumeSum(cut)) / (double(kerf) * area);
  };
  EXPECT_NEAR(taken({.planes = {{{0, 0.2f, 0}, {0, 1, 1}}}}), 1, 0.01);
  EXPECT_NEAR(taken({.rough = {rough}}), 1, 0.01);
  EXPECT_NEAR(taken({.fields = {tool}}), 1, 0.01);
  EXPECT_NEAR(taken({.cells = {{-0.5f, 0, 0}, {0.5f, 0.1f, 0}}}), 1, 0.01);
}

TEST(LevelSetPieces, PermutedKnivesMakeTheSameBits) {
  const auto level = ball(20);
  Knives knives{
      .planes = randomBlades({.count = 4, .box = kBall, .throughCentre = true, .seed = 3}),
      .cells = scatteredPoints(sphere({0, 0, 0}, 0.9f), kBall, 4, 1),
      .rough = {{{{0, 0, 0}, {1, 0, 0}}, {.amplitude = 0.05f, .noise = {.frequency = 2}}},
                {{{0, 0, 0}, {0, 1, 0}}, {.amplitude = 0.05f, .noise = {.frequency = 2, .seed = 1}}}},
      .fields = {Knife(sphere({0, 0, 1}, 0.7f)), Knife(sphere({0, 0, -1}, 0.5f)),
                 Knife(sphere({0, 1, 0}, 1))}};
  const Pieces cut = cutIntoMeshes(*level, knives);
  std::reverse(knives.planes.begin(), knives.planes.end());
  std::reverse(knives.cells.begin(), knives.cells.end());
  std::reverse(knives.rough.begin(), knives.rough.end());
  std::rotate(knives.fields.begin(), knives.fields.begin() + 1, knives.fields.end());
  const Pieces other = cutIntoMeshes(*level, knives);
  ASSERT_EQ(cut.pieces.size(), other.pieces.size());
  EXPECT_GT(cut.pieces.size(), 50u);
  for (std::size_t i = 0; i < cut.pieces.size(); ++i) {
    const Piece &a = cut.pieces[i], &b = other.pieces[i];
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.mesh.corners, b.mesh.corners);
    EXPECT_EQ(attributeOf(a.mesh, "uv").values, attributeOf(b.mesh, "uv").values);
    EXPECT_EQ(*a.cell, 3 - *b.cell);
    const auto& s = a.code.sides;
    EXPECT_EQ(b.code.sides, (std::vector<bool>{s[3], s[2], s[1], s[0], s[5], s[4], s[7], s[8], s[6]}));
  }
}

TEST(LevelSetPieces, AreTheSameAtAnyNumberOfThreads) {
  const auto level = ball(24);
  const Knives knives{.planes = randomBlades({.count = 3, .box = kBall}),
                      .fields = {Knife(sphere({0, 0, 1}, 0.7f))}};
  const Pieces many = cutIntoMeshes(*level, knives);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Pieces alone = cutIntoMeshes(*level, knives);
  ASSERT_EQ(many.pieces.size(), alone.pieces.size());
  for (std::size_t i = 0; i < many.pieces.size(); ++i) {
    EXPECT_EQ(many.pieces[i].mesh.positions, alone.pieces[i].mesh.positions);
    EXPECT_EQ(many.pieces[i].mesh.corners, alone.pieces[i].mesh.corners);
  }
}

TEST(LevelSetPieces, InnerFacesHaveTheirPlacesAsTextureCoordinates) {
  const auto level = ball(16);
  const RoughBlade rough{{{0, 0.1f, 0}, {0, 1, 0}}, {.amplitude = 0.05f, .noise = {.frequency = 1}}};
  const Pieces cut = cutIntoMeshes(*level, {.rough = {rough}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    const MeshAttribute& uv = attributeOf(piece.mesh, "uv");
    ASSERT_LT(firstInside(piece.mesh), piece.mesh.faceCount());
    for (std::size_t c = 3 * firstInside(piece.mesh); c < piece.mesh.corners.size(); ++c) {
      // Across y: x and z, in some order and direction.
      const Vec3d& p = piece.mesh.positions[piece.mesh.corners[c]];
      EXPECT_NEAR(std::hypot(double(uv.values[2 * c]), double(uv.values[2 * c + 1])), std::hypot(p.x, p.z),
                  1e-6);
    }
  }
}

TEST(LevelSetPieces, SliversBelowAVoxelAreLeftOutAndCounted) {
  const auto level = ball(10);
  const double voxel = std::pow(double(level->voxelSize()), 3);
  // A cap of height 0.02: pi h^2 (1 - h / 3), 1.25 of a thousandth.
  const Knives knives{.planes = {{{0, 0.985f, 0}, {0, 1, 0}}}};
  const Pieces cut = cutIntoMeshes(*level, knives);
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.slivers, 1u);
  EXPECT_GT(cut.sliverVolume, 0);
  EXPECT_LT(cut.sliverVolume, voxel);
  EXPECT_EQ(cutIntoMeshes(*level, knives, {.minVolume = 0.0}).pieces.size(), 2u);
}

TEST(LevelSetPieces, AreSoundOnAnySamplesByAnyFields) {
  std::size_t checked = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    const int side = 3 + int(seed / 4 % 4);
    const auto level = randomLattice(seed, side);
    const Mesh whole = marchingTetrahedra(*level);
    if (whole.faceCount() == 0) continue;
    std::mt19937 random(seed);
    Knives knives;
    CutOptions options{.minVolume = 0.0};
    const int fields = 1 + int(random() % 3);
    for (int k = 0; k < fields; ++k)
      knives.fields.push_back(gridField(randomLattice(std::uint32_t(random()), side)));
    if (random() % 4 == 0) options.kerf = 0.1f;
    const Pieces cut = cutIntoMeshes(*level, knives, options);
    for (const Piece& piece : cut.pieces) {
      const Topology topology = topologyOf(piece.mesh);
      ASSERT_TRUE(topology.isClosedManifold()) << "seed " << seed << ": " << topology;
      ASSERT_GT(piece.mass.volume, 0) << seed;
      ++checked;
    }
    if (options.kerf == 0) {
      // Where knives are near, a sample of 0 counts as 2^-29 of the largest.
      ASSERT_NEAR(volumeSum(cut) / signedVolume(whole), 1, 0x1p-29) << seed;
    }
  }
  EXPECT_GT(checked, 300u);
}

TEST(LevelSetPieces, AreSoundOnAnySamplesByPlanes) {
  for (std::uint32_t seed = 0; seed < 120; ++seed) {
    const auto level = randomLattice(seed, 3 + int(seed / 4 % 4));
    const Mesh whole = marchingTetrahedra(*level);
    if (whole.faceCount() == 0) continue;
    const CutOptions options{.minVolume = 0.0};
    Knives knives{.planes = randomBlades({.count = 2, .box = boundingBox(whole), .seed = seed})};
    knives.planes.push_back({{0, 7, 0}, {0, 1, 0}});  // through samples
    const Pieces cut = cutIntoMeshes(*level, knives, options);
    for (const Piece& piece : cut.pieces) {
      const Topology topology = topologyOf(piece.mesh);
      ASSERT_TRUE(topology.isClosedManifold()) << "seed " << seed << ": " << topology;
    }
    ASSERT_NEAR(volumeSum(cut) / signedVolume(whole), 1, 1e-10) << seed;
    // Together with fields, whose faces may lie in the plane, surfaces may touch themselves along edges.
    knives.fields.push_back(gridField(randomLattice(seed + 1, 5)));
    for (const Piece& piece : cutIntoMeshes(*level, knives, options).pieces)
      ASSERT_TRUE(topologyOf(piece.mesh).isClosedManifold())
          << "seed " << seed << ": " << topologyOf(piece.mesh);
  }
}

TEST(LevelSetPieces, TheCubeInManyWaysIsWhole) {
  const std::string path = sharedData("volumes/cube_levelset.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  // Every fifth sample: the file itself, of 1.5 million, is cut through the program.
  const auto fine = toBricks(readScalarGrid(path));
  const float h = 5 * fine->voxelSize();
  const auto level = bakeGrid(gridField(fine), {.voxelSize = h, .box = fine->worldBox()});
  const Mesh whole = marchingTetrahedra(*level);
  const Box box = boundingBox(whole);
  const RoughnessOptions hills{.amplitude = 0.2f, .noise = {.frequency = 0.4f}};
  std::vector<Knives> ways;
  for (const int n : {1, 5, 20}) ways.push_back({.planes = randomBlades({.count = n, .box = box})});
  ways.push_back({.cells = scatteredPoints(gridField(level), box, 12, 1)});
  ways.emplace_back();
  for (const BladePlane& blade : randomBlades({.count = 3, .box = box}))
    ways.back().rough.push_back({blade, hills});
  for (const Knives& knives : ways) {
    const Pieces cut = cutIntoMeshes(*level, knives);
    EXPECT_GT(cut.pieces.size(), 1u);
    expectSound(whole, cut);
  }
}

TEST(LevelSetPieces, TheBunnyCutByPlanesHillsAndABallIsWhole) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh bunny = readMesh(path);
  const Box box = boundingBox(bunny);
  const float size = box.longestSide();
  const auto level = toBricks(meshToLevelSet(bunny, {.voxelSize = double(size) / 128}));
  Knives knives{.planes = randomBlades({.count = 2, .box = box}),
                .fields = {Knife(sphere(box.center(), 0.2f * size))}};
  knives.rough.push_back(
      {{box.center(), {0, 1, 0}}, {.amplitude = 0.01f * size, .noise = {.frequency = 5 / size}}});
  const Pieces cut = cutIntoMeshes(*level, knives);
  EXPECT_GE(cut.pieces.size(), 12u);
  expectSound(marchingTetrahedra(*level), cut);
}

TEST(LevelSetPieces, RefuseWhatMakesNoSense) {
  const auto level = ball(8);
  const auto refused = [&](const Knives& knives, const CutOptions& options = {}) {
    EXPECT_THROW(cutIntoMeshes(*level, knives, options), Error);
  };
  refused({.planes = {{{0, 0, 0}, {0, 0, 0}}}});
  refused({.cells = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}});
  refused({}, {.kerf = -1});
  refused({.fields = {Knife(sphere({0, 0, 0}, 1), 0.5f)}});
  refused({}, {.minVolume = -1.0});
  struct Stop : Progress {
    bool cancelled() const override { return true; }
  } stop;
  EXPECT_THROW(cutIntoMeshes(*level, {}, {}, stop), Cancelled);
}

}  // namespace
}  // namespace nephele::test
