#include "nephele/render/scene/camera_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::messageOf;

void expectNear(const Vec3d& a, const Vec3d& b, double tolerance = 1e-9) {
  for (int axis = 0; axis != 3; ++axis) EXPECT_NEAR(a[axis], b[axis], tolerance) << axis;
}

TEST(Rotation, TurnsAboutItsAxesInTheirOrder) {
  // A quarter about x takes y to z, about y z to x, about z x to y.
  expectNear(Rotation::euler({90, 0, 0}, {})({0, 1, 0}), {0, 0, 1});
  expectNear(Rotation::euler({0, 90, 0}, {})({0, 0, 1}), {1, 0, 0});
  expectNear(Rotation::euler({0, 0, 90}, {})({1, 0, 0}), {0, 1, 0});
  // ZXY: x -> (z) y -> (x) z -> (y) x;  XYZ: x -> (x) x -> (y) -z -> (z) -z.
  expectNear(Rotation::euler({90, 90, 90}, RotationOrder::parse("ZXY"))({1, 0, 0}), {1, 0, 0});
  expectNear(Rotation::euler({90, 90, 90}, RotationOrder::parse("xyz"))({1, 0, 0}), {0, 0, -1});
  EXPECT_EQ(RotationOrder().name(), "ZXY");
  for (const char* bad : {"", "XY", "XXY", "XYZX", "ABC", "rotate"})
    EXPECT_THROW(RotationOrder::parse(bad), Error) << bad;
}

TEST(Rotation, GivesBackItsAnglesInEveryOrder) {
  for (const char* name : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
    const RotationOrder order = RotationOrder::parse(name);
    // The middle angle within a quarter turn, where angles are unique; then where they are not.
    for (const Vec3d& degrees : {Vec3d{10, 20, 30}, Vec3d{-80, 45, 60}, Vec3d{5, -70, -80}})
      expectNear(Rotation::euler(degrees, order).eulerDegrees(order), degrees, 1e-9);
    for (const Vec3d& degrees :
         {Vec3d{90, 90, 90}, Vec3d{90, 0, 30}, Vec3d{20, -90, 30}, Vec3d{170, 200, -300}}) {
      const Rotation turn = Rotation::euler(degrees, order);
      const Rotation again = Rotation::euler(turn.eulerDegrees(order), order);
      expectNear(turn({1, 2, 3}), again({1, 2, 3}), 1e-7);
    }
  }
}

TEST(Rotation, SlerpTurnsEvenlyTheShorterWayAndGoesOn) {
  const Rotation a = Rotation::euler({0, 170, 0}, {}), b = Rotation::euler({0, -170, 0}, {});
  for (const double s : {-0.5, 0.0, 0.25, 0.5, 1.0, 2.0})
    expectNear(slerp(a, b, s)({0, 0, 1}), Rotation::euler({0, 170 + 20 * s, 0}, {})({0, 0, 1}));
  expectNear(slerp(a, a, 0.3)({1, 2, 3}), a({1, 2, 3}));
}

TEST(Rotation, IsMadeOfAxes) {
  for (const Vec3d& degrees :
       {Vec3d{0, 0, 0}, Vec3d{180, 0, 0}, Vec3d{0, 180, 0}, Vec3d{0, 0, 180}, Vec3d{40, -70, 110}}) {
    const Rotation turn = Rotation::euler(degrees, {});
    const Rotation again = Rotation::ofAxes(turn({1, 0, 0}), turn({0, 1, 0}));
    expectNear(turn({1, 2, 3}), again({1, 2, 3}));
  }
}

TEST(CameraMotion, ReproducesConstantSpeedAndAcceleration) {
  // Positions on a parabola in time, at uneven frames; beyond the ends it goes on at the last speed.
  const auto place = [](double f) { return Vec3d{2 * f, 0.5 * f * f, 1 - f}; };
  std::vector<CameraKey> keys;
  for (const double frame : {1.0, 2.0, 4.0, 4.5, 8.0})
    keys.push_back({.frame = frame, .position = place(frame)});
  const CameraMotion motion(keys);
  for (const double frame : {1.0, 1.3, 3.7, 4.2, 7.9, 8.0})
    expectNear(motion.at(frame).position, place(frame));
  expectNear(motion.at(9).position, place(8) + Vec3d{2, 8, -1});
  expectNear(motion.at(0.5).position, place(1) - Vec3d{1, 0.5, -0.5});
  // Straight lines instead.
  expectNear(CameraMotion(keys, false).at(3).position, (place(2) + place(4)) * 0.5);
}

