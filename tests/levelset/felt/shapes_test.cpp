#include <gtest/gtest.h>

#include <cmath>

#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "tests/levelset/felt/levelset_felt.h"
#include "tests/support/run_program.h"

namespace nephele::felt {
namespace {

constexpr double kBall = 4.0 / 3 * 3.14159265358979;

const Mesh& meshOf(const Value& value) {
  return value.as<std::shared_ptr<const Shape>>()->mesh;
}

TEST(FeltShapes, AreFoundWhereverTheyAreAndHoweverLargeTheyAre) {
  // Volumes of balls and of the ball's upper half; marching cubes are of second order.
  auto values =
      ran("shape ball = ls2shape(sphere((0,0,0), 1)); shape far = ls2shape(sphere((300,-20,5000), 3));\n"
          "shape large = ls2shape(sphere((0,0,0), 1e4)); shape small = ls2shape(sphere((0.1,0,0), 1e-3));\n"
          "shape two = ls2shape(union(sphere((-3,0,0), 1), sphere((40,0,0), 2)), 400);\n"
          "shape dome = ls2shape(sphere((0,0,0), 1), domain((-1.1,0,-1.1), (2.2,1.2,2.2), 0.02));");
  const auto ratio = [&](const char* name, double radius) {
    const MeshDiagnosis is = diagnose(meshOf(values[name]));
    EXPECT_TRUE(is.manifold()) << name;
    return is.volume / (kBall * radius * radius * radius);
  };
  EXPECT_NEAR(ratio("ball", 1), 1, 1e-3);
  EXPECT_NEAR(ratio("far", 3), 1, 1e-3);
  EXPECT_NEAR(ratio("large", 1e4), 1, 1e-3);
  EXPECT_NEAR(ratio("small", 1e-3), 1, 1e-3);
  EXPECT_NEAR(diagnose(meshOf(values["two"])).volume / (9 * kBall), 1, 5e-3);
  EXPECT_NEAR(ratio("dome", 1), 0.5, 1e-3);
}

TEST(FeltShapes, BecomeDistancesThatGoFar) {
  auto values = ran("scalarfield l = shape2ls(ls2shape(sphere((0,0,0), 1)), 64);");
  const ScalarField& level = values["l"].as<ScalarField>();
  for (const float r : {0.3f, 0.8f, 1.0f, 1.2f, 1.8f}) EXPECT_NEAR(level({0, r, 0}), 1 - r, 4e-3f) << r;
}

TEST(FeltShapes, OfMeshesAndCloudsHaveAnEndThatRangesShow) {
  auto values =
      ran("shape ball = ls2shape(sphere((0,0,0), 1), 64);\nshape again = ls2shape(shape2ls(ball, 64), 64);\n"
          "shape cloud = ls2shape(cumulo(ball, 0.05, 2, amplitude = 0.05, frequency = 2), 64);");
  EXPECT_NEAR(diagnose(meshOf(values["again"])).volume / kBall, 1, 3e-3);
  const MeshDiagnosis cloud = diagnose(meshOf(values["cloud"]));
  EXPECT_TRUE(cloud.manifold());
  EXPECT_GT(cloud.volume, 1.05 * kBall);
}

TEST(FeltShapes, AreCutAsWideAsAsked) {
  // A slab of 0.2 is gone from the ball, whatever the knife's field is multiplied by: 2 (pi/3) h^2 (3 - h).
  const double h = 0.9, left = 2 * 3.14159265358979 / 3 * h * h * (3 - h);
  for (const std::string steepness : {"0.2", "1", "10"}) {
    auto values = ran("shape[] p = cut(ls2shape(sphere((0,0,0), 1), 64), [" + steepness +
                      " * identity().x], 64, 0.2);");
    double volume = 0;
    const Array pieces = values["p"].as<Array>();
    ASSERT_EQ(pieces->size(), 2u) << steepness;
    for (const Value& piece : *pieces) volume += diagnose(meshOf(piece)).volume;
    EXPECT_NEAR(volume / left, 1, 5e-3) << steepness;
  }
}

TEST(FeltShapes, KeepNumbersThatAreSetInAttributesOfSeveral) {
  const test::TemporaryFolder folder;
  auto values =
      ran("shape ball = ls2shape(sphere((0,0,0), 1), 16); shape a = setattribute(ball, \"color.r\", 0.25);\n"
          "write(\"" +
          folder.file("a.ply") +
          "\", a); float r = eval(attribute(setattribute(a, \"color.r\", 0.75), \"color.r\"), "
          "(0,1,0));");
  EXPECT_NEAR(values["r"].as<double>(), 0.75, 1e-6);
}

TEST(FeltShapes, TakeNoNoticeOfHowSteepFieldsAre) {
  // Volume of a ball, whatever its field is multiplied by.
  for (const std::string steepness : {"1e-6", "1", "1000"}) {
    auto values = ran("shape ball = ls2shape(" + steepness + " * sphere((0,0,0), 1), 64);");
    EXPECT_NEAR(diagnose(meshOf(values["ball"])).volume / kBall, 1, 2e-3) << steepness;
  }
}

TEST(FeltShapes, AreWarpedOntoEachOtherByNacelleOnADomain) {
  // Spheres as r^2: the point with the same value lies on the same ray.
  auto values = ran(
      "scalarfield one = 1 - identity() * identity(); scalarfield other = 1.69 - identity() * identity();\n"
      "vectorfield X = nacelle(other, one, domain((-1.5,-1.5,-1.5), (3,3,3), 0.04));");
  const Vec3f image = values["X"].as<VectorField>()(Vec3f{0.6f, 0, 0.8f} * 1.3f);
  EXPECT_NEAR(length(image - Vec3f(0.6f, 0, 0.8f)), 0, 1e-3f);
}

TEST(FeltShapes, AreCutIntoPiecesThatFit) {
  auto values =
      ran("shape[] p = cut(ls2shape(sphere((0,0,0), 1)), [plane((0,0,0), (1,0,0)), plane((0,0,0), (0,1,0))], "
          "64);\n"
          "int n = size(p); shape first = p[0];");
  ASSERT_EQ(values["n"].as<std::int64_t>(), 4);
  for (const Value& piece : *values["p"].as<Array>()) {
    const MeshDiagnosis is = diagnose(meshOf(piece));
    EXPECT_TRUE(is.closed());
    EXPECT_NEAR(is.volume, kBall / 4, 0.01 * kBall / 4);
  }
  EXPECT_EQ(values["first"].as<std::shared_ptr<const Shape>>()->name, "surface --");
}

TEST(FeltShapes, GrowCloudsAsTheFormSays) {
  // With one layer: r(n) = R + |N(R n)| a; N has the amplitude as its rms, so that the surface lies outside.
  auto values =
      ran("shape ball = ls2shape(sphere((0,0,0), 1), 64);\n"
          "scalarfield none = cumulo(ball, 0.05, 1, amplitude = 0, frequency = 2);\n"
          "scalarfield some = cumulo(ball, 0.05, 2, amplitude = 0.1, frequency = 2, seed = 3);");
  const ScalarField &none = values["none"].as<ScalarField>(), &some = values["some"].as<ScalarField>();
  EXPECT_NEAR(none({0, 1.05f, 0}), -0.05f, 2e-3f);
  double sum = 0;
  for (int i = 0; i < 100; ++i) {
    const float angle = 0.0628f * float(i);
    const float rise = some({std::cos(angle), std::sin(angle), 0});
    EXPECT_GE(rise, -2e-3f);
    sum += double(rise) / 100;
  }
  EXPECT_GT(sum, 0.04);
  EXPECT_LT(sum, 0.3);
}

TEST(FeltShapes, AreRefusedInWords) {
  EXPECT_EQ(
      refusal("shape s = ls2shape(plane((0,0,0), (0,1,0)));"),
      "s.felt:1:11: error: what is inside has no end, or its ranges show none within 500 000 of the origin\n"
      "  shape s = ls2shape(plane((0,0,0), (0,1,0)));\n            ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n"
      "  hint: multiply it by a mask, or say within which domain to look");
  EXPECT_NE(refusal("scalarfield l = shape2ls(ls2shape(sphere((0,0,0), 1), 32), voxel = 1e-5);")
                .find("error: the level set of the shape may take"),
            std::string::npos);
  EXPECT_NE(
      refusal("shape[] p = cut(ls2shape(sphere((0,0,0), 1), 32), [identity().x], kerf = -1);").find("kerf"),
      std::string::npos);
  EXPECT_NE(
      refusal("scalarfield f = attribute(ls2shape(sphere((0,0,0), 1), 32), \"wetness\");").find("wetness"),
      std::string::npos);
  EXPECT_EQ(refusal("shape s = ls2shape(sphere((0,0,0), 1) - 2);"),
            "s.felt:1:11: error: the field is nowhere above 0, so that there is no shape\n"
            "  shape s = ls2shape(sphere((0,0,0), 1) - 2);\n            ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n"
            "  hint: shapes are where a field is above 0");
  EXPECT_EQ(
      refusal("shape s = ls2shape(sphere((0,0,0), 1), 100000);"),
      "s.felt:1:11: error: resolution is 100000, and may be from 4 to 4096\n"
      "  shape s = ls2shape(sphere((0,0,0), 1), 100000);\n            ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~");
}

}  // namespace
}  // namespace nephele::felt
