#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

RoughBlade rough(const BladePlane& plane, float amplitude = 0.05f, float frequency = 1.0f) {
  return {plane, {.amplitude = amplitude, .noise = {.frequency = frequency}, .octaves = 2}};
}

std::vector<RoughBlade> roughBlades(const Mesh& mesh, int count, std::uint32_t seed = 0) {
  const Box box = boundingBox(mesh);
  const float size = length(box.size());
  std::vector<RoughBlade> blades;
  for (const BladePlane& plane : randomBlades({.count = count, .box = box, .seed = seed}))
    blades.push_back(rough(plane, 0.01f * size, 4 / size));
  return blades;
}

std::string errorOf(const Mesh& mesh, const Knives& knives, const CutOptions& options) {
  try {
    cutIntoMeshes(mesh, knives, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expectError(const Mesh& mesh, const Knives& knives, const std::string& part,
                 const CutOptions& options = {}) {
  const std::string message = errorOf(mesh, knives, options);
  EXPECT_NE(message.find(part), std::string::npos) << "got: " << message;
}

double volumeOn(const Pieces& cut, const std::vector<bool>& sides) {
  double volume = 0;
  for (const Piece& piece : cut.pieces)
    if (piece.code.sides == sides) volume += piece.mass.volume;
  return volume;
}

TEST(MeshKnives, AKnifeThatMissesLeavesTheMeshAsItIs) {
  for (const bool around : {false, true}) {
    const Mesh knife = around ? boxMesh({-2, -2, -2}, {2, 2, 2}) : boxMesh({2, 2, 2}, {3, 3, 3});
    const Pieces cut = cutIntoMeshes(cube(), {.rough = {rough({{0, 5, 0}, {0, 1, 0}})}, .solids = {knife}});
    ASSERT_EQ(cut.pieces.size(), 1u);
    EXPECT_EQ(cut.pieces[0].code.sides, (std::vector<bool>{false, around}));
    EXPECT_EQ(cut.pieces[0].mesh.faceCount(), 12u);
    EXPECT_EQ(cut.pieces[0].mass.volume, 8);
  }
}

TEST(MeshKnives, PointsThatRoundingBringsTogetherAreOne) {
  // The hills of both blades begin from the middle of the cube, so that many of their points all but meet.
  const Mesh source = boxMesh({0, 0, 0}, {1, 1, 1});
  const Vec3f middle{0.5f, 0.5f, 0.5f};
  const auto hills = [&](const Vec3f& normal, std::uint32_t seed) -> RoughBlade {
    return {{middle, normal}, {.amplitude = 0.01f, .noise = {.frequency = 5, .seed = seed}, .octaves = 4}};
  };
  const Pieces cut = cutIntoMeshes(source, {.rough = {hills({0, 1, 0}, 0), hills({1, 0, 0}, 1)}});
  expectSound(source, cut);
  ASSERT_EQ(cut.pieces.size(), 4u);
  for (const Piece& piece : cut.pieces) {
    const MeshDiagnosis diagnosis = diagnose(piece.mesh);
    EXPECT_TRUE(diagnosis.manifold());
    EXPECT_EQ(diagnosis.degenerateFaces, 0u);
  }
}

TEST(MeshKnives, CoincidentKnivesCutOnce) {
  const Mesh ball = icosphere(1, 3), knife = icosphere(0.7, 3, {0.8, 0.1, 0});
  const RoughBlade blade = rough({{0.1f, 0.2f, 0}, {1, 2, 3}});
  const Pieces once = cutIntoMeshes(ball, {.rough = {blade}, .solids = {knife}});
  const Pieces twice = cutIntoMeshes(ball, {.rough = {blade, blade}, .solids = {knife, knife}});
  expectSound(ball, twice);
  ASSERT_EQ(twice.pieces.size(), once.pieces.size());
  EXPECT_EQ(twice.slivers, 0u);
  for (const Piece& piece : once.pieces) {
    const std::vector<bool>& s = piece.code.sides;
    EXPECT_NEAR(volumeOn(twice, {s[0], s[0], s[1], s[1]}), piece.mass.volume, 1e-13);
  }
}

TEST(MeshKnives, ARoughBladeWithoutHillsIsAPlane) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const BladePlane plane{{0.2f, 0.1f, 0}, {1, 0.5f, 0.25f}};
  const Pieces flat = cutIntoMeshes(mesh, {.planes = {plane}});
  const Pieces cut = cutIntoMeshes(mesh, {.rough = {rough(plane, 0)}});
  expectSound(mesh, cut);
  ASSERT_EQ(cut.pieces.size(), flat.pieces.size());
  for (std::size_t i = 0; i < cut.pieces.size(); ++i) {
    EXPECT_EQ(cut.pieces[i].code, flat.pieces[i].code);
    EXPECT_NEAR(cut.pieces[i].mass.volume, flat.pieces[i].mass.volume, 1e-12);
    EXPECT_NEAR(cut.pieces[i].mass.area, flat.pieces[i].mass.area, 1e-11);
  }
}

TEST(MeshKnives, RoughFacesLieOnTheHillsOfTheRoughKnife) {
  const RoughBlade blade = rough({{0.1f, 0.05f, 0}, {0.3f, 1, 0.2f}}, 0.1f, 1);
  const ScalarField knife = roughKnife(blade.plane, blade.roughness).field;
  const Pieces cut = cutIntoMeshes(cube(), {.rough = {blade}});
  expectSound(cube(), cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    std::vector<bool> isOuter(piece.mesh.positions.size());
    for (std::size_t f = 0; f < firstInside(piece.mesh); ++f)
      for (const std::uint32_t v : piece.mesh.face(f)) isOuter[v] = true;
    const MeshAttribute& uv = attributeOf(piece.mesh, "uv");
    double highest = 0;
    for (std::size_t f = firstInside(piece.mesh); f < piece.mesh.faceCount(); ++f)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = piece.mesh.face(f)[k];
        const Vec3d p = piece.mesh.positions[v];
        const double above = dot(p - Vec3d(blade.plane.point), normalize(Vec3d(blade.plane.normal)));
        highest = std::max(highest, std::abs(above));
        // Points of the lattice are on the hills, up to floats.
        if (!isOuter[v]) {
          EXPECT_NEAR(knife(Vec3f(p)), 0, 2e-6);
        }
        // The place on the plane: with the height it makes up the distance from the origin's foot.
        const double u = double(uv.values[2 * (3 * f + k)]), w = double(uv.values[2 * (3 * f + k) + 1]);
        const double along = dot(p, normalize(Vec3d(blade.plane.normal)));
        EXPECT_NEAR(u * u + w * w + along * along, dot(p, p), 1e-5);
      }
    // Unit rms: some hill is as high as the amplitude.
    EXPECT_GT(highest, 0.1);
  }
}

TEST(MeshKnives, AKerfOfPlanesTakesTheSlab) {
  const Pieces cut =
      cutIntoMeshes(cube(), {.planes = {{{0, 0, 0}, {0, 1, 0}}, {{0.5f, 0, 0}, {2, 0, 0}}}}, {.kerf = 0.25f});
  ASSERT_EQ(cut.pieces.size(), 4u);
  double volume = 0;
  for (const Piece& piece : cut.pieces) {
    EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold());
    EXPECT_TRUE(piece.neighbours.empty());
    volume += piece.mass.volume;
  }
  // (2 - w) x (2 - w) x 2.
  EXPECT_NEAR(volume, 1.75 * 1.75 * 2, 1e-14);
  EXPECT_EQ(cut.slivers, 0u);
  EXPECT_NEAR(volumeOn(cut, {false, false}), 0.875 * 1.375 * 2, 1e-14);
}