TEST(CameraMotion, KeepsItsTargetInSightBetweenKeys) {
  std::vector<CameraKey> keys;
  for (const double frame : {1.0, 2.0, 3.0})
    keys.push_back({.frame = frame,
                    .position = {std::sin(frame) * 9, 2, std::cos(frame) * 9},
                    .target = Vec3d{0, 1, 0}});
  const CameraMotion motion(keys);
  for (double frame = 0.75; frame < 3.3; frame += 0.125) {
    const CameraKey key = motion.at(frame);
    expectNear(key.rotation({0, 0, -1}), normalize(Vec3d{0, 1, 0} - key.position));
    EXPECT_NEAR(key.rotation({1, 0, 0}).y, 0, 1e-12);  // level
  }
}

TEST(CameraMotion, ZoomsEvenlyInFocalLengthAndNeverBeyondItsKeys) {
  std::vector<CameraKey> keys;
  for (int i = 0; i != 4; ++i)
    keys.push_back({.frame = double(i),
                    .fovDegrees = fovDegreesOf(i < 2 ? 20 : 80, 36),
                    .lensRadius = i < 2 ? 0.0 : 1.0});
  const CameraMotion motion(keys);
  EXPECT_NEAR(focalLengthOf(*motion.at(1.5).fovDegrees, 36), 50, 1e-9);  // half way, by symmetry
  for (double frame = -1; frame < 5; frame += 0.1) {
    const CameraKey key = motion.at(frame);
    EXPECT_GE(*key.lensRadius, 0);
    EXPECT_LE(*key.lensRadius, 1);
    EXPECT_GE(focalLengthOf(*key.fovDegrees, 36), 20 - 1e-9);
    EXPECT_LE(focalLengthOf(*key.fovDegrees, 36), 80 + 1e-9);
  }
  // A value at one frame only holds at all.
  keys[1].focusDistance = 7;
  EXPECT_EQ(*CameraMotion(keys).at(3).focusDistance, 7);
}

constexpr const char* kChan =
    "# frame tx ty tz rx ry rz vfov\n"
    "1 0 1 10 0 0 0 30\n"
    "\n"
    "2\t1 1 10 -5 2.5 0 30 \r\n"
    "3.5 +2 1 1e1 -10 5 1.5 40 # closer\n";

TEST(CameraFile, ReadsChan) {
  const CameraMotion motion = parseChan(kChan, "a.chan");
  ASSERT_EQ(motion.keys().size(), 3u);
  EXPECT_EQ(motion.lastFrame(), 3.5);
  const CameraKey& key = motion.keys()[2];
  EXPECT_EQ(key.position, (Vec3d{2, 1, 10}));
  EXPECT_EQ(*key.verticalFovDegrees, 40);
  // Roll about z first, then down by 10 degrees, then 5 degrees to the left.
  const double x = -10 * M_PI / 180, y = 5 * M_PI / 180;
  expectNear(key.rotation({0, 0, -1}), {-std::sin(y) * std::cos(x), std::sin(x), -std::cos(y) * std::cos(x)});
  // Without angles of view, and in another order.
  const CameraMotion plain = parseChan("7 0 0 0 90 90 90\n", "b.chan", RotationOrder::parse("XYZ"));
  EXPECT_FALSE(plain.keys()[0].verticalFovDegrees);
  expectNear(plain.keys()[0].rotation({1, 0, 0}), {0, 0, -1});
}

void expectSame(const CameraMotion& a, const CameraMotion& b) {
  ASSERT_EQ(a.keys().size(), b.keys().size());
  EXPECT_EQ(a.isSmooth(), b.isSmooth());
  for (std::size_t i = 0; i != a.keys().size(); ++i) {
    const CameraKey &k = a.keys()[i], &l = b.keys()[i];
    EXPECT_EQ(k.frame, l.frame);
    expectNear(k.position, l.position);
    expectNear(k.rotation({1, 2, 3}), l.rotation({1, 2, 3}));
    EXPECT_EQ(k.target.has_value(), l.target.has_value());
    for (const auto member :
         {&CameraKey::fovDegrees, &CameraKey::verticalFovDegrees, &CameraKey::orthographicWidth,
          &CameraKey::fStop, &CameraKey::lensRadius, &CameraKey::focusDistance, &CameraKey::filmWidth}) {
      ASSERT_EQ((k.*member).has_value(), (l.*member).has_value());
      EXPECT_NEAR((k.*member).value_or(0), (l.*member).value_or(0), 1e-9);
    }
  }
}

TEST(CameraFile, WritesChanThatItReadsBack) {
  for (const char* name : {"ZXY", "XYZ"}) {
    const RotationOrder order = RotationOrder::parse(name);
    const CameraMotion motion = parseChan(kChan, "a.chan", order);
    expectSame(motion, parseChan(chanText(motion, 1.5, order), "b.chan", order));
  }
  // A horizontal angle becomes upright: tan(v / 2) = tan(h / 2) / aspect.
  const CameraMotion wide({{.frame = 1, .fovDegrees = 90}});
  const CameraMotion back = parseChan(chanText(wide, 2), "c.chan");
  EXPECT_NEAR(*back.keys()[0].verticalFovDegrees, 2 * std::atan(0.5) * 180 / M_PI, 1e-9);
  // The narrowest and the widest, in wide and in high pictures.
  for (const double across : {0.01, 179.0})
    for (const double aspect : {1.5, 0.5, 65536.0, 1.0 / 65536})
      EXPECT_NO_THROW(
          parseChan(chanText(CameraMotion({{.frame = 1, .fovDegrees = across}}), aspect), "d.chan"))
          << across << " " << aspect;
}

