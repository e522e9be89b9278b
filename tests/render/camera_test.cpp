#include "render/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "modeling/error.h"
#include "render/lights.h"

namespace nephele {
namespace {

constexpr Camera::Frame kFrame{320, 180, 40.0f};

TEST(Camera, LooksAtItsTargetThroughTheMiddleOfThePicture) {
  const Camera camera = Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0, 1, 0}, kFrame);
  const Ray ray = camera.ray(160, 90);
  const Vec3d towards = normalize(Vec3d{3, -2, -5});
  EXPECT_NEAR(dot(ray.direction, towards), 1, 1e-12);
  EXPECT_EQ(ray.origin, (Vec3d{1, 2, 3}));
}

TEST(Camera, HasAHorizontalFieldOfView) {
  const Camera camera = Camera::lookingAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, kFrame);
  const double angle = std::acos(dot(camera.ray(0, 90).direction, camera.ray(320, 90).direction));
  EXPECT_NEAR(degrees(float(angle)), 40, 1e-4);
  // Right of the picture is +x, its top +y, for a camera in front (+z).
  EXPECT_GT(camera.ray(320, 90).direction.x, 0);
  EXPECT_GT(camera.ray(160, 0).direction.y, 0);
}

TEST(Camera, StandsWhereAzimuthAndElevationSay) {
  // Azimuth from +z towards +x, elevation from the horizon.
  const std::vector<Vec3f> points{{0.1f, 0, 0},  {-0.1f, 0, 0}, {0, 0.1f, 0},
                                  {0, -0.1f, 0}, {0, 0, 0.1f},  {0, 0, -0.1f}};
  const struct {
    float azimuth, elevation;
    Vec3d towards;
  } cases[] = {
      {0, 0, {0, 0, 1}}, {90, 0, {1, 0, 0}}, {0, 90, {0, 1, 0}}, {-90, 0, {-1, 0, 0}}, {33, -90, {0, -1, 0}}};
  for (const auto& c : cases) {
    const Camera camera = Camera::framing(points, c.azimuth, c.elevation, kFrame);
    EXPECT_NEAR(dot(normalize(camera.position()), c.towards), 1, 1e-6) << c.azimuth << " " << c.elevation;
    EXPECT_NEAR(dot(camera.forward(), c.towards), -1, 1e-6);
  }
}

TEST(Camera, FramesAllPointsTightly) {
  std::vector<Vec3f> points;
  for (int i = 0; i != 60; ++i)
    points.push_back({3 + std::sin(float(i) * 1.3f), -7 + 0.4f * std::cos(float(i) * 2.1f),
                      2.5f * std::sin(float(i) * 0.7f)});
  for (const float azimuth : {0.0f, 70.0f, 200.0f})
    for (const float elevation : {-80.0f, 0.0f, 30.0f}) {
      const Camera camera = Camera::framing(points, azimuth, elevation, kFrame, 0.05f);
      double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
      for (const Vec3f& point : points) {
        const Vec3d p = camera.project(Vec3d(point));
        EXPECT_GT(p.z, 0);
        left = std::min(left, p.x), right = std::max(right, p.x);
        top = std::min(top, p.y), bottom = std::max(bottom, p.y);
      }
      // Inside the margin of 5 % of each side, and touching it on both sides of one axis.
      EXPECT_GE(left, 16 - 1e-3);
      EXPECT_LE(right, 304 + 1e-3);
      EXPECT_GE(top, 9 - 1e-3);
      EXPECT_LE(bottom, 171 + 1e-3);
      EXPECT_TRUE((left < 16.01 && right > 303.99) || (top < 9.01 && bottom > 170.99));
    }
}

TEST(Camera, FramesSomethingFiniteWhateverItIsGiven) {
  for (const std::vector<Vec3f>& points :
       {std::vector<Vec3f>{}, std::vector<Vec3f>{{1, 2, 3}}, std::vector<Vec3f>{{0, 0, 0}, {0, 0, 9}}}) {
    const Camera camera = Camera::framing(points, 0, 0, kFrame);
    EXPECT_TRUE(isFinite(camera.position()));
    for (const Vec3f& point : points) EXPECT_GT(camera.project(Vec3d(point)).z, 0);
  }
}

TEST(Camera, ProjectsWhatItsRaysHit) {
  const Camera camera = Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0.2f, 1, 0}, kFrame);
  const Ray ray = camera.ray(37.25, 150.5);
  const Vec3d p = camera.project(ray.origin + ray.direction * 7.5);
  EXPECT_NEAR(p.x, 37.25, 1e-9);
  EXPECT_NEAR(p.y, 150.5, 1e-9);
}

TEST(Camera, StoresMatricesThatAgreeWithItsRays) {
  const Camera camera = Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0, 1, 0}, kFrame);
  const Ray ray = camera.ray(37.25, 150.5);
  const Vec3d p = ray.origin + ray.direction * 7.5;
  const double row[4] = {p.x, p.y, p.z, 1};
  double inCamera[4] = {}, inNdc[4] = {};
  for (int column = 0; column != 4; ++column)
    for (int i = 0; i != 4; ++i) {
      inCamera[column] += row[i] * camera.worldToCamera()[i * 4 + column];
      inNdc[column] += row[i] * camera.worldToNdc()[i * 4 + column];
    }
  const double depth = 7.5 * dot(ray.direction, camera.forward());
  EXPECT_NEAR(inCamera[2], -depth, 1e-5);  // looks along -z
  EXPECT_NEAR(inNdc[3], depth, 1e-5);
  EXPECT_NEAR(inNdc[0] / inNdc[3], 2 * 37.25 / 320 - 1, 1e-5);
  EXPECT_NEAR(inNdc[1] / inNdc[3], 1 - 2 * 150.5 / 180, 1e-5);
  EXPECT_NEAR(inNdc[2] / inNdc[3], 1 / depth, 1e-5);
}

TEST(Camera, RefusesWhatItCannotLookThrough) {
  EXPECT_THROW(Camera::lookingAt({1, 1, 1}, {1, 1, 1}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 5, 0}, {0, 0, 0}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 5, NAN}, {0, 0, 0}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {0, 10, 40}), Error);
  EXPECT_THROW(Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {10, 10, 180}), Error);
}

}  // namespace
}  // namespace nephele
