// Cloud shapes: what every seed of every species must have.
#include "nephele/modeling/shape/cloud_shapes.h"

#include <queue>

#include "nephele/modeling/base/error.h"
#include "tests/support/check_field.h"

namespace nephele::test {
namespace {

/// Samples of `level` on the nodes of a lattice over the box, `n` along its longest side.
struct Samples {
  Vec3i count;
  float step;
  std::vector<float> values;

  Samples(const CloudShape& shape, int n) : step(shape.box.longestSide() / float(n)) {
    const Box box = shape.box.expanded(2 * step);
    count = Vec3i(box.size() / step) + Vec3i{1, 1, 1};
    Points points(std::size_t(count.x) * std::size_t(count.y) * std::size_t(count.z));
    std::size_t i = 0;
    for (int z = 0; z < count.z; ++z)
      for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x; ++x)
          points.set(i++, box.min + Vec3f{float(x), float(y), float(z)} * step);
    values = evaluate(shape.level, points).data[0];
  }
  std::size_t at(int x, int y, int z) const {
    return std::size_t(x) + std::size_t(count.x) * (std::size_t(y) + std::size_t(count.y) * std::size_t(z));
  }
  /// Extent of the inside along each axis, in steps.
  Vec3i inside() const {
    Vec3i low = count, high{};
    for (int z = 0; z < count.z; ++z)
      for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x; ++x)
          if (values[at(x, y, z)] > 0) {
            low = nephele::min(low, Vec3i{x, y, z});
            high = nephele::max(high, Vec3i{x, y, z});
          }
    return high - low + Vec3i{1, 1, 1};
  }
  int components() const {
    std::vector<bool> seen(values.size());
    int found = 0;
    for (std::size_t start = 0; start < values.size(); ++start) {
      if (seen[start] || !(values[start] > 0)) continue;
      ++found;
      std::queue<std::size_t> open({start});
      seen[start] = true;
      while (!open.empty()) {
        const std::size_t i = open.front();
        open.pop();
        for (const std::size_t way : {std::size_t(1), std::size_t(count.x), at(0, 0, 1)})
          for (const std::size_t j : {i - way, i + way})
            if (j < values.size() && !seen[j] && values[j] > 0) {
              seen[j] = true;
              open.push(j);
            }
      }
    }
    return found;
  }
};

class OfEverySpecies : public testing::TestWithParam<CloudSpecies> {};
INSTANTIATE_TEST_SUITE_P(CloudShape, OfEverySpecies,
                         testing::ValuesIn(cloudSpecies().begin(), cloudSpecies().end()),
                         [](const auto& species) { return std::string(speciesName(species.param)); });

TEST_P(OfEverySpecies, KeepsWhatFieldsPromise) {
  const CloudShape shape = cloudShape({.species = GetParam(), .seed = 3, .size = 2});
  // Creases between lobes are kinks only where no fillet rounds them; curvature is up to 1 / 0.02.
  checkField(shape.level, shape.box.expanded(0.2f), {.step = 1e-3f, .smoothShare = 0.6});
}

TEST_P(OfEverySpecies, IsOnePieceWithTheProportionsOfItsSpecies) {
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const Samples samples(cloudShape({.species = GetParam(), .seed = seed}), 40);
    EXPECT_EQ(samples.components(), 1);
    const Vec3i extent = samples.inside();
    const double ratio = double(extent.y) / std::max(extent.x, extent.z);
    // The brackets of CloudSpecies.
    const Interval allowed = GetParam() == CloudSpecies::humilis     ? Interval{0.2f, 0.5f}
                             : GetParam() == CloudSpecies::mediocris ? Interval{0.5f, 1.1f}
                                                                     : Interval{0.95f, 1.9f};
    EXPECT_GE(ratio, allowed.min);
    EXPECT_LE(ratio, allowed.max);
  }
}

