#include "nephele/levelset/mesh/mesh_repair.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/known_meshes.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::KnownMesh;
using test::sharedData;
using Mode = MeshRepairOptions::Mode;

void addCube(Mesh& mesh, const Vec3d& low, double side, bool inward = false) {
  const auto base = std::uint32_t(mesh.positions.size());
  for (int i = 0; i < 8; ++i) mesh.positions.push_back(low + Vec3d(i & 1, i >> 1 & 1, i >> 2 & 1) * side);
  const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    std::vector<std::uint32_t> quad(q, q + 4);
    if (inward) std::swap(quad[1], quad[3]);
    for (std::uint32_t& v : quad) v += base;
    mesh.addFace(quad);
  }
}

Mesh cube(bool inward = false) {
  Mesh mesh;
  addCube(mesh, {0, 0, 0}, 1, inward);
  return mesh;
}

Mesh withoutFace(const Mesh& mesh, std::size_t left) {
  Mesh result;
  result.positions = mesh.positions;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    if (f != left) result.addFace(mesh.face(f));
  return result;
}

std::string messageFor(const Mesh& mesh, Mode mode) {
  try {
    repairMesh(mesh, {.mode = mode});
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(MeshDiagnosis, CubeIsAClosedManifold) {
  const MeshDiagnosis is = diagnose(cube());
  EXPECT_TRUE(is.manifold());
  EXPECT_FALSE(is.inward());
  EXPECT_EQ(is.eulerCharacteristic, 2);
  EXPECT_EQ(is.genus(), 0);
  EXPECT_EQ(is.triangles, 12u);
  EXPECT_TRUE(is.problems().empty());
}

TEST(MeshDiagnosis, ProblemsAreInWords) {
  Mesh mesh = withoutFace(cube(), 0);
  mesh.positions.emplace_back(9, 9, 9);
  const auto first = mesh.face(0);
  mesh.addFace(std::vector<std::uint32_t>(first.begin(), first.end()));
  const std::vector<std::string> problems = diagnose(mesh).problems();
  const std::vector<std::string> expected{"open: 4 boundary edges in 1 hole",
                                          "4 non-manifold edges (more than two faces)", "1 duplicate face",
                                          "1 unused vertex"};
  for (const std::string& problem : expected)
    EXPECT_NE(std::find(problems.begin(), problems.end(), problem), problems.end()) << problem;
  EXPECT_EQ(diagnose(cube(true)).problems(), std::vector<std::string>{"oriented inwards"});
}

TEST(MeshDiagnosis, FacesWithACornerTwiceAreDegenerateUnlessItIsABridge) {
  const auto degenerate = [](const std::vector<std::uint32_t>& corners) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {1, 1, 0}, {1, 2, 0}, {2, 1, 0}};
    mesh.addFace(corners);
    return diagnose(mesh).degenerateFaces;
  };
  EXPECT_EQ(degenerate({0, 1, 2, 3}), 0u);
  EXPECT_EQ(degenerate({0, 1, 2, 0}), 1u);
  EXPECT_EQ(degenerate({0, 0, 1, 2}), 1u);
  EXPECT_EQ(degenerate({0, 1, 2, 1, 3}), 1u);
  EXPECT_EQ(degenerate({1, 2, 3, 0, 2}), 1u);
  EXPECT_EQ(degenerate({0, 1, 2}), 0u);
  EXPECT_EQ(degenerate({1, 3, 1}), 1u);
  // A square with a triangle cut out of it, which a bridge from corner 0 leads to.
  EXPECT_EQ(degenerate({0, 1, 2, 3, 0, 4, 5, 6, 4}), 0u);
}

TEST(MeshDiagnosis, SolidsThatShareAnEdgeAreClosedButNotManifold) {
  Mesh mesh;
  addCube(mesh, {0, 0, 0}, 1);
  addCube(mesh, {1, 1, 0}, 1);  // they touch in the edge x = y = 1
  const MeshDiagnosis is = diagnose(mesh);
  EXPECT_EQ(is.nonManifoldEdges, 1u);
  EXPECT_TRUE(is.closed());
  EXPECT_FALSE(is.manifold());
  EXPECT_DOUBLE_EQ(is.volume, 2);
}

