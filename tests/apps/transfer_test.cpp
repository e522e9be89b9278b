// The verb transfer, through the program.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"
#include "tests/support/uv_layout.h"

namespace nephele::test {
namespace {

class TransferVerb : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string written(const std::string& name, const Mesh& mesh) const {
    writeMesh(file(name), mesh);
    return file(name);
  }
  ProgramResult transfer(const std::string& from, const std::string& to, const std::string& options) const {
    return runProgram("transfer --from " + from + " --to " + to + " " + options);
  }
  nlohmann::json stats() const { return nlohmann::json::parse(textOf(file("s.json"))); }
  std::string withStats(const std::string& output) const {
    return "-o " + file(output) + " --stats " + file("s.json") + " ";
  }
  /// A picture whose red grows along u and whose green grows along v.
  std::string ramp(int width, int height) const {
    Image image;
    image.width = width;
    image.height = height;
    for (const char* name : {"R", "G", "B", "A"}) image.add(name);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
        image.channels[0].values[i] = (float(x) + 0.5f) / float(width);
        image.channels[1].values[i] = 1 - (float(y) + 0.5f) / float(height);
        image.channels[2].values[i] = 0.25f;
        image.channels[3].values[i] = 1;
      }
    writePng(file("ramp.png"), image, {.shoulder = 0.99999f});
    return file("ramp.png");
  }

  const std::string sphere_ = ownData("data/sphere_uv.obj");
  const std::string tori_ = ownData("data/linked_tori_and_cone.obj");
  TemporaryFolder folder_;
};

Mesh turned(Mesh mesh, double degrees, double scale, const Vec3d& shift) {
  const double a = degrees * M_PI / 180;
  for (Vec3d& p : mesh.positions)
    p = Vec3d{p.x * std::cos(a) + p.z * std::sin(a), p.y, p.z * std::cos(a) - p.x * std::sin(a)} * scale +
        shift;
  return mesh;
}

TEST_F(TransferVerb, GivesAnObjectTextureCoordinatesAndSaysHowGood) {
  const ProgramResult result = transfer(sphere_, tori_, withStats("out.obj") + "--align none --quality fast");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find("turned over"), std::string::npos) << result.output;
  const Mesh object = readMesh(tori_), out = readMesh(file("out.obj"));
  EXPECT_EQ(out.positions.size(), object.positions.size());
  EXPECT_EQ(out.corners, object.corners);
  for (const float v : attributeOf(out, "uv").values) EXPECT_TRUE(std::isfinite(v));
  const auto json = stats();
  EXPECT_GE(json["iterations"].size(), 1u);
  for (const char* name : {"median", "p95", "p99", "max"})
    EXPECT_TRUE(json["iterations"].back()[name].is_number()) << name;
  // Bars of the warp field: within a hundredth of a voxel for 99 of 100, a tenth for all.
  EXPECT_LE(double(json["iterations"].back()["p99"]), 0.01);
  EXPECT_LE(double(json["iterations"].back()["max"]), 0.1);
  for (const char* name : {"unconverged_fraction", "flipped_fraction", "degenerate_fraction", "coverage"}) {
    EXPECT_GE(double(json[name]), 0) << name;
    EXPECT_LE(double(json[name]), 1) << name;
  }
  EXPECT_GE(double(json["stretch_median"]), 1);
  EXPECT_GE(double(json["stretch_p95"]), double(json["stretch_median"]));
}

TEST_F(TransferVerb, SaysWhereAMapIsTornAndPaintsIt) {
  // Onto a sphere of which it shows one side only: far away, all of the tori is nearest to that side.
  writeMesh(file("far.obj"), turned(readMesh(tori_), 0, 1, {20, 0, 0}));
  const ProgramResult torn = transfer(sphere_, file("far.obj"),
                                      withStats("out.obj") + "--align none --method closest --preview " +
                                          file("p.png") + " --preview-paint distortion --size 64x32");
  ASSERT_EQ(torn.exitCode, 0) << torn.errors;
  EXPECT_NE(torn.errors.find("of the reference is not shown"), std::string::npos) << torn.errors;
  EXPECT_NE(torn.errors.find("the largest region of it lies near ("), std::string::npos) << torn.errors;
  EXPECT_GT(double(stats()["largest_uncovered_region"]["share"]), 0.5);
  EXPECT_EQ(readImage(file("p.png")).width, 64);
  const ProgramResult whole = transfer(sphere_, sphere_, withStats("out.obj") + "--align none");
  ASSERT_EQ(whole.exitCode, 0) << whole.errors;
  EXPECT_EQ(whole.errors.find("not shown"), std::string::npos) << whole.errors;
  EXPECT_LT(double(stats()["worst_region"]["share"]), 0.005);
}