TEST_P(OfEverySpecies, HasTheSizeAskedForAndLiesInItsBox) {
  for (const float size : {0.01f, 1.0f, 3000.0f}) {
    const CloudShape shape = cloudShape({.species = GetParam(), .seed = 1, .size = size});
    // Fillets: up to 4 % of the half width to each side.
    EXPECT_GE(shape.box.longestSide(), size);
    EXPECT_LE(shape.box.longestSide(), 1.05f * size);
    EXPECT_EQ(shape.box.min.y, 0);
    const Samples samples(shape, 40);
    const Vec3i n = samples.count;
    int outside = 0;
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x) {
          // Nodes 0, 1 and the last one lie outside the box, node 2 on its face.
          const bool beyond = std::min({x, y, z}) < 2;
          if (beyond) outside += samples.values[samples.at(x, y, z)] > 0;
        }
    EXPECT_EQ(outside, 0);
    const Vec3i extent = samples.inside();
    EXPECT_NEAR(float(std::max({extent.x, extent.y, extent.z})) * samples.step, size, 0.08f * size);
  }
}

TEST_P(OfEverySpecies, IsCutFlatAtTheBase) {
  const CloudShape shape = cloudShape({.species = GetParam(), .seed = 2});
  // In the middle of the cloud, far from the rim, the level near the base is the height above it.
  for (const float y : {-0.02f, -0.005f, 0.005f, 0.02f}) EXPECT_NEAR(shape.level({0, y, 0}), y, 1e-5f) << y;
}

TEST_P(OfEverySpecies, IsSteepEnoughAndNowhereSteeperThanADistance) {
  const CloudShape shape = cloudShape({.species = GetParam(), .seed = 4});
  std::mt19937 random(5);
  const Points points = randomPoints(shape.box.expanded(0.15f), 20000, random);
  Values<float> values(points.size());
  Gradients<float> grads(points.size());
  shape.level.evalGrad(points.spans(), values.spans(), grads.spans());
  std::size_t near = 0, steep = 0, shallow = 0;
  // Spheres, blended with weights that add up to 1, keep 1. Ellipsoids do not: the header's bound.
  const float bound = GetParam() == CloudSpecies::humilis ? 1.15f : 1.0001f;
  for (std::size_t i = 0; i < points.size(); ++i) {
    // The band of the default layers: 0.025 sum(0.55^i) 3.84 = 0.17 of the size outside.
    const float l = values.data[0][i];
    if (!(l > -0.17f && l < 0)) continue;
    const float g = length(Vec3f{grads.data[0][i], grads.data[1][i], grads.data[2][i]});
    EXPECT_LE(g, bound);
    ++near;
    steep += g >= 0.9f;
    shallow += g < 0.7f;
  }
  EXPECT_GE(near, 3000u);
  EXPECT_GE(double(steep), 0.78 * double(near));
  EXPECT_LE(double(shallow), 0.03 * double(near));
}

TEST(CloudShape, IsTheSameForTheSameSeedAndAnotherForAnother) {
  for (const CloudSpecies species : cloudSpecies()) {
    const CloudShape first = cloudShape({.species = species, .seed = 7});
    const CloudShape again = cloudShape({.species = species, .seed = 7});
    const CloudShape other = cloudShape({.species = species, .seed = 8});
    ASSERT_EQ(first.lobes.size(), again.lobes.size());
    for (std::size_t i = 0; i < first.lobes.size(); ++i) {
      EXPECT_EQ(first.lobes[i].center, again.lobes[i].center);
      EXPECT_EQ(first.lobes[i].radii, again.lobes[i].radii);
    }
    EXPECT_NE(first.lobes[0].center, other.lobes[0].center);
  }
}

TEST(CloudShape, RefusesSizesThatAreNotPositive) {
  for (const float size : {0.0f, -1.0f, INFINITY, NAN})
    EXPECT_THROW(cloudShape({.size = size}), Error) << size;
  EXPECT_THROW(cloudShape({.species = CloudSpecies(7)}), Error);
}

}  // namespace
}  // namespace nephele::test