TEST(MeshKnives, AKerfOfCellsMovesEveryBisector) {
  std::vector<Vec3f> points;
  for (int i = 0; i < 8; ++i)
    points.push_back({i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f});
  const Pieces cut = cutIntoMeshes(cube(), {.cells = points}, {.kerf = 0.25f});
  ASSERT_EQ(cut.pieces.size(), 8u);
  for (const Piece& piece : cut.pieces) {
    EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold());
    EXPECT_NEAR(piece.mass.volume, 0.875 * 0.875 * 0.875, 1e-14);
  }
}

TEST(MeshKnives, AKerfTakesItsWidthTimesTheAreaOfTheBlade) {
  const Mesh mesh = torusMesh(1, 0.4, 60, 30);
  const float kerf = 0.02f;
  const BladePlane plane{{0.1f, 0.05f, 0.02f}, {1, 0.3f, 0.2f}};
  const std::array<Knives, 3> cuts{Knives{.planes = {plane}},
                                   Knives{.cells = {{-1, 0.1f, 0}, {0.9f, 0, 0.2f}}},
                                   Knives{.rough = {rough(plane, 0.06f, 2)}}};
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    SCOPED_TRACE(i);
    double area = 0;
    for (const Piece& piece : cutIntoMeshes(mesh, cuts[i]).pieces) area += insideArea(piece.mesh) / 2;
    const Pieces cut = cutIntoMeshes(mesh, cuts[i], {.kerf = kerf});
    for (const Piece& piece : cut.pieces) EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold());
    const double gone = signedVolume(mesh) - volumeSum(cut);
    EXPECT_NEAR(gone / (double(kerf) * area), 1, 0.01);
    if (i == 2) {
      EXPECT_GT(area, 1.05 * insideArea(cutIntoMeshes(mesh, cuts[0]).pieces[0].mesh));
    }
  }
}

