// Pictures on surfaces: filtered look-up, baking to another layout, objects without a volume.
#include "nephele/render/preview/texture_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/texture_image.h"
#include "nephele/render/preview/surface_picture.h"
#include "nephele/render/preview/transfer_picture.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

Image picture(int width, int height, const std::function<Vec3f(int, int)>& colour) {
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"})
    image.add(name).values.assign(std::size_t(width * height), 1.0f);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = 0; k < 3; ++k)
        image.channels[std::size_t(k)].values[std::size_t(y * width + x)] = colour(x, y)[k];
  return image;
}

TEST(Texture, LiesOnWhiteWhereItIsTransparent) {
  Image image = picture(1, 1, [](int, int) { return Vec3f{0.25f, 0.125f, 0}; });
  image.channels[3].values[0] = 0.25f;
  EXPECT_EQ(Texture(image).at(0.5, 0.5), (Vec3f{1, 0.875f, 0.75f}));
}

TEST(Texture, IsExactAtTexelsAndRepeats) {
  const Image image = picture(5, 3, [](int x, int y) { return Vec3f{float(x), float(y), 1}; });
  const Texture texture(image);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x)
      for (const double turn : {0.0, 1.0, -2.0}) {
        const Vec3f c = texture.at((x + 0.5) / 5 + turn, 1 - (y + 0.5) / 3 - turn);
        EXPECT_NEAR(c.x, x, 1e-5);
        EXPECT_NEAR(c.y, y, 1e-5);
      }
  // Halfway between the last and the first column.
  EXPECT_NEAR(texture.at(0, 0.5).x, 2, 1e-5);
  EXPECT_EQ(texture.at(NAN, 0), Vec3f{});
}

TEST(Texture, SeenFromAfarIsTheMeanWhateverTheSize) {
  // 7 x 5 with a mean of 3 and 2.
  const Texture texture(picture(7, 5, [](int x, int y) { return Vec3f{float(x), float(y), 0.5f}; }));
  for (const double u : {0.1, 0.6, 0.9}) {
    const Vec3f c = texture.at(u, 0.3, 1e6);
    EXPECT_NEAR(c.x, 3, 1e-5);
    EXPECT_NEAR(c.y, 2, 1e-5);
    EXPECT_NEAR(c.z, 0.5, 1e-6);
  }
  // A chess board of single texels is grey at two texels' width.
  const Texture board(picture(8, 8, [](int x, int y) { return Vec3f{float((x + y) % 2), 0, 0}; }));
  for (const double u : {0.05, 0.33, 0.71}) EXPECT_NEAR(board.at(u, u, 2).x, 0.5, 1e-6);
}

// The square [0, 1]^2 in n x n quads with its own coordinates as uv, mapped by `layout`.
Mesh square(int n, const std::function<std::array<double, 2>(double, double)>& layout) {
  Mesh mesh;
  std::vector<float> uv;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.positions.push_back({double(i) / n, double(j) / n, 0});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto id = [n](int a, int b) { return std::uint32_t(b * (n + 1) + a); };
      mesh.addFace(std::array<std::uint32_t, 4>{id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
      for (const std::uint32_t v : mesh.face(mesh.faceCount() - 1))
        for (const double x : layout(mesh.positions[v].x, mesh.positions[v].y)) uv.push_back(float(x));
    }
  mesh.attributes = {{"uv", MeshAttribute::Domain::corner, 2, uv}};
  return mesh;
}

std::array<double, 2> same(double u, double v) {
  return {u, v};
}

TEST(BakeTexture, ToTheSameLayoutGivesThePictureBack) {
  const Image image = picture(32, 24, [](int x, int y) {
    return Vec3f{0.5f + 0.4f * std::sin(0.4f * float(x)), 0.5f + 0.4f * std::cos(0.5f * float(y)),
                 float(x) / 32};
  });
  const Mesh mesh = square(4, same);
  // One sample per texel lies on the texel's middle.
  const BakedTexture baked =
      bakeTexture(mesh, image, mesh, mesh.positions, {.width = 32, .height = 24, .samples = 1});
  EXPECT_EQ(baked.covered, 1);
  for (const char* name : {"R", "G", "B"})
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 32; ++x) EXPECT_NEAR(baked.image.at(name, x, y), image.at(name, x, y), 1e-4);
}

TEST(BakeTexture, FiltersAPictureThatIsFinerThanTheTexture) {
  // A chess board of single texels becomes grey.
  const Image board = picture(256, 256, [](int x, int y) { return Vec3f{float((x + y) % 2), 0, 0}; });
  const Mesh mesh = square(2, same);
  const BakedTexture baked =
      bakeTexture(mesh, board, mesh, mesh.positions, {.width = 16, .height = 16, .samples = 1});
  for (const float v : baked.image.channel("R").values) EXPECT_NEAR(v, 0.5, 1e-3);
}

TEST(BakeTexture, RepeatsCoordinatesOutsideTheUnitSquare) {
  const Image image = picture(16, 16, [](int x, int y) { return Vec3f{float(x) / 16, float(y) / 16, 0}; });
  const Mesh reference = square(2, same), shifted = square(2, [](double u, double v) {
                                            return std::array{u + 3, v - 2};
                                          });
  const TextureBakeOptions options{.width = 16, .height = 16};
  const BakedTexture a = bakeTexture(reference, image, reference, reference.positions, options),
                     b = bakeTexture(reference, image, shifted, shifted.positions, options);
  EXPECT_EQ(b.covered, 1);
  for (std::size_t i = 0; i < 256; ++i)
    EXPECT_NEAR(a.image.channel("R").values[i], b.image.channel("R").values[i], 1e-4);
}

