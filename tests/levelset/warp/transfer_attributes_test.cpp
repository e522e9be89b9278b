// Attributes from one surface to another.
#include "nephele/levelset/warp/transfer_attributes.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/warp/detail/attribute_charts.h"
#include "nephele/levelset/warp/reference_surface.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"
#include "tests/support/uv_layout.h"

namespace nephele::test {
namespace {

std::vector<Vec3d> closestPoints(const Mesh& reference, const Mesh& object) {
  const detail::ReferenceSurface surface(reference);
  std::vector<Vec3d> images;
  for (const Vec3d& p : object.positions) {
    const auto at = surface.nearest(p);
    images.push_back(surface.position(at.triangle, at.weights) + surface.origin());
  }
  return images;
}

Mesh carried(const Mesh& reference, const Mesh& object, const TransferOptions& options = {}) {
  return transferAttributes(reference, object, closestPoints(reference, object), options);
}

// A globe of radius 1: u = longitude / 2 pi from +x towards -z, v from the south pole; one column of
// triangles per pole, whose pole corners have the u between the other two.
Mesh globe(int columns, int rows) {
  Mesh mesh;
  std::vector<float> uv;
  const auto id = [&](int i, int j) {
    return j == 0 ? 0u : j == rows ? 1u : 2u + std::uint32_t((j - 1) * columns + i % columns);
  };
  mesh.positions = {{0, -1, 0}, {0, 1, 0}};
  for (int j = 1; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * std::numbers::pi * i / columns, b = std::numbers::pi * (double(j) / rows - 0.5);
      mesh.positions.push_back({std::cos(a) * std::cos(b), std::sin(b), -std::sin(a) * std::cos(b)});
    }
  const auto add = [&](const std::array<std::array<double, 2>, 3>& c) {
    std::array<std::uint32_t, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      face[k] = id(int(c[k][0]), int(c[k][1]));
      uv.push_back(float(c[k][0] / columns));
      uv.push_back(float(c[k][1] / rows));
    }
    mesh.addFace(face);
  };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double x = i, y = j;
      if (j == 0) {
        add({{{x + 0.5, 0}, {x + 1, 1}, {x, 1}}});
      } else if (j == rows - 1) {
        add({{{x, y}, {x + 1, y}, {x + 0.5, y + 1}}});
      } else {
        add({{{x, y}, {x + 1, y}, {x + 1, y + 1}}});
        add({{{x, y}, {x + 1, y + 1}, {x, y + 1}}});
      }
    }
  mesh.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, uv});
  return mesh;
}

double longitude(const Vec3d& p) {
  const double a = std::atan2(-p.z, p.x) / (2 * std::numbers::pi);
  return a < 0 ? a + 1 : a;
}

// Whether the triangle, projected from the origin, holds the y axis.
bool isAroundPole(const Mesh& mesh, std::size_t f) {
  double turn = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d &a = mesh.positions[mesh.face(f)[i]], &b = mesh.positions[mesh.face(f)[(i + 1) % 3]];
    if (std::hypot(a.x, a.z) < 1e-9) return true;
    turn += std::atan2(a.z * b.x - a.x * b.z, a.x * b.x + a.z * b.z);
  }
  return std::abs(turn) > 1;
}

TEST(AttributeCharts, KnowThePolesAndTheSeamOfAGlobe) {
  const Mesh mesh = globe(24, 12);
  const detail::AttributeCharts charts(mesh, mesh.attributes[0]);
  EXPECT_EQ(charts.chartCount(), 1u);
  EXPECT_EQ(charts.period(0), 1);
  EXPECT_EQ(charts.period(1), 0);
  // 12 edges along the seam.
  EXPECT_EQ(charts.seams().size(), 24u);
  int poles = 0;
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    EXPECT_EQ(charts.poleComponent(c), mesh.corners[c] < 2 ? 0 : -1);
    poles += charts.poleComponent(c) == 0;
  }
  EXPECT_EQ(poles, 48);
  // Every edge leads on; the turn around the globe adds 1.
  for (std::uint32_t t = 0; t < mesh.faceCount(); ++t)
    for (int e = 0; e < 3; ++e) EXPECT_TRUE(charts.across(t, e).has_value());
}

