// What cells send, against the sums that it stands for: moments times detail::harmonics of one way at a time.
#include "nephele/render/light/detail/sending_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "nephele/modeling/base/random_stream.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using detail::kMostMoments;
constexpr int kCells = detail::CellRows::kVector;

Vec3f wayFrom(const Vec3f& place, const Vec3f& node) {
  const Vec3f way = node - place;
  return length(way) > 0 ? normalize(way) : Vec3f{0, 0, 1};
}

struct Case {
  std::vector<float> moments, beam;
  float weights[detail::kMostDegree + 1], beamWay[kMostMoments] = {1.0f};
  detail::SendingCells cells;

  explicit Case(int degree) : moments(std::size_t(kCells * kMostMoments)), beam(kCells) {
    detail::RandomStream random{std::uint64_t(degree)};
    for (float& moment : moments) moment = random.uniform();
    for (float& value : beam) value = random.uniform();
    for (float& weight : weights) weight = random.uniform();
    cells.node = {8, 5, 3};
    cells.degree = degree;
    cells.weights = weights;
    cells.moments = moments.data();
    cells.beam = beam.data();
    cells.beamWay = beamWay;
  }

  void expectSums() {
    test::forEachTarget([&] {
      detail::send(cells);
      for (int n = 0; n != kCells; ++n) {
        const Vec3f node = cells.node + Vec3f{float(n), 0, 0};
        float towards[kMostMoments], along[kMostMoments];
        detail::harmonics(-(cells.isEyeAPlace ? wayFrom(cells.eye, node) : cells.eye), cells.degree, towards);
        if (cells.beamPlace) detail::harmonics(wayFrom(*cells.beamPlace, node), cells.degree, along);
        double light = 0, sent = 0;
        for (int m = 0; m != detail::momentCount(cells.degree); ++m) {
          const double counts = double(weights[detail::degreeOf(m)]) * double(towards[m]);
          light += counts * double(moments[std::size_t(m * kCells + n)]);
          sent += counts * double((cells.beamPlace ? along : beamWay)[m]) * double(beam[std::size_t(n)]);
        }
        // Rounding of some 36 sums of values up to 3.
        EXPECT_NEAR(cells.own[n], light - sent, 2e-5) << n;
        EXPECT_NEAR(cells.ofBeam[n], sent, 2e-5) << n;
      }
    });
  }
};

TEST(SendingCells, SendSumsOfHarmonicsToAnEye) {
  for (int degree = 0; degree <= detail::kMostDegree; ++degree) {
    SCOPED_TRACE(degree);
    Case near(degree);
    near.cells.eye = {20, -30, 7.5f};
    near.cells.isEyeAPlace = true;
    detail::harmonics(normalize(Vec3f{1, -2, 0.5f}), degree, near.beamWay);
    near.expectSums();
    Case far(degree);
    far.cells.eye = normalize(Vec3f{-1, 2, 3});
    const Vec3f lamp{11, 4, 2};
    far.cells.beamPlace = &lamp;
    far.expectSums();
  }
}

TEST(SendingCells, KnowAWayWhereTheEyeIsInOneOfThem) {
  Case inside(3);
  inside.cells.eye = inside.cells.node + Vec3f{2, 0, 0};
  inside.cells.isEyeAPlace = true;
  inside.cells.beamPlace = &inside.cells.eye;
  inside.expectSums();
}

TEST(SendingCells, EyesBeyondAFloatAreAnywhere) {
  Case away(3);
  away.cells.eye = {1e30f, 0, 0};
  away.cells.isEyeAPlace = true;
  detail::send(away.cells);
  for (int n = 0; n != kCells; ++n) EXPECT_TRUE(std::isfinite(away.cells.own[n]));
}

}  // namespace
}  // namespace nephele