TEST(MeshDiagnosis, MeshWithoutFacesIsNotClosed) {
  EXPECT_FALSE(diagnose(Mesh{}).closed());
  EXPECT_EQ(diagnose(Mesh{}).problems(), std::vector<std::string>{"no faces"});
}

TEST(MeshRepair, GoodMeshPassesUntouched) {
  Mesh mesh = cube();
  mesh.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, std::vector<float>(48, 0.5f)});
  mesh.groups = {{"all", 0, 6}};
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_TRUE(repaired.repairs.empty());
  EXPECT_EQ(repaired.mesh.positions, mesh.positions);
  EXPECT_EQ(repaired.mesh.corners, triangulated(mesh).corners);
  EXPECT_EQ(repaired.mesh.attributes[0].values.size(), 72u);
  EXPECT_EQ(repaired.mesh.groups[0].faceCount, 12u);
  EXPECT_TRUE(repaired.after.manifold());
}

/// A vertex attribute of two numbers: twice x, and y - z.
void paint(Mesh& mesh) {
  MeshAttribute paint{"paint", MeshAttribute::Domain::vertex, 2, {}};
  for (const Vec3d& p : mesh.positions)
    paint.values.insert(paint.values.end(), {float(2 * p.x), float(p.y - p.z)});
  mesh.attributes.push_back(std::move(paint));
}

TEST(MeshRepair, VertexAttributesSurviveMergedVerticesAndFilledHoles) {
  for (const Mesh& source : {withoutFace(cube(), 3), test::unshared(withoutFace(cube(), 3))}) {
    Mesh open = source;
    paint(open);
    const Mesh closed = repairMesh(open).mesh;
    ASSERT_EQ(closed.attributes.size(), 1u);
    EXPECT_EQ(closed.attributes[0].name, "paint");
    Mesh expected = closed;
    expected.attributes.clear();
    paint(expected);
    EXPECT_EQ(closed.attributes[0].values, expected.attributes[0].values);
  }
}

TEST(MeshRepair, AWrapTakesVertexAttributesFromTheClosestPoint) {
  Mesh mesh = cube();
  paint(mesh);
  const Mesh wrapped = repairMesh(mesh, {.mode = Mode::wrap, .wrapAlpha = 0.1, .wrapOffset = 0.02}).mesh;
  ASSERT_EQ(wrapped.attributes.size(), 1u);
  ASSERT_EQ(wrapped.attributes[0].values.size(), 2 * wrapped.positions.size());
  for (std::size_t v = 0; v < wrapped.positions.size(); ++v) {
    // The attribute is linear and the closest point of the unit cube is known.
    const Vec3d p = min(max(wrapped.positions[v], Vec3d{0, 0, 0}), Vec3d{1, 1, 1});
    EXPECT_NEAR(wrapped.attributes[0].values[2 * v], 2 * p.x, 1e-4);
    EXPECT_NEAR(wrapped.attributes[0].values[2 * v + 1], p.y - p.z, 1e-4);
  }
}

TEST(MeshRepair, HoleIsFilledWithTheMissingFace) {
  const RepairedMesh repaired = repairMesh(withoutFace(cube(), 3));
  EXPECT_EQ(repaired.repairs, std::vector<std::string>{"filled 1 hole (4 boundary edges)"});
  EXPECT_TRUE(repaired.after.manifold());
  EXPECT_DOUBLE_EQ(repaired.after.volume, 1);
}

TEST(MeshRepair, ModeOffRefusesAnOpenMeshWithItsDefectsAndTheOption) {
  const std::string message = messageFor(withoutFace(cube(), 3), Mode::off);
  EXPECT_NE(message.find("not closed: open: 4 boundary edges in 1 hole"), std::string::npos) << message;
  EXPECT_NE(message.find("repair mode 'auto'"), std::string::npos) << message;
  EXPECT_EQ(messageFor(cube(), Mode::off), "no error");
  EXPECT_NE(messageFor(cube(true), Mode::off).find("oriented inwards"), std::string::npos);
}