// A box whose six sides are six charts in a row; their corners share v = 0 and 1.
Mesh boxOfSixCharts(const Vec3d& low, const Vec3d& high, float step = 1.0f / 6, float width = 0.15f) {
  Mesh box = boxMesh(low, high);
  std::vector<float> uv;
  for (int side = 0; side < 6; ++side) {
    const float u0 = float(side) * step, u1 = u0 + width;
    for (const float x : {u0, 0.f, u1, 0.f, u1, 1.f, u0, 0.f, u1, 1.f, u0, 1.f}) uv.push_back(x);
  }
  box.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, uv});
  return box;
}

TEST(AttributeCharts, DoNotTakeCornersWhereChartsMeetForPoles) {
  const Mesh box = boxOfSixCharts({0, 0, 0}, {1, 1, 1});
  const detail::AttributeCharts charts(box, box.attributes[0]);
  EXPECT_EQ(charts.chartCount(), 6u);
  EXPECT_EQ(charts.period(0), 0);
  EXPECT_EQ(charts.seams().size(), 24u);
  for (std::size_t c = 0; c < box.corners.size(); ++c) EXPECT_EQ(charts.poleComponent(c), -1);
}

TEST(TransferAttributes, KeepsTheCornersOfABoxWhoseSidesAreWholeTiles) {
  // Three sides meet in each corner, with whole numbers that differ, as around a pole.
  const Mesh box = boxOfSixCharts({0, 0, 0}, {1, 1, 1}, 1, 1);
  const detail::AttributeCharts charts(box, box.attributes[0]);
  for (std::size_t c = 0; c < box.corners.size(); ++c) EXPECT_EQ(charts.poleComponent(c), -1);
  EXPECT_EQ(transferAttributes(box, box, box.positions).attributes[0].values, box.attributes[0].values);
}

TEST(AttributeCharts, OfASoupAreThoseOfTheSurface) {
  Mesh soup = unshared(globe(24, 12));
  soup.attributes = globe(24, 12).attributes;
  EXPECT_EQ(detail::AttributeCharts(soup, soup.attributes[0]).chartCount(), 1u);
}

TEST(TransferAttributes, GoesOnAcrossTheSeamOfAGlobe) {
  const Mesh reference = globe(96, 48), object = icosphere(1, 4);
  const Mesh result = carried(reference, object);
  const std::vector<float>& uv = attributeOf(result, "uv").values;
  const std::vector<float> extents = uvExtents(result);
  int around = 0, beyond = 0;
  for (std::size_t f = 0; f < result.faceCount(); ++f) {
    around += isAroundPole(result, f);
    EXPECT_TRUE(extents[f] <= 0.5 || isAroundPole(result, f)) << f << " " << extents[f];
    for (std::size_t c = 3 * f; c < 3 * f + 3; ++c) {
      EXPECT_GE(uv[2 * c], 0);
      EXPECT_LT(uv[2 * c], 1.5);
      beyond += uv[2 * c] > 1;
      const Vec3d& p = result.positions[result.corners[c]];
      const double radius = std::hypot(p.x, p.z);
      if (radius < 0.1) continue;
      // The triangles of the globe are linear in u where longitude is not: half of a column's sagitta.
      const double du = double(uv[2 * c]) - longitude(p);
      EXPECT_NEAR(du - std::round(du), 0, 5e-4 / radius);
      EXPECT_NEAR(uv[2 * c + 1], 0.5 + std::asin(p.y) / std::numbers::pi, 1e-3);
    }
  }
  EXPECT_GE(around, 1);
  EXPECT_GT(beyond, 10);
}

TEST(TransferAttributes, GivesPolesTheMeanOfTheOtherCorners) {
  const Mesh reference = globe(24, 12);
  // A fan about the north pole, turned by a third of a column.
  Mesh fan;
  fan.positions.push_back({0, 1, 0});
  for (int i = 0; i < 24; ++i) {
    const double a = 2 * std::numbers::pi * (i + 1.0 / 3) / 24, b = 0.45 * std::numbers::pi;
    fan.positions.push_back({std::cos(a) * std::cos(b), std::sin(b), -std::sin(a) * std::cos(b)});
  }
  for (std::uint32_t i = 0; i < 24; ++i)
    fan.addFace(std::array<std::uint32_t, 3>{0, 1 + i, 1 + (i + 1) % 24});
  const Mesh result = carried(reference, fan);
  const std::vector<float>& uv = attributeOf(result, "uv").values;
  for (std::size_t f = 0; f < 24; ++f) {
    EXPECT_NEAR(uv[6 * f], 0.5 * (uv[6 * f + 2] + uv[6 * f + 4]), 1e-6);
    EXPECT_EQ(uv[6 * f + 1], 1);
    EXPECT_NEAR(uv[6 * f + 4] - uv[6 * f + 2], 1.0 / 24, 0.01);
  }
}

