#include "nephele/render/scene/turntable.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/environment.h"

namespace nephele {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;
const Vec3f kMiddle{0.3f, -0.2f, 1.5f};

// An irregular cloud of points around kMiddle, not in the middle of its own box.
std::vector<Vec3f> points() {
  std::vector<Vec3f> result;
  for (int i = 0; i != 200; ++i) {
    const float a = 2.4f * float(i), h = float(i % 17) / 16, r = 0.2f + 0.8f * h * float(i % 5) / 4;
    result.push_back(kMiddle + Vec3f{r * std::cos(a), 1.5f * h - 0.6f, 0.4f * r * std::sin(a)});
  }
  return result;
}

Camera startCamera() {
  return Camera::framing(sweptOutline(points(), kMiddle), 25, 10, {160, 90});
}

TEST(Turntable, ReturnsToItsFirstFrameAfterTheLast) {
  const Turntable turntable(Orbit::camera, kMiddle, 1, 48);
  EXPECT_EQ(turntable.degreesAt(1), 0);
  EXPECT_EQ(turntable.degreesAt(49), 0);
  EXPECT_EQ(turntable.degreesAt(13), 90);
  EXPECT_NEAR(turntable.degreesAt(0), turntable.degreesAt(48), 1e-12);
  const Camera start = startCamera();
  EXPECT_EQ(turntable.camera(start, 49).worldToCamera(), start.worldToCamera());
  // Turns of another number close, too, and frames may start anywhere.
  EXPECT_EQ(Turntable(Orbit::camera, kMiddle, 1001, 1040, 3).degreesAt(1041), 0);
  EXPECT_EQ(Turntable(Orbit::camera, kMiddle, 1, 4, -1).degreesAt(2), 270);
}

TEST(Turntable, AStepOfFramesIsPartOfTheSameTurn) {
  const Turntable turntable(Orbit::camera, kMiddle, 1, 48);
  for (int frame = 1; frame <= 48; frame += 5)
    EXPECT_DOUBLE_EQ(turntable.degreesAt(frame), 7.5 * (frame - 1));
}

TEST(Turntable, TheCameraGoesRoundInEqualStepsAtOneDistanceAndHeight) {
  const Turntable turntable(Orbit::camera, kMiddle, 1, 12);
  const Camera start = startCamera();
  const Vec3d middle(kMiddle);
  const auto flat = [](Vec3d v) {
    v.y = 0;
    return v;
  };
  for (int frame = 1; frame <= 12; ++frame) {
    const Camera a = turntable.camera(start, frame), b = turntable.camera(start, frame + 1);
    EXPECT_NEAR(length(a.position() - middle), length(start.position() - middle), 1e-12);
    EXPECT_NEAR(a.position().y, start.position().y, 1e-12);
    const Vec3d u = normalize(flat(a.position() - middle)), v = normalize(flat(b.position() - middle));
    EXPECT_NEAR(dot(u, v), std::cos(30 * kDegree), 1e-12);
    // From +z towards +x: against the sense of y x u.
    EXPECT_NEAR(dot(cross(u, v), Vec3d{0, 1, 0}), std::sin(30 * kDegree), 1e-12);
    // The middle stays where it is in the picture.
    const Vec3d here = a.project(middle), first = start.project(middle);
    for (int axis = 0; axis != 3; ++axis) EXPECT_NEAR(here[axis], first[axis], 1e-9);
    // Rigid: the axes stay perpendicular and of length 1.
    EXPECT_NEAR(dot(a.right(), a.up()), 0, 1e-12);
    EXPECT_NEAR(length(cross(a.right(), a.up()) + a.forward()), 0, 1e-12);
  }
}

TEST(Turntable, OneFramingShowsEveryFrameAndIsTight) {
  const std::vector<Vec3f> all = points();
  const Turntable turntable(Orbit::camera, kMiddle, 1, 24);
  const Camera start = startCamera();
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (int frame = 1; frame <= 24; ++frame) {
    const Camera camera = turntable.camera(start, frame);
    for (const Vec3f& point : all) {
      const Vec3d p = camera.project(Vec3d(point));
      ASSERT_GT(p.z, 0);
      left = std::min(left, p.x);
      right = std::max(right, p.x);
      top = std::min(top, p.y);
      bottom = std::max(bottom, p.y);
    }
  }
  // The margin of Camera::framing is 4 % of 160 x 90 pixels.
  EXPECT_GE(left, 0.04 * 160 - 1e-3);
  EXPECT_LE(right, 0.96 * 160 + 1e-3);
  EXPECT_GE(top, 0.04 * 90 - 1e-3);
  EXPECT_LE(bottom, 0.96 * 90 + 1e-3);
  // One pair of sides touches, up to the steps of the turn.
  EXPECT_TRUE((left < 0.05 * 160 && right > 0.95 * 160) || (top < 0.05 * 90 && bottom > 0.95 * 90));
}

TEST(Turntable, SweptOutlineIsSmallAndHoldsAllTurnedPoints) {
  const std::vector<Vec3f> all = points(), swept = sweptOutline(all, kMiddle);
  EXPECT_LT(swept.size(), 20u * 96u);
  // Farther out in every direction than any point at any angle is.
  for (int i = 0; i != 60; ++i) {
    const float around = 2.39996f * float(i), up = -1 + float(i) / 29.5f;
    const Vec3f direction{std::cos(around), up, std::sin(around)};
    float outline = -1e9f, points = -1e9f;
    for (const Vec3f& p : swept) outline = std::max(outline, dot(direction, p - kMiddle));
    for (const Vec3f& p : all) {
      const Vec3f q = p - kMiddle;
      points = std::max(points, std::hypot(q.x, q.z) + up * q.y);
    }
    EXPECT_GE(outline, points - 1e-5f);
    EXPECT_LE(outline, points + 0.002f);
  }
  EXPECT_TRUE(sweptOutline({}, kMiddle).empty());
  EXPECT_EQ(sweptOutline(std::vector<Vec3f>{kMiddle}, kMiddle).size(), 96u);
}

// Corners at each height are enough, about any axis; those of a box of 5^3 points are 5 times 4.
TEST(Turntable, SweptCornersHaveTheSameSweptOutline) {
  const std::vector<Vec3f> all = points(), corners = sweptCorners(all);
  for (const Vec3f& axis : {kMiddle, Vec3f{}, Vec3f{-7, 1, 3}})
    EXPECT_EQ(sweptOutline(corners, axis), sweptOutline(all, axis));
  std::vector<Vec3f> box;
  for (int i = 0; i != 125; ++i) box.push_back({float(i % 5), float(i / 5 % 5), float(i / 25)});
  std::vector<Vec3f> ofBox = sweptCorners(box);
  EXPECT_EQ(sweptOutline(ofBox, {1, 0, 2}), sweptOutline(box, {1, 0, 2}));
  const std::set<std::tuple<float, float, float>> distinct = [&] {
    std::set<std::tuple<float, float, float>> result;
    for (const Vec3f& p : ofBox) result.emplace(p.x, p.y, p.z);
    return result;
  }();
  EXPECT_EQ(distinct.size(), 20u);
  EXPECT_LE(sweptCorners(ofBox).size(), ofBox.size());
  EXPECT_TRUE(sweptCorners({}).empty());
}

TEST(Turntable, AModelThatTurnsSeesCameraAndLightsTurnTheOtherWay) {
  const Turntable model(Orbit::model, kMiddle, 1, 8), camera(Orbit::camera, kMiddle, 1, 8);
  const Camera start = startCamera();
  const Lights lights{
      {{"sun", directionTowards(90, 38), {6, 6, 6}}, {"sun2", directionTowards(200, 5), {1, 1, 1}}},
      {0.1f, 0.2f, 0.3f}};
  const Camera here = model.camera(start, 3), there = camera.camera(start, 9 - 2);
  for (std::size_t i = 0; i != 16; ++i) EXPECT_NEAR(here.worldToCamera()[i], there.worldToCamera()[i], 1e-6);
  // What the camera sees of the lights does not change.
  const Lights turned = model.lights(lights, 3);
  for (std::size_t sun = 0; sun != 2; ++sun) {
    const Vec3d before(lights.suns[sun].direction), after(turned.suns[sun].direction);
    EXPECT_NEAR(dot(before, start.right()), dot(after, here.right()), 1e-6);
    EXPECT_NEAR(dot(before, start.up()), dot(after, here.up()), 1e-6);
    EXPECT_NEAR(dot(before, start.forward()), dot(after, here.forward()), 1e-6);
    EXPECT_EQ(lights.suns[sun].irradiance, turned.suns[sun].irradiance);
  }
  EXPECT_EQ(turned.sky, lights.sky);
}

TEST(Turntable, LightsThatTurnTakeTheMapOfTheSkyAlong) {
  std::vector<Vec3f> radiance(32);
  radiance[11] = {5, 4, 3};
  Lights lights;
  lights.map = std::make_shared<const Environment>(8, 4, radiance);
  const Lights turned = Turntable(Orbit::light, kMiddle, 1, 8).lights(lights, 2);
  ASSERT_NE(turned.map, nullptr);
  // Frame 2 of 1 to 8 is turned by 45 degrees, one of the map's columns.
  for (int azimuth = 7; azimuth < 360; azimuth += 15)
    for (const int elevation : {-50, -10, 10, 50}) {
      const auto a = float(azimuth), e = float(elevation);
      EXPECT_EQ(turned.map->radiance(directionTowards(a + 45, e)),
                lights.map->radiance(directionTowards(a, e)));
    }
}

TEST(Turntable, LightsThatTurnLeaveTheCameraAlone) {
  const Turntable turntable(Orbit::light, kMiddle, 1, 8);
  const Camera start = startCamera();
  EXPECT_EQ(turntable.camera(start, 4).worldToCamera(), start.worldToCamera());
  const Lights lights{{{"sun", directionTowards(90, 38), {6, 6, 6}}}, {}};
  const Vec3f expected = directionTowards(90 + 45, 38),
              actual = turntable.lights(lights, 2).suns[0].direction;
  EXPECT_LT(length(expected - actual), 1e-6f);
  // And a camera that turns leaves the lights.
  EXPECT_EQ(Turntable(Orbit::camera, kMiddle, 1, 8).lights(lights, 2).suns[0].direction,
            lights.suns[0].direction);
}

TEST(Turntable, PointsAndSpotsTurnAboutTheMiddle) {
  Lights lights;
  lights.locals.resize(1);
  lights.locals[0].position = kMiddle + Vec3f{0, 2, 3};
  lights.locals[0].cone = LocalLight::Cone{{0, -2, -3}};
  // A quarter turn takes +z to +x.
  const LocalLight turned = Turntable(Orbit::light, kMiddle, 1, 4).lights(lights, 2).locals[0];
  EXPECT_LT(length(turned.position - (kMiddle + Vec3f{3, 2, 0})), 1e-6f);
  EXPECT_LT(length(turned.cone->direction - Vec3f{-3, -2, 0}), 1e-6f);
}

TEST(Turntable, RefusesTurnsAndFramesThatMakeNoTurntable) {
  EXPECT_THROW(Turntable(Orbit::camera, kMiddle, 5, 4), Error);
  EXPECT_THROW(Turntable(Orbit::camera, kMiddle, 1, 4, 0), Error);
  EXPECT_THROW(Turntable(Orbit::camera, kMiddle, 1, 4, std::nan("")), Error);
  EXPECT_THROW(Turntable(Orbit::camera, kMiddle, 1, 4, 1e4), Error);
  EXPECT_THROW(Turntable(Orbit::camera, {NAN, 0, 0}, 1, 4), Error);
}

}  // namespace
}  // namespace nephele
