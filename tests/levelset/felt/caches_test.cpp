#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "nephele/modeling/base/progress.h"
#include "tests/levelset/felt/levelset_felt.h"

namespace nephele::felt {
namespace {

const std::string kTurned = "domain d((1,2,3), (2,1,1.5), (0.3,-0.5,0.8), 0.1, 0.05, 0.15);\n";

/// Points inside of that domain, and their distance to its border in cells.
Vec3f insideTurned(std::mt19937& random) {
  std::uniform_real_distribution<float> share(0, 1);
  const Domain domain{{1, 2, 3}, {2, 1, 1.5}, {0.3, -0.5, 0.8}, {0.1, 0.05, 0.15}};
  return domain.toWorld()(Vec3f{2 * share(random), share(random), 1.5f * share(random)});
}

TEST(FeltCaches, HoldLinearFieldsExactlyOnTurnedDomainsWithThreeCellSizes) {
  // Trilinear interpolation and central differences are exact for what is linear.
  auto values =
      ran(kTurned +
          "vectorfield X = identity(); scalarfield f = X * (1,-2,0.5) + 3;\n"
          "scalarcache c(d); cachewrite(c, f); scalarfield g = cacheread(c);\n"
          "vectorfield slope = grad(g);\n"
          "vectorcache v(d); cachewrite(v, (f, 2 * f, X.y)); vectorfield w = cacheread(v);\n"
          "matrixcache m(d); cachewrite(m, matrixfield(X, 2 * X, X)); matrixfield n = cacheread(m);\n"
          "matrixfield jacobian = grad(w);");
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3f p = insideTurned(random);
    const float f = p.x - 2 * p.y + 0.5f * p.z + 3;
    EXPECT_NEAR(values["g"].as<ScalarField>()(p), f, 2e-5f);
    const Vec3f slope = values["slope"].as<VectorField>()(p);
    EXPECT_NEAR(length(slope - Vec3f(1, -2, 0.5f)), 0, 2e-4f);
    const Vec3f w = values["w"].as<VectorField>()(p);
    EXPECT_NEAR(length(w - Vec3f(f, 2 * f, p.y)), 0, 5e-5f);
    const Mat3f n = values["n"].as<MatrixField>()(p);
    EXPECT_NEAR(n(1, 2), 2 * p.z, 5e-5f);
    EXPECT_NEAR(values["jacobian"].as<MatrixField>()(p)(1, 1), -4, 4e-4f);
  }
}

TEST(FeltCaches, GiveTheNearestValueOfTheBorderOutside) {
  auto values =
      ran("domain d((0,0,0), (1,1,1), 0.25);\nscalarfield f = bake(identity().x + 10 * identity().y, d);"
          "vectorfield g = grad(f);");
  const ScalarField& f = values["f"].as<ScalarField>();
  EXPECT_FLOAT_EQ(f({7, 0.5f, 0.5f}), 6);
  EXPECT_FLOAT_EQ(f({-2, 9, -3}), 10);
  const Vec3f g = values["g"].as<VectorField>()({7, 0.5f, 0.5f});
  EXPECT_FLOAT_EQ(g.x, 0);
  EXPECT_NEAR(g.y, 10, 1e-4);
}

TEST(FeltCaches, HaveTheirGradientsOnTheirFaces) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> hundredths(-2000, 2000);
  for (int i = 0; i < 30; ++i) {
    const double x = hundredths(random) * 0.01, y = hundredths(random) * 0.01, z = hundredths(random) * 0.01;
    auto values =
        ran(fmt::format("domain d(({}, {}, {}), (1,1,1), 0.1);\n"
                        "vectorfield g = grad(bake(identity() * (1,2,3), d));",
                        x, y, z));
    for (const Vec3d& corner : {Vec3d{0, 0, 0}, Vec3d{1, 1, 1}, Vec3d{0, 1, 0.5}})
      EXPECT_NEAR(length(values["g"].as<VectorField>()(Vec3f(Vec3d{x, y, z} + corner)) - Vec3f(1, 2, 3)), 0,
                  2e-3f)
          << x << " " << y << " " << z;
  }
}