TEST(TransferAttributes, KeepsEveryFaceInOneChart) {
  const Mesh reference = boxOfSixCharts({-1, -1, -1}, {1, 1, 1});
  Mesh object = icosphere(1.2, 4);
  const Mesh result = carried(reference, object);
  UvIslands islands(reference);
  EXPECT_EQ(islands.count(), 6u);
  EXPECT_EQ(islands.mixedFaces(result), 0u);
  // Away from the edges of the box values are what the closest point has: v is one coordinate.
  const std::vector<float>& uv = attributeOf(result, "uv").values;
  for (std::size_t c = 0; c < result.corners.size(); ++c) {
    const Vec3d p = result.positions[result.corners[c]];
    if (std::abs(p.x) > 0.8 || std::abs(p.y) > 0.8 || p.z > -1) continue;
    // The side at the low end of z comes first: corners (low, low), (low, high), (high, high).
    EXPECT_NEAR(uv[2 * c], (p.y + 1) / 2 * 0.15, 1e-5);
    EXPECT_NEAR(uv[2 * c + 1], (p.x + 1) / 2, 1e-5);
  }
}

TEST(TransferAttributes, FollowsACutWithinAChart) {
  // An open tube unrolled to a length that is no whole number: one chart whose seam does not wrap.
  const int around = 32;
  Mesh tube;
  std::vector<float> uv;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < around; ++i) {
      const double a = 2 * std::numbers::pi * i / around;
      tube.positions.push_back({std::cos(a), std::sin(a), double(j)});
    }
  for (int i = 0; i < around; ++i) {
    const auto id = [&](int k, int j) { return std::uint32_t(j * around + k % around); };
    tube.addFace(std::array<std::uint32_t, 4>{id(i, 0), id(i + 1, 0), id(i + 1, 1), id(i, 1)});
    const float u0 = 0.8f * float(i) / around, u1 = 0.8f * float(i + 1) / around;
    for (const float x : {u0, 0.f, u1, 0.f, u1, 1.f, u0, 1.f}) uv.push_back(x);
  }
  tube.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, uv});
  // The same tube of 45 columns, none of which ends at the cut but the first.
  Mesh object;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 45; ++i) {
      const double a = 2 * std::numbers::pi * (i + 0.3) / 45;
      object.positions.push_back({std::cos(a), std::sin(a), double(j)});
    }
  for (int i = 0; i < 45; ++i) {
    const auto id = [&](int k, int j) { return std::uint32_t(j * 45 + k % 45); };
    object.addFace(std::array<std::uint32_t, 4>{id(i, 0), id(i + 1, 0), id(i + 1, 1), id(i, 1)});
  }
  const Mesh result = carried(tube, object);
  const std::vector<float> extents = uvExtents(result);
  ASSERT_EQ(extents.size(), 45u);
  const std::vector<float>& carriedUv = attributeOf(result, "uv").values;
  for (std::size_t f = 0; f < 45; ++f) {
    // 0.8 / 45 across, or what lies on one side of the cut.
    const float width = std::abs(carriedUv[8 * f + 2] - carriedUv[8 * f]);
    EXPECT_LE(width, 0.8f / 45 * 1.02f) << f;
    EXPECT_GE(width, 0.8f / 45 * 0.5f) << f;
  }
}