TEST(MeshRepair, InwardMeshIsTurned) {
  const RepairedMesh repaired = repairMesh(cube(true));
  EXPECT_EQ(repaired.repairs, std::vector<std::string>{"turned the mesh outward"});
  EXPECT_DOUBLE_EQ(repaired.after.volume, 1);
}

// As an export with a negative scale has it: the volumes add up to nothing.
TEST(MeshRepair, APartThatIsTheOtherMirroredIsTurned) {
  Mesh mesh;
  addCube(mesh, {0, 0, 0}, 1);
  addCube(mesh, {3, 0, 0}, 1, true);
  EXPECT_NEAR(diagnose(mesh).volume, 0, 1e-12);
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_EQ(repaired.repairs, std::vector<std::string>{"turned 1 of 2 parts outward"});
  EXPECT_DOUBLE_EQ(repaired.after.volume, 2);
}

TEST(MeshRepair, OneTurnedFaceIsTurnedBack) {
  Mesh mesh = cube();
  std::swap(mesh.corners[5], mesh.corners[7]);
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_TRUE(repaired.after.manifold());
  EXPECT_DOUBLE_EQ(repaired.after.volume, 1);
}

// Outer cube of side 4, something of side 1 inside it, and a free cube of side 2 beside it.
TEST(MeshRepair, CavitiesStayAndEverythingElseTurnsOutward) {
  struct Case {
    bool outerInward, innerInward, freeInward;
    double volume;
  };
  const Case cases[] = {
      {false, true, false, 64 - 1 + 8},   // right already: the inner cube is a cavity
      {false, false, false, 64 + 1 + 8},  // a solid inside a solid is left alone
      {true, false, true, 64 - 1 + 8},    // everything inside out: the cavity turns with its solid
      {true, false, false, 64 - 1 + 8},  {false, true, true, 64 - 1 + 8},
      {true, true, false, 64 + 1 + 8},  // both inward: both are solids turned inside out
  };
  for (const Case& c : cases) {
    Mesh mesh;
    addCube(mesh, {8, 0, 0}, 2, c.freeInward);
    addCube(mesh, {1, 1, 1}, 1, c.innerInward);
    addCube(mesh, {0, 0, 0}, 4, c.outerInward);
    const RepairedMesh repaired = repairMesh(mesh);
    EXPECT_NEAR(repaired.after.volume, c.volume, 1e-12) << c.outerInward << c.innerInward << c.freeInward;
    EXPECT_TRUE(repaired.after.manifold());
    EXPECT_EQ(repaired.repairs.empty(), !c.outerInward && !c.freeInward);
  }
}

TEST(MeshRepair, WallBetweenTwoSolidsIsDropped) {
  Mesh mesh;
  addCube(mesh, {0, 0, 0}, 1);
  addCube(mesh, {1, 0, 0}, 1);
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_EQ(repaired.repairs, std::vector<std::string>{"dropped 2 coincident faces"});
  EXPECT_TRUE(repaired.after.manifold());
  EXPECT_DOUBLE_EQ(repaired.after.volume, 2);
}

TEST(MeshRepair, BoundaryVerticesThatNearlyMeetAreMerged) {
  Mesh mesh = withoutFace(cube(), 5);
  const auto base = std::uint32_t(mesh.positions.size());
  const Mesh whole = cube();
  for (const std::uint32_t v : whole.face(5))
    mesh.positions.push_back(whole.positions[v] + Vec3d(3e-7, 0, -2e-7));
  mesh.addFace(std::array<std::uint32_t, 4>{base, base + 1, base + 2, base + 3});
  const RepairedMesh repaired = repairMesh(mesh);
  ASSERT_EQ(repaired.repairs.size(), 1u);
  EXPECT_EQ(repaired.repairs[0], "merged 4 boundary vertices closer than 1e-06");
  EXPECT_EQ(repaired.after.vertices, 8u);
}