TEST(MeshKnives, AKerfWiderThanEverythingLeavesNothing) {
  const Pieces cut = cutIntoMeshes(cube(), {.planes = {{{0, 0, 0}, {0, 1, 0}}}}, {.kerf = 10});
  EXPECT_TRUE(cut.pieces.empty());
  EXPECT_EQ(cut.slivers, 0u);
  EXPECT_TRUE(cutIntoMeshes(cube(), {.cells = {{-0.5f, 0, 0}, {0.5f, 0, 0}}}, {.kerf = 10}).pieces.empty());
  EXPECT_TRUE(cutIntoMeshes(cube(), {.rough = {rough({{0, 0, 0}, {0, 1, 0}})}}, {.kerf = 10}).pieces.empty());
}

TEST(MeshKnives, AllKindsCutTogether) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const Box box = boundingBox(mesh);
  const Knives knives{.planes = randomBlades({.count = 2, .box = box, .seed = 5}),
                      .cells = scatteredPoints(ScalarField(1), box, 6, 4),
                      .rough = roughBlades(mesh, 2),
                      .solids = {icosphere(0.5, 3, {1, 0.1, 0}), boxMesh({-2, -0.3, -0.2}, {0, 0.5, 0.1})}};
  const Pieces cut = cutIntoMeshes(mesh, knives);
  expectSound(mesh, cut);
  EXPECT_GT(cut.pieces.size(), 40u);
  for (std::size_t i = 0; i + 1 < cut.pieces.size(); ++i) {
    const Piece &a = cut.pieces[i], &b = cut.pieces[i + 1];
    ASSERT_EQ(a.code.sides.size(), 6u);
    EXPECT_LE(*a.cell, *b.cell);
    if (a.cell == b.cell) {
      EXPECT_LE(a.code.sides, b.code.sides);
    }
  }
  // Sides are what they say.
  for (const Piece& piece : cut.pieces) {
    const Vec3d& p = piece.mesh.positions[0];
    if (length(p - Vec3d{1, 0.1, 0}) < 0.49) {
      EXPECT_TRUE(piece.code.sides[4]);
    }
    const double height = dot(p - Vec3d(knives.planes[0].point), Vec3d(knives.planes[0].normal));
    if (std::abs(height) > 1e-6) {
      EXPECT_EQ(piece.code.sides[0], height > 0);
    }
  }
  const Pieces wide = cutIntoMeshes(mesh, knives, {.kerf = 0.01f});
  for (const Piece& piece : wide.pieces) EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold());
  EXPECT_LT(volumeSum(wide), volumeSum(cut));
}

TEST(MeshKnives, ThePiecesAreTheSameInAnyOrder) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  std::vector<RoughBlade> blades = roughBlades(mesh, 4);
  const Pieces cut = cutIntoMeshes(mesh, {.rough = blades});
  std::reverse(blades.begin(), blades.end());
  const Pieces other = cutIntoMeshes(mesh, {.rough = blades});
  ASSERT_EQ(cut.pieces.size(), other.pieces.size());
  for (const Piece& piece : cut.pieces) {
    const std::vector<bool> sides(piece.code.sides.rbegin(), piece.code.sides.rend());
    EXPECT_NEAR(volumeOn(other, sides), volumeOn(cut, piece.code.sides), 1e-13);
  }
}