TEST(TransferAttributes, InterpolatesValuesOfVerticesLinearly) {
  Mesh reference = boxMesh({0, 0, 0}, {1, 2, 3});
  MeshAttribute heat{"heat", MeshAttribute::Domain::vertex, 1, {}},
      flow{"flow", MeshAttribute::Domain::vertex, 3, {}};
  for (const Vec3d& p : reference.positions) {
    heat.values.push_back(float(p.x + 2 * p.y - p.z));
    for (int k = 0; k < 3; ++k) flow.values.push_back(float(p[k]));
  }
  reference.attributes = {heat, flow};
  Mesh object = midpointSplit(midpointSplit(boxMesh({0, 0, 0}, {1, 2, 3})));
  const Mesh result = carried(reference, object);
  ASSERT_EQ(result.attributes.size(), 2u);
  EXPECT_EQ(result.attributes[0].domain, MeshAttribute::Domain::vertex);
  EXPECT_EQ(result.attributes[1].width, 3);
  for (std::size_t v = 0; v < object.positions.size(); ++v) {
    const Vec3d& p = object.positions[v];
    EXPECT_NEAR(result.attributes[0].values[v], p.x + 2 * p.y - p.z, 2e-6);
    // Vectors are copied and not turned.
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(result.attributes[1].values[3 * v + std::size_t(k)], p[k], 2e-6);
  }
}

TEST(TransferAttributes, CarriesConstantsPerFaceAsTheyAre) {
  // Each side of a box has a colour of its own at its corners: nothing in between appears.
  Mesh reference = boxMesh({-1, -1, -1}, {1, 1, 1});
  MeshAttribute colour{"paint", MeshAttribute::Domain::corner, 3, {}};
  for (int c = 0; c < 36; ++c)
    for (int k = 0; k < 3; ++k) colour.values.push_back(float(c / 6) + 10 * float(k));
  reference.attributes = {colour};
  const Mesh result = carried(reference, icosphere(1.3, 3));
  const std::vector<float>& paint = attributeOf(result, "paint").values;
  for (std::size_t f = 0; f < result.faceCount(); ++f)
    for (std::size_t c = 3 * f; c < 3 * f + 3; ++c) {
      EXPECT_EQ(paint[3 * c], std::round(paint[3 * c]));
      EXPECT_EQ(paint[3 * c], paint[9 * f]);
      EXPECT_EQ(paint[3 * c + 2], paint[3 * c] + 20);
    }
}

// Differences between the texture coordinates that `object` had and gets.
std::vector<double> ownUvErrors(const Mesh& reference, Mesh object, std::span<const Vec3d> images) {
  const std::vector<float> own = attributeOf(object, "uv").values;
  object.attributes.clear();
  const Mesh result = transferAttributes(reference, object, images, {.names = {"uv"}});
  const std::vector<float>& uv = attributeOf(result, "uv").values;
  UvIslands islands(reference);
  EXPECT_EQ(islands.mixedFaces(result), 0u);
  std::vector<double> errors;
  for (std::size_t c = 0; c < result.corners.size(); ++c)
    errors.push_back(std::hypot(double(uv[2 * c]) - own[2 * c], double(uv[2 * c + 1]) - own[2 * c + 1]));
  std::sort(errors.begin(), errors.end());
  return errors;
}

class KnownCoordinates : public testing::TestWithParam<std::pair<const char*, std::size_t>> {};