TEST(FeltCaches, RangesHoldWhatIsInterpolated) {
  auto values = ran(kTurned + "scalarfield f = bake(perlin(3), d);");
  const ScalarField& f = values["f"].as<ScalarField>();
  std::mt19937 random(2);
  std::uniform_real_distribution<float> at(-1, 5), size(0, 1);
  for (int i = 0; i < 300; ++i) {
    Box box;
    box.min = {at(random), at(random), at(random)};
    box.max = box.min + Vec3f{size(random), size(random), size(random)};
    const Interval range = f.range(box);
    for (int k = 0; k < 20; ++k) {
      const Vec3f p = box.min + box.size() * Vec3f{size(random), size(random), size(random)};
      EXPECT_TRUE(range.contains(f(p)));
    }
  }
  EXPECT_TRUE(std::isfinite(f.range(Box::everywhere()).max));
}

TEST(FeltCaches, MayBeWrittenFromWhatTheyHeld) {
  auto values =
      ran("domain d((0,0,0), (1,1,1), 0.25);\nscalarcache c(d); cachewrite(c, identity().x);\n"
          "scalarfield before = cacheread(c); cachewrite(c, 2 * cacheread(c)); scalarfield after = "
          "cacheread(c);");
  EXPECT_FLOAT_EQ(values["before"].as<ScalarField>()({0.5f, 0, 0}), 0.5f);
  EXPECT_FLOAT_EQ(values["after"].as<ScalarField>()({0.5f, 0, 0}), 1);
}

TEST(FeltCaches, MendSingleSamplesThatAreNotFinite) {
  // The direction of a distance at its centre, which is a sample: by symmetry the mean around it is 0.
  auto values =
      ran("vectorfield n = bake(grad(sqrt(identity() * identity())), domain((-1,-1,-1), (2,2,2), 0.25));");
  EXPECT_NEAR(length(values["n"].as<VectorField>()({0, 0, 0})), 0, 1e-6f);
}

TEST(FeltCaches, AreRefusedInWords) {
  EXPECT_EQ(refusal("scalarcache c(domain((0,0,0), (1,1,1), 0.1));\nscalarfield f = cacheread(c);"),
            "s.felt:2:17: error: nothing has been written to this cache yet\n"
            "  scalarfield f = cacheread(c);\n                  ^~~~~~~~~~~~\n"
            "  hint: cachewrite(cache, field) fills it");
  EXPECT_EQ(refusal("domain d((0,0,0), (1,1,1), 0.0001);"),
            "s.felt:1:8: error: a domain may have 2.1e+09 cells at most, not 1e+12\n"
            "  domain d((0,0,0), (1,1,1), 0.0001);\n         ^~~~~~~~~~~~~~~~~~~~~~~~~~~");
  Context small;
  small.limits.memoryBytes = 1e9;
  EXPECT_EQ(
      refusal("scalarcache c(domain((0,0,0), (1,1,1), 0.001));\ncachewrite(c, identity().x);", &small),
      "s.felt:2:1: error: the samples of 1000 x 1000 x 1000 cells may take 16 GB, and 1 GB are allowed\n"
      "  cachewrite(c, identity().x);\n  ^~~~~~~~~~~~~~~~~~~~~~~~~~~\n"
      "  hint: give the domain larger cells or a smaller box");
  EXPECT_EQ(refusal("scalarfield f = bake(log(identity().x), domain((-1,0,0), (2,1,1), 0.1));"),
            "s.felt:1:17: error: the field is nan at (-1, 0, 0) and around it, and samples must be finite\n"
            "  scalarfield f = bake(log(identity().x), domain((-1,0,0), (2,1,1), 0.1));\n"
            "                  ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~\n"
            "  hint: is something divided by 0 there, or the root of a negative number taken? clamp(f, low, "
            "high) keeps values finite");
}

TEST(FeltCaches, HoldTheSameBitsAtAnyNumberOfThreads) {
  const std::string script = kTurned + "vectorfield f = bake(curlnoise(), d);";
  std::vector<Vec3f> values[2];
  for (int run = 0; run < 2; ++run) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, run == 0 ? 1 : 4);
    std::mt19937 random(3);
    auto made = ran(script);
    for (int i = 0; i < 100; ++i) values[run].push_back(made["f"].as<VectorField>()(insideTurned(random)));
  }
  EXPECT_EQ(values[0], values[1]);
}

TEST(FeltCaches, StopWhereTheirRunIsCancelled) {
  struct Stopped : Progress {
    bool cancelled() const override { return true; }
  } stopped;
  Context context;
  context.progress = &stopped;
  EXPECT_THROW(
      Program("s.felt", "scalarfield f = bake(perlin(3), domain((0,0,0), (1,1,1), 0.01));", gridFunctions())
          .run(context),
      Cancelled);
}

}  // namespace
}  // namespace nephele::felt