constexpr const char* kJson = R"({
  "interpolation": "linear",
  "film_width": 24,
  "frames": [
    {"frame": 1, "position": [0, 1, 10], "look_at": [0, 0, 0], "focal_length": 12, "f_stop": 2.8},
    {
      "frame": 11,
      "position": [10, 1, 0], "look_at": [0, 0, 0], "up": [0, 1, 0.1],
      "f_stop": 4, "focus_distance": 9.5
    }
  ]
})";

TEST(CameraFile, ReadsJson) {
  const CameraMotion motion = parseCameraJson(kJson, "a.json");
  EXPECT_NEAR(*motion.at(1).fovDegrees, 90, 1e-9);  // 24 mm of film 12 mm behind the lens
  EXPECT_NEAR(*motion.at(6).fStop, 3.4, 1e-9);
  EXPECT_EQ(*motion.at(1).focusDistance, 9.5);
  expectNear(motion.at(6).position, {5, 1, 5});
  const CameraMotion turned = parseCameraJson(
      R"({"rotation_order": "XYZ", "frames": [{"frame": 1, "position": [0,0,0], "rotation": [90,90,90]}]})",
      "b.json");
  expectNear(turned.keys()[0].rotation({1, 0, 0}), {0, 0, -1});
}

TEST(CameraFile, WritesJsonThatItReadsBack) {
  const CameraMotion motion = parseCameraJson(kJson, "a.json");
  expectSame(motion, parseCameraJson(cameraJsonText(motion), "b.json"));
  const CameraMotion chan = parseChan(kChan, "a.chan");
  expectSame(chan, parseCameraJson(cameraJsonText(chan), "b.json"));
}

// Places whose differences no number holds, and frames that twelve digits do not tell apart, were written so
// that they could not be read.
TEST(CameraFile, WrittenAtTheEndsOfItsRangesIsReadAgain) {
  const CameraMotion motion =
      parseChan("999999998.5 1e30 -1e30 0 0 0 0\n999999998.501 -1e30 1e30 0 0 0 0\n", "a.chan");
  for (const CameraMotion& again :
       {parseChan(chanText(motion, 1), "b.chan"), parseCameraJson(cameraJsonText(motion), "b.json")}) {
    ASSERT_EQ(again.keys().size(), 2u);
    for (const std::size_t i : {0, 1}) {
      EXPECT_EQ(again.keys()[i].frame, motion.keys()[i].frame);
      EXPECT_EQ(again.keys()[i].position, motion.keys()[i].position);
    }
  }
}

TEST(CameraFile, SaysWhatIsWrongWithAChanAndWhere) {
  const struct {
    const char *text, *message;
  } cases[] = {
      {"", "a.chan: holds no frames"},
      {"# nothing\n\n", "a.chan: holds no frames"},
      {"1 0 0 0 0 0\n",
       "a.chan:1: expected 7 or 8 numbers (frame tx ty tz rx ry rz [vertical fov]), found 6"},
      {"1 0 0 0 0 0 0 30 5\n",
       "a.chan:1: expected 7 or 8 numbers (frame tx ty tz rx ry rz [vertical fov]), found more"},
      {"1 0 0 0 0 0 0\n2 0 0 x 0 0 0\n", "a.chan:2: 'x' is not a number"},
      {"1 0 0 0 0 0 0\n2 0 0 nan 0 0 0\n", "a.chan:2: 'nan' is not a number"},
      {"1 0 0 0 0 0 0\n2 0 0 1e999 0 0 0\n", "a.chan:2: '1e999' is not a number"},
      {"1 0 0 0 0 0 0\n2 0 0 0 0 0 0 30\n", "a.chan:2: has 8 numbers, the lines before have 7"},
      {"1 0 0 0 0 0 0\n\n1 0 0 0 0 0 0\n", "a.chan:3: frame 1 comes after frame 1, but frames must increase"},
      {"1 0 0 0 0 0 0 30\n2 0 0 0 0 0 0 200\n",
       "a.chan:2: frame 2: fov must be from 1e-07 to 179.99999, got 200"},
      {"-1e308 0 0 0 0 0 0 30\n", "a.chan:1: frame -1e+308: frames are from -1e+09 to 1e+09"},
      {"1 0 0 0 0 0 0\n1.0000001 0 0 0 0 0 0\n",
       "a.chan:2: frame 1: comes after frame 1, but frames must increase, by 1e-06 at least"},
      {"1 0 0 1e31 0 0 0\n",
       "a.chan:1: frame 1: position must be from -1e+30 to 1e+30 along each axis, got 1e+31"}};
  for (const auto& c : cases) EXPECT_EQ(messageOf([&] { parseChan(c.text, "a.chan"); }), c.message);
}