TEST(MeshRepair, SheetsAreRefusedAndWrappedOnDemand) {
  Mesh sheet;
  sheet.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  const std::string message = messageFor(sheet, Mode::automatic);
  EXPECT_NE(message.find("an open sheet, not a solid"), std::string::npos) << message;
  EXPECT_NE(message.find("repair mode 'wrap'"), std::string::npos) << message;

  const RepairedMesh shell = repairMesh(sheet, {.mode = Mode::wrap, .wrapAlpha = 0.1, .wrapOffset = 0.02});
  EXPECT_TRUE(shell.after.manifold());
  // The wrap's corners lie at the offset from the sheet, so it lies in the offset body, which is convex: area
  // 1 times 2 x 0.02, half a tube along the perimeter of 4, and a ball at the corners. Its chords cut off
  // less than half.
  const double body = 0.04 + 4 * 0.5 * 3.1416 * 0.02 * 0.02 + 4.0 / 3 * 3.1416 * 0.02 * 0.02 * 0.02;
  EXPECT_GT(shell.after.volume, 0.5 * body);
  EXPECT_LT(shell.after.volume, body);
  EXPECT_NE(shell.repairs[0].find("wrapped with alpha 0.1 (10 % of the longest side), offset 0.02 (2 %)"),
            std::string::npos)
      << shell.repairs[0];
}

TEST(MeshRepair, SaysThatAWrapOfAnOpenSurfaceIsAShell) {
  Mesh open = test::icosphere(1, 3);
  open.corners.resize(open.corners.size() - 3 * 400);
  open.faceStart.resize(open.faceStart.size() - 400);
  const MeshRepairOptions options{.mode = Mode::wrap, .wrapAlpha = 0.05, .wrapOffset = 0.01};
  const RepairedMesh shell = repairMesh(open, options);
  ASSERT_EQ(shell.repairs.size(), 2u);
  // The longest side is 2, and the offset lies on both sides.
  EXPECT_NE(shell.repairs[1].find("a shell about 0.04 thick"), std::string::npos) << shell.repairs[1];
  EXPECT_EQ(repairMesh(test::icosphere(1, 3), options).repairs.size(), 1u)
      << "a closed surface becomes a solid";
}

TEST(MeshRepair, WrapsWhatLiesNearerTogetherThanNumbersTell) {
  // An octahedron, and in its middle corners that differ by 1e-200 and less: spheres through these have
  // centres beyond a double.
  Mesh mesh = test::octahedron();
  for (const Vec3d& corner :
       {Vec3d{1e-200, 3e-300, 5e-310}, Vec3d{2e-300, 1e-200, 4e-310}, Vec3d{3e-310, 4e-290, 1e-200}})
    mesh.positions.push_back(corner);
  for (const auto& face : {std::array<std::uint32_t, 3>{6, 7, 8}, {6, 7, 0}, {7, 8, 2}, {8, 6, 4}})
    mesh.addFace(face);
  const RepairedMesh solid = repairMesh(mesh, {.mode = Mode::wrap, .wrapAlpha = 0.05, .wrapOffset = 0.01});
  // Between the octahedron and all that is within an offset of 0.02 of it: 4/3, and 0.02 times its area and
  // 0.0004 times its edges' 12 sqrt(2) times half of their outer angle of 70.5 degrees more, and a ball.
  EXPECT_GT(signedVolume(solid.mesh), 4.0 / 3);
  EXPECT_LT(signedVolume(solid.mesh),
            4.0 / 3 + 0.02 * 4 * std::sqrt(3.0) + 0.0004 * 12 * std::sqrt(2.0) * 0.615 + 4e-5);
}

