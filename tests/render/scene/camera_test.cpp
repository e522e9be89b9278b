#include "nephele/render/scene/camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/scene/rotation.h"

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
  EXPECT_NEAR(inCamera[2], depth, 1e-5);
  EXPECT_NEAR(inNdc[3], depth, 1e-5);
  EXPECT_NEAR(inNdc[0] / inNdc[3], 37.25 / 320, 1e-5);
  EXPECT_NEAR(inNdc[1] / inNdc[3], 150.5 / 180, 1e-5);
  EXPECT_NEAR(inNdc[2] / inNdc[3], 1 / depth, 1e-5);
}

TEST(Camera, RefusesWhatItCannotLookThrough) {
  EXPECT_THROW(Camera::lookingAt({1, 1, 1}, {1, 1, 1}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 5, 0}, {0, 0, 0}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 5, NAN}, {0, 0, 0}, {0, 1, 0}, kFrame), Error);
  EXPECT_THROW(Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {0, 10, 40}), Error);
  EXPECT_THROW(Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {10, 10, 180}), Error);
}

constexpr Camera::Frame kParallel{320, 180, 40.0f, Camera::Projection::orthographic, 8.0f};

TEST(OrthographicCamera, HasParallelRaysAndItsWidth) {
  const Camera camera = Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0, 1, 0}, kParallel);
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {320.0, 0.0}, {17.5, 133.25}})
    EXPECT_EQ(camera.ray(x, y).direction, camera.forward());
  EXPECT_NEAR(length(camera.ray(320, 90).origin - camera.ray(0, 90).origin), 8, 1e-12);
  EXPECT_NEAR(length(camera.ray(7, 180).origin - camera.ray(7, 0).origin), 4.5, 1e-12);
  EXPECT_EQ(camera.pixelAngle(), 0);
  EXPECT_NEAR(camera.pixelWidth(100), 8.0 / 320, 1e-12);
}

TEST(OrthographicCamera, FramesAllPointsTightly) {
  std::vector<Vec3f> points;
  for (int i = 0; i != 60; ++i)
    points.push_back({3 + std::sin(float(i) * 1.3f), -7 + 0.4f * std::cos(float(i) * 2.1f),
                      2.5f * std::sin(float(i) * 0.7f)});
  Camera::Frame frame = kParallel;
  frame.orthographicWidth.reset();
  for (const float azimuth : {0.0f, 70.0f, 200.0f})
    for (const float elevation : {-80.0f, 0.0f, 30.0f}) {
      const Camera camera = Camera::framing(points, azimuth, elevation, frame, 0.05f);
      double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
      for (const Vec3f& point : points) {
        const Vec3d p = camera.project(Vec3d(point));
        EXPECT_GT(p.z, 0);
        left = std::min(left, p.x), right = std::max(right, p.x);
        top = std::min(top, p.y), bottom = std::max(bottom, p.y);
      }
      EXPECT_TRUE((std::fabs(left - 16) < 0.01 && std::fabs(right - 304) < 0.01) ||
                  (std::fabs(top - 9) < 0.01 && std::fabs(bottom - 171) < 0.01))
          << left << " " << right << " " << top << " " << bottom;
      EXPECT_NEAR(left + right, 320, 0.01);
      EXPECT_NEAR(top + bottom, 180, 0.01);
    }
  // A width that is asked for stays.
  frame.orthographicWidth = 50.0f;
  EXPECT_NEAR(Camera::framing(points, 20, 10, frame).screenWidth(), 50, 1e-5);
  EXPECT_TRUE(isFinite(Camera::framing(std::vector<Vec3f>{{1, 2, 3}}, 0, 0, kParallel).position()));
}