// Products of lengths of tiny meshes have no place in single precision.
TEST_F(TransferVerb, IsAsGoodInAnyUnits) {
  ASSERT_EQ(transfer(sphere_, tori_, withStats("out.obj") + "--align none --method closest").exitCode, 0);
  const auto asTheyAre = stats();
  for (const double scale : {1e-9, 1e9}) {
    writeMesh(file("sphere.obj"), turned(readMesh(sphere_), 0, scale, {}));
    writeMesh(file("tori.obj"), turned(readMesh(tori_), 0, scale, {}));
    const ProgramResult result = transfer(file("sphere.obj"), file("tori.obj"),
                                          withStats("out.obj") + "--align none --method closest");
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    for (const char* name : {"flipped_fraction", "degenerate_fraction", "coverage"})
      EXPECT_NEAR(double(stats()[name]), double(asTheyAre[name]), 0.005) << name << " at " << scale;
  }
}

TEST_F(TransferVerb, SmearsNoFaceOverTheSeam) {
  for (const char* options : {"--align none --quality fast", "--quality fast", "--method closest"}) {
    ASSERT_EQ(transfer(sphere_, tori_, withStats("out.ply") + options).exitCode, 0);
    const Mesh out = readMesh(file("out.ply"));
    const std::vector<float> extents = uvExtents(out);
    const std::vector<float>& uv = attributeOf(out, "uv").values;
    // Only faces that hold a pole may be long, and those reach into the row of triangles about it.
    const float row = 1.0f / 24;
    for (std::size_t f = 0; f < extents.size(); ++f) {
      const float low = std::min({uv[6 * f + 1], uv[6 * f + 3], uv[6 * f + 5]}),
                  high = std::max({uv[6 * f + 1], uv[6 * f + 3], uv[6 * f + 5]});
      EXPECT_TRUE(extents[f] <= 0.5f || low < 2 * row || high > 1 - 2 * row)
          << options << ' ' << f << ' ' << extents[f];
    }
  }
}

