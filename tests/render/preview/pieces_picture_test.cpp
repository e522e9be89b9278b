#include "nephele/render/preview/pieces_picture.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

double apart(const Vec3f& a, const Vec3f& b) {
  return std::hypot(std::cbrt(double(a.x)) - std::cbrt(double(b.x)),
                    std::cbrt(double(a.y)) - std::cbrt(double(b.y)),
                    std::cbrt(double(a.z)) - std::cbrt(double(b.z)));
}

Pieces halves() {
  const std::vector<CutPart> model{{.mesh = boxMesh({-1, -1, -1}, {1, 1, 1})}};
  return cutIntoMeshes(model, {.planes = {{{0, 0, 0}, {0, 1, 0}}}});
}

TEST(PieceColours, AreAllDifferentAndFarApartWherePiecesTouch) {
  // A chain of pieces.
  constexpr std::size_t kCount = 200;
  std::vector<std::vector<PieceContact>> neighbours(kCount);
  std::vector<double> sizes;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    if (i > 0) neighbours[i].push_back({i - 1, 1});
    if (i + 1 < kCount) neighbours[i].push_back({i + 1, 1});
    sizes.push_back(1 + std::sin(i));
  }
  const std::vector<Vec3f> colours = pieceColours(neighbours, sizes);
  for (std::size_t i = 0; i < kCount; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NE(colours[i], colours[j]) << i << " " << j;
      // A twelfth of the hue circle apart at least, in the space of cube roots.
      if (j + 1 == i) {
        EXPECT_GT(apart(colours[i], colours[j]), 0.05) << i;
      }
    }
}

TEST(PiecesPicture, IsTheSameAtAnyThreadCount) {
  const Pieces set = halves();
  const PiecesPictureOptions options{.width = 48, .height = 36, .samples = 8};
  const Image many = picturePieces(set, options);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Image single = picturePieces(set, options);
  for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(many.channels[c].values, single.channels[c].values);
  for (const float a : many.channel("A").values) EXPECT_EQ(a, 1);
}

TEST(PiecesPicture, LiesInTheShadeBelowThePieces) {
  const Image image = picturePieces(halves(), {.width = 64, .height = 64, .explode = 0});
  // Right of the box, away from the lamp, the ground is darker than on the side of the lamp.
  double left = 0, right = 0;
  for (int x = 0; x < 8; ++x) {
    left += double(image.at("G", x, 52));
    right += double(image.at("G", 63 - x, 52));
  }
  EXPECT_LT(right, 0.97 * left);
}

TEST(PiecesPicture, HasObjectsThatAreMovedApart) {
  const auto height = [](double explode) {
    Box box;
    for (const SurfaceObject& object : piecesObjects(halves(), explode))
      box = box.including(boundingBox(object.mesh));
    return double(box.size().y);
  };
  EXPECT_NEAR(height(0), 2, 1e-6);
  // Centroids half above and half below the middle go as far again.
  EXPECT_NEAR(height(1), 3, 1e-6);
  EXPECT_THROW(piecesObjects({}, 0), Error);
}

TEST(PiecesPicture, RefusesNothingAndOddSampleCounts) {
  EXPECT_THROW(picturePieces({}, {}), Error);
  EXPECT_THROW(picturePieces(halves(), {.width = 8, .height = 8, .samples = 0}), Error);
  EXPECT_THROW(picturePieces(halves(), {.width = 0, .height = 8}), Error);
}

}  // namespace
}  // namespace nephele::test