// Cameras of every kind, cropped off their axes.
std::vector<Camera> everyKind() {
  std::vector<Camera> cameras;
  for (Camera::Frame frame : {kFrame, kParallel}) {
    cameras.push_back(Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0.2f, 1, 0}, frame));
    frame.crop = PixelBox{200, 10, 320, 60};
    cameras.push_back(Camera::lookingAt({1, 2, 3}, {4, 0, -2}, {0.2f, 1, 0}, frame).withLens({0.2, 5}));
  }
  return cameras;
}

TEST(Camera, ProjectsWhatItsRaysHitWhateverItsKind) {
  for (const Camera& camera : everyKind())
    for (const auto& [x, y] : {std::pair{0.5, 0.5}, {37.25, 150.5}, {319.0, 11.0}}) {
      const Ray ray = camera.ray(x, y);
      const Vec3d p = camera.project(ray.origin + ray.direction * 7.5);
      EXPECT_NEAR(p.x, x, 1e-9);
      EXPECT_NEAR(p.y, y, 1e-9);
      EXPECT_NEAR(p.z, 7.5 * dot(ray.direction, camera.forward()), 1e-9);
    }
}

TEST(Camera, StoresMatricesThatAgreeWithItsRaysWhateverItsKind) {
  // Over the whole picture, also where only a part of it is wanted.
  for (const Camera& camera : everyKind()) {
    const Vec3d p = camera.ray(250.5, 30.25).origin + camera.ray(250.5, 30.25).direction * 7.5;
    const double row[4] = {p.x, p.y, p.z, 1};
    double inCamera[4] = {}, inNdc[4] = {};
    for (std::size_t column = 0; column != 4; ++column)
      for (std::size_t i = 0; i != 4; ++i) {
        inCamera[column] += row[i] * camera.worldToCamera()[i * 4 + column];
        inNdc[column] += row[i] * camera.worldToNdc()[i * 4 + column];
      }
    const double depth = camera.project(p).z;
    EXPECT_NEAR(inCamera[2], depth, 1e-5);
    EXPECT_NEAR(inNdc[3], camera.isOrthographic() ? 1 : depth, 1e-5);
    EXPECT_NEAR(inNdc[0] / inNdc[3], 250.5 / 320, 1e-5);
    EXPECT_NEAR(inNdc[1] / inNdc[3], 30.25 / 180, 1e-5);
    EXPECT_NEAR(inNdc[2] / inNdc[3], camera.isOrthographic() ? -depth : 1 / depth, 1e-5);
  }
}

TEST(Camera, TurnsFocalLengthsIntoAnglesAndBack) {
  EXPECT_NEAR(fovDegreesOf(18, 36), 90, 1e-12);
  EXPECT_NEAR(fovDegreesOf(50, 36), 39.597752, 1e-6);  // the "normal" lens of 35 mm photography
  EXPECT_NEAR(focalLengthOf(fovDegreesOf(85, 24), 24), 85, 1e-10);
  EXPECT_THROW(fovDegreesOf(0, 36), Error);
  EXPECT_THROW(fovDegreesOf(50, -1), Error);
  EXPECT_THROW(focalLengthOf(180, 36), Error);
}

TEST(Lens, RaysOfAPixelMeetInThePlaneOfFocus) {
  for (const Camera& pinhole : everyKind()) {
    const Camera camera = pinhole.withLens({0.3, 6});
    const Ray central = camera.ray(250.5, 30.25);
    const Vec3d meeting = central.origin + central.direction * (6 / dot(central.direction, camera.forward()));
    EXPECT_NEAR(camera.project(meeting).z, 6, 1e-12);
    double widest = 0;
    for (int i = 0; i != 64; ++i) {
      const Ray ray = camera.ray(250.5, 30.25, (i % 8) / 8.0, (i / 8) / 8.0);
      EXPECT_NEAR(length(ray.direction), 1, 1e-12);
      EXPECT_NEAR(length(cross(ray.direction, meeting - ray.origin)), 0, 1e-12);
      // From a disc across the line of sight.
      const Vec3d aside = ray.origin - central.origin;
      EXPECT_NEAR(dot(aside, camera.forward()), 0, 1e-12);
      EXPECT_LE(length(aside), 0.3 + 1e-12);
      widest = std::max(widest, length(aside));
    }
    EXPECT_NEAR(widest, 0.3, 1e-12);
    EXPECT_NEAR(length(camera.ray(250.5, 30.25, 0.5, 0.5).direction - central.direction), 0, 1e-14);
  }
}