TEST_F(TransferVerb, MixesNoChartsOnAnotherMeshOfTheSameShape) {
  const std::string spot = sharedData("meshes/spot_uv.obj"),
                    remesh = sharedData("meshes/spot_remesh_23k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(spot);
  for (const char* options : {"--quality fast", "--method closest"}) {
    const ProgramResult result = transfer(spot, remesh, withStats("out.obj") + options);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Mesh reference = readMesh(spot), out = readMesh(file("out.obj"));
    EXPECT_EQ(UvIslands(reference).mixedFaces(out), 0u) << options;
    const std::vector<float> extents = uvExtents(out);
    // The longest face of the reference spans 0.08; the object's faces are smaller, but some reach across the
    // folds at the legs.
    EXPECT_LT(*std::ranges::max_element(extents), 0.2f) << options;
  }
}

TEST_F(TransferVerb, FindsTheOwnCoordinatesOfATurnedCopy) {
  const std::string spot = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(spot);
  const Mesh original = readMesh(spot);
  const std::string copy = written("copy.obj", turned(original, 90, 1.4, {3, -1, 2}));
  const ProgramResult result = transfer(spot, copy, withStats("out.obj") + "--quality fast");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const std::vector<float>&own = attributeOf(original, "uv").values,
        uv = attributeOf(readMesh(file("out.obj")), "uv").values;
  std::vector<double> errors;
  for (std::size_t c = 0; c < own.size(); c += 2)
    errors.push_back(std::hypot(uv[c] - own[c], uv[c + 1] - own[c + 1]));
  std::sort(errors.begin(), errors.end());
  // Bars of the specification for a known correspondence under a similarity.
  EXPECT_LE(errors[errors.size() / 2], 1e-3);
  EXPECT_LE(errors[errors.size() * 99 / 100], 1e-2);
  EXPECT_LE(double(stats()["flipped_fraction"]), 0.002);
  EXPECT_LE(double(stats()["stretch_p95"]), 1.2);
  EXPECT_GE(double(stats()["coverage"]), 0.99);
}

TEST_F(TransferVerb, WritesTheMapAndTheWarpedMesh) {
  const std::string ball = written("ball.obj", icosphere(1.2, 3, {0.2, 0, 0}));
  const ProgramResult result = transfer(sphere_, ball,
                                        withStats("out.obj") + "--align none --resolution 64 --warp " +
                                            file("w.vdb") + " --warped-mesh " + file("w.obj"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const std::vector<VdbGrid> grids = readVdbFile(file("w.vdb"));
  ASSERT_EQ(grids.size(), 1u);
  const VdbGridInfo info = describe(grids[0]);
  EXPECT_EQ(info.name, "rest");
  EXPECT_EQ(info.type, "vec3s");
  EXPECT_NEAR(info.voxelSize.x, 2.4 / 64, 1e-5);
  EXPECT_GT(info.activeVoxels, 50000u);
  // On the surface of the ball the map leads to the sphere: the same distance from its middle everywhere.
  const auto components = vectorComponents(grids[0]);
  const auto x = toBricks(components[0]), y = toBricks(components[1]), z = toBricks(components[2]);
  for (const Vec3f& p : {Vec3f{1.4f, 0, 0}, Vec3f{0.2f, 1.2f, 0}, Vec3f{0.2f, 0, -1.2f}}) {
    const Vec3f q = x->worldToIndex()(p);
    const Vec3i voxel{int(std::lround(q.x)), int(std::lround(q.y)), int(std::lround(q.z))};
    const Vec3d image{double(x->at(voxel)), double(y->at(voxel)), double(z->at(voxel))};
    // Within a voxel, and the chords of the sphere of radius 1, which lie up to 2 % deep.
    EXPECT_NEAR(length(image), 1, 2.4 / 64 * 0.9 + 0.02);
  }
  const Mesh warped = readMesh(file("w.obj"));
  EXPECT_TRUE(diagnose(warped).closed());
  const double radius = 1.2;
  for (const Vec3d& p : warped.positions)
    EXPECT_NEAR(length(p - Vec3d{0.2, 0, 0}), radius, 0.1 * 2.4 / 64 + 0.01);
}

TEST_F(TransferVerb, WarpsIntoObjectsOfAnySize) {
  // Bricks about the object must not depend on the units of the reference.
  std::uint64_t first = 0;
  for (const double radius : {0.05, 20.0}) {
    const std::string ball = written("ball.obj", icosphere(radius, 3, {3 * radius, 0, 0}));
    const ProgramResult result = transfer(sphere_, ball,
                                          withStats("out.obj") + "--quality fast --resolution 48 --warp " +
                                              file("w.vdb") + " --warped-mesh " + file("w.obj"));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Mesh warped = readMesh(file("w.obj"));
    EXPECT_TRUE(diagnose(warped).closed());
    EXPECT_EQ(diagnose(warped).components, 1u);
    const double voxel = 2 * radius / 48;
    for (const Vec3d& p : warped.positions)
      EXPECT_NEAR(length(p - Vec3d{3 * radius, 0, 0}), radius, 0.1 * voxel + 0.01 * radius);
    const std::uint64_t voxels = describe(readVdbFile(file("w.vdb"))[0]).activeVoxels;
    if (first == 0) first = voxels;
    // Voxels stand at multiples of their size, so a few bricks may differ.
    EXPECT_NEAR(double(voxels) / double(first), 1, 0.15);
  }
}

TEST_F(TransferVerb, BakesATextureForTheObjectsOwnCoordinates) {
  // The same square twice, laid out turned by a quarter the second time.
  Mesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  Mesh other = square;
  square.attributes = {{"uv", MeshAttribute::Domain::corner, 2, {0, 0, 1, 0, 1, 1, 0, 1}}};
  other.attributes = {
      {"uv", MeshAttribute::Domain::corner, 2, {0.75f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f, 0.25f, 0.25f}}};
  const ProgramResult result =
      transfer(written("from.obj", square), written("to.obj", other),
               withStats("out.obj") + "--method closest --texture " + ramp(64, 64) + " --bake-texture " +
                   file("baked.png") + " --bake-size 80x80 --gutter 2");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(attributeOf(readMesh(file("out.obj")), "uv").values, other.attributes[0].values);
  EXPECT_NEAR(double(stats()["texels_covered"]), 0.25, 0.001);
  const Image baked = readImage(file("baked.png"));
  ASSERT_EQ(baked.width, 80);
  const auto linear = [](float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
  };
  // u' = 0.75 - 0.5 y and v' = 0.25 + 0.5 x, so the picture's u grows upwards and its v to the left.
  for (int row = 22; row < 58; ++row)
    for (int column = 22; column < 58; ++column) {
      const double u = (column + 0.5) / 80, v = 1 - (row + 0.5) / 80;
      EXPECT_NEAR(linear(baked.at("R", column, row)), (v - 0.25) * 2, 0.012);
      EXPECT_NEAR(linear(baked.at("G", column, row)), (0.75 - u) * 2, 0.012);
    }
  // Two texels of gutter, then the mean.
  EXPECT_NEAR(linear(baked.at("R", 18, 40)), linear(baked.at("R", 20, 40)), 0.03);
  EXPECT_NEAR(linear(baked.at("R", 2, 2)), 0.5, 0.01);
}

TEST_F(TransferVerb, SaysWhatABakedPngCannotHold) {
  Image bright;
  bright.width = bright.height = 8;
  for (const char* name : {"R", "G", "B"}) bright.add(name);
  for (Image::Channel& channel : bright.channels) std::ranges::fill(channel.values, 2.0f);
  writeExr(file("bright.exr"), bright, ImageCamera{});
  const std::string bake =
      withStats("out.obj") + "--method closest --bake-texture " + file("baked.png") + " --texture ";
  const ProgramResult result = transfer(sphere_, sphere_, bake + file("bright.exr"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("64 of 64 texels are brighter than 1"), std::string::npos) << result.errors;
  EXPECT_EQ(transfer(sphere_, sphere_, bake + ramp(8, 8)).errors.find("brighter"), std::string::npos);
}

TEST_F(TransferVerb, PaintsDistortionWithoutTextureCoordinates) {
  const std::string plain = written("plain.obj", icosphere(1, 1));
  const ProgramResult result = transfer(
      plain, plain, "--method closest --size 32x16 --preview-paint distortion --preview " + file("p.png"));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
}

TEST_F(TransferVerb, MakesAPreview) {
  const std::string ball = written("ball.obj", icosphere(1, 2));
  const std::string preview = "--method closest --preview " + file("p.png") + " --size 160x80 ";
  for (const std::string& more : {std::string("--checker 8"), "--texture " + ramp(8, 8)}) {
    const ProgramResult result = transfer(sphere_, ball, withStats("out.obj") + preview + more);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Image image = readImage(file("p.png"));
    EXPECT_EQ(image.width, 160);
    EXPECT_EQ(image.height, 80);
    EXPECT_EQ(double(stats()["unconverged_fraction"]), 1);
    // Both halves show their ball before the backdrop.
    for (const int x : {45, 115}) EXPECT_NE(image.at("R", x, 40), image.at("B", x, 40)) << more;
  }
}

TEST_F(TransferVerb, CarriesColoursAndNumbersOfVertices) {
  Mesh coloured = icosphere(1, 3);
  MeshAttribute colour{"color", MeshAttribute::Domain::vertex, 3, {}},
      mass{"mass", MeshAttribute::Domain::vertex, 1, {}};
  for (const Vec3d& p : coloured.positions) {
    for (int k = 0; k < 3; ++k) colour.values.push_back(float(0.5 + 0.5 * p[k]));
    mass.values.push_back(float(3 * p.y));
  }
  coloured.attributes = {colour, mass};
  const std::string from = written("from.ply", coloured), to = written("to.obj", icosphere(1, 2));
  ASSERT_EQ(transfer(from, to, withStats("out.ply") + "--align none").exitCode, 0);
  const Mesh out = readMesh(file("out.ply"));
  for (std::size_t v = 0; v < out.positions.size(); ++v) {
    // Levels 2 and 3 share vertices; colours are 8 bits.
    EXPECT_NEAR(attributeOf(out, "mass").values[v], 3 * out.positions[v].y, 1e-4);
    EXPECT_NEAR(attributeOf(out, "color").values[3 * v], 0.5 + 0.5 * out.positions[v].x, 3.0 / 255);
  }
  ASSERT_EQ(transfer(from, to, "-o " + file("OUT.PLY")).exitCode, 0);
  EXPECT_EQ(attributeOf(readMesh(file("OUT.PLY")), "mass").values.size(), out.positions.size());
  // An OBJ holds the colours only, and says so.
  const ProgramResult obj = transfer(from, to, withStats("out.obj") + "--align none");
  ASSERT_EQ(obj.exitCode, 0) << obj.errors;
  EXPECT_NE(obj.errors.find("cannot hold mass"), std::string::npos) << obj.errors;
  const ProgramResult asked = transfer(from, to, "-o " + file("other.obj") + " --attributes mass");
  EXPECT_EQ(asked.exitCode, 1);
  EXPECT_NE(asked.errors.find("cannot hold 'mass'"), std::string::npos) << asked.errors;
}

TEST_F(TransferVerb, CarriesEveryAttributeOfCornersToAPly) {
  // Linear over each face, with a jump between the upper and the lower half: on the split faces of the same
  // ball every corner finds the value of its own face again.
  Mesh reference = icosphere(1, 2);
  struct Layer {
    const char* name;
    int width;
  };
  const Layer layers[] = {{"uv", 2}, {"uv1", 2}, {"color", 4}, {"heat", 1}, {"flow", 3}};
  const auto value = [](const Layer& layer, const Vec3d& p, int k, bool isUpper) {
    return 0.5 + 0.25 * p[(k + layer.width) % 3] + (isUpper ? 0.2 : 0.0) * layer.width;
  };
  const auto isUpper = [](const Mesh& mesh, std::size_t face) {
    double sum = 0;
    for (const std::uint32_t v : mesh.face(face)) sum += mesh.positions[v].y;
    return sum > 0;
  };
  for (const Layer& layer : layers) {
    MeshAttribute attribute{layer.name, MeshAttribute::Domain::corner, layer.width, {}};
    for (std::size_t f = 0; f < reference.faceCount(); ++f)
      for (const std::uint32_t v : reference.face(f))
        for (int k = 0; k < layer.width; ++k)
          attribute.values.push_back(float(value(layer, reference.positions[v], k, isUpper(reference, f))));
    reference.attributes.push_back(std::move(attribute));
  }
  Mesh plain = reference;
  plain.attributes.clear();
  const Mesh object = midpointSplit(plain);
  const std::string from = written("from.ply", reference), to = written("to.obj", object);
  const ProgramResult result =
      transfer(from, to, withStats("out.ply") + "--align none --quality fast --preview " + file("p.png"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Mesh out = readMesh(file("out.ply"));
  EXPECT_EQ(out.attributes.size(), std::size(layers));
  for (const Layer& layer : layers) {
    const MeshAttribute& carried = attributeOf(out, layer.name);
    ASSERT_EQ(carried.domain, MeshAttribute::Domain::corner) << layer.name;
    ASSERT_EQ(carried.width, layer.width) << layer.name;
    for (std::size_t c = 0; c < out.corners.size(); ++c)
      for (int k = 0; k < layer.width; ++k)
        // midpointSplit keeps the four parts of a face together.
        EXPECT_NEAR(carried.values[c * std::size_t(layer.width) + std::size_t(k)],
                    value(layer, out.positions[out.corners[c]], k, isUpper(reference, c / 12)), 2e-4)
            << layer.name << ' ' << c;
  }
  // Asked for by name, and where the format holds the coordinates only.
  ASSERT_EQ(transfer(from, to, "-o " + file("heat.ply") + " --align none --quality fast --attributes heat")
                .exitCode,
            0);
  EXPECT_EQ(attributeOf(readMesh(file("heat.ply")), "heat").values, attributeOf(out, "heat").values);
  const ProgramResult obj = transfer(from, to, withStats("out.obj") + "--align none --quality fast");
  ASSERT_EQ(obj.exitCode, 0) << obj.errors;
  EXPECT_NE(obj.errors.find("cannot hold uv1, color, heat, flow, left out; a .ply can"), std::string::npos)
      << obj.errors;
  const ProgramResult asked = transfer(from, to, "-o " + file("other.obj") + " --attributes uv1");
  EXPECT_EQ(asked.exitCode, 1);
  EXPECT_NE(asked.errors.find(".ply every attribute"), std::string::npos) << asked.errors;
}

TEST_F(TransferVerb, CarriesTheSecondTextureCoordinatesOfAGlb) {
  const std::string box = sharedData("meshes/multi_uv_box.glb");
  NEPHELE_REQUIRE_SHARED_DATA(box);
  const std::string to = written("to.obj", readMesh(box));
  ASSERT_EQ(transfer(box, to, "-o " + file("out.ply") + " --align none --quality fast").exitCode, 0);
  const Mesh own = readMesh(box), out = readMesh(file("out.ply"));
  for (const MeshAttribute& a : own.attributes) {
    if (!a.name.starts_with("uv")) continue;
    const std::vector<float>& carried = attributeOf(out, a.name).values;
    ASSERT_EQ(carried.size(), a.values.size());
    for (std::size_t i = 0; i < carried.size(); ++i) EXPECT_NEAR(carried[i], a.values[i], 1e-5) << a.name;
  }
}

TEST_F(TransferVerb, IsTheSameAtAnyThreadCount) {
  const std::string torus = written("torus.obj", torusMesh(0.8, 0.3, 40, 20));
  ASSERT_EQ(transfer(sphere_, torus, withStats("one.obj") + "--threads 1").exitCode, 0);
  ASSERT_EQ(transfer(sphere_, torus, withStats("four.obj") + "--threads 4").exitCode, 0);
  EXPECT_EQ(textOf(file("one.obj")), textOf(file("four.obj")));
}

TEST_F(TransferVerb, TakesShapesThatAreOpenInsideOutFarAwayOrHuge) {
  Mesh inverted = icosphere(1, 2), open = icosphere(1, 2), many = icosphere(0.3, 1);
  std::reverse(inverted.corners.begin(), inverted.corners.end());
  open.corners.resize(open.corners.size() - 60);
  open.faceStart.resize(open.faceStart.size() - 20);
  for (int i = 1; i < 12; ++i)
    many = joined(many, icosphere(0.3, 1, {0.7 * i, 0.2 * (i % 3), 0.5 * (i % 2)}));
  Mesh coincident = unshared(icosphere(1, 1));
  coincident.addFace(std::array<std::uint32_t, 3>{0, 0, 0});
  const std::vector<std::pair<const char*, Mesh>> shapes{
      {"inverted", inverted},
      {"open", open},
      {"many", many},
      {"coincident", coincident},
      {"far", turned(icosphere(1, 2), 20, 1, {1e5, -2e5, 1e5})},
      {"huge", turned(icosphere(1, 2), 20, 1000, {0, 0, 0})}};
  for (const auto& [name, mesh] : shapes) {
    const std::string to = written(std::string(name) + ".ply", mesh);
    for (const char* method : {"nacelle", "closest"}) {
      const ProgramResult result = transfer(sphere_, to, withStats("out.obj") + "--method " + method);
      ASSERT_EQ(result.exitCode, 0) << name << " " << result.errors;
      EXPECT_EQ(textOf(file("out.obj")).find("nan"), std::string::npos) << name;
      EXPECT_EQ(textOf(file("s.json")).find("null"), std::string::npos) << name;
      for (const float v : attributeOf(readMesh(file("out.obj")), "uv").values)
        ASSERT_TRUE(std::isfinite(v)) << name;
    }
  }
  const ProgramResult result = transfer(sphere_, file("open.ply"), withStats("out.obj"));
  EXPECT_NE(result.errors.find("is not closed"), std::string::npos) << result.errors;
}

TEST_F(TransferVerb, RefusesFilesThatLackWhatIsAskedFor) {
  const std::string plain = written("plain.obj", icosphere(1, 1)), picture = ramp(4, 4);
  Mesh cap = icosphere(1, 1);
  cap.corners.resize(60);
  cap.faceStart.resize(21);
  const std::string open = written("open.obj", cap), warped = " --warped-mesh " + file("w.obj");
  std::ofstream(file("empty.png"));
  const std::vector<std::array<std::string, 3>> cases{
      {plain, sphere_, "has no attributes"},
      {sphere_ + " --attributes paint", plain, "has no attribute 'paint'; it has uv"},
      {plain + " --preview " + file("p.png"), sphere_, "which --preview needs"},
      {plain + " --texture " + picture, sphere_, "which --texture needs"},
      {sphere_ + warped, open, "open.obj: is not closed, and --warped-mesh needs"},
      {open + warped, sphere_, "open.obj: is not closed, and --warped-mesh needs"},
      {sphere_ + " --texture /nowhere/t.png", plain, "/nowhere/t.png"},
      {sphere_ + " --texture " + file("empty.png"), plain, "empty.png"},
      {sphere_ + " --texture " + picture + " --bake-texture " + file("b.png"), plain,
       "which --bake-texture needs"},
      {sphere_ + " --attributes uv --texture " + picture + " --bake-texture " + file("b.png"), sphere_,
       "would replace"},
      {"/nowhere/a.obj", sphere_, "/nowhere/a.obj"},
      {sphere_, "/nowhere/b.obj", "/nowhere/b.obj"},
      {sphere_ + " --warp " + file("w.vdb") + " --resolution 90000 --memory-limit 1G", sphere_,
       "--resolution"},
      {sphere_ + " --subdivide 6 --memory-limit 500M", plain, "use --quality fast"}};
  const std::size_t before = folder_.entryCount();
  for (const auto& [from, to, said] : cases) {
    const ProgramResult result = transfer(from, to, "-o " + file("out.obj"));
    EXPECT_EQ(result.exitCode, 1) << from << result.errors;
    EXPECT_NE(result.errors.find(said), std::string::npos) << from << "\n" << result.errors;
  }
  EXPECT_EQ(folder_.entryCount(), before);
}

TEST_F(TransferVerb, BadOptionsAreUsageErrorsThatNameThem) {
  for (const std::string bad : {"--method fast",
                                "--align maybe",
                                "--quality ok",
                                "--iterations 0",
                                "--iterations 21",
                                "--order 3",
                                "--resolution 1",
                                "--warp w.obj",
                                "--warped-mesh w.vdb",
                                "--bake-texture b.png",
                                "--preview p.jpg",
                                "--checker 3",
                                "--attributes uv,,color",
                                "--texture t.png --bake-texture b.png --bake-size 5",
                                "--preview p.png --size 0x5",
                                "--preview p.png --view 1",
                                "--bake-samples 2",
                                "--method closest --warped-mesh w.obj",
                                "--method closest --align similarity",
                                "--method closest --quality best",
                                "--method closest --iterations 4",
                                "--method closest --order 2"}) {
    const ProgramResult result = transfer(sphere_, sphere_, "-o " + file("out.obj") + " " + bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    const std::string option = bad.substr(bad.rfind("--"), bad.find(' ', bad.rfind("--")) - bad.rfind("--"));
    EXPECT_NE(result.errors.find(option), std::string::npos) << result.errors;
  }
  EXPECT_EQ(runProgram("transfer --from " + sphere_).exitCode, 2);
  Mesh coloured = readMesh(sphere_);
  coloured.attributes.push_back(
      {"color", MeshAttribute::Domain::vertex, 3, std::vector<float>(3 * coloured.positions.size(), 0.5f)});
  const ProgramResult unseen =
      transfer(written("coloured.ply", coloured), sphere_,
               "-o " + file("out.obj") + " --attributes color --preview " + file("p.png"));
  EXPECT_EQ(unseen.exitCode, 2);
  EXPECT_NE(unseen.errors.find("which --preview shows"), std::string::npos) << unseen.errors;
  EXPECT_EQ(folder_.entryCount(), 1u);
  EXPECT_EQ(transfer(sphere_, sphere_, "-o " + file("out.stl")).exitCode, 2);
  EXPECT_EQ(folder_.entryCount(), 1u);
}

}  // namespace
}  // namespace nephele::test