TEST(CameraFile, SaysWhatIsWrongWithJsonAndWhere) {
  const auto frames = [](const std::string& list) { return "{\n\"frames\": [\n" + list + "\n]}"; };
  const std::string good = R"({"frame": 1, "position": [0,0,9], "look_at": [0,0,0]})";
  const struct {
    std::string text, line, part;
  } cases[] = {
      {"", "a.json:1:", "is not JSON"},
      {"{\n\"frames\": [\n}", "a.json:3:", "is not JSON"},
      {"[1, 2]", "a.json:1:", "object with 'frames'"},
      {"{\n\"frame\": 3}", "a.json:2:", "'frame' is not known"},
      {"{\"a\\nb\": 3}", "a.json:1:", "'a\\nb' is not known"},
      {"{}", "a.json:1:", "'frames'"},
      {frames(""), "a.json:2:", "holds no frames"},
      {frames("7"), "a.json:2:", "frames[0] must be an object"},
      {frames(good + ",\n" + good), "a.json:4:", "frame 1 comes after frame 1"},
      {frames(good + ",\n{\"frame\": 2,\n\"position\": [1, 2]}"),
       "a.json:5:", "position must be three numbers"},
      {frames(good + ",\n{\"frame\": \"2\"}"), "a.json:4:", "frame must be a number"},
      {frames(good + ",\n{\"frame\": 2}"), "a.json:4:", "'position' is missing"},
      {frames(good + ",\n{\"frame\": 2, \"position\": [0,0,9]}"),
       "a.json:4:", "either 'rotation' or 'look_at'"},
      {frames(good + ",\n{\"frame\": 2, \"position\": [0,0,9], \"rotation\": [0,0,0]}"),
       "a.json:4:", "at all frames or at none"},
      {frames("{\"frame\": 2, \"position\": [0,0,9], \"look_at\": [0,0,9]}"), "a.json:3:", "looks nowhere"},
      {frames("{\"frame\": 2, \"position\": [0,9,0], \"look_at\": [0,0,0]}"), "a.json:3:", "parallel"},
      {frames("{\"frame\": 2, \"position\": [0,0,9], \"look_at\": [0,0,0],\n\"lens\": 3}"),
       "a.json:4:", "'lens' is not known"},
      {frames("{\"frame\": 2, \"position\": [0,0,9], \"look_at\": [0,0,0],\n\"fov\": 35,\n\"focal_length\": "
              "50}"),
       "a.json:4:", "one of"},
      {frames("{\"frame\": 2, \"position\": [0,0,9], \"look_at\": [0,0,0], \"focus_distance\": -1}"),
       "a.json:3:", "focus_distance must be at least"},
      {"{\"rotation_order\": \"QQQ\", \"frames\": []}", "a.json:1:", "rotation order"},
      {"{\"rotation_order\": \"\\n\", \"frames\": []}", "a.json:1:", "got '\\n'"},
      {"{\"interpolation\": \"linear\\n\", \"frames\": []}", "a.json:1:", "not linear\\n"},
      {"{\"interpolation\": \"cubic\", \"frames\": []}", "a.json:1:", "smooth or linear"},
      {std::string(100, '['), "a.json:1:", "nested"}};
  for (const auto& c : cases) {
    const std::string message = messageOf([&] { parseCameraJson(c.text, "a.json"); });
    EXPECT_EQ(message.find(c.line), 0u) << message << " of " << c.text;
    EXPECT_NE(message.find(c.part), std::string::npos) << message << " of " << c.text;
  }
}

TEST(CameraFile, ReadsFilesByTheirExtension) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("a.CHAN")) << kChan;
  std::ofstream(folder.file("a.json")) << kJson;
  EXPECT_EQ(readCameraFile(folder.file("a.CHAN")).keys().size(), 3u);
  EXPECT_EQ(readCameraFile(folder.file("a.json")).keys().size(), 2u);
  EXPECT_THROW(readCameraFile(folder.file("missing.chan")), Error);
  EXPECT_THROW(readCameraFile(folder.file("a.fbx")), Error);
  std::ofstream(folder.file("bad.chan")) << "1 2 3\n";
  EXPECT_EQ(
      messageOf([&] { readCameraFile(folder.file("bad.chan")); }).find(folder.file("bad.chan") + ":1: "), 0u);
}

}  // namespace
}  // namespace nephele