TEST(Lens, IsCoveredEvenly) {
  // Means over a uniform disc: 0, and 1/4 of the square of each coordinate; a quarter lies within half the
  // radius.
  const Camera camera = Camera::lookingAt({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kFrame).withLens({1, 5});
  Vec3d mean, square;
  int inner = 0;
  for (int i = 0; i != 256; ++i)
    for (int j = 0; j != 256; ++j) {
      const Vec3d p = camera.ray(160, 90, (i + 0.5) / 256, (j + 0.5) / 256).origin / 256.0;
      mean += p / 256.0;
      square += p * p;
      inner += length(p) * 256 < 0.5;
    }
  EXPECT_NEAR(length(mean), 0, 1e-9);
  EXPECT_NEAR(square.x, 0.25, 1e-4);
  EXPECT_NEAR(square.y, 0.25, 1e-4);
  EXPECT_NEAR(inner / 65536.0, 0.25, 1e-3);
}

TEST(Lens, BlursAPointToItsCircleOfConfusion) {
  // A point at depth d is seen by rays through pixels within radius * focus * |1 / d - 1 / focus| / (width of
  // a pixel at distance 1); of an orthographic camera by radius |1 - d / focus| / pixel.
  const double radius = 0.05, focus = 6;
  for (const Camera::Frame& frame : {kFrame, kParallel})
    for (const double depth : {3.0, 6.0, 12.0}) {
      const Camera camera =
          Camera::lookingAt({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, frame).withLens({radius, focus});
      // The ray through the rim of the lens and pixel x meets depth d beside the axis at a place that is
      // linear in x; where it is 0, the pixel sees the point.
      const auto beside = [&](double x) {
        const Ray ray = camera.ray(x, 90, 1, 0.5);
        return (ray.origin + ray.direction * (depth / dot(ray.direction, camera.forward()))).x;
      };
      const double x = 160 - beside(160) / (beside(161) - beside(160));
      const double exact = camera.isOrthographic()
                               ? radius * std::fabs(1 - depth / focus) / camera.pixelWidth(0)
                               : radius * std::fabs(1 / depth - 1 / focus) / camera.pixelAngle();
      EXPECT_NEAR(std::fabs(x - 160), exact, 1e-6) << depth;
    }
}

TEST(MotionBlur, TurnsTheVolumeAboutItsCentre) {
  const RigidMotion motion{{1, 0, 0}, {0, 90, 0}, {5, 0, 0}};
  // After one frame what was at z = 1 beside the centre is at x = 1 beside it, a unit further on: a ray that
  // looks there then looks at z = 1 in the body, where it was.
  const Ray seen = motion.toBody({{7, 3, 0}, {0, -1, 0}}, 1);
  EXPECT_NEAR(length(seen.origin - Vec3d{5, 3, 1}), 0, 1e-12);
  EXPECT_NEAR(length(seen.direction - Vec3d{0, -1, 0}), 0, 1e-12);
  EXPECT_EQ(motion.toBody({{7, 3, 0}, {0, -1, 0}}, 0).origin, (Vec3d{7, 3, 0}));
}

TEST(MotionBlur, FollowsACameraThatTurns) {
  // A quarter turn about y in 9 poses: between them within a thousandth of a degree of an even turn.
  std::vector<Camera> poses;
  for (int i = 0; i != 9; ++i) {
    const Rotation turn = Rotation::euler({0, 90.0 * i / 8, 0}, {});
    poses.push_back(Camera::facing({1, 2, 3}, turn({1, 0, 0}), turn({0, 1, 0}), kFrame));
  }
  const Camera camera = poses[4].withShutter(poses);
  EXPECT_TRUE(camera.isMoving());
  for (const double time : {0.0, 0.03, 0.5, 0.77, 1.0}) {
    const Rotation turn = Rotation::euler({0, 90 * time, 0}, {});
    const Ray ray = camera.ray(37.25, 150.5, 0, 0, time);
    const Ray exact = Camera::facing({1, 2, 3}, turn({1, 0, 0}), turn({0, 1, 0}), kFrame).ray(37.25, 150.5);
    EXPECT_NEAR(length(ray.direction - exact.direction), 0, 3e-4);
    EXPECT_NEAR(length(camera.forwardAt(time) - turn({0, 0, -1})), 0, 3e-4);
  }
  EXPECT_EQ(camera.ray(3, 4).direction, poses[4].ray(3, 4).direction);
  EXPECT_FALSE(camera.withShutter({}).isMoving());
}

TEST(Camera, FramesWhatIsTinyAsItFramesTheRest) {
  const std::vector<Vec3f> points{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  for (const Camera::Frame& frame : {kFrame, kParallel}) {
    const Camera camera = Camera::framing(points, 30, 20, frame);
    for (const float unit : {1e-12f, 1e12f}) {
      std::vector<Vec3f> scaled;
      for (const Vec3f& point : points) scaled.push_back(point * unit);
      const Camera other = Camera::framing(scaled, 30, 20, frame);
      EXPECT_NEAR(length(other.position() * (1.0 / double(unit)) - camera.position()), 0, 1e-5) << unit;
    }
  }
}

TEST(Camera, FramesTheOutermostPointsAsItFramesAll) {
  std::vector<Vec3f> points;
  for (int i = 0; i != 500; ++i)
    points.push_back({std::sin(1.7f * float(i)), 3 * std::cos(2.3f * float(i)), 0.01f * float(i)});
  for (const Camera::Frame& frame : {kFrame, kParallel})
    for (const float azimuth : {0.0f, 25.0f, 190.0f}) {
      const std::vector<Vec3f> few = Camera::outermost(points, azimuth, 15, frame);
      EXPECT_LE(few.size(), 7u);
      const Camera one = Camera::framing(few, azimuth, 15, frame),
                   all = Camera::framing(points, azimuth, 15, frame);
      EXPECT_EQ(one.worldToCamera(), all.worldToCamera());
      EXPECT_EQ(one.screenWidth(), all.screenWidth());
    }
  EXPECT_TRUE(Camera::outermost({}, 0, 0, kFrame).empty());
}

TEST(Camera, RefusesLensesAndFramesThatCannotBe) {
  const Camera camera = Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, kFrame);
  EXPECT_THROW(camera.withLens({-1, 1}), Error);
  EXPECT_THROW(camera.withLens({1, 0}), Error);
  EXPECT_THROW(camera.withLens({NAN, 1}), Error);
  Camera::Frame frame = kParallel;
  frame.orthographicWidth = 0.0f;
  EXPECT_THROW(Camera::framing({}, 0, 0, frame), Error);
  frame.orthographicWidth.reset();
  EXPECT_THROW(Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, frame), Error);
  EXPECT_THROW(Camera::facing({}, {1, 0, 0}, {1, 0, 0}, kFrame), Error);
  for (const PixelBox& crop : {PixelBox{0, 0, 321, 180}, PixelBox{-1, 0, 20, 20}, PixelBox{5, 5, 5, 9}}) {
    frame = kFrame;
    frame.crop = crop;
    EXPECT_THROW(Camera::framing({}, 0, 0, frame), Error);
  }
  Camera::Frame other = kFrame;
  other.width = 10;
  const Camera poses[] = {camera, Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, other)};
  EXPECT_THROW(camera.withShutter(poses), Error);
}

}  // namespace
}  // namespace nephele