TEST_P(KnownCoordinates, ComeBackToASplitMesh) {
  const std::string path = sharedData(GetParam().first);
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh reference = triangulated(readMesh(path));
  // 13 islands of spot are the number in its manifest.
  if (GetParam().second > 0) {
    EXPECT_EQ(UvIslands(reference).count(), GetParam().second);
  }
  const Mesh object = midpointSplit(midpointSplit(reference));
  const std::vector<double> errors = ownUvErrors(reference, object, object.positions);
  EXPECT_LE(errors[errors.size() / 2], 1e-4);
  EXPECT_LE(errors[errors.size() * 99 / 100], 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Files, KnownCoordinates,
                         testing::Values(std::pair{"meshes/spot_uv.obj", 13},
                                         std::pair{"meshes/bunny_28k_uv.ply", 0}));

TEST(TransferAttributes, DoesNotDependOnSizeAndPlace) {
  Mesh reference = boxOfSixCharts({-1, -1, -1}, {1, 1, 1});
  Mesh object = midpointSplit(midpointSplit(reference));
  for (const double size : {1e-3, 1e3})
    for (const double shift : {0.0, 1e6}) {
      Mesh far = reference, farObject = object;
      for (Vec3d& p : far.positions) p = p * size + Vec3d{shift, -shift, shift} * size;
      for (Vec3d& p : farObject.positions) p = p * size + Vec3d{shift, -shift, shift} * size;
      const std::vector<double> errors = ownUvErrors(far, farObject, farObject.positions);
      EXPECT_LE(errors.back(), 1e-4) << size << " " << shift;
    }
}

TEST(TransferAttributes, KeepsPolygonsGroupsAndOtherAttributes) {
  const Mesh reference = boxOfSixCharts({0, 0, 0}, {1, 1, 1});
  Mesh object;
  object.positions = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  object.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  object.groups = {{"top", 0, 1}};
  object.attributes = {{"uv", MeshAttribute::Domain::vertex, 2, std::vector<float>(8, 7.0f)},
                       {"mass", MeshAttribute::Domain::vertex, 1, {1, 2, 3, 4}}};
  const Mesh result = transferAttributes(reference, object, object.positions);
  EXPECT_EQ(result.faceCount(), 1u);
  EXPECT_EQ(result.groups[0].name, "top");
  EXPECT_EQ(attributeOf(result, "mass").values, (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(attributeOf(result, "uv").domain, MeshAttribute::Domain::corner);
  EXPECT_EQ(attributeOf(result, "uv").values.size(), 8u);
}

TEST(TransferAttributes, OfShapesWithoutAreaIsFinite) {
  const Mesh reference = boxOfSixCharts({0, 0, 0}, {1, 1, 1});
  Mesh object = icosphere(1, 1);
  object.positions.insert(object.positions.end(), 3, object.positions[0]);
  const auto n = std::uint32_t(object.positions.size());
  object.addFace(std::array<std::uint32_t, 3>{0, 0, 0});
  object.addFace(std::array<std::uint32_t, 3>{n - 1, n - 2, n - 3});
  object.addFace(std::array<std::uint32_t, 3>{0, 1, n - 1});
  Mesh flat = reference;
  for (Vec3d& p : flat.positions) p.y = p.z = 0;
  for (const Mesh* from : {&reference, &std::as_const(flat)})
    for (const float v : attributeOf(carried(*from, object), "uv").values) EXPECT_TRUE(std::isfinite(v));
}

TEST(TransferAttributes, SaysWhichAttributesThereAre) {
  Mesh reference = boxOfSixCharts({0, 0, 0}, {1, 1, 1});
  reference.attributes.push_back({"mass", MeshAttribute::Domain::vertex, 1, std::vector<float>(8, 1.0f)});
  try {
    carried(reference, reference, {.names = {"colour"}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "transfer: the reference has no attribute 'colour'; it has uv, mass");
  }
  EXPECT_EQ(carried(reference, boxMesh({0, 0, 0}, {1, 1, 1}), {.names = {"mass"}}).attributes.size(), 1u);
}

TEST(TransferAttributes, LeavesNormalsUnlessAskedFor) {
  Mesh reference = boxMesh({0, 0, 0}, {1, 1, 1});
  for (const char* name : {"nx", "ny", "nz", "mass"})
    reference.attributes.push_back({name, MeshAttribute::Domain::vertex, 1, std::vector<float>(8, 1.0f)});
  const Mesh object = boxMesh({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(carried(reference, object).attributes.size(), 1u);
  EXPECT_EQ(carried(reference, object, {.names = {"nx"}}).attributes[0].name, "nx");
}

TEST(TransferAttributes, RefusesWhatCannotBeCarried) {
  const Mesh reference = boxOfSixCharts({0, 0, 0}, {1, 1, 1}), object = icosphere(1, 0);
  EXPECT_THROW(carried(boxMesh({0, 0, 0}, {1, 1, 1}), object), Error);
  EXPECT_THROW(transferAttributes(reference, object, std::vector<Vec3d>(2)), Error);
  std::vector<Vec3d> images = object.positions;
  images[3].z = INFINITY;
  EXPECT_THROW(transferAttributes(reference, object, images), Error);
  Mesh broken = reference;
  broken.attributes[0].values[5] = NAN;
  EXPECT_THROW(carried(broken, object), Error);
}

}  // namespace
}  // namespace nephele::test