TEST(MeshKnives, DoNotDependOnTheNumberOfThreads) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const Knives knives{.cells = scatteredPoints(ScalarField(1), boundingBox(mesh), 4, 4),
                      .rough = roughBlades(mesh, 3),
                      .solids = {icosphere(0.5, 3, {1, 0.1, 0})}};
  const Pieces cut = cutIntoMeshes(mesh, knives);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Pieces again = cutIntoMeshes(mesh, knives);
  ASSERT_EQ(cut.pieces.size(), again.pieces.size());
  for (std::size_t i = 0; i < cut.pieces.size(); ++i) {
    EXPECT_EQ(cut.pieces[i].mesh.positions, again.pieces[i].mesh.positions);
    EXPECT_EQ(cut.pieces[i].mesh.corners, again.pieces[i].mesh.corners);
  }
}

TEST(MeshKnives, KnownMeshesSumToThemselves) {
  for (const char* name : {"bunny_7k.obj", "spot_uv.obj", "fertility_genus4.off", "fandisk_13k.obj"}) {
    const std::string path = sharedData(std::string("meshes/") + name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    SCOPED_TRACE(name);
    const Mesh mesh = readMesh(path);
    const Box box = boundingBox(mesh);
    const Pieces cut = cutIntoMeshes(mesh, {.rough = roughBlades(mesh, 3)});
    expectSound(mesh, cut);
    EXPECT_GE(cut.pieces.size(), 5u);
    const Mesh ball = icosphere(0.25 * double(length(box.size())), 4, Vec3d(box.center()));
    expectSound(mesh,
                cutIntoMeshes(mesh, {.planes = randomBlades({.count = 2, .box = box}), .solids = {ball}}));
  }
}

TEST(MeshKnives, OuterFacesKeepTheirTextureCoordinates) {
  const std::string path = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh spot = triangulated(readMesh(path));
  const Pieces cut = cutIntoMeshes(
      spot, {.planes = randomBlades({.count = 1, .box = boundingBox(spot)}), .rough = roughBlades(spot, 2)});
  std::size_t checked = 0;
  EXPECT_LT(worstTexture(spot, cut, 5, checked), 1e-5);
  EXPECT_GT(checked, 1000u);
}

TEST(MeshKnives, GroupsAndVertexColoursContinue) {
  Mesh mesh = cube();
  mesh.groups = {{"bottom and top", 2, 4}, {"rest", 6, 6}};
  MeshAttribute colour{"color", MeshAttribute::Domain::vertex, 3, {}};
  for (const Vec3d& p : mesh.positions)
    for (const int k : {0, 1, 2}) colour.values.push_back(float(p[k]));
  mesh.attributes.push_back(colour);
  const Pieces cut = cutIntoMeshes(
      mesh, {.planes = {{{0.5f, 0, 0}, {1, 0.5f, 0.25f}}}, .rough = {rough({{0, 0, 0}, {0.2f, 1, 0.1f}})}});
  ASSERT_EQ(cut.pieces.size(), 4u);
  for (const Piece& piece : cut.pieces) {
    ASSERT_GE(piece.mesh.groups.size(), 2u);
    EXPECT_EQ(piece.mesh.groups.back().name, "inside");
    std::vector<bool> isOuter(piece.mesh.positions.size());
    for (std::size_t f = 0; f < firstInside(piece.mesh); ++f)
      for (const std::uint32_t v : piece.mesh.face(f)) isOuter[v] = true;
    // The colour of the source is its place, and places are linear on triangles.
    const MeshAttribute& value = attributeOf(piece.mesh, "color");
    for (std::size_t i = 0; i < piece.mesh.positions.size(); ++i)
      for (const int k : {0, 1, 2})
        if (isOuter[i]) {
          EXPECT_NEAR(value.values[3 * i + std::size_t(k)], piece.mesh.positions[i][k], 1e-6);
        }
  }
}

TEST(MeshKnives, KerfOfASolidOfSmallTrianglesIsThatOfItsDistance) {
  // Half of space from samples, as a field is made a knife: its rims have triangles smaller than the kerf.
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Mesh half = marchingCubes(*sampledBlade(plane({0.1f, 0, 0}, {1, 0, 0}), box, 2.0 / 64, 0.1f), 0.0f);
  const Pieces cut = cutIntoMeshes(cube(), {.solids = {half}}, {.kerf = 0.1f});
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_NEAR(volumeOn(cut, {true}), 4 * 0.85, 1e-3);
  EXPECT_NEAR(volumeOn(cut, {false}), 4 * 1.05, 1e-3);
  for (const Piece& piece : cut.pieces) EXPECT_TRUE(diagnose(piece.mesh).manifold());
}

TEST(MeshKnives, SolidsThinnerThanTheKerfGoWhole) {
  const Pieces cut = cutIntoMeshes(cube(), {.solids = {icosphere(0.3, 4)}}, {.kerf = 0.8f});
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{false});
  const double ball = 4.0 / 3 * std::numbers::pi * 0.7 * 0.7 * 0.7;
  EXPECT_NEAR(cut.pieces[0].mass.volume, 8 - ball, 3e-3 * ball);
}