TEST(MeshRepair, AShellThinnerThanVoxelsIsRefusedBeforeItIsMade) {
  struct Steps final : Progress {
    mutable std::atomic<int> count{0};
    void advance(double) const override { ++count; }
  };
  Mesh open = test::icosphere(1, 3);
  open.corners.resize(open.corners.size() - 3 * 400);
  open.faceStart.resize(open.faceStart.size() - 400);
  // At resolution 64 alpha is a voxel and the offset a sixth of it, so that the shell has a third.
  const double voxel = 2.0 / 64;
  const Steps refused, made;
  try {
    repairMesh(open, {.mode = Mode::wrap, .voxelSize = voxel}, refused);
    ADD_FAILURE() << "a shell of a third of a voxel";
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("a shell about 0.0104 thick"), std::string::npos) << message;
    // 1/300 of the side, 2.2 voxels.
    EXPECT_NE(message.find("try resolution 660"), std::string::npos) << message;
  }
  const RepairedMesh shell =
      repairMesh(open, {.mode = Mode::wrap, .wrapAlpha = 1.0 / 64, .wrapOffset = 1.0 / 384}, made);
  EXPECT_EQ(shell.repairs.size(), 2u);
  // A wrap four times coarser has a sixteenth of the points.
  EXPECT_LT(4 * refused.count, made.count);

  EXPECT_EQ(repairMesh(test::icosphere(1, 3), {.mode = Mode::wrap, .voxelSize = voxel}).repairs.size(), 1u);
  // One face of 1280 is missing: half a voxel cannot pass.
  const Mesh nearlyClosed = withoutFace(test::icosphere(1, 3), 7);
  EXPECT_EQ(repairMesh(nearlyClosed, {.mode = Mode::wrap, .voxelSize = 0.2}).repairs.size(), 1u);
}

TEST(MeshRepair, AWrapIsCoarserWhereAFinerOneWouldEnterHoles) {
  // A sphere without its pole: a hole about 0.13 wide. Alpha is a voxel of 2 / 64 and enters it, alphas of
  // twice and four times that find it closed, at the latter for certain.
  Mesh open = test::icosphere(1, 4);
  const double hole = 0.065;
  Mesh kept;
  kept.positions = open.positions;
  for (std::size_t f = 0; f != open.faceCount(); ++f) {
    const auto face = open.face(f);
    const bool isPole = std::ranges::any_of(face, [&](std::uint32_t v) {
      const Vec3d& p = open.positions[v];
      return p.z > 0 && std::hypot(p.x, p.y) < hole;
    });
    if (!isPole) kept.addFace(face);
  }
  ASSERT_GT(diagnose(kept).boundaryEdges, 0u);
  const RepairedMesh solid = repairMesh(kept, {.mode = Mode::wrap, .voxelSize = 2.0 / 64});
  ASSERT_EQ(solid.repairs.size(), 1u) << solid.repairs[1];
  EXPECT_NE(solid.repairs[0].find("a finer wrap would enter"), std::string::npos) << solid.repairs[0];
  // Between the sphere and the one that is the coarsest offset larger.
  const double ball = 4 * M_PI / 3, offset = 4 * 2.0 / 384;
  EXPECT_GT(solid.after.volume, 0.99 * ball);
  EXPECT_LT(solid.after.volume, ball * std::pow(1 + offset, 3));
}

TEST(MeshRepair, AWrapStopsWhereItIsCancelled) {
  struct Stop final : Progress {
    mutable std::atomic<int> asked{0};
    bool cancelled() const override { return ++asked > 20; }
  };
  EXPECT_THROW(repairMesh(cube(), {.mode = Mode::wrap}, Stop()), Cancelled);
}

// Searching all triangulations of such a loop takes hours.
TEST(MeshRepair, LongFlatLoopsAreFilledWithoutSearch) {
  constexpr std::uint32_t kCount = 5000;
  Mesh cup;
  std::vector<std::uint32_t> bottom;
  for (const double z : {0.0, 1.0})
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const double angle = 2 * M_PI * i / kCount;
      cup.positions.push_back({std::cos(angle), std::sin(angle), z});
    }
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const std::uint32_t next = (i + 1) % kCount;
    cup.addFace(std::array{i, next, kCount + next, kCount + i});
    bottom.push_back(kCount - 1 - i);
  }
  cup.addFace(bottom);
  const RepairedMesh filled = repairMesh(cup);
  EXPECT_TRUE(filled.after.closed());
  // A prism: the area of the polygon times its height.
  EXPECT_NEAR(filled.after.volume, 0.5 * kCount * std::sin(2 * M_PI / kCount), 1e-9);
}