TEST(BakeTexture, ContinuesChartsByTheGutterAndNoFarther) {
  const Image red = picture(4, 4, [](int x, int) { return x < 2 ? Vec3f{1, 0, 0} : Vec3f{1, 0.5f, 0}; });
  const Mesh reference = square(1, same), small = square(1, [](double u, double v) {
                                            return std::array{0.25 + u / 2, 0.25 + v / 2};
                                          });
  const BakedTexture baked =
      bakeTexture(reference, red, small, small.positions, {.width = 64, .height = 64, .gutter = 3});
  EXPECT_NEAR(baked.covered, 0.25, 1e-12);
  const auto green = [&](int x) { return baked.image.at("G", x, 32); };
  EXPECT_NEAR(green(16), green(13), 1e-3);
  EXPECT_NEAR(green(12), 0.25, 1e-2);
  EXPECT_NEAR(green(51 - 1), green(47), 1e-3);
  for (const float v : baked.image.channel("R").values) EXPECT_NEAR(v, 1, 1e-5);
}

TEST(BakeTexture, OfAMirroredChartIsMirrored) {
  const Image image = picture(16, 16, [](int x, int) { return Vec3f{float(x) / 16, 0, 0}; });
  const Mesh reference = square(1, same), mirrored = square(1, [](double u, double v) {
                                            return std::array{1 - u, v};
                                          });
  const BakedTexture baked =
      bakeTexture(reference, image, mirrored, mirrored.positions, {.width = 16, .height = 16, .samples = 1});
  for (int x = 0; x < 16; ++x) EXPECT_NEAR(baked.image.at("R", x, 8), float(15 - x) / 16, 1e-4);
}

TEST(BakeTexture, RefusesWhatItCannotBake) {
  const Image image = picture(2, 2, [](int, int) { return Vec3f{}; });
  const Mesh good = square(1, same), plain = icosphere(1, 1);
  EXPECT_THROW(bakeTexture(plain, image, good, good.positions), Error);
  EXPECT_THROW(bakeTexture(good, image, plain, plain.positions), Error);
  EXPECT_THROW(bakeTexture(good, image, good, plain.positions), Error);
  EXPECT_THROW(bakeTexture(good, image, good, good.positions, {.width = 0}), Error);
  EXPECT_THROW(bakeTexture(good, image, good, good.positions, {.samples = 0}), Error);
  EXPECT_THROW(bakeTexture(good, image, good, good.positions, {.gutter = -1}), Error);
  EXPECT_THROW(Texture(Image{}), Error);
}

TEST(PictureSurfaces, IsOpaqueFiniteAndLitFromTheLeft) {
  const Image image =
      pictureSurfaces({{.mesh = icosphere(1, 4)}}, {.width = 96, .height = 64, .samples = 16});
  for (const Image::Channel& channel : image.channels)
    for (const float v : channel.values) EXPECT_TRUE(std::isfinite(v));
  for (const float a : image.channel("A").values) EXPECT_EQ(a, 1);
  EXPECT_GT(image.at("G", 36, 30), 1.3f * image.at("G", 62, 36));
  EXPECT_THROW(pictureSurfaces({}), Error);
  EXPECT_THROW(pictureSurfaces({{.mesh = icosphere(1, 1)}}, {.samples = 0}), Error);
}

TEST(PictureTransfer, ShowsBothShapesEquallyLarge) {
  Mesh mesh = square(1, same);
  Mesh large = mesh;
  for (Vec3d& p : large.positions) p = p * 1000.0 + Vec3d{500, 0, 2};
  const auto red = std::make_shared<const Image>(picture(2, 2, [](int, int) { return Vec3f{1, 0, 0}; }));
  const Image image = pictureTransfer(mesh, large, red, nullptr,
                                      {.width = 128, .height = 64, .azimuthDegrees = 0, .samples = 4});
  int left = 0, right = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 128; ++x)
      if (image.at("R", x, y) > 4 * image.at("G", x, y)) (x < 64 ? left : right)++;
  EXPECT_GT(left, 300);
  EXPECT_NEAR(double(left) / right, 1, 0.06);
  EXPECT_THROW(pictureTransfer(mesh, icosphere(1, 1), red, nullptr), Error);
}

TEST(TransferObjects, StandSideBySideForAnyAzimuthAndAreNotTurned) {
  // A square in the plane z = 0: seen from the side it has no width, and the row is as long as its gap.
  const Mesh mesh = square(1, same);
  for (const float azimuth : {0.0f, 90.0f}) {
    const auto objects = transferObjects(mesh, mesh, nullptr, nullptr, {.azimuthDegrees = azimuth});
    ASSERT_EQ(objects.size(), 2u);
    const Box left = boundingBox(objects[0].mesh), right = boundingBox(objects[1].mesh);
    for (const Box& box : {left, right}) {
      EXPECT_NEAR(box.size().x, 1, 1e-5);
      EXPECT_NEAR(box.size().z, 0, 1e-5);
      EXPECT_NEAR(box.min.y, 0, 1e-6);
    }
    // To the right of a camera in front is +x, of one at +x it is -z.
    if (azimuth == 0) {
      EXPECT_NEAR(left.max.x, -right.min.x, 1e-5);
      EXPECT_GT(right.min.x, 0);
    } else {
      EXPECT_NEAR(left.min.z, -right.max.z, 1e-5);
      EXPECT_LT(right.max.z, 0);
    }
  }
}

}  // namespace
}  // namespace nephele::test