TEST(MeshKnives, RefuseWhatCannotCut) {
  Mesh open = icosphere(0.5, 2);
  open.corners.resize(open.corners.size() - 3);
  open.faceStart.pop_back();
  expectError(cube(), {.solids = {cube(), open}}, "solid 1 is open: 3 edges");
  Mesh turned = cube();
  for (std::size_t c = 0; c < turned.corners.size(); c += 3)
    std::swap(turned.corners[c], turned.corners[c + 1]);
  expectError(cube(), {.solids = {turned}}, "solid 0 must enclose a volume");
  expectError(cube(), {.solids = {Mesh{}}}, "solid 0 has no faces");
  expectError(cube(), {}, "kerf must be finite and >= 0, got -0.1", {.kerf = -0.1f});
  expectError(cube(), {}, "kerf", {.kerf = std::numeric_limits<float>::quiet_NaN()});
  expectError(cube(), {.rough = {rough({{0, 0, 0}, {0, 0, 0}})}}, "rough blade 0");
  expectError(cube(), {.rough = {rough({{0, 0, 0}, {0, 1, 0}}, -1)}}, "amplitude must be >= 0, got -1");
  RoughBlade fine = rough({{0, 0, 0}, {0, 1, 0}});
  fine.spacing = 1e-7f;
  expectError(cube(), {.rough = {fine}}, "too fine");
  fine.spacing = -1;
  expectError(cube(), {.rough = {fine}}, "spacing must be >= 0, got -1");
}

TEST(MeshKnives, SayWhatCrossesItselfWhereAnotherPasses) {
  // Two boxes that overlap near x = 1: closed, but no solid there.
  const Mesh crossed = joined(boxMesh({0, 0, 0}, {1.2, 1, 1}), boxMesh({0.8, 0.1, 0.1}, {2, 1.1, 1.1}));
  const Mesh there = boxMesh({0.5, 0.45, -1}, {1.5, 0.55, 3}),
             away = boxMesh({0.1, 0.45, -1}, {0.5, 0.55, 3});
  expectError(crossed, {.solids = {there}}, "the mesh crosses itself near");
  // Where nothing else passes, what crosses itself is taken as it is.
  const Mesh bars =
      joined(boxMesh({-3, -0.2, -0.2}, {0.1, 0.2, 0.2}), boxMesh({-0.1, -0.1, -0.1}, {3, 0.3, 0.3}));
  EXPECT_NEAR(volumeSum(cutIntoMeshes(cube(), {.solids = {bars}})), 8, 1e-13);
  const Pieces cut = cutIntoMeshes(crossed, {.solids = {away}});
  EXPECT_NEAR(volumeSum(cut), signedVolume(crossed), 1e-13);
  // A knife that crosses itself in the surface of the mesh.
  const Mesh knife =
      joined(boxMesh({-0.5, 0.5, -0.5}, {0.1, 1.5, 0.2}), boxMesh({-0.1, 0.6, -0.1}, {0.5, 1.4, 0.5}));
  expectError(cube(), {.solids = {knife}}, "solid 0 crosses itself near");
}

}  // namespace
}  // namespace nephele::test