TEST(MeshRepair, PairsOfTrianglesAreCountedWithinALimit) {
  // A fan whose triangles all meet at its hub: two thousand squared over two pairs of boxes at most.
  Mesh fan;
  fan.positions.push_back({0, 0, 0});
  for (std::uint32_t i = 0; i <= 4000; ++i) {
    fan.positions.push_back({std::cos(i * 1e-3), std::sin(i * 1e-3), (i % 2) * 1e-3});
    if (i > 0) fan.addFace(std::array{0u, i, i + 1});
  }
  EXPECT_FALSE(countSelfIntersections(fan, 10).has_value());
  EXPECT_TRUE(countSelfIntersections(fan).has_value());
  EXPECT_EQ(countSelfIntersections(test::icosphere(1, 3), 20), std::size_t(0));
}

TEST(MeshRepair, FlatClosedMeshIsRefused) {
  Mesh flat;
  addCube(flat, {0, 0, 0}, 1);
  for (Vec3d& p : flat.positions) p.z *= 1e-6;
  EXPECT_NE(messageFor(flat, Mode::automatic).find("is flat"), std::string::npos);
  EXPECT_NE(messageFor(flat, Mode::off).find("is flat"), std::string::npos);
}

TEST(MeshRepair, NothingButDegenerateFacesIsRefused) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}};
  mesh.addFace(std::array<std::uint32_t, 3>{0, 1, 1});
  for (const Mode mode : {Mode::automatic, Mode::off, Mode::wrap})
    EXPECT_NE(messageFor(mesh, mode), "no error");
  EXPECT_NE(messageFor(Mesh{}, Mode::automatic).find("no faces"), std::string::npos);
}

TEST(MeshRepair, RefusesToWrapWhatIsFartherFromTheOriginThanItsDigitsReach) {
  Mesh far = test::icosphere(1, 1);
  // Steps between numbers at 1e6 are a hundredth of the offset.
  for (Vec3d& p : far.positions) p = p * 1e-6 + Vec3d{1e6, 0, 0};
  try {
    repairMesh(far, {.mode = Mode::wrap});
    FAIL() << "was wrapped";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("too far from the origin"), std::string::npos) << error.what();
  }
  for (Vec3d& p : far.positions) p = (p - Vec3d{1e6, 0, 0}) * 1e6 + Vec3d{100, 0, 0};
  EXPECT_GT(repairMesh(far, {.mode = Mode::wrap}).mesh.faceCount(), 0u);
}

TEST(MeshRepair, WrapOptionsOutOfRangeAreNamed) {
  EXPECT_THROW(repairMesh(cube(), {.mode = Mode::wrap, .wrapAlpha = 0}), Error);
  EXPECT_THROW(repairMesh(cube(), {.mode = Mode::wrap, .wrapOffset = -1}), Error);
}

TEST(MeshRepair, CancellingStopsIt) {
  struct Impatient : Progress {
    bool cancelled() const override { return true; }
  };
  EXPECT_THROW(repairMesh(cube(), {}, Impatient()), Cancelled);
}

TEST(SolidVolume, CountsOverlapsOnceAndLeavesCavitiesOut) {
  EXPECT_NEAR(solidVolume(cube()), 1, 2e-3);
  Mesh overlapping = cube();
  addCube(overlapping, {0.5, 0.5, 0.5}, 1);
  EXPECT_NEAR(solidVolume(overlapping), 2 - 0.125, 2e-3);
  Mesh nested = cube();
  addCube(nested, {0.25, 0.25, 0.25}, 0.5);
  EXPECT_NEAR(solidVolume(nested), 1, 2e-3);
  Mesh hollow = cube();
  addCube(hollow, {0.25, 0.25, 0.25}, 0.5, true);
  EXPECT_NEAR(solidVolume(hollow), 1 - 0.125, 2e-3);
}

TEST(SolidVolume, EqualsTheSumForRealMeshesWithoutIntersections) {
  for (const KnownMesh& known : test::kKnownMeshes) {
    if (!std::string_view(known.name).starts_with("meshes/") || known.selfIntersections != 0) continue;
    NEPHELE_REQUIRE_SHARED_DATA(sharedData(known.name));
    EXPECT_NEAR(solidVolume(readMesh(sharedData(known.name))) / known.volume, 1, 2e-3) << known.name;
  }
}

class SelfIntersections : public ::testing::TestWithParam<KnownMesh> {};

TEST_P(SelfIntersections, AreCountedAsTheManifestSays) {
  const std::string path = sharedData(GetParam().name);
  NEPHELE_REQUIRE_SHARED_DATA(path);
  EXPECT_EQ(countSelfIntersections(readMesh(path)), std::size_t(GetParam().selfIntersections));
}

std::string testName(const char* file) {
  std::string name = file;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

std::vector<KnownMesh> meshesWithKnownPairs() {
  std::vector<KnownMesh> meshes;
  for (const KnownMesh& mesh : test::kKnownMeshes)
    if (mesh.selfIntersections >= 0) meshes.push_back(mesh);
  return meshes;
}

INSTANTIATE_TEST_SUITE_P(All, SelfIntersections, ::testing::ValuesIn(meshesWithKnownPairs()),
                         [](const auto& file) { return testName(file.param.name); });

TEST(MeshRepair, GoodRealMeshesPassUntouched) {
  for (const KnownMesh& known : test::kKnownMeshes) {
    if (!std::string_view(known.name).starts_with("meshes/")) continue;
    NEPHELE_REQUIRE_SHARED_DATA(sharedData(known.name));
    const RepairedMesh repaired = repairMesh(readMesh(sharedData(known.name)));
    EXPECT_TRUE(repaired.repairs.empty()) << known.name << ": " << repaired.repairs[0];
    EXPECT_TRUE(repaired.after.manifold()) << known.name;
  }
}

// What becomes of each file in mode auto. docs/meshes.md has the same table for people.
struct Outcome {
  const char* name;
  std::vector<std::string> repairs;  // every one, in order
  const char* refusal = nullptr;     // or this part of the error
};

std::ostream& operator<<(std::ostream& stream, const Outcome& outcome) {
  return stream << outcome.name;
}

class DefectiveFiles : public ::testing::TestWithParam<Outcome> {};

TEST_P(DefectiveFiles, AreRepairedAsListedOrRefusedWithTheReason) {
  const Outcome& outcome = GetParam();
  const std::string path = sharedData(std::string("defective/") + outcome.name);
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  if (outcome.refusal) {
    const std::string message = messageFor(mesh, Mode::automatic);
    EXPECT_NE(message.find(outcome.refusal), std::string::npos) << message;
    EXPECT_NE(message.find("repair mode 'wrap'"), std::string::npos) << message;
    return;
  }
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_EQ(repaired.repairs, outcome.repairs);
  EXPECT_TRUE(repaired.after.closed());
  EXPECT_GT(repaired.after.volume, 0);
  EXPECT_EQ(repaired.after.mergedVertices, 0u);
  EXPECT_TRUE(repaired.mesh.isTriangles());
}

INSTANTIATE_TEST_SUITE_P(
    All, DefectiveFiles,
    ::testing::Values(
        Outcome{"bunny_open_5_holes_ascii.ply", {"filled 5 holes (223 boundary edges)"}},
        Outcome{"camel_head_open.off", {"filled 1 hole (56 boundary edges)"}},
        Outcome{"capsule_200_degenerate_uv.obj", {"dropped 200 degenerate triangles"}},
        Outcome{"conrod_mixed_orientation.stl",
                {"dropped 6 coincident faces", "turned 2167 triangles to agree with the rest"}},
        Outcome{"cube_with_fold.ply", {}}, Outcome{"cubes_29_components.obj", {}},
        Outcome{"degenerate_faces.obj", {}, "is flat"}, Outcome{"generic_twin_12_parts.obj", {}},
        Outcome{"guitar_94_parts.ply", {}},
        Outcome{"horse_97k_inside_out_be.ply", {"turned the mesh outward"}},
        Outcome{"hourglass_nonmanifold_vertex.obj", {}},
        Outcome{"human_neutral_uv_open.obj", {"filled 1 hole (32 boundary edges)"}},
        Outcome{"joined_tetrahedra_nonmanifold.obj", {"dropped 2 coincident faces"}},
        Outcome{"many_small_holes.ply", {}, "an open sheet"},
        Outcome{"moebius_strip_quads.obj", {}, "a one-sided sheet"},
        Outcome{"noisy_sphere_inside_out_quads.obj", {"turned the mesh outward"}},
        Outcome{"nonmanifold_edge.obj", {}, "an open sheet"},
        Outcome{"nonmanifold_vertex.obj", {}, "an open sheet"},
        Outcome{"nonoriented_edge.obj", {}, "an open sheet"},
        Outcome{"openscad_nonmanifold.obj", {"dropped 4 coincident faces"}},
        Outcome{"planar_mesh_nonmanifold.ply", {}, "an open sheet"},
        Outcome{"plane_27_holes.obj", {"filled 27 holes (341 boundary edges)"}},
        Outcome{"rounded_cube_zero_area_uv.obj", {}}, Outcome{"self_intersecting_closed.obj", {}},
        Outcome{"single_triangle_ascii.stl", {}, "an open sheet"}, Outcome{"sliver_tet_5005_unused.ply", {}},
        Outcome{"spider_ascii.stl",
                {"dropped 40 coincident faces", "dropped 16 degenerate triangles",
                 "turned 4 triangles to agree with the rest", "filled 6 holes (72 boundary edges)"}},
        Outcome{"suzanne_open_quads.obj", {"merged 2 equal vertices", "filled 4 holes (42 boundary edges)"}},
        Outcome{"teapot_open_seams.obj",
                {"merged 403 equal vertices", "filled 6 holes (160 boundary edges)"}},
        Outcome{"thingi_42400_degenerate.stl", {}}, Outcome{"three_tori_components.obj", {}},
        Outcome{"triangle_soup_100.stl", {}, "an open sheet"},
        Outcome{"triple_vierbein_nonmanifold.obj", {}, "an open sheet"},
        Outcome{"trumpet_nonmanifold_quads.obj", {"dropped 6 coincident faces"}},
        Outcome{"two_overlapping_spheres.obj", {}}),
    [](const auto& file) { return testName(file.param.name); });

// The 36th file; a coarse wrap keeps the test short.
TEST(MeshRepair, TruckOfPanelsIsWrapped) {
  const std::string path = sharedData("defective/truck_many_defects.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const RepairedMesh repaired = repairMesh(readMesh(path), {.wrapAlpha = 0.05, .wrapOffset = 0.02});
  ASSERT_EQ(repaired.repairs.size(), 1u);
  EXPECT_NE(repaired.repairs[0].find("31 parts could not be closed"), std::string::npos)
      << repaired.repairs[0];
  EXPECT_TRUE(repaired.after.manifold());
}

TEST(MeshRepair, FaceThatGoesRoundAndRoundBecomesTheSideOfItsBox) {
  const std::string path = sharedData("malformed/long_face_line.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const RepairedMesh repaired =
      repairMesh(readMesh(path));  // a unit cube; one face names its corners 117 times
  EXPECT_TRUE(repaired.after.manifold());
  EXPECT_DOUBLE_EQ(repaired.after.volume, 1);
}

TEST(MeshRepair, FilledBunnyHasTheVolumeOfItsClosedRemesh) {
  const std::string open = sharedData("defective/bunny_open_5_holes_ascii.ply");
  const std::string closed = sharedData("meshes/bunny_28k_uv.ply");
  NEPHELE_REQUIRE_SHARED_DATA(open);
  const RepairedMesh repaired = repairMesh(readMesh(open));
  EXPECT_TRUE(repaired.after.manifold());
  EXPECT_EQ(repaired.after.genus(), 0);
  // Another program closed and remeshed the same scan; its caps and its 2.5 times larger triangles cost 0.5
  // %.
  EXPECT_NEAR(repaired.after.volume / diagnose(readMesh(closed)).volume, 1, 0.01);
}

}  // namespace
}  // namespace nephele
